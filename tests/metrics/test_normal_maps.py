"""Verdicts on normal maps: what renderers make of them is a convention or a limitation, what is misread a bug."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from notabug.adapters.base import Declaration
from notabug.references.models.model import models
from notabug.references.predict import predict
from notabug.references.tracer.envelope import trace_picture
from notabug.references.tracer.options import Options
from notabug.scenes_usd.scene import Scene

IDENTITY, BUMPS, RIDGES = "normal_maps/identity", "normal_maps/bumps", "normal_maps/mirrored_uv"
FEATURES = ("mapped_away", "bump_light", "tangents", "normal_level")
REFERENCE = dict(zip(FEATURES, ("keep", "cut", "triangle", "127.5"), strict=True))


def small(studio: Any, name: str, share: float = 0.4, **variants: str) -> Scene:
    scene: Scene = studio.scene(name, **variants)
    return replace(scene, width=int(scene.width * share), height=int(scene.height * share))


def found(studio: Any, picture: Any, scene: Scene, declaration: Declaration | None = None) -> tuple[str, list[str]]:
    verdict = studio.verdict([picture], scene, declaration or studio.point)
    return verdict.word, [each.name for each in verdict.findings]


def word_of(studio: Any, picture: Any, scene: Scene, declaration: Declaration | None = None) -> str:
    word: str = studio.verdict([picture], scene, declaration or studio.point, naming=False).word
    return word


def drawn(scene: Scene, name: str) -> Any:
    (model,) = (each for each in models(scene) if each.name == name)
    return predict(scene, [model.as_drawn()]).point


ALLOWED = [
    (BUMPS, "mapped_normal_flipped", "", "pass"),
    (BUMPS, "mapped_normal_raised", "", "pass"),
    (BUMPS, "mapped_normal_black", "", "limitation"),
    (BUMPS, "bump_light_leak", "", "limitation"),
    (
        BUMPS,
        "bump_terminator_softened",
        "light fades towards a surface's horizon as much as the mapped normal leans, by Estevez's shadowing",
        "limitation",
    ),
    (RIDGES, "tangents_interpolated", "", "pass"),
    (RIDGES, "tangents_cotangent", "", "pass"),
    (IDENTITY, "normal_map_level", "", "pass"),
]
FAULTS = [
    (BUMPS, "normal_map_as_srgb"),
    (BUMPS, "normal_unscaled"),
    (BUMPS, "normal_map_in_world_space"),
    (BUMPS, "normal_green_flipped"),
    (RIDGES, "mapped_normal_not_normalised"),
    (RIDGES, "tangent_handedness"),
    (RIDGES, "normal_red_flipped"),
    (RIDGES, "normal_map_ignored"),
    (IDENTITY, "normal_map_as_srgb"),
    (IDENTITY, "normal_map_in_world_space"),
]


@pytest.mark.parametrize("scene", [BUMPS, RIDGES, IDENTITY])
def test_the_reference_passes_whatever_is_declared(studio: Any, scene: str) -> None:
    read = small(studio, scene)
    picture = trace_picture(read, Options().for_scene(read))
    assert found(studio, picture, read) == ("pass", [])
    assert found(studio, picture, read, replace(studio.point, **REFERENCE)) == ("pass", [])


@pytest.mark.parametrize(("scene", "name", "claim", "word"), ALLOWED, ids=[each[1] for each in ALLOWED])
def test_what_renderers_make_of_maps_is_named(studio: Any, scene: str, name: str, claim: str, word: str) -> None:
    """And called a bug of a renderer that declares not to do so."""
    read = small(studio, scene)
    (model,) = (each for each in models(read) if each.name == name and each.claim.startswith(claim))
    picture = predict(read, [model]).point
    assert found(studio, picture, read) == (word, [name])
    assert model.when is not None
    feature, value = model.when
    assert found(studio, picture, read, replace(studio.point, **{feature: value})) == (word, [name])
    assert word_of(studio, picture, read, replace(studio.point, **REFERENCE)) == "bug"


@pytest.mark.parametrize(("scene", "fault"), FAULTS, ids=[f"{scene[12:]}-{fault}" for scene, fault in FAULTS])
def test_faults_are_named(studio: Any, scene: str, fault: str) -> None:
    read = small(studio, scene)
    word, names = found(studio, drawn(read, fault), read)
    assert (word, names[0]) == ("bug", fault)


def edited(scene: Scene, edit: Any) -> Scene:
    return replace(scene, textures=tuple(replace(each, pixels=edit(each.pixels)) for each in scene.textures))


OTHERS = {
    "channels exchanged": lambda pixels: pixels[..., [1, 0, 2]],
    "half as steep": lambda pixels: pixels * [0.5, 0.5, 1.0],
    "steeper by a tenth": lambda pixels: pixels * [1.1, 1.1, 1.0],
    "upside down": lambda pixels: pixels[::-1],
    "a texel beside": lambda pixels: np.roll(pixels, 2, axis=1),
    "pointing inwards": lambda pixels: pixels * [1.0, 1.0, -1.0],
}


@pytest.mark.parametrize("edit", OTHERS)
def test_what_no_convention_allows_is_a_bug(studio: Any, edit: str) -> None:
    """Pictures of other maps on the same scenes: every limitation and convention is open to them."""
    for name in (BUMPS, RIDGES):
        read = small(studio, name)
        other = edited(read, OTHERS[edit])
        assert word_of(studio, trace_picture(other, Options().for_scene(other)), read) == "bug", name


def test_a_whole_black_bump_is_no_normal_that_faces_away(studio: Any) -> None:
    """Half of the pixels where none faces away, black: the limitation excuses no other pixel."""
    read = small(studio, BUMPS)
    picture = trace_picture(read, Options(mapped_away="black")).copy()
    reference = trace_picture(read, Options())
    lit = np.argwhere((picture == reference).all(axis=2) & (reference.max(axis=2) > 0.1))
    picture[tuple(lit[:: len(lit) // 40].T)] = 0.0
    assert word_of(studio, picture, read) == "bug"


def test_a_convention_is_kept_in_the_whole_picture(studio: Any) -> None:
    """Turned on the left, and not on the right: no renderer does that."""
    read = small(studio, BUMPS)
    picture = trace_picture(read, Options(mapped_away="flip")).copy()
    half = read.width // 2
    picture[:, half:] = trace_picture(read, Options())[:, half:]
    assert word_of(studio, picture, read) == "bug"
