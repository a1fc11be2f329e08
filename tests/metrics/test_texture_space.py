"""Verdicts on texture space: what hardware, atlases and welded meshes do is a limitation where declared, else a bug."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from notabug.adapters.base import Quality
from notabug.adapters.inhouse import InHouse
from notabug.references.models.model import Model, models
from notabug.references.models.texture_space import _meets_border
from notabug.references.predict import configured
from notabug.references.tracer.envelope import trace_picture
from notabug.references.workarounds.texture_space import gutter, split
from notabug.scenes_usd.scene import Preview, Scene

CENTRES = Quality(samples=1)
WRAP, SEAM = "texture_space/wrap", "texture_space/seam"
POINT = InHouse().declaration(CENTRES)
SIZE = 64


def small(studio: Any, name: str, **variants: str) -> Scene:
    return replace(studio.scene(name, **variants), width=SIZE, height=SIZE)


def drawn(scene: Scene, *chosen: Model) -> Any:
    return trace_picture(*configured(scene, chosen))


def found(studio: Any, picture: Any, scene: Scene, declared: Any = POINT) -> tuple[str, list[str]]:
    verdict = studio.verdict([picture], scene, declared)
    return verdict.word, [each.name for each in verdict.findings]


def word(studio: Any, picture: Any, scene: Scene, declared: Any = POINT) -> str:
    """The verdict's word, without looking for a bug's name."""
    return str(studio.verdict([picture], scene, declared, naming=False).word)


def ours(scene: Scene, **switches: Any) -> tuple[Any, Any]:
    """What the in-house renderer draws and declares with ``switches``."""
    adapter = InHouse(limitations=(), **switches)
    return adapter, adapter.declaration(CENTRES)


LIMITED = [
    (WRAP, {}, {"texture_bits": 4}, "texel_weights"),
    (WRAP, {}, {"texture_bits": 8}, "texel_weights"),
    (WRAP, {}, {"texture_border": "clamped"}, "border_not_filtered"),
    (WRAP, {"space": "sRGB"}, {"texture_decoding": "after"}, "decoded_after_filter"),
    (SEAM, {}, {"texture_border": "clamped"}, "border_not_filtered"),
    (SEAM, {}, {"uv_seam": "first"}, "welded_seam"),
    (SEAM, {"columns": "27"}, {"uv_seam": "last"}, "welded_seam"),
]


@pytest.mark.parametrize(("name", "variants", "switches", "shown"), LIMITED, ids=str)
def test_each_is_a_limitation_where_it_is_declared_and_a_bug_where_it_is_not(
    studio: Any, name: str, variants: dict[str, str], switches: dict[str, Any], shown: str
) -> None:
    scene = small(studio, name, **variants)
    adapter, declared = ours(scene, **switches)
    (picture,) = studio.draw(adapter, scene, CENTRES)
    assert found(studio, picture, scene, declared) == ("limitation", [shown])
    assert word(studio, picture, scene) == "bug"
    assert found(studio, drawn(scene), scene, declared) == ("pass", []), "who may is not bound to"


def of_numbers(scene: Scene, kind: str) -> Scene:
    """``scene`` whose map is not one of a colour, but of the number ``kind`` of UsdPreviewSurface, in grey."""
    grey = tuple(
        replace(texture, pixels=np.repeat(texture.pixels.mean(axis=2, keepdims=True), 3, axis=2), colour_space="raw")
        for texture in scene.textures
    )
    materials = tuple(
        replace(material, texture=-1, diffuse=(0.6, 0.5, 0.4), preview=replace(Preview(), **{kind: material.texture}))
        for material in scene.materials
    )
    return replace(scene, textures=grey, materials=materials)


@pytest.mark.parametrize(
    ("name", "kind", "switches", "shown"),
    [
        (WRAP, "metallic_map", {"texture_border": "clamped"}, "border_not_filtered"),
        (WRAP, "roughness_map", {"texture_bits": 4}, "texel_weights"),
        (SEAM, "metallic_map", {"uv_seam": "first"}, "welded_seam"),
    ],
)
def test_a_map_of_numbers_alone_is_looked_up_as_one_of_colours_is(
    studio: Any, name: str, kind: str, switches: dict[str, Any], shown: str
) -> None:
    scene = of_numbers(small(studio, name), kind)
    adapter, declared = ours(scene, **switches)
    (picture,) = studio.draw(adapter, scene, CENTRES)
    assert found(studio, picture, scene, declared) == ("limitation", [shown])
    assert word(studio, picture, scene) == "bug"


@pytest.mark.parametrize("kind", ["roughness_map", "metallic_map", "emission_map"])
def test_faults_of_a_look_up_are_known_of_maps_of_numbers_and_those_of_colours_are_not(studio: Any, kind: str) -> None:
    scene = of_numbers(small(studio, WRAP), kind)
    names = {model.name for model in models(scene)}
    assert {"texture_wrap", "texture_nearest", "negative_uv"} <= names
    assert {"texture_decoded", "texture_encoded", "texture_channels_swapped"}.isdisjoint(names)


def test_a_wrap_mode_of_a_map_of_numbers_is_named(studio: Any) -> None:
    scene = of_numbers(small(studio, WRAP), "metallic_map")
    clamped = replace(scene, textures=tuple(replace(each, wrap_s="clamp", wrap_t="clamp") for each in scene.textures))
    assert found(studio, drawn(clamped), scene) == ("bug", ["texture_wrap"])


@pytest.mark.parametrize(
    ("low", "high", "meets"),
    [
        (0.0, 1.0, True),
        (0.125, 0.875, False),  # a gutter of half a texel, of four
        (0.1, 0.9, True),
        (0.95, 1.05, True),  # within the half texels on both sides of a border
        (-0.05, 0.05, True),
        (1.2, 1.8, False),
        (-2.9, -2.1, True),
        (-2.8, -2.2, False),
    ],
)
@pytest.mark.parametrize("axis", [0, 1])
def test_a_border_is_met_within_half_a_texel_of_it(
    studio: Any, low: float, high: float, meets: bool, axis: int
) -> None:
    scene = small(studio, WRAP)
    mesh = next(mesh for mesh in scene.meshes if scene.materials[mesh.material].textures)
    assert mesh.uv is not None
    uv = np.full(mesh.uv.shape, 0.5)
    uv[:, axis] = np.linspace(low, high, len(uv))
    texture = replace(scene.textures[0], pixels=np.zeros((4, 4, 3)), wrap_s="repeat", wrap_t="repeat")
    assert _meets_border(replace(mesh, uv=uv), texture) == meets


def test_a_limitation_excuses_nothing_beside_it(studio: Any) -> None:
    """A square in the dark, 1 % too much light, and half of a squeezed column."""
    scene = small(studio, SEAM)
    adapter, declared = ours(scene, uv_seam="first")
    (picture,) = studio.draw(adapter, scene, CENTRES)
    dark = picture.copy()
    dark[30:34, 40:44] *= 0.5
    half = picture.copy()
    half[: SIZE // 2] = drawn(scene)[: SIZE // 2]
    for wrong in (dark, picture * 1.01, half):
        assert word(studio, wrong, scene, declared) == "bug"


def test_coarse_weights_are_no_excuse_for_coarser_ones(studio: Any) -> None:
    scene = small(studio, WRAP)
    adapter, _ = ours(scene, texture_bits=4)
    (picture,) = studio.draw(adapter, scene, CENTRES)
    for bits in (6, 8):
        assert word(studio, picture, scene, replace(POINT, texture_bits=bits)) == "bug"


FAULTS = [
    (WRAP, {}, "texture_wrap", "clamped"),
    (WRAP, {}, "texture_wrap", "mirrored"),
    (WRAP, {}, "texture_wrap", "black"),
    (WRAP, {"wrap": "mirror"}, "texture_wrap", "repeats"),
    (WRAP, {"wrap": "clamp"}, "texture_wrap", "black"),
    (WRAP, {"wrap": "black"}, "texture_wrap", "clamped"),
    (WRAP, {"wrap": "repeat_clamp"}, "texture_wrap", "exchanged"),
    (WRAP, {}, "negative_uv", "lose their sign"),
    (WRAP, {}, "negative_uv", "taken for 0"),
    (WRAP, {}, "negative_uv", "from the top"),
    (WRAP, {"wrap": "clamp"}, "negative_uv", "from the bottom"),
    (WRAP, {}, "flipped_v", ""),
    (WRAP, {}, "shifted_uv", "in u"),
    (WRAP, {}, "texel_centre", "(+0.5, -0.5)"),
    (WRAP, {}, "texture_decoded", ""),
    (WRAP, {"space": "sRGB"}, "texture_encoded", ""),
    (WRAP, {"space": "sRGB"}, "texture_decoded_late", ""),
    (WRAP, {"transform": "all"}, "uv_transform_order", "moved"),
    (WRAP, {"transform": "all"}, "uv_transform_order", "turned"),
    (WRAP, {"transform": "all"}, "uv_transform_turned", ""),
    (WRAP, {"transform": "all"}, "uv_transform_ignored", ""),
    (SEAM, {}, "border_filter_lost", ""),
    (SEAM, {}, "seam_welded", "first"),
    (SEAM, {"columns": "27"}, "seam_welded", "last"),
]


@pytest.mark.sweep_except(
    f"{WRAP}-variants0-texture_wrap-clamped",
    f"{WRAP}-variants7-negative_uv-lose their sign",
    f"{WRAP}-variants9-negative_uv-from the top",
    f"{WRAP}-variants16-texture_decoded_late-",
    f"{WRAP}-variants17-uv_transform_order-moved",
    f"{WRAP}-variants19-uv_transform_turned-",
    f"{WRAP}-variants20-uv_transform_ignored-",
    f"{SEAM}-variants21-border_filter_lost-",
    f"{SEAM}-variants22-seam_welded-first",
)
@pytest.mark.parametrize(("name", "variants", "fault", "part"), FAULTS)
def test_each_fault_is_a_bug_of_its_name(
    studio: Any, name: str, variants: dict[str, str], fault: str, part: str
) -> None:
    scene = small(studio, name, **variants)
    chosen = next(each for each in models(scene) if each.name == fault and part in each.claim)
    said, names = found(studio, drawn(scene, chosen), scene)
    assert (said, names[0]) == ("bug", fault)


@pytest.mark.parametrize(
    ("name", "variants"),
    [(WRAP, {}), (WRAP, {"wrap": "mirror"}), (WRAP, {"wrap": "black"}), (WRAP, {"space": "sRGB"}), (SEAM, {})],
)
def test_what_is_right_passes_by_any_declaration(studio: Any, name: str, variants: dict[str, str]) -> None:
    scene = small(studio, name, **variants)
    unknown = replace(
        POINT, texture_border="unknown", texture_decoding="unknown", texture_filter="unknown", uv_seam="unknown"
    )
    for declared in (POINT, unknown, replace(POINT, texture_bits=6, uv_seam="first", texture_border="clamped")):
        assert found(studio, drawn(scene), scene, declared) == ("pass", [])


@pytest.mark.parametrize(
    ("name", "switches", "edit"),
    [(WRAP, {"texture_border": "clamped"}, gutter), (SEAM, {"uv_seam": "first"}, split)],
)
def test_workarounds_take_the_artifact_away(studio: Any, name: str, switches: dict[str, Any], edit: Any) -> None:
    """What is drawn of the edited scene is the reference of the scene itself, to rounding."""
    scene = small(studio, name)
    adapter, _ = ours(scene, **switches)
    (before,) = studio.draw(adapter, scene, CENTRES)
    (after,) = studio.draw(adapter, edit(scene), CENTRES)
    assert np.abs(after - drawn(scene)).max() < 1e-6
    assert np.abs(before - drawn(scene)).max() > 0.1
