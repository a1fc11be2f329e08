"""Every shell line of the README and of the docs runs, in a folder that holds what it speaks of.

A line that does not run here stands in ``SKIPPED`` with the reason; the command line reads its words all the same.
"""

from __future__ import annotations

import contextlib
import io
import os
import re
import shlex
import shutil
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np
import pytest
import typer

from notabug.cli import app, main
from notabug.scenes_usd.picture import write_exr
from notabug.scenes_usd.reader import read_scene
from notabug.scenes_usd.writer import write_scene

pytestmark = pytest.mark.slow

ROOT = Path(__file__).resolve().parents[2]
PAGES = (ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").glob("*.md")))
TIMEOUT = 600

NETWORK = "needs the network"
SETS_UP = "sets up a checkout, which these tests run in"
MINUTES = "draws much of the corpus, which takes minutes"
COVERED = "is what test_your_renderer.py does, with a compiler"
SKIPPED = {
    "git clone <this repository> notabug && cd notabug": NETWORK,
    "make run": SETS_UP,
    "make test": SETS_UP,
    "notabug run": MINUTES,
    "notabug run --quick": "draws a scene of each class with every renderer; test_selection.py says which",
    "notabug run terminator -r povray": MINUTES,
    "notabug run terminator -r povray --variant tessellation=all": MINUTES,
    "notabug run preview": MINUTES,
    "notabug run 'texture/*' --variants all --out nightly": MINUTES,
    "notabug run --workarounds terminator": MINUTES,
    "notabug bench verdict --quick": MINUTES,
    "notabug bench faults --quick": MINUTES,
    "notabug gallery notabug-out --out site": MINUTES,
    "notabug run --shard 1/2 --out part1": MINUTES,
    "notabug run --shard 2/2 --out part2": MINUTES,
    "notabug run --executor dask://127.0.0.1:8786": "needs a Dask scheduler: test_workers.py starts one",
    "mkdir try && cd try": COVERED,
    "cp <notabug>/docs/tiny.c . && cc -O2 tiny.c -o tiny -lm": COVERED,
    "notabug calibrate -r tiny": COVERED,
    "notabug run -r tiny": COVERED,
}
CODES = (0, 1)  # a bug found is no crash
OTHER_CODES = {"notabug reduce my_scene.usda -r mitsuba": (0, 1, 5)}  # 5: there is no bug to reduce


def lines() -> Iterator[str]:
    """Every line of every shell block, continued lines joined, remarks taken off."""
    for page in PAGES:
        for block in re.findall(r"^```(?:sh|bash|shell|console)\n(.*?)^```", page.read_text("utf-8"), re.M | re.S):
            for line in block.replace("\\\n", " ").splitlines():
                told = re.sub(r"\s+#\s.*$", "", line)
                if told := " ".join(told.split()) if "'" not in told and '"' not in told else told.strip():
                    yield re.sub(r"\s{2,}", " ", told)


LINES = tuple(dict.fromkeys(lines()))


def test_there_are_lines_and_the_table_is_not_stale() -> None:
    assert len(LINES) > 25
    assert set(SKIPPED) - set(LINES) == set()
    assert set(OTHER_CODES) - set(LINES) == set()


@pytest.mark.parametrize("line", [each for each in LINES if each.startswith("notabug ")])
def test_the_command_line_understands_it(line: str) -> None:
    """Options and arguments that are not there any more are found without running anything."""
    words = shlex.split(line.split(" > ")[0])[1:]
    group: Any = typer.main.get_command(app)
    command = group.commands[words[0]]
    command.make_context(words[0], words[1:], resilient_parsing=False)


@pytest.fixture(scope="module")
def folder(shared: Any) -> Path:
    """What the lines speak of: a scene, a frame, a run, runs before and after, two parts; and ``notabug`` on PATH."""
    made: Path = shared("docs", fill)
    return made


def fill(made: Path) -> None:
    scene = read_scene("terminator/sphere", {"tessellation": "8x4"})
    write_scene(replace(scene, width=24, height=24), made / "my_scene.usda")
    frame = read_scene("terminator/sphere")
    from notabug.references.predict import preview

    write_exr(made / "frame.exr", np.asarray(preview(frame)))
    shim = made / "bin" / "notabug"
    shim.parent.mkdir()
    shim.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m notabug "$@"\n')
    shim.chmod(0o755)
    for words in (
        "run terminator/sphere texture/uneven_quad -r inhouse -r povray --seeds 2 --out notabug-out",
        "adapt my_scene.usda --out own.usda",
        "run my_scene.usda -r inhouse --out part1",
        "run my_scene.usda -r zbuffer --out part2",
    ):
        done = told(f"notabug {words}", made)
        assert done.returncode in CODES, done.stderr
    for name in ("before", "after"):
        shutil.copytree(made / "notabug-out", made / name)


def told(line: str, folder: Path) -> subprocess.CompletedProcess[str]:
    """``line`` in ``folder``: in this process where it only calls notabug, else in a shell."""
    environment = {key: value for key, value in os.environ.items() if key not in ("CI", "GITHUB_STEP_SUMMARY")}
    places = (str(folder / "bin"), str(Path(sys.executable).parent), environment["PATH"])
    environment["PATH"] = os.pathsep.join(places)
    environment["NOTABUG_JOBS"] = "1"
    environment["NOTABUG_TRUST"] = str(folder)
    if line.startswith("notabug ") and ">" not in line:
        with mock.patch.dict(os.environ, environment, clear=True), contextlib.chdir(folder):
            return called(shlex.split(line))
    return subprocess.run(
        ["sh", "-c", line], cwd=folder, capture_output=True, text=True, env=environment, timeout=TIMEOUT, check=False
    )


def called(words: list[str]) -> subprocess.CompletedProcess[str]:
    """What the command line of ``words`` comes to, called here: to start Python for each takes longer than most do."""
    out, err = io.StringIO(), io.StringIO()
    with (
        mock.patch.object(sys, "argv", words),
        contextlib.redirect_stdout(out),
        contextlib.redirect_stderr(err),
        pytest.raises(SystemExit) as stop,
    ):
        main()
    return subprocess.CompletedProcess(words, int(stop.value.code or 0), out.getvalue(), err.getvalue())


@pytest.mark.parametrize("line", [each for each in LINES if each not in SKIPPED])
def test_it_runs(line: str, folder: Path, tmp_path: Path, povray: Any, mitsuba: Any) -> None:
    """Each in a copy of its own, so that no line depends on what another one left."""
    done = told(line, shutil.copytree(folder, tmp_path / "docs"))
    assert done.returncode in OTHER_CODES.get(line, CODES), done.stderr
    assert "Traceback" not in done.stdout + done.stderr
