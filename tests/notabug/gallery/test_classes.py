"""Every class has a page that can be drawn, whatever rules its models have."""

from __future__ import annotations

from pathlib import Path
from typing import get_args

from notabug.gallery.entries import own_models
from notabug.gallery.site import build
from notabug.gallery.templating import RULES
from notabug.references.models.model import Rule
from notabug.scenes_usd.catalogue import CLASSES, scenes
from notabug.scenes_usd.reader import read_scene


def test_every_class_has_a_page(tmp_path: Path) -> None:
    first: dict[str, str] = {}
    for entry in scenes():
        first.setdefault(entry.card.artifact_class, entry.id)
    build([], tmp_path / "site", with_models=False, step=0, only=list(first.values()))
    assert {page.stem for page in (tmp_path / "site" / "class").iterdir()} >= set(CLASSES)


def test_every_class_lists_models_of_its_own() -> None:
    lacking = set(CLASSES) - {"calibration", "own"}
    for entry in scenes():
        name = entry.card.artifact_class
        if name in lacking and own_models(name, read_scene(entry.id, entry.defaults)):
            lacking.remove(name)
    assert not lacking


def test_a_cutout_shows_the_filter_of_colour_and_alpha() -> None:
    names = {each.name for each in own_models("texture_space", read_scene("texture_space/cutout", {"alpha": "cut"}))}
    assert {"associated_filter", "texel_weights"} <= names
    assert "associated_filter" not in {
        each.name for each in own_models("texture_space", read_scene("texture_space/seam", {"columns": "9"}))
    }


def test_every_rule_has_a_formula() -> None:
    assert set(RULES) == set(get_args(Rule))
