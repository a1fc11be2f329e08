"""Files that cannot be written: one job's error or exit code 2, never a trace and never 1, which stands for a bug."""

from __future__ import annotations

import errno
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import notabug.runs.job
import notabug.runs.run
from notabug.adapters import trees
from notabug.adapters.base import Quality, Render, RendererError
from notabug.scenes_usd.errors import FileError, is_of_files
from notabug.scenes_usd.picture import write_exr
from notabug.scenes_usd.reader import find
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
    write = notabug.runs.job.write_json

    def full(path: Path, document: Any) -> None:
        if path.name == "result.json" and "uneven_quad" in str(path):
            raise OSError(errno.ENOSPC, "No space left on device")
        write(path, document)

    monkeypatch.setattr(notabug.runs.job, "write_json", full)
    assert door.run("terminator/sphere", "texture/uneven_quad") == 3
    found = {each["scene"]: each for each in json.loads((door.out / "run.json").read_text())["results"]}
    assert found["terminator/sphere"]["verdict"] == "pass"
    assert found["texture/uneven_quad"]["verdict"] == "error"
    assert "No space left on device" in found["texture/uneven_quad"]["message"]


def test_a_record_that_cannot_be_written_ends_the_run_with_one_line(door: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(path: Path, document: Any) -> None:
        del document
        raise OSError(errno.ENOSPC, "No space left on device", str(path))

    monkeypatch.setattr(notabug.runs.run, "write_json", full)
    assert door.run("terminator/sphere") == 2
    assert "make room on the disk" in door.stderr
    assert "Traceback" not in door.stderr


def test_a_folder_of_a_renderer_that_is_a_link_is_not_followed(door: Any, tmp_path: Path) -> None:
    (tmp_path / "mine").mkdir()
    assert door.run("terminator/sphere") == 0
    (job,) = door.out.glob("terminator/sphere/*/grey")
    for name in ("renders", "nearest.exr", "log.txt", "renders.json", ".job.lock"):
        trees.remove(job / name)
        (job / name).symlink_to(tmp_path / "mine")
    assert door.run("terminator/sphere") == 0
    trees.remove(job)
    job.symlink_to(tmp_path / "mine")
    assert door.run("terminator/sphere") == 0
    trees.remove(job.parent)
    job.parent.symlink_to(tmp_path / "mine")
    assert door.run("terminator/sphere") == 0
    assert not list((tmp_path / "mine").iterdir())
    assert not job.is_symlink()


def test_a_lock_that_is_a_folder_and_a_mass_of_litter_cost_nothing(door: Any) -> None:
    def litter(folder: Path) -> None:
        trees.remove(folder / ".job.lock")
        (folder / ".job.lock").mkdir()
        (folder / "renders" / "seed0.exr").mkdir()
        for index in range(2000):
            (folder / "renders" / str(index)).touch()
        inner = folder / "deep"
        for _ in range(300):
            inner /= "in"
        inner.mkdir(parents=True)

    draw = door.grey.render
    door.patch.setattr(door.grey, "render", leaving(draw, litter, "terminator/sphere"))
    assert door.run("terminator/sphere", "texture/uneven_quad") == 0
    door.patch.setattr(door.grey, "render", draw)
    assert door.run("terminator/sphere", "--no-resume") == 0
    (job,) = door.out.glob("terminator/sphere/*/grey")
    assert len(list(job.rglob("*"))) < 20


def test_a_renderer_that_replaces_its_folder_writes_nowhere_else(door: Any, tmp_path: Path) -> None:
    (tmp_path / "mine").mkdir()

    def litter(folder: Path) -> None:
        trees.remove(folder / "renders")
        (folder / "renders").symlink_to(tmp_path / "mine")

    door.patch.setattr(door.grey, "render", leaving(door.grey.render, litter, "terminator/sphere"))
    assert door.run("terminator/sphere", "texture/uneven_quad") == 3
    found = {each["scene"]: each for each in json.loads((door.out / "run.json").read_text())["results"]}
    assert found["texture/uneven_quad"]["verdict"] == "pass"
    assert "replaced a folder" in found["terminator/sphere"]["message"]
    assert not list((tmp_path / "mine").iterdir())


@pytest.mark.parametrize(
    "words",
    [
        ["run", "terminator/sphere"],
        ["export", "terminator/sphere", "--to", "obj"],
        ["judge", "a.exr", "--scene", "terminator/sphere"],
        ["gallery", "--scene", "terminator/sphere", "--no-models"],
        ["merge", "run"],
        ["bench", "stability", "--quick"],
        ["reduce", "terminator/sphere", "-r", "grey"],
    ],
    ids=lambda words: words[0],
)
def test_a_folder_with_files_of_others_is_refused_and_left(door: Any, tmp_path: Path, words: list[str]) -> None:
    write_exr(tmp_path / "a.exr", np.full((256, 256, 3), 0.5))
    if words[0] == "merge":
        assert door("run", "terminator/sphere", "--out", "run") == 0
    theirs = tmp_path / "theirs"
    files = ("index.html", "data/mine.js", "thumbs/mine.webp", "bench/mine.svg", "report.html")
    for name in files:
        (theirs / name).parent.mkdir(parents=True, exist_ok=True)
        (theirs / name).write_text("mine")
    assert door(*words, "--out", "theirs") == 2
    assert "files that notabug did not make" in door.stderr
    assert {path.relative_to(theirs).as_posix() for path in theirs.rglob("*") if path.is_file()} == set(files)
    assert all((theirs / name).read_text() == "mine" for name in files)


def test_a_gallery_removes_only_what_it_wrote(door: Any, tmp_path: Path) -> None:
    words = ("gallery", "--no-models", "--out", "site")
    assert door(*words, "--scene", "terminator/sphere") == 0
    site = tmp_path / "site"
    (site / "thumbs" / "mine.webp").write_text("mine")
    (site / "data" / "mine.js").write_text("mine")
    before = {path.name for path in (site / "thumbs").iterdir()}
    note = json.loads((site / ".notabug.json").read_text())
    (tmp_path / "secret.js").write_text("mine")
    note["files"] += ["../secret.js", str(tmp_path / "secret.js"), "linked/secret.js", 7, ""]
    (site / "linked").symlink_to(tmp_path)
    (site / ".notabug.json").write_text(json.dumps(note))
    assert door(*words, "--scene", "texture/uneven_quad") == 0
    after = {path.name for path in (site / "thumbs").iterdir()}
    assert before & after == {"mine.webp"}
    assert (site / "data" / "mine.js").is_file()
    assert (tmp_path / "secret.js").is_file()
    assert door("run", "terminator/sphere", "--out", "site") == 2
    assert "holds a gallery" in door.stderr


def test_a_bad_scene_costs_the_others_nothing(door: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NOTABUG_TRUST", "")
    good = find("calibration/plain_card").read_text(encoding="utf-8")
    texts = {
        "first": good,
        "deep": good + 'def Xform "a"\n{\n' * 20_000 + "}\n" * 20_000,
        "outside": good + 'def "More" (\n    references = @../x.usda@\n)\n{\n}\n',
        "broken": "#usda 1.0\n(",
        "last": good,
    }
    for name, text in texts.items():
        (tmp_path / f"{name}.usda").write_text(text)
    assert door.run(*(f"{name}.usda" for name in texts)) == 2
    found = {each["scene"]: each for each in json.loads((door.out / "run.json").read_text())["results"]}
    assert {name: each["verdict"] for name, each in found.items()} == {
        **dict.fromkeys(("first", "last"), "pass"),
        **dict.fromkeys(("deep", "outside", "broken"), "error"),
    }
    assert "nested too deep" in found["deep"]["message"]
    assert "outside of the scene's folder" in found["outside"]["message"]
    assert door.run("deep.usda") == 2


def test_no_log_is_written_through_a_link_that_a_failing_renderer_left(door: Any, tmp_path: Path) -> None:
    (tmp_path / "mine").mkdir()

    def fails(scene: Scene, out: Path, quality: Quality) -> tuple[Render, ...]:
        del quality
        if scene.id == "terminator/sphere":
            job = out.parent
            trees.remove(job)
            job.symlink_to(tmp_path / "mine")
            error = RendererError("it crashed")
            error.log = "its log"
            raise error
        return draw(scene, out, Quality())

    draw = door.grey.render
    door.patch.setattr(door.grey, "render", fails)
    assert door.run("terminator/sphere") == 3
    assert not list((tmp_path / "mine").iterdir())
    door.patch.setattr(door.grey, "render", draw)
    assert door.run("terminator/sphere") == 0
    assert not list((tmp_path / "mine").iterdir())


@pytest.mark.parametrize("value", ["[]", "{}", '[{"image": 3}]', '"x"', '[{"image": "a\\u0000b"}]'])
def test_a_list_of_pictures_of_another_shape_is_drawn_anew(door: Any, value: str) -> None:
    assert door.run("terminator/sphere") == 0
    (path,) = door.out.glob("terminator/sphere/*/grey/renders.json")
    stored = json.loads(path.read_text())
    path.write_text(json.dumps({**stored, "renders": json.loads(value)}))
    path.with_name("result.json").unlink()
    assert door.run("terminator/sphere") == 0
