"""Files that cannot be written: one job's error or exit code 2, never a trace and never 1, which stands for a bug."""

from __future__ import annotations

import errno
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import notabug.run
from notabug.adapters.base import Quality, Render
from notabug.scenes_usd.errors import FileError, is_of_files
from notabug.scenes_usd.picture import write_exr
from notabug.scenes_usd.scene import Scene


def test_which_errors_are_of_files() -> None:
    assert is_of_files(OSError(errno.ENOSPC, "full"))
    assert is_of_files(NotADirectoryError(errno.ENOTDIR, "no folder", "/a/b"))
    assert not is_of_files(ConnectionResetError(errno.ECONNRESET, "gone"))
    assert not is_of_files(OSError("no number"))
    assert not is_of_files(ValueError("x"))
    assert "/a/b" in str(FileError.of(NotADirectoryError(errno.ENOTDIR, "no folder", "/a/b")))


@pytest.mark.parametrize("words", [["run", "terminator/sphere"], ["export", "terminator/sphere", "--to", "obj"]])
@pytest.mark.parametrize("place", ["file", "below a file", "a name that is too long"])
def test_an_out_that_cannot_be_a_folder(door: Any, tmp_path: Path, words: list[str], place: str) -> None:
    (tmp_path / "file").write_text("mine")
    out = {"file": "file", "below a file": "file/out", "a name that is too long": "x" * 300}[place]
    assert door(*words, "--out", out) == 2
    assert door.stderr.count("\n") == 1
    assert "Traceback" not in door.stderr
    assert (tmp_path / "file").read_text() == "mine"


def test_judge_and_gallery_into_a_file(door: Any, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("mine")
    write_exr(tmp_path / "a.exr", np.full((256, 256, 3), 0.5))
    assert door("judge", "a.exr", "--scene", "terminator/sphere", "--out", "file") == 2
    assert "Traceback" not in door.stderr
    assert door("gallery", "--scene", "terminator/sphere", "--no-models", "--out", "file") == 2
    assert "Traceback" not in door.stderr
    assert (tmp_path / "file").read_text() == "mine"


def test_accept_into_a_folder(door: Any, tmp_path: Path) -> None:
    from notabug.metrics.verdict import Verdict

    door.judge.verdicts["terminator/sphere"] = Verdict("inconclusive")
    assert door.run("terminator/sphere") == 0
    (tmp_path / "folder").mkdir()
    door.patch.delenv("CI", raising=False)
    words = ["terminator/sphere", "-r", "grey", "--because", "x", "--run", str(door.out), "--expect", "folder"]
    assert door("accept", *words) == 2
    assert door.stderr.count("\n") == 1


Draw = Callable[[Scene, Path, Quality], tuple[Render, ...]]


def leaving(draw: Draw, litter: Callable[[Path], None], scene: str) -> Draw:
    """``draw``, and then what ``litter`` leaves in the job's folder, for ``scene``."""

    def drawn(drawn_scene: Scene, out: Path, quality: Quality) -> tuple[Render, ...]:
        made = draw(drawn_scene, out, quality)
        if drawn_scene.id == scene:
            litter(out.parent)
        return made

    return drawn


def folders(*names: str) -> Callable[[Path], None]:
    def litter(folder: Path) -> None:
        for name in names:
            (folder / name / "in").mkdir(parents=True)

    return litter


@pytest.mark.parametrize(
    "name", ["log.txt", "result.json", "renders.json", "mean.exr", "nearest.exr", "reference.exr", "more"]
)
def test_folders_in_place_of_our_files_cost_nothing(door: Any, name: str) -> None:
    door.patch.setattr(door.grey, "render", leaving(door.grey.render, folders(name), "terminator/sphere"))
    assert door.run("terminator/sphere", "texture/uneven_quad") == 0
    found = {each["scene"]: each["verdict"] for each in json.loads((door.out / "run.json").read_text())["results"]}
    assert found == {"terminator/sphere": "pass", "texture/uneven_quad": "pass"}
    assert door.run("terminator/sphere", "texture/uneven_quad", "--no-resume") == 0


def test_a_full_disk_costs_the_job_that_met_it(door: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    write = notabug.run.write_json

    def full(path: Path, document: Any) -> None:
        if path.name == "result.json" and "uneven_quad" in str(path):
            raise OSError(errno.ENOSPC, "No space left on device")
        write(path, document)

    monkeypatch.setattr(notabug.run, "write_json", full)
    assert door.run("terminator/sphere", "texture/uneven_quad") == 3
    found = {each["scene"]: each for each in json.loads((door.out / "run.json").read_text())["results"]}
    assert found["terminator/sphere"]["verdict"] == "pass"
    assert found["texture/uneven_quad"]["verdict"] == "error"
    assert "No space left on device" in found["texture/uneven_quad"]["message"]


def test_a_record_that_cannot_be_written_ends_the_run_with_one_line(door: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(path: Path, document: Any) -> None:
        del document
        raise OSError(errno.ENOSPC, "No space left on device", str(path))

    monkeypatch.setattr(notabug.run, "write_json", full)
    assert door.run("terminator/sphere") == 2
    assert "make room on the disk" in door.stderr
    assert "Traceback" not in door.stderr
