"""A run that is killed at random moments, over and over: nothing is lost, doubled, orphaned or left behind.

Moments are drawn by what the run has come to, the calls of its renderer, and a time after that, so that on a busy
machine as on an idle one they fall into all of it: the start of Python, the reading of scenes, calibration, rendering,
judging and the writing of records.
"""

from __future__ import annotations

import contextlib
import json
import random
import signal
import subprocess
import tempfile
import time
from collections import Counter
from pathlib import Path

from notabug.bench.faults_setting import PATIENCE, Setting, lay_out

KILLS = 10  # of runs in one folder
SCENES = 4
PAUSE = 0.1  # seconds that the renderer takes for a picture
MOST_CALLS = 3  # of the renderer, until a run is killed
_LOOK = 0.005


def take(seed: int, number: int, kills: int = KILLS) -> list[str]:
    """Kill runs in the folder ``number`` of ``seed`` so many times; what is wrong with what became of them."""
    chance = random.Random(f"{seed} kills {number}")  # noqa: S311 - no secret depends on it
    with tempfile.TemporaryDirectory(prefix="notabug-") as name, contextlib.ExitStack() as closing:
        names = [f"scene{index}" for index in range(SCENES)]
        setting = lay_out(Path(name).resolve(), names, environment={"PAUSE": str(PAUSE)}, retries=0)
        closing.callback(setting.end_all)  # where the bench itself is stopped
        jobs = chance.choice(("1", "2"))
        whole = setting.folder / "whole"
        begun, process = time.monotonic(), setting.start("--jobs", jobs, "--out", str(whole))
        _come_to(setting, process, 1)
        start = time.monotonic() - begun
        if code := process.wait(PATIENCE):
            return [f"a run that nobody killed ended with {code}"]
        shown = _files(whole)
        found: list[str] = []
        rounds = 0
        while kills:
            attempt = _Attempt(setting, setting.folder / f"out{rounds}", jobs, chance, start)
            kills -= attempt.kill(kills)
            found += [f"folder {number}, {what}" for what in attempt.finish(shown)]
            rounds += 1
        return found


class _Attempt:
    """One folder of results, whose run is killed until it is finished."""

    def __init__(self, setting: Setting, out: Path, jobs: str, chance: random.Random, start: float) -> None:
        self.setting, self.out, self.chance, self.start = setting, out, chance, start
        self.words = ("--jobs", jobs, "--out", str(out))
        self.before = setting.calls()
        for source in setting.sources:  # other contents of the same meaning: each is first read by a child again
            path = setting.folder / source
            path.write_text(f"{path.read_text(encoding='utf-8')}# for {out.name}\n", encoding="utf-8")
        self.final: dict[str, int] = {}  # scene with a result on record: calls of it until then
        self.found: list[str] = []

    def kill(self, most: int) -> int:
        """Kill the run up to ``most`` times; how often that came before its end."""
        for count in range(most):
            calls = self.chance.randint(0, MOST_CALLS)
            pause = self.chance.uniform(0.0, 4 * PAUSE if calls else self.start)
            process = self.setting.start(*self.words)
            _come_to(self.setting, process, self.setting.calls().total() + calls)
            end = time.monotonic() + pause
            while time.monotonic() < end and process.poll() is None:
                time.sleep(_LOOK)
            process.send_signal(signal.SIGKILL)
            if process.wait(PATIENCE) != -signal.SIGKILL:
                return count
            self._look()
        return most

    def _look(self) -> None:
        """Note what is wrong with what a killed run has left."""
        if left := self.setting.end_all():
            self.found.append(f"after a kill {left}")
        if broken := self.setting.broken(self.out):
            self.found.append(f"half a file: {', '.join(broken)}")
        finished = _finished(self.out)
        if lost := self.final.keys() - finished:
            self.found.append(f"lost: {', '.join(sorted(lost))}")
        calls = self.setting.calls() - self.before
        self.final |= {scene: calls[scene] for scene in finished - self.final.keys()}

    def finish(self, shown: frozenset[str]) -> list[str]:
        """Have the same command go on to its end; all that is wrong. ``shown`` are the files of a run left alone."""
        code, log = self.setting.run(*self.words)
        if code:
            self.found.append(f"the run that went on ended with {code}: {log[-300:]}")
        verdicts = Counter(scene for scene, word, _ in self.setting.verdicts(self.out) if word == "pass")
        if verdicts != Counter(self.setting.names):
            self.found.append(f"results: {dict(verdicts)}")
        calls = self.setting.calls() - self.before
        if again := [scene for scene, count in self.final.items() if calls[scene] != count]:
            self.found.append(f"drawn again: {', '.join(sorted(again))}")
        if litter := _files(self.out) ^ shown:
            self.found.append(f"files: {', '.join(sorted(litter)[:5])}")
        if temporary := sorted(path.name for path in (self.setting.folder / "tmp").iterdir()):
            self.found.append(f"temporary files: {', '.join(temporary[:5])}")
        if left := self.setting.end_all():
            self.found.append(left)
        return self.found


def _come_to(setting: Setting, process: subprocess.Popen[bytes], calls: int) -> None:
    """Wait until the renderer was called so often, or the run is over."""
    end = time.monotonic() + PATIENCE
    while setting.calls().total() < calls and process.poll() is None and time.monotonic() < end:
        time.sleep(_LOOK)


def _finished(out: Path) -> set[str]:
    """The scenes whose results are on record."""
    found = set()
    for path in out.glob("own/*/*/*/result.json"):
        try:
            found.add(str(json.loads(path.read_text(encoding="utf-8"))["result"]["scene"]))
        except (OSError, ValueError, KeyError):
            continue
    return found


def _files(out: Path) -> frozenset[str]:
    """The files below ``out`` but locks, which are there while they are held and may stay."""
    paths = (path.relative_to(out).as_posix() for path in out.rglob("*") if not path.is_dir())
    return frozenset(path for path in paths if not path.endswith(".lock"))
