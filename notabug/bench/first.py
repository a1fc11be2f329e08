"""``python -m notabug.bench.first [WHEEL]``: how long a user waits for verdicts, first and later, and for a run.

With a wheel (`make wheel` builds one) a clean virtual environment is made for it, which downloads what it needs; else
the program is the one that runs this. Its cache is empty at first. The run is of every scene by five renderers, with
everything predicted before. Beside the seconds that pass are those of processors, which other programs disturb less.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
import venv
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import psutil

from notabug.references.predict import predict
from notabug.scenes_usd.picture import write_exr
from notabug.scenes_usd.reader import read_scene

SCENE = "terminator/sphere"
RENDERERS = ("inhouse", "zbuffer", "povray", "mitsuba", "opengl")
WARM = 3  # times; the shortest counts


@dataclass(frozen=True, slots=True)
class Wait:
    """How long a command took: ``seconds`` that passed, of ``processor``, and ``asked`` of the former."""

    what: str
    seconds: float
    processor: float
    asked: float

    def __str__(self) -> str:
        mark = "✓" if self.seconds < self.asked else "✗"
        asked = f"(asked: under {self.asked:g})"
        return f"{mark} {self.what}: {self.seconds:.2f} s {asked}, {self.processor:.2f} s of processor"


def timed(command: Sequence[str], environment: Mapping[str, str], codes: Sequence[int] = (0,)) -> tuple[float, float]:
    """The seconds that ``command`` takes, and those of processors that it and its children use."""
    before, start = psutil.Process().cpu_times(), time.perf_counter()
    done = subprocess.run(command, env=dict(environment), capture_output=True, text=True, check=False)
    seconds, after = time.perf_counter() - start, psutil.Process().cpu_times()
    if done.returncode not in codes:
        raise SystemExit(f"{' '.join(command)} ended with {done.returncode}:\n{done.stdout}{done.stderr}")
    used = after.children_user + after.children_system - before.children_user - before.children_system
    return seconds, used


def verdicts(program: Sequence[str], folder: Path) -> list[Wait]:
    """The first verdict of ``program``, with nothing predicted yet, later ones, and its help."""
    scene, picture = read_scene(SCENE), folder / "picture.exr"
    write_exr(picture, predict(scene).point)
    environment = {**os.environ, "NOTABUG_CACHE": str(folder / "cache")}
    judge = [*program, "judge", str(picture), "--scene", SCENE, "--filter", "point"]
    first = timed(judge, environment)
    warm = min(timed(judge, environment) for _ in range(WARM))
    brief = min(timed([*program, "--help"], environment) for _ in range(WARM))
    return [
        Wait("notabug judge, the first one", *first, asked=3.0),
        Wait("notabug judge, later", *warm, asked=1.0),
        Wait("notabug --help", *brief, asked=0.3),
    ]


def run(program: Sequence[str], folder: Path, renderers: Sequence[str], scenes: Sequence[str] = ()) -> Wait:
    """A run whose predictions are there already: the second of two."""
    words = [word for name in renderers for word in ("-r", name)]
    command = [*program, "run", *scenes, "--no-resume", "--out", str(folder / "out"), *words]
    findings = (0, 1)  # 1: a renderer has a bug
    timed(command, os.environ, findings)
    return Wait(
        f"notabug run --no-resume, {len(renderers)} renderers", *timed(command, os.environ, findings), asked=40.0
    )


def installed(wheel: Path, folder: Path) -> Path:
    """The program of ``wheel`` in a clean environment."""
    venv.create(folder / "venv", with_pip=True)
    binaries = folder / "venv" / ("Scripts" if sys.platform == "win32" else "bin")
    pip = [str(binaries / "python"), "-m", "pip", "install", "--quiet", "--disable-pip-version-check", str(wheel)]
    subprocess.run(pip, check=True)
    return binaries / "notabug"


def main() -> int:
    """Print the figures; 1 where one is more than what is asked."""
    parser = argparse.ArgumentParser(prog="python -m notabug.bench.first", description=__doc__)
    parser.add_argument("wheel", nargs="?", type=Path, help="a wheel to install in a clean environment")
    parser.add_argument("--no-run", action="store_true", help="only verdicts: the run takes some minutes")
    parser.add_argument("--json", action="store_true")
    asked = parser.parse_args()
    here = (sys.executable, "-m", "notabug")
    with tempfile.TemporaryDirectory(prefix="notabug-first-") as name:
        folder = Path(name)
        program = here if asked.wheel is None else (str(installed(asked.wheel, folder)),)
        waits = verdicts(program, folder)
        if not asked.no_run:
            waits.append(run(here, folder, RENDERERS))  # renderers are those of this environment
    if asked.json:
        print(json.dumps([asdict(wait) for wait in waits]))
    else:
        print("\n".join(map(str, waits)))
    return int(any(wait.seconds >= wait.asked for wait in waits))


if __name__ == "__main__":
    sys.exit(main())
