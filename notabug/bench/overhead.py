"""``python -m notabug.bench.overhead``: what a run costs over the bare commands of a renderer that takes 50 ms.

The same commands are timed bare, one after the other, and under the runner: sixty jobs, each with a picture of its own
scene. *Supervision* is what the adapter adds to a command: export, a fresh folder, limits, the check of what came back.
*Run* is the whole of it, reading, judging and writing the record too, one job at a time and then as many at a time as
`notabug run` would do here. Each is given on the clock, which other programs on the machine disturb, and in the
runner's own processor time, which they do not; the renderer's is not counted there. *Command* is `notabug run` as it is
typed, from the start of Python to the end of the report; beside it the bare commands, as many at a time.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from notabug.adapters.base import Quality
from notabug.adapters.config import Table
from notabug.adapters.configured import configured
from notabug.adapters.export.formats import write_pfm
from notabug.adapters.settings import filled
from notabug.crew import crew
from notabug.record import Result
from notabug.references.predict import predict
from notabug.run import Plan, run
from notabug.scenes_usd.reader import find, read_scene
from notabug.selection import choose

JOBS = 60
SECONDS = 0.05
SIDE = 64

_RENDERER = """
import shutil, sys, time
shutil.copyfile(sys.argv[3], sys.argv[2])
time.sleep(max(0.0, float(sys.argv[4]) - {start}))
"""


@dataclass(slots=True)
class Counting:
    """A watcher that keeps the results."""

    results: list[Result] = field(default_factory=list)

    def begin(self, jobs: int) -> None: ...
    def start(self, scene: str, variant: str, renderer: str, stage: str) -> None: ...
    def done(self, result: Result, kept: bool) -> None:
        del kept
        self.results.append(result)


def measure(folder: Path, jobs: int = JOBS) -> dict[str, float]:
    """Seconds of the bare commands, of renders under supervision and of the whole run, and shares of them."""
    text = find("calibration/plain_card").read_text(encoding="utf-8").replace("(256, 256)", f"({SIDE}, {SIDE})")
    names = [f"scene{index}" for index in range(jobs)]
    for name in names:
        (folder / f"{name}.usda").write_text(text, encoding="utf-8")
    for scene in (read_scene(folder / "scene0.usda"), read_scene("calibration/plain_card")):
        write_pfm(folder / f"{scene.width}.pfm", predict(scene).point.astype(np.float64))
    begun = time.perf_counter()
    subprocess.run([sys.executable, "-S", "-E", "-c", "pass"], check=True)
    start = time.perf_counter() - begun
    (folder / "render.py").write_text(_RENDERER.format(start=start))
    words = [
        sys.executable,
        "-S",
        "-E",
        str(folder / "render.py"),
        "{scene}",
        "{image}",
        "{folder}/{width}.pfm",
        str(SECONDS),
    ]
    entry = {"command": words, "image": "pfm", "filter": "point", "capabilities": ["mesh", "distant_light", "shadows"]}
    adapter = configured("fifty", Table(entry, "bench", folder), {})
    holes = {"scene": "", "image": str(folder / "out.pfm"), "folder": str(folder), "width": str(SIDE)}
    bare_words = [filled(each, holes) for each in words]
    subprocess.run(bare_words, check=True)
    begun = time.perf_counter()
    for _ in range(jobs):
        subprocess.run(bare_words, check=True, capture_output=True, stdin=subprocess.DEVNULL)
    bare = time.perf_counter() - begun

    scenes = [read_scene(folder / f"{name}.usda") for name in names]
    begun, spent = time.perf_counter(), time.process_time()
    for index, scene in enumerate(scenes):
        out = folder / "renders" / str(index)
        out.mkdir(parents=True)
        adapter.render(scene, out, Quality())
    renders, renders_own = time.perf_counter() - begun, time.process_time() - spent

    watcher = Counting()
    choices = choose([str(folder / f"{name}.usda") for name in names], {})
    begun, spent = time.perf_counter(), time.process_time()
    plan = Plan(choices, {"fifty": (adapter, adapter.find())}, folder / "out")
    run(plan, watcher)
    whole, whole_own = time.perf_counter() - begun, time.process_time() - spent
    passed = sum(each.verdict.word == "pass" for each in watcher.results)
    judging = sum(each.seconds["judge"] for each in watcher.results)

    at_work, threads = crew("", 0, jobs)
    begun = time.perf_counter()
    run(replace(plan, out=folder / "default", crew=at_work, quality=Quality(threads=threads)), Counting())
    default = time.perf_counter() - begun

    lines = [f"{key} = {json.dumps(value)}" for key, value in entry.items()]  # strings and lists are TOML too
    (folder / "notabug.toml").write_text("\n".join(["[renderers.fifty]", *lines, ""]), encoding="utf-8")
    typed = [sys.executable, "-m", "notabug", "run", *(f"{name}.usda" for name in names), "-r", "fifty"]
    begun = time.perf_counter()
    subprocess.run(typed, cwd=folder, check=True, capture_output=True)
    command = time.perf_counter() - begun
    begun = time.perf_counter()
    with ThreadPoolExecutor(at_work.at_once) as pool:
        list(pool.map(lambda _: subprocess.run(bare_words, check=True, capture_output=True), range(jobs)))
    bare_at_once = time.perf_counter() - begun
    return {
        "jobs": float(jobs),
        "passed": float(passed),
        "bare": bare,
        "renders": renders,
        "run": whole,
        "judging": judging,
        "jobs at once": float(at_work.at_once),
        "run, jobs at once": default,
        "command": command,
        "bare, jobs at once": bare_at_once,
        "supervision over bare": renders / bare - 1.0,
        "run over bare": whole / bare - 1.0,
        "run but for judging over bare": (whole - judging) / bare - 1.0,
        "run, jobs at once, over bare": default / bare - 1.0,
        "command over bare": command / bare - 1.0,
        "supervision, own time over 50 ms": renders_own / jobs / SECONDS,
        "run, own time over 50 ms": whole_own / jobs / SECONDS,
    }


def main() -> None:
    """Print the figures as JSON."""
    with tempfile.TemporaryDirectory(prefix="notabug-") as name:
        found = measure(Path(name).resolve())
    sys.stdout.write(json.dumps({key: round(value, 3) for key, value in found.items()}) + "\n")


if __name__ == "__main__":
    main()
