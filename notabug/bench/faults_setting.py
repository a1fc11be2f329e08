"""A folder with small scenes and a renderer that draws them right or misbehaves (``misbehaving``), as it is asked."""

from __future__ import annotations

import contextlib
import json
import os
import re
import signal
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import IO

import numpy as np
import psutil

PROGRAM = Path(__file__).with_name("misbehaving") / "program.py"
SIDE = 32  # pixels: a job is quick
OUT = "notabug-out"  # where a run writes that is not told otherwise
PATIENCE = 900.0  # seconds on the clock for one run: a machine may be busy
GRACE = 20.0  # seconds on the clock until what is to end with its run counts as left
MARK = "NOTABUG_FAULTS"  # in the environment of all that a setting starts


@dataclass(frozen=True, slots=True)
class Setting:
    """Scenes called ``names`` in ``folder``, drawn by the renderer called ``renderer``."""

    folder: Path
    names: tuple[str, ...]
    renderer: str

    @property
    def pictures(self) -> Path:
        """Where the right pictures are, and what the renderer notes."""
        return self.folder / "pictures"

    @property
    def out(self) -> Path:
        return self.folder / OUT

    @property
    def sources(self) -> list[str]:
        return [f"{name}.usda" for name in self.names]

    @property
    def command(self) -> list[str]:
        """The run of all scenes, to be started in ``folder``."""
        return [sys.executable, "-P", "-m", "notabug", "run", "-r", self.renderer, *self.sources]

    def environment(self) -> dict[str, str]:
        """The variables of the run: temporary files go into a folder of their own, so that litter shows."""
        return {**os.environ, "TMPDIR": str(self.folder / "tmp"), MARK: str(self.folder)}

    def start(
        self,
        *words: str,
        log: IO[bytes] | int = subprocess.DEVNULL,
        environment: Mapping[str, str] = MappingProxyType({}),
    ) -> subprocess.Popen[bytes]:
        """The run as a process, which heeds signals though whoever started this one had them ignored."""
        return subprocess.Popen(
            [*self.command, *words],
            cwd=self.folder,
            env={**self.environment(), **environment},
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=log,
            preexec_fn=_heed if os.name == "posix" else None,
        )

    def run(self, *words: str, environment: Mapping[str, str] = MappingProxyType({})) -> tuple[int | None, str]:
        """The exit state of a whole run and what it printed; None where it did not end within PATIENCE."""
        log = self.folder / "log"
        with log.open("wb") as file, self.start(*words, log=file, environment=environment) as process:
            try:
                code: int | None = process.wait(PATIENCE)
            except subprocess.TimeoutExpired:
                process.kill()
                code = None
        return code, log.read_text("utf-8", "replace")

    def end_all(self) -> str:
        """Kill what is still at work here after GRACE; what that was, or ""."""
        end = time.monotonic() + GRACE
        while (left := self.alive()) and time.monotonic() < end:
            time.sleep(0.2)
        told = []
        for process in left:
            with contextlib.suppress(psutil.Error):
                note = self.pictures / f"daemon-{process.pid}.pid"
                of = note.read_text(encoding="utf-8") if note.is_file() else " ".join(process.cmdline()[-6:])[:120]
                told.append(f"{process.pid} ({process.status()}): {of}")
                process.kill()
        return f"{len(told)} processes are left: {'; '.join(told)}" if told else ""

    def calls(self) -> Counter[str]:
        """How often the renderer was asked for each scene."""
        log = self.pictures / "calls.txt"
        return Counter(log.read_text(encoding="utf-8").split() if log.is_file() else [])

    def verdicts(self, out: Path | None = None) -> list[tuple[str, str, str]]:
        """Scene, verdict and message of each result on record, none where there is no record."""
        path = (out or self.out) / "run.json"
        results = json.loads(path.read_text(encoding="utf-8"))["results"] if path.is_file() else []
        return [(result["scene"], result["verdict"], result["message"]) for result in results]

    def broken(self, out: Path | None = None) -> list[str]:
        """The JSON files of a run that are not whole."""
        found = []
        for path in sorted((out or self.out).rglob("*.json")):
            try:
                json.loads(path.read_text(encoding="utf-8"))
            except ValueError:
                found.append(path.name)
        return found

    def alive(self) -> list[psutil.Process]:
        """The processes that the runs here started, by the mark in their environment or by their notes."""
        noted = {int(path.stem.rpartition("-")[2]) for path in self.pictures.glob("*.pid")}
        return [process for process in psutil.process_iter() if _is_of(process, str(self.folder), noted)]


def trace(log: str) -> str:
    """The end of a trace of notabug's own in what a run printed, or "": a renderer's is quoted and does not count.

    >>> trace("Traceback (most recent call last):\\nKeyError"), trace("  | Traceback (most recent call last):")
    ('Traceback (most recent call last):\\nKeyError', '')
    """
    found = re.search("^Traceback", log, re.MULTILINE)
    return log[found.start() :][-300:] if found else ""


def _heed() -> None:
    for number in (signal.SIGINT, signal.SIGHUP):
        signal.signal(number, signal.SIG_DFL)


def _is_of(process: psutil.Process, folder: str, noted: set[int]) -> bool:
    """Whether ``process`` is at work for the setting in ``folder``; a number that was noted may be another's now."""
    try:
        if process.pid == os.getpid() or process.status() == psutil.STATUS_ZOMBIE:
            return False
        if process.environ().get(MARK) == folder:
            return True
        return process.pid in noted and any("time.sleep(3600)" in word for word in process.cmdline())
    except psutil.Error:
        return False


def lay_out(folder: Path, names: Sequence[str], renderer: str = "wild", **settings: object) -> Setting:
    """Write scenes called ``names`` into ``folder``, the pictures they should give, and the renderer's configuration.

    ``settings`` are keys of its table in ``notabug.toml``.
    """
    from notabug.adapters.export.formats import write_pfm
    from notabug.references.predict import predict
    from notabug.scenes_usd.reader import find, read_scene

    made = Setting(folder, tuple(names), renderer)
    for inner in (made.pictures, folder / "tmp"):
        inner.mkdir(parents=True)
    text = find("calibration/plain_card").read_text(encoding="utf-8").replace("(256, 256)", f"({SIDE}, {SIDE})")
    for source in made.sources:
        (folder / source).write_text(text, encoding="utf-8")
    right = predict(read_scene(folder / made.sources[0])).point.astype(np.float64)
    for name in names:
        write_pfm(made.pictures / f"{name}.pfm", right)
    card = predict(read_scene("calibration/plain_card")).point.astype(np.float64)
    write_pfm(made.pictures / "calibration-plain_card.pfm", card)
    table = {
        "command": [sys.executable, "-S", "-E", str(PROGRAM), "{scene}", "{image}", "{folder}/pictures"],
        "image": "pfm",
        "filter": "point",
        "capabilities": ["mesh", "distant_light", "shadows"],
        **settings,
    }
    lines = [f"[renderers.{renderer}]", *(f"{key} = {_toml(value)}" for key, value in table.items())]
    (folder / "notabug.toml").write_text("\n".join(lines) + "\n", encoding="utf-8")
    return made


def _toml(value: object) -> str:
    """``value`` as TOML, whose texts, numbers and lists are JSON's.

    >>> _toml({"PAUSE": "0.2"}), _toml(["a", "b"]), _toml(4)
    ('{ PAUSE = "0.2" }', '["a", "b"]', '4')
    """
    if isinstance(value, Mapping):
        return f"{{ {', '.join(f'{key} = {_toml(inner)}' for key, inner in value.items())} }}"
    return json.dumps(value)
