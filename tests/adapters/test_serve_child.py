"""serve_child.py: a script that draws one job does all jobs of a process, and draws each as if it were the only one."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import notabug.adapters.child_job as child_job
from notabug.adapters.base import RendererMissingError
from notabug.adapters.kept import KeptChild, end_kept, kept_child
from notabug.adapters.process import run_child
from notabug.adapters.registry import adapter

SERVE = Path(child_job.__file__).with_name("serve_child.py")
SCRIPT = """
import os, sys
from pathlib import Path
jobs = []
def main(folder):
    jobs.append(folder.name)
    print("noise without an end", end="")
    if folder.name == "exits": sys.exit("it says why")
    if folder.name == "raises": raise ValueError("no such scene")
    (folder / "picture").write_text(" ".join(jobs) + " " + os.environ["TMPDIR"])
"""


@pytest.fixture
def served(tmp_path: Path) -> Iterator[KeptChild]:
    script = tmp_path / "draws.py"
    script.write_text(SCRIPT)
    for name in ("a", "exits", "raises", "b"):
        (tmp_path / name).mkdir()
    made = kept_child((sys.executable, "-P", str(SERVE), str(script)), where="tiny")
    yield made
    made.end()


def test_a_job_that_fails_says_why_and_the_next_is_drawn_by_the_same_process(served: KeptChild, tmp_path: Path) -> None:
    ended = {name: served.do(tmp_path / name, timeout=60.0) for name in ("a", "exits", "raises", "b")}
    assert {name: end.exit for name, end in ended.items()} == {"a": 0, "exits": 1, "raises": 1, "b": 0}
    assert ended["exits"].log.rstrip().endswith("it says why")
    assert "Traceback" not in ended["exits"].log
    assert "in main" in ended["raises"].log
    assert (tmp_path / "b" / "picture").read_text().split()[:4] == ["a", "exits", "raises", "b"]


def test_temporary_files_go_with_the_folder_of_the_child(served: KeptChild, tmp_path: Path) -> None:
    """Of one that stays with its own, which is there as long as it is; of another with the job's."""
    served.do(tmp_path / "a", timeout=60.0)
    place = Path((tmp_path / "a" / "picture").read_text().split()[-1])
    assert place.is_dir()
    served.end()
    assert not place.exists()
    told = run_child(
        [sys.executable, "-c", "import os; print(os.environ['TMPDIR'])"],
        where="tiny",
        folder=tmp_path / "b",
        timeout=60.0,
    )
    assert told.log.strip() == str(tmp_path / "b")


@pytest.mark.parametrize("name", ["cycles", "panda3d", "pygfx", "vtk"])
def test_what_was_drawn_before_leaves_no_trace(stage: Any, monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    """The same scene by a process of its own, by one that stays, and by the same one after another scene."""
    renderer = adapter(name)
    try:
        renderer.find()
    except RendererMissingError as missing:
        pytest.skip(str(missing))
    camera, light = stage.camera((0.4, -3.0, 3.0)), stage.distant((0.3, -0.6, 0.5))
    scene = stage.scene([stage.quad()], [light], camera, size=(16, 16))
    other = stage.scene([stage.ball()], [stage.point((1.0, -2.5, 2.0))], camera, [stage.grey(0.5)], size=(24, 24))
    run = child_job.Script._run
    with monkeypatch.context() as alone:
        alone.setattr(child_job.Script, "_run", lambda script, *told: run(replace(script, served=False), *told))
        expected = stage.draw(renderer, scene)
    try:
        pictures = [stage.draw(renderer, drawn) for drawn in (scene, other, scene)]
    finally:
        end_kept()
    assert pictures[1].shape == (24, 24, 3)
    np.testing.assert_array_equal(pictures[0], expected)
    np.testing.assert_array_equal(pictures[2], expected)
