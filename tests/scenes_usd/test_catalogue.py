"""The catalogue and the tables of expected verdicts."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from notabug.scenes_usd.card import CLASSES
from notabug.scenes_usd.catalogue import entry, expected, preview_scenes, read_entry, read_expected, scenes
from notabug.scenes_usd.errors import SceneError, SelectionError
from notabug.scenes_usd.reader import CORPUS, read_scene


def test_every_scene_file_is_listed() -> None:
    listed = {each.path for each in scenes()} | {CORPUS / f"{scene}.usda" for scene in preview_scenes()}
    assert listed == set(CORPUS.glob("*/*.usda"))


@pytest.mark.parametrize("scene", [each.id for each in scenes()])
def test_entry_agrees_with_reader(scene: str) -> None:
    listed = entry(scene)
    for name in ("", *(f"{key}={each}" for key, names in listed.variants.items() for each in names)):
        choice = dict([name.split("=")]) if name else {}
        read = read_scene(scene, choice)
        assert (read.id, read.card.claim, read.card.artifact_class) == (scene, listed.claim, listed.artifact_class)
        assert dict(read.variants) == {**listed.defaults, **choice}
        assert scene.split("/")[0] == listed.artifact_class
        assert read.card.cites
        assert read.card.requires


def test_scenes_in_the_order_of_the_table() -> None:
    classes = [CLASSES.index(each.artifact_class) for each in scenes()]
    assert classes == sorted(classes)


def test_unknown_entry() -> None:
    with pytest.raises(SelectionError, match=r"no scene called 'texture/none'; expected one of .*texture/uneven_quad"):
        entry("texture/none")


def test_entry_without_card(write: Callable[..., Path]) -> None:
    """A team's own scene needs neither a card nor a default prim."""
    for change in (("dictionary notabug", "dictionary other"), ('defaultPrim = "Scene"', "")):
        assert read_entry(write(change, name=f"{len(change[0])}.usda")).artifact_class == "own"


def test_expected_from_general_to_special(write: Callable[..., Path]) -> None:
    path = write()
    scene = read_scene(path)
    assert expected(scene) == {}
    path.with_suffix(".expected.toml").write_text(
        '[variant."size=one,hue=red"]\na = "bug"\n'
        '[variant."size=one"]\na = "limitation: x + y"\nb = "unsupported"\n'
        '[variant."*"]\n"*" = "pass"\na = "error"\n'
    )
    assert expected(scene) == {"*": "pass", "a": "limitation: x + y", "b": "unsupported"}
    assert expected(replace(scene, variants={"size": "two"})) == {"*": "pass", "a": "error"}
    assert expected(replace(scene, variants={"size": "one", "hue": "red"}))["a"] == "bug"


@pytest.mark.parametrize(
    ("text", "fragment"),
    [
        ("[variant", "not valid TOML"),
        ('[variants."*"]\na = "pass"', "unknown key"),
        ('[variant."*"]\na = "passes"', r'variant."\*".a: not a verdict'),
        ('[variant."*"]\na = "limitation"', "with its name"),
        ('[variant."*"]\na = "pass: x"', "not a verdict"),
        ('[variant."*"]\na = 3', "not a verdict"),
        ('[variant."size"]\na = "pass"', "not a choice"),
        ('[variant]\n"size=one" = 3', "not a table"),
        ("variant = 3", "not a table"),
    ],
)
def test_expected_refused(text: str, fragment: str, tmp_path: Path) -> None:
    path = tmp_path / "x.expected.toml"
    path.write_text(text)
    with pytest.raises(SceneError, match=fragment):
        read_expected(path)


@pytest.mark.parametrize("scene", [each.id for each in scenes()])
def test_tables_name_variants_that_exist(scene: str) -> None:
    listed = entry(scene)
    path = listed.path.with_suffix(".expected.toml")
    assert path.is_file()
    for choice in read_expected(path):
        for key, name in choice:
            assert name in listed.variants[key]


def test_no_table_without_a_scene() -> None:
    for path in CORPUS.glob("*/*.expected.toml"):
        assert path.with_name(path.name.replace(".expected.toml", ".usda")).is_file()
