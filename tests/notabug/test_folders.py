"""Folder names: whatever a scene is called, its files stay inside the run's folder."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from notabug.runs.folders import FolderInUseError, folder_name, job_folder, sole_writer, write_json
from notabug.runs.own_folder import ForeignFolderError, check, claim


@given(st.text(st.characters(), max_size=200))
def test_a_folder_name_is_one_harmless_name(text: str) -> None:
    name = folder_name(text)
    assert name not in ("", ".", "..")
    assert not name.startswith((".", "-"))
    assert not set(name) & set("/\\:\0\n")
    assert len(name.encode()) < 100


@given(st.text(max_size=100), st.text(max_size=100))
def test_unequal_texts_have_unequal_names(a: str, b: str) -> None:
    if {a, b} != {"", "default"}:
        assert (folder_name(a) == folder_name(b)) == (a == b)


@pytest.mark.parametrize("hostile", ["../../etc", "/etc/passwd", "..", "a/../../b", "~root", "con\0x", "$(rm -rf)"])
def test_a_job_stays_inside(tmp_path: Path, hostile: str) -> None:
    folder = job_folder(tmp_path, hostile, hostile, hostile)
    assert folder.resolve().is_relative_to(tmp_path.resolve())
    assert len(folder.relative_to(tmp_path).parts) == 4


def test_writing_is_all_or_nothing(tmp_path: Path) -> None:
    path = tmp_path / "a.json"
    write_json(path, {"a": 1})
    with pytest.raises(ValueError, match="JSON"):
        write_json(path, {"a": float("nan")})
    assert json.loads(path.read_text()) == {"a": 1}
    assert [each.name for each in tmp_path.iterdir()] == ["a.json"]


def test_whose_a_folder_is(tmp_path: Path) -> None:
    claim(tmp_path / "new" / "out", "gallery")
    assert check(tmp_path / "new" / "out", "gallery")
    with pytest.raises(ForeignFolderError, match="holds a gallery"):
        check(tmp_path / "new" / "out", "run")
    assert not check(tmp_path / "gone", "run")
    (tmp_path / "hidden").mkdir()
    for name in (".notabug.lock", "..notabug.json.x.partial"):  # of a process that is about to take it
        (tmp_path / "hidden" / name).touch()
    assert not check(tmp_path / "hidden", "run")
    for index, name in enumerate(("notabug.toml", ".git", "run.json")):
        folder = tmp_path / f"theirs{index}"
        folder.mkdir()
        (folder / name).write_text("{}")
        with pytest.raises(ForeignFolderError, match="did not make"):
            claim(folder, "run")
    (tmp_path / "copied").mkdir()  # by what leaves hidden files behind
    write_json(tmp_path / "copied" / "run.json", {"schema": 1, "tool": {"name": "notabug"}})
    claim(tmp_path / "copied", "run")
    assert (tmp_path / "copied" / ".notabug.json").is_file()


def test_two_runs_do_not_share_a_folder(tmp_path: Path) -> None:
    with sole_writer(tmp_path / "out"):
        with pytest.raises(FolderInUseError, match="another run is writing"), sole_writer(tmp_path / "out"):
            pass
        with sole_writer(tmp_path / "other"):
            pass
    with sole_writer(tmp_path / "out"):
        pass
