"""Every fault model, drawn in-house, is called a bug of its own name: at pixel centres and in noisy pictures."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from notabug.adapters.base import Quality
from notabug.adapters.inhouse import InHouse
from notabug.references.models.model import models
from notabug.references.tracer.envelope import Envelope
from notabug.scenes_usd.scene import Scene

CENTRES = Quality(samples=1)
NOISY = Quality(samples=64, seeds=(0, 1, 2, 3))

SPHERE = ("light_gain", "no_shadow", "flat_normals", "normals_not_normalised")
TEXTURE = ("texture_decoded", "texture_encoded")
QUAD = ("light_gain", "affine_uv", "swapped_uv", "flipped_v", "shifted_uv", *TEXTURE)
NEAR = {  # see test_near_faults.py
    "no_epsilon", "epsilon_too_large", "epsilon_not_scaled", "colour_of_neither", "hole", "loser_wins",
}  # fmt: skip
MAPS = {"shadow_map_reversed", "shadow_map_moved", "shadow_bias_negated"}  # see test_shadow_maps.py
PARTS = {  # see test_naming.py
    "light_negated", "texel_centre", "texture_nearest", "face_missing", "cracks",
}  # fmt: skip
CARD = ("light_gain", "swapped_uv", "flipped_v", "shifted_uv", *TEXTURE)
SHINY = ("light_gain", "exponent", "specular_missing", "specular_twice", "diffuse_missing", "specular_tinted")
IDLE = {  # faults that cannot act: nothing there casts a shadow, and a card straight on has no perspective
    "texture/uneven_quad": ("no_shadow",),
    "calibration/card": ("no_shadow", "affine_uv"),
}
PLACES = [
    ("terminator/sphere", {"tessellation": "24x12"}, SPHERE),
    ("terminator/sphere", {"tessellation": "16x8"}, SPHERE),
    ("texture/uneven_quad", {"split": "quad"}, QUAD),
    ("texture/uneven_quad", {"split": "split13"}, QUAD),
    ("calibration/card", {}, CARD),
]
ALIKE = {
    ("calibration/card", "flipped_v"): {"upside_down"},  # the card fills the picture evenly: the same picture
    # 110 degrees from light to view (L + V)/2 is .57 long: its 32nd power is no highlight at all
    ("phong/lobes", "specular_missing"): {"halfway_not_normalised"},
    ("phong/lobes", "halfway_not_normalised"): {"specular_missing"},
}
CASES = [
    pytest.param(name, variants, fault, id="-".join([name, *variants.values(), fault]))
    for name, variants, faults in PLACES
    for fault in faults
]


OTHERS = [  # at pixel centres and in few pixels
    ("phong/lobes", {"lobe": "phong", "n": "32"}, SHINY),
    ("phong/lobes", {"lobe": "blinn", "n": "32"}, (*SHINY, "halfway_not_normalised")),
    ("phong/floor_lobes", {"lobe": "phong", "n": "32"}, SHINY),
    ("phong/interpolation", {"lobe": "phong"}, ("exponent", "flat_normals", "normals_not_normalised")),
    ("separation/t_highlight", {"part": "both"}, (*SHINY, "reflection_of_unnormalised_light")),
    ("mirror/corner", {}, ("mirror_reversed", "mirror_handedness", "primary_view_vector", "mirrored_highlight_lost")),
    ("terminator/mirror_sphere", {"tessellation": "24x12"}, ("no_shadow", "flat_normals", "mirror_handedness")),
]


@pytest.mark.parametrize(
    ("name", "variants", "fault"),
    [
        pytest.param(name, variants, fault, id="-".join([name, *variants.values(), fault]))
        for name, variants, faults in OTHERS
        for fault in faults
    ],
)
@pytest.mark.sweep_except(
    "phong/lobes-phong-32-exponent",
    "phong/lobes-phong-32-specular_twice",
    "phong/lobes-blinn-32-light_gain",
    "phong/lobes-blinn-32-halfway_not_normalised",
    "phong/floor_lobes-phong-32-light_gain",
    "phong/floor_lobes-phong-32-specular_missing",
    "phong/floor_lobes-phong-32-diffuse_missing",
    "phong/floor_lobes-phong-32-specular_tinted",
    "phong/interpolation-phong-flat_normals",
    "phong/interpolation-phong-normals_not_normalised",
    "separation/t_highlight-both-light_gain",
    "separation/t_highlight-both-reflection_of_unnormalised_light",
    "mirror/corner-mirror_reversed",
    "mirror/corner-primary_view_vector",
    "mirror/corner-mirrored_highlight_lost",
    "terminator/mirror_sphere-24x12-no_shadow",
    "terminator/mirror_sphere-24x12-mirror_handedness",
)
def test_in_few_pixels(studio: Any, name: str, variants: dict[str, str], fault: str) -> None:
    _check(studio, _small(studio.scene(name, **variants)), fault, CENTRES)


def test_every_fault_is_tried() -> None:
    """A new fault model is tried here, or drawn by the labelled benchmark."""
    from notabug.bench.verdict.catalogue import FAULTS
    from notabug.scenes_usd.reader import read_scene

    labelled = {name for each in FAULTS for name in each.right}

    for name, variants, faults in PLACES:
        known = {each.name for each in models(read_scene(name, variants)) if each.kind == "fault"} - NEAR - PARTS - MAPS
        assert known <= labelled | set(faults) | set(IDLE.get(name, ())), name
        assert known >= set(faults) | set(IDLE.get(name, ())), name


def _same(faulty: Envelope, right: Envelope) -> bool:
    """Whether both are of one picture: a hypothesis has fewer samples than the reference, and a bound that says so."""
    exact = ("point", "ids", "spared_point")
    near = np.abs(faulty.mean - right.mean) <= faulty.bound + right.bound + 1e-6
    return near.all() and all(np.array_equal(getattr(faulty, name), getattr(right, name)) for name in exact)


@pytest.mark.parametrize(("name", "fault"), [(name, fault) for name, faults in IDLE.items() for fault in faults])
def test_a_fault_that_cannot_act_predicts_the_reference(studio: Any, name: str, fault: str) -> None:
    scene = studio.scene(name)
    faulty, right = studio.predicted(scene, fault), studio.predicted(scene)
    if fault == "affine_uv":  # the same uv by another sum
        assert (np.abs(faulty.mean - right.mean) <= faulty.bound + right.bound + 1e-6).all()
        assert np.abs(faulty.point - right.point).max() < 1e-6
    else:
        assert _same(faulty, right)
    verdict = studio.verdict(studio.draw(InHouse(faults=(fault,)), scene, CENTRES), scene, studio.point)
    assert verdict.word == "pass"


def _small(scene: Scene) -> Scene:
    """The same view in fewer pixels: 64 samples in each of 65,536 pixels for four seeds take 20 s."""
    return replace(scene, width=96, height=96)


def _check(studio: Any, scene: Scene, fault: str, quality: Quality) -> None:
    adapter = InHouse(faults=(fault,))
    verdict = studio.verdict(studio.draw(adapter, scene, quality), scene, adapter.declaration(quality))
    bug = verdict.findings[0] if verdict.findings else None
    said = (
        "nothing" if bug is None else f"{bug.name}, {bug.area_px:.0f} px, z {bug.z:.0f}, {'+'.join(verdict.triggers)}"
    )
    rest = ", ".join(each.name for each in verdict.findings[1:])
    print(f"\n{scene.id} {scene.variant} {fault} at {quality.samples} spp: {verdict.word}: {said}; beside it: {rest}")
    assert verdict.word == "bug"
    assert bug is not None
    assert bug.name in {fault, *ALIKE.get((scene.id, fault), ())}


@pytest.mark.parametrize(("name", "variants", "fault"), CASES)
@pytest.mark.sweep_except(
    "terminator/sphere-24x12-light_gain",
    "terminator/sphere-24x12-no_shadow",
    "terminator/sphere-24x12-normals_not_normalised",
    "terminator/sphere-16x8-flat_normals",
    "texture/uneven_quad-quad-light_gain",
    "texture/uneven_quad-quad-affine_uv",
    "texture/uneven_quad-quad-swapped_uv",
    "texture/uneven_quad-quad-texture_encoded",
    "texture/uneven_quad-split13-light_gain",
    "calibration/card-flipped_v",
    "calibration/card-shifted_uv",
    "calibration/card-texture_decoded",
)
def test_at_pixel_centres(studio: Any, name: str, variants: dict[str, str], fault: str) -> None:
    _check(studio, _small(studio.scene(name, **variants)), fault, CENTRES)


@pytest.mark.parametrize(("name", "variants", "fault"), CASES)
@pytest.mark.sweep_except(
    "terminator/sphere-24x12-flat_normals",
    "terminator/sphere-16x8-no_shadow",
    "terminator/sphere-16x8-normals_not_normalised",
    "texture/uneven_quad-quad-affine_uv",
    "texture/uneven_quad-quad-swapped_uv",
    "texture/uneven_quad-quad-flipped_v",
    "texture/uneven_quad-quad-shifted_uv",
    "texture/uneven_quad-quad-texture_decoded",
    "texture/uneven_quad-split13-texture_encoded",
    "calibration/card-light_gain",
)
def test_in_four_noisy_pictures(studio: Any, name: str, variants: dict[str, str], fault: str) -> None:
    _check(studio, _small(studio.scene(name, **variants)), fault, NOISY)


@pytest.mark.parametrize(("name", "variants"), [(name, variants) for name, variants, _ in PLACES])
def test_without_a_fault_noisy_pictures_are_no_bug(studio: Any, name: str, variants: dict[str, str]) -> None:
    scene, adapter = _small(studio.scene(name, **variants)), InHouse()
    verdict = studio.verdict(studio.draw(adapter, scene, NOISY), scene, adapter.declaration(NOISY))
    assert verdict.word in ("pass", "limitation")
    assert not verdict.triggers
