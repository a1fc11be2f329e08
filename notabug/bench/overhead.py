"""``python -m notabug.bench.overhead``: what a run costs over the bare commands of a renderer that takes 50 ms.

The same sixty commands are timed bare, one after the other, and under the runner, each with a picture of its own scene.
*Supervision* is what the adapter adds to a command: export, a fresh folder, limits, the check of what came back; its
jobs and the bare ones take turns. *One at a time* and *at once* are the whole of a run, reading, judging and writing
the record too, the latter with as many jobs at once as `notabug run` would do here. *Command* is `notabug run` as it
is typed, from the start of Python to the end of the report. All is done in ROUNDS, each compared with bare commands of
its own, as other programs on the machine disturb the clock; the middle one is given. *Own* is the runner's processor
time for a job in one process, the renderer's not counted.
"""

from __future__ import annotations

import json
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from notabug.adapters.base import Adapter, Quality
from notabug.adapters.config import renderer_tables
from notabug.adapters.configured import configured
from notabug.adapters.export.formats import write_pfm
from notabug.adapters.settings import filled
from notabug.references.predict import predict
from notabug.results.record import Result
from notabug.runs.plan import Plan, Silent
from notabug.runs.run import run
from notabug.runs.selection import choose
from notabug.runs.workers import Alone, Workers, workers_for
from notabug.scenes_usd.reader import find, read_scene

JOBS = 60
SECONDS = 0.05
SIDE = 64
ROUNDS = 3
CAPABILITIES = ["mesh", "distant_light", "shadows"]

_RENDERER = """
import sys, time
open(sys.argv[2], "wb").write(open(sys.argv[3], "rb").read())
time.sleep(max(0.0, float(sys.argv[4]) - {start}))
"""


@dataclass(frozen=True, slots=True)
class Bench:
    """Scenes, a renderer that takes SECONDS for each, and its configuration, in ``folder``."""

    folder: Path
    names: list[str]
    bare: list[str]

    @classmethod
    def set_up(cls, folder: Path, jobs: int) -> Bench:
        text = find("calibration/plain_card").read_text(encoding="utf-8").replace("(256, 256)", f"({SIDE}, {SIDE})")
        names = [f"scene{index}.usda" for index in range(jobs)]
        for name in names:
            (folder / name).write_text(text, encoding="utf-8")
        for scene in (read_scene(folder / names[0]), read_scene("calibration/plain_card")):
            write_pfm(folder / f"{scene.width}.pfm", predict(scene).point.astype(np.float64))
        python = [sys.executable, "-S", "-E"]
        start = min(_seconds(lambda: subprocess.run([*python, "-c", "pass"], check=True)) for _ in range(3))
        (folder / "render.py").write_text(_RENDERER.format(start=start), encoding="utf-8")
        script, picture = str(folder / "render.py"), "{folder}/{width}.pfm"
        words = [*python, script, "{scene}", "{image}", picture, str(SECONDS)]
        entry = {"command": words, "image": "pfm", "filter": "point", "capabilities": CAPABILITIES}
        lines = [f"{key} = {json.dumps(value)}" for key, value in entry.items()]  # strings and lists are TOML too
        (folder / "notabug.toml").write_text("\n".join(["[renderers.fifty]", *lines, ""]), encoding="utf-8")
        holes = {"scene": "", "image": str(folder / "out.pfm"), "folder": str(folder), "width": str(SIDE)}
        return cls(folder, names, [filled(word, holes) for word in words])

    def adapter(self) -> Adapter:
        return configured("fifty", renderer_tables(self.folder / "notabug.toml")["fifty"], {})

    def command(self, times: int = 1) -> None:
        """Bare commands, one after the other."""
        for _ in range(times):
            subprocess.run(self.bare, check=True, capture_output=True, stdin=subprocess.DEVNULL)

    def supervision(self) -> tuple[float, float, float]:
        """Seconds of bare commands, of the same under supervision in turns with them, and of the latter's own."""
        adapter, bare, supervised, own = self.adapter(), 0.0, 0.0, 0.0
        with tempfile.TemporaryDirectory(dir=self.folder) as out:
            for scene in [read_scene(self.folder / name) for name in self.names]:
                bare += _seconds(self.command)
                place = Path(out) / scene.id
                place.mkdir()
                spent = time.process_time()
                supervised += _seconds(lambda: adapter.render(scene, place, Quality()))  # noqa: B023 - called here
                own += time.process_time() - spent
        return bare, supervised, own

    def run(self, workers: Workers, threads: int = 0) -> tuple[float, list[Result]]:
        """Seconds of a whole run in this process, and its results."""
        adapter = self.adapter()
        choices = choose([str(self.folder / name) for name in self.names], {})
        with tempfile.TemporaryDirectory(dir=self.folder) as out:
            renderers = {"fifty": (adapter, adapter.find())}
            plan = Plan(choices, renderers, Path(out), quality=Quality(threads=threads), workers=workers)
            begun = time.perf_counter()
            results = run(plan, Silent()).results
            return time.perf_counter() - begun, results

    def typed(self) -> float:
        """Seconds of `notabug run` as a program of its own."""
        with tempfile.TemporaryDirectory(dir=self.folder) as out:
            words = [sys.executable, "-m", "notabug", "run", *self.names, "-r", "fifty", "--out", out]
            return _seconds(lambda: subprocess.run(words, cwd=self.folder, check=True, capture_output=True))


def measure(folder: Path, jobs: int = JOBS, rounds: int = ROUNDS) -> dict[str, float]:
    """Seconds of each way to do the jobs, the middle of ``rounds``, and shares of the bare commands' seconds."""
    bench = Bench.set_up(folder, jobs)
    at_work, threads = workers_for("", 0, jobs)
    found: dict[str, list[float]] = {}

    def note(**values: float) -> None:
        for name, value in values.items():
            found.setdefault(name.replace("_", " "), []).append(value)

    # before workers are started: what a supervised process leaves behind is looked for among all children
    for _ in range(rounds):
        bare, supervised, own = bench.supervision()
        note(supervision_over_bare=supervised / bare - 1.0, supervision_own_ms=1e3 * own / jobs)
    for _ in range(rounds):
        spent = time.process_time()
        alone, results = bench.run(Alone())
        note(one_at_a_time_own_ms=1e3 * (time.process_time() - spent) / jobs)
        at_once, _ = bench.run(at_work, threads)
        typed = bench.typed()
        bare = _seconds(lambda: bench.command(jobs))
        note(passed=sum(result.verdict.word == "pass" for result in results))
        note(bare=bare, one_at_a_time=alone, at_once=at_once, command=typed)
        note(one_at_a_time_over_bare=alone / bare - 1.0)
        note(at_once_over_bare=at_once / bare - 1.0, command_over_bare=typed / bare - 1.0)
    middle = {name: statistics.median(values) for name, values in found.items()}
    return {"jobs": float(jobs), "jobs at once": float(at_work.at_once), **middle}


def _seconds(what: Callable[[], object]) -> float:
    begun = time.perf_counter()
    what()
    return time.perf_counter() - begun


def main() -> None:
    """Print the figures as JSON."""
    with tempfile.TemporaryDirectory(prefix="notabug-") as name:
        found = measure(Path(name).resolve())
    sys.stdout.write(json.dumps({key: round(value, 3) for key, value in found.items()}) + "\n")


if __name__ == "__main__":
    main()
