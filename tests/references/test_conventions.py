"""Conventions of real renderers' highlights: each normalisation has a factor of its own."""

from __future__ import annotations

import pytest

from notabug.references.models.model import models
from notabug.scenes_usd.reader import read_scene

FACTORS = {"n2": lambda n: (n + 2) / 2, "n8": lambda n: (n + 8) / 8, "n2over8": lambda n: (n + 2) / 8}


@pytest.mark.parametrize("scene_id", ["phong/lobes", "phong/floor_lobes", "phong/interpolation"])
def test_divisors_of_2_and_of_8_are_edits_of_their_own(scene_id: str) -> None:
    scene = read_scene(scene_id)
    shiny = [index for index, material in enumerate(scene.materials) if any(material.specular)]
    assert shiny
    found = {}
    for model in models(scene):
        if model.name.startswith("lobe_normalised_"):
            name = model.name.removeprefix("lobe_normalised_")
            edited = model.edit(scene)
            for index in shiny:
                before, after = scene.materials[index], edited.materials[index]
                factor = FACTORS[name](before.exponent)
                assert after.specular == pytest.approx([factor * part for part in before.specular])
                found.setdefault(index, set()).add(round(factor, 9))
    assert all(len(factors) == len(FACTORS) for factors in found.values())
    assert set(found) == set(shiny)
