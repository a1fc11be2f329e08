"""Selections: ids, classes, globs, files; variants by set."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from notabug.runs.selection import QUICK, NothingSelectedError, choose, parse_variants, quick
from notabug.scenes_usd.card import CLASSES
from notabug.scenes_usd.catalogue import entry, scenes
from notabug.scenes_usd.errors import SelectionError
from notabug.scenes_usd.look import Look
from notabug.scenes_usd.reader import find

SPHERE = "terminator/sphere"


def test_nothing_named_is_every_scene_once_at_its_defaults() -> None:
    choices = choose([], {})
    assert [each.id for each in choices] == [each.id for each in scenes()]
    assert not any(each.variants for each in choices)


@pytest.mark.parametrize("word", ["terminator/sphere", "terminator", "*/sphere", "term*"])
def test_a_scene_by_any_name(word: str) -> None:
    assert SPHERE in [each.id for each in choose([word], {})]


def test_a_scene_named_twice_runs_once() -> None:
    assert [each.id for each in choose([SPHERE, SPHERE, "*/sphere"], {})].count(SPHERE) == 1


def test_several_variants_of_a_set() -> None:
    wanted = parse_variants(["tessellation=8x4", "tessellation=48x24,24x12"])
    assert [each.variant for each in choose([SPHERE], wanted)] == [
        "tessellation=8x4",
        "tessellation=48x24",
        "tessellation=24x12",
    ]


def test_all_of_a_set_and_all_sets() -> None:
    every = [f"tessellation={name}" for name in entry(SPHERE).variants["tessellation"]]
    assert [each.variant for each in choose([SPHERE], parse_variants(["tessellation=all"]))] == every
    assert [each.variant for each in choose([SPHERE], {}, every_variant=True)] == every


def test_the_default_is_one_choice_however_many_sets_vary_about_it() -> None:
    found = entry("acne/sphere")
    full = [{**found.defaults, **each.variants} for each in choose([found.id], {}, every_variant=True)]
    assert len(full) == 1 + sum(len(values) - 1 for values in found.variants.values())
    assert all(full.count(each) == 1 for each in full)
    named = {name: [value] for name, value in found.defaults.items()}
    assert len(choose([found.id], named)) == 1


def test_a_scene_without_the_set_keeps_its_default() -> None:
    found = {each.id: each.variant for each in choose([SPHERE, "calibration/card"], {"tessellation": ["8x4"]})}
    assert found == {SPHERE: "tessellation=8x4", "calibration/card": ""}


def test_files_of_one_name_have_folders_of_their_own(tmp_path: Path) -> None:
    files = []
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        files.append(shutil.copy(entry(SPHERE).path, tmp_path / name / "mine.usda"))
    first, second = choose([str(each) for each in files], {"tessellation": ["8x4"]})
    assert (first.id, second.id) == ("mine", "mine")
    assert first.folder != second.folder
    assert first.variant == "tessellation=8x4"


@pytest.mark.parametrize("word", ["", "=", "a=", "=b", "a"])
def test_what_is_no_variant(word: str) -> None:
    with pytest.raises(SelectionError, match="SET=NAME"):
        parse_variants([word])


def test_a_glob_without_a_match_is_nothing() -> None:
    with pytest.raises(NothingSelectedError):
        choose(["nothing*"], {})


def test_quick_takes_one_scene_of_each_class() -> None:
    chosen = quick(choose([], {}))
    assert [each.id for each in chosen] == list(QUICK)
    classes = [each.id.partition("/")[0] for each in chosen]
    assert sorted(classes) == sorted(set(CLASSES) - {"calibration"})
    assert [each.id for each in quick(choose(["texture/simplified", "acne/*"], {}))] == [
        "texture/simplified",
        "acne/sphere",
    ]
    assert [each.id for each in quick(choose(["calibration/card"], {}))] == ["calibration/card"]


def test_of_many_variants_the_one_that_ends_its_reader_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The default passes and is drawn; the variant is a job of its own that says why it is not."""
    monkeypatch.setenv("NOTABUG_TRUST", "")
    monkeypatch.setenv("NOTABUG_CACHE", str(tmp_path / "cache"))
    path = tmp_path / "card.usda"
    path.write_text(find("calibration/plain_card").read_text(encoding="utf-8"), encoding="utf-8")
    start = subprocess.Popen

    def started(command: list[str], **how: Any) -> Any:
        harms = any(("light", "point") in Look.from_text(text).variants for text in command[5:])
        return start([sys.executable, "-S", "-c", "import os; os.abort()"] if harms else command, **how)

    monkeypatch.setattr(subprocess, "Popen", started)
    choices = choose([str(path)], {"light": ["all"]})
    assert {choice.variant: "ends its reader" in choice.refused for choice in choices} == {
        "light=distant": False,
        "light=point": True,
    }
