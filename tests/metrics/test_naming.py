"""Names of faults: at strengths of their own, local ones, and limitations beside them."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from notabug.adapters.base import Declaration, Quality
from notabug.adapters.inhouse import InHouse
from notabug.metrics.admissible import Admissible, admissible
from notabug.metrics.causes import encoded
from notabug.metrics.explain import fit
from notabug.metrics.judge import judge
from notabug.metrics.likely import coarse
from notabug.metrics.names import Name, better
from notabug.metrics.naming import possible
from notabug.metrics.noise import measure
from notabug.metrics.policy import POLICY
from notabug.metrics.verdict import Verdict
from notabug.references.models.camera import pixel_shift
from notabug.references.models.model import Model, models
from notabug.references.predict import configured, predict
from notabug.references.tracer.envelope import trace_envelope, trace_picture
from notabug.scenes_usd.scene import Scene
from notabug.scenes_usd.srgb import decode_srgb

DECLARATION = InHouse().declaration(Quality(samples=1))
BOX = replace(InHouse().declaration(Quality(samples=64)), noisy=False)


@pytest.fixture(scope="module")
def ball(studio: Any) -> Scene:
    return replace(studio.scene("terminator/sphere"), width=64, height=64)


def model(scene: Scene, name: str, strength: float | None = None, kind: str = "fault") -> Model:
    found = next(each for each in models(scene) if each.name == name and each.kind == kind)
    if strength is None:
        return found
    assert found.at is not None
    return found.at(strength)


def verdict(scene: Scene, *applied: Model) -> Verdict:
    return judge([trace_picture(*configured(scene, applied))], scene, DECLARATION, perceive=False).verdict


@pytest.mark.parametrize("strength", [0.7, 1.02, 1.5])
def test_an_albedo_is_named_with_its_strength(ball: Scene, strength: float) -> None:
    found = verdict(ball, model(ball, "albedo", strength))
    assert (found.word, found.findings[0].name) == ("bug", "albedo")
    assert f"{strength:.3g} times" in found.findings[0].message


@pytest.mark.parametrize("scene", ["acne/glass_slab", "terminator/glass_sphere"])
@pytest.mark.parametrize("strength", [0.9, 1.03, 1.1, 1.25])
@pytest.mark.sweep_except(
    "0.9-terminator/glass_sphere", "1.03-terminator/glass_sphere", "1.1-terminator/glass_sphere", "1.25-acne/glass_slab"
)
def test_a_wrong_index_of_refraction_is_named_with_its_strength(studio: Any, scene: str, strength: float) -> None:
    """What glass shows does not grow with the strength: it moves, so a fit by the slope stops short."""
    small = replace(studio.scene(scene), width=64, height=64)
    found = verdict(small, model(small, "ior", strength))
    assert (found.word, found.findings[0].name) == ("bug", "ior")
    told = float(re.search(r"is ([\d.]+) times", found.findings[0].message)[1])  # type: ignore[index]
    assert told == pytest.approx(strength, rel=0.02)


def test_of_two_names_that_leave_rounding_the_one_tried_first_is_told() -> None:
    first, other = (
        Name(name, "", 0.0, misfit, preview_misfit=2.0) for name, misfit in (("first", 1.8e-5), ("other", 1.7e-5))
    )
    assert not better(other, first, POLICY.names.exact, noisy=False)
    assert better(replace(other, misfit=1e-9), first, POLICY.names.exact, noisy=False)
    assert better(replace(other, misfit=3e-3), replace(first, misfit=4e-3), POLICY.names.exact, noisy=False)


@pytest.mark.parametrize(("name", "strength"), [("floor_lobes", 0.7), ("floor_lobes", 1.5), ("interpolation", 0.6)])
@pytest.mark.sweep_except("floor_lobes-1.5", "interpolation-0.6")
def test_an_exponent_is_named_beside_three_habits_of_a_renderer(studio: Any, name: str, strength: float) -> None:
    """As three.js and pygfx have them: Blinn's lobe, times N.L, normalised by the exponent that was read wrong."""
    scene = replace(studio.scene(f"phong/{name}"), width=64, height=64)
    habits = [
        model(scene, each, kind="limitation") for each in ("lobe_blinn", "lobe_normalised_n2over8", "highlight_cosine")
    ]
    misread = model(scene, "exponent", strength).edit(scene)
    declared = replace(
        DECLARATION, lobe="blinn", normalised="n2over8", highlight="cosine", shadows="none", interpolation="phong"
    )
    with_habits = [replace(each, options={**each.options, "shadows": "none"}) for each in habits]
    picture = trace_picture(*configured(misread, with_habits))
    found = judge([picture], scene, declared, perceive=False).verdict
    assert (found.word, found.findings[0].name) == ("bug", "exponent")
    right = trace_picture(*configured(scene, with_habits))
    assert judge([right], scene, declared, perceive=False).verdict.word == "limitation"


@pytest.mark.parametrize("strength", [0.02, 0.2])
def test_a_moved_light_is_named(ball: Scene, strength: float) -> None:
    assert verdict(ball, model(ball, "light_moved", strength)).findings[0].name == "light_moved"


def test_without_naming_a_bug_stays_unexplained(ball: Scene) -> None:
    picture = trace_picture(*configured(ball, (model(ball, "albedo", 1.5),)))
    found = judge([picture], ball, DECLARATION, perceive=False, naming=False).verdict
    assert [each.name for each in found.findings if each.kind == "bug"] == ["unexplained"]


def test_a_limitation_beside_a_large_gain_is_not_lost(ball: Scene) -> None:
    found = verdict(ball, model(ball, "light_gain", 2.0), model(ball, "facet_self_shadow", kind="limitation"))
    assert [each.name for each in found.findings] == ["light_gain", "facet_self_shadow"]


def test_a_limitation_beside_a_fault_that_may_show_anything_has_its_share(studio: Any) -> None:
    """Its share is what a finding states: a picture with the wrong aspect was an internal error for want of it."""
    scene = replace(studio.scene("terminator/mirror_sphere"), width=64, height=64)
    facets, dots = model(scene, "facet_self_reflection", kind="limitation"), model(scene, "no_epsilon")

    def predicted(chosen: tuple[Model, ...]) -> Admissible:
        return admissible(predict(scene, chosen), DECLARATION)

    measured = measure([trace_picture(*configured(scene, (facets,)))], predicted(()).edge)
    assert dots.rule == "any"
    assert fit(measured, (facets,), predicted, (dots,)).alphas[facets.name].any()


def test_a_fault_of_some_faces_is_named(ball: Scene) -> None:
    """Normals that point inwards on every third face only."""
    flipped = model(ball, "normals_flipped")

    def some(scene: Scene) -> Scene:
        wrong = flipped.edit(scene)
        objects = []
        for right, other in zip(scene.objects, wrong.objects, strict=True):
            normals = getattr(right, "normals", None)
            if normals is None:
                objects.append(right)
                continue
            face = np.repeat(np.arange(len(right.counts)), right.counts)  # type: ignore[union-attr]
            mixed = np.where((face % 3 == 0)[:, None], other.normals, normals)  # type: ignore[union-attr]
            objects.append(replace(right, normals=np.ascontiguousarray(mixed)))
        return replace(scene, objects=tuple(objects))

    assert verdict(ball, replace(flipped, edit=some)).findings[0].name == "normals_flipped"


@pytest.mark.parametrize("declaration", [DECLARATION, BOX], ids=["point", "box"])
def test_scattered_wrong_pixels_have_no_name(studio: Any, ball: Scene, declaration: Declaration) -> None:
    """Half dark pixels are no dots of rays without an epsilon: those would be all over what is lit."""
    clean = studio.predicted(ball)
    picture = np.array(clean.point if declaration.filter == "point" else clean.mean)
    picture.reshape(-1, 3)[::97] *= 0.5
    found = judge([picture], ball, declaration, perceive=False).verdict
    assert (found.word, found.findings[0].name) == ("bug", "unexplained")


@pytest.mark.parametrize("strength", [0.75, 1.333])
def test_another_shape_of_picture_is_named(studio: Any, strength: float) -> None:
    scene = replace(studio.scene("terminator/mirror_sphere"), width=64, height=64)
    aspect = model(scene, "aspect", strength)
    found = judge([predict(scene, [aspect]).mean], scene, BOX, perceive=False).verdict
    assert found.findings[0].name == "aspect"


def test_another_light_is_no_dots(studio: Any) -> None:
    scene = replace(studio.scene("acne/sphere"), width=64, height=64)
    moved = model(scene, "light_moved", 0.3)
    found = judge([predict(scene, [moved]).mean], scene, BOX, perceive=False).verdict
    assert found.findings[0].name == "light_moved"


def test_a_clamped_highlight_is_no_fight_of_surfaces(studio: Any) -> None:
    """Between two colours and their shadows lies every darker one, but a fight takes more than a little of them."""
    scene = replace(studio.scene("visibility/coincident_spheres"), width=64, height=64)
    right = studio.predicted(scene).mean
    found = judge([np.minimum(right, 0.9 * np.percentile(right, 99))], scene, BOX, perceive=False).verdict
    assert (found.word, found.findings[0].name) == ("bug", "clamped")


def test_means_over_blocks() -> None:
    values = np.arange(32.0).reshape(4, 8, 1)
    assert coarse(values, 1) is values
    assert coarse(values, 4).ravel().tolist() == [values[:, :4].mean(), values[:, 4:].mean()]
    assert coarse(np.ones((7, 9, 3)), 4).shape == (1, 2, 3)


# --- shifts of the raster ------------------------------------------------------------------------------------------

SHIFTED = ("terminator/sphere", "visibility/standing", "mirror/corner", "texture/uneven_quad")


def shifted(scene: Scene, vector: tuple[float, float], declaration: Declaration) -> Verdict:
    applied = (pixel_shift(scene.width, scene.height, *vector),)
    draw = configured(scene, applied)
    point = declaration.filter == "point"
    picture = trace_picture(*draw) if point else trace_envelope(*draw, grid=5, refine=0).mean
    return judge([picture], scene, declaration, perceive=False).verdict


@pytest.mark.parametrize("name", SHIFTED)
@pytest.mark.parametrize("vector", [(0.5, 0.5), (-0.5, 0.0), (0.0, 0.5)])
@pytest.mark.sweep_except(
    "vector0-mirror/corner", "vector1-visibility/standing", "vector1-texture/uneven_quad", "vector2-terminator/sphere"
)
def test_half_a_pixel_is_rays_through_corners(studio: Any, name: str, vector: tuple[float, float]) -> None:
    scene = replace(studio.scene(name), width=64, height=48)
    found = shifted(scene, vector, BOX)
    assert (found.word, found.findings[0].name) == ("bug", "pixel_shift")
    assert "rays through pixel corners, not centres" in found.message
    assert (found.numbers["shift_x"], found.numbers["shift_y"]) == vector


@pytest.mark.parametrize("name", SHIFTED)
@pytest.mark.parametrize("vector", [(0.25, -0.25), (0.0, 1.0), (-1.0, 0.0), (1.3, 0.4)])
@pytest.mark.sweep_except(
    "vector0-texture/uneven_quad",
    "vector1-terminator/sphere",
    "vector2-visibility/standing",
    "vector2-mirror/corner",
    "vector3-texture/uneven_quad",
)
def test_a_shift_is_named_with_its_vector(studio: Any, name: str, vector: tuple[float, float]) -> None:
    """A quarter of a pixel, a row, a column, any: and the numbers beside it do not say 0."""
    found = shifted(replace(studio.scene(name), width=64, height=48), vector, BOX)
    assert (found.word, found.findings[0].name) == ("bug", "pixel_shift")
    assert "corners" not in found.message
    assert (found.numbers["shift_x"], found.numbers["shift_y"]) == pytest.approx(vector, abs=0.05)


def test_half_a_pixel_is_found_at_pixel_centres_too(studio: Any) -> None:
    found = shifted(replace(studio.scene("terminator/sphere"), width=64, height=48), (0.5, 0.5), DECLARATION)
    assert found.findings[0].name == "pixel_shift"


def test_a_picture_moved_after_it_was_drawn_has_a_border_that_says_nothing(studio: Any) -> None:
    """Its border is repeated, or black; a picture drawn through moved pixels would show more of the scene there."""
    scene = replace(studio.scene("terminator/sphere"), width=64, height=64)
    right = np.asarray(predict(scene).mean, np.float64)
    for mode in ("edge", "constant"):
        wide = np.pad(right, ((2, 0), (3, 0), (0, 0)), mode=mode)  # type: ignore[call-overload]
        found = judge([wide[:64, :64]], scene, BOX, perceive=False).verdict
        assert found.findings[0].name == "pixel_shift"
        assert (found.numbers["shift_x"], found.numbers["shift_y"]) == pytest.approx((3.0, 2.0), abs=0.02)


@pytest.mark.parametrize("name", ["terminator/sphere", "visibility/standing", "mirror/corner"])
@pytest.mark.sweep_except("visibility/standing", "mirror/corner")
def test_a_moved_camera_is_no_shift(studio: Any, name: str) -> None:
    """A shift moves all depths alike."""
    scene = replace(studio.scene(name), width=96, height=96)
    found = judge([predict(scene, [model(scene, "camera_moved", 0.02)]).mean], scene, BOX, perceive=False).verdict
    assert found.findings[0].name == "camera_moved"


@pytest.mark.parametrize("size", [96, 192])
@pytest.mark.parametrize("name", ["texture/uneven_quad", "texture/perspective_floor", "phong/floor_lobes"])
@pytest.mark.sweep_except("texture/uneven_quad-96", "texture/perspective_floor-192", "phong/floor_lobes-96")
def test_a_slight_field_of_view_is_found_where_edges_allow(studio: Any, name: str, size: int) -> None:
    """Two thousandths move the border of 96 pixels by a tenth of one, as aliased edges do, and that of 192 by a fifth.

    It never has another name.
    """
    scene = replace(studio.scene(name), width=size, height=size)
    found = judge([predict(scene, [model(scene, "field_of_view", 1.002)]).mean], scene, BOX, perceive=False).verdict
    assert found.word in ("bug", "pass")
    assert found.word == "pass" or found.findings[0].name == "field_of_view"
    assert (name, size) != ("texture/perspective_floor", 192) or found.word == "bug"


# --- faults beside conventions, and names that are not told ---------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "variants"),
    [("terminator/sphere", {"tessellation": "8x4"}), ("terminator/bowl", {}), ("phong/interpolation", {})],
)
@pytest.mark.parametrize("fault", ["albedo", "normals_not_normalised", "light_gain"])
@pytest.mark.sweep_except(
    "albedo-terminator/bowl-variants1",
    "normals_not_normalised-phong/interpolation-variants2",
    "light_gain-terminator/sphere-variants0",
    "light_gain-phong/interpolation-variants2",
)
def test_a_fault_is_named_on_top_of_a_renderers_conventions(
    studio: Any, name: str, variants: dict[str, str], fault: str
) -> None:
    """Flipped silhouettes and the shadows of facets, each of which hides the other and the fault."""
    scene = replace(studio.scene(name, **variants), width=96, height=96)
    beside = [
        model(scene, "silhouette_flip", kind="convention"),
        model(scene, "facet_self_shadow", kind="limitation"),
    ]
    picture = trace_envelope(*configured(scene, (model(scene, fault), *beside)), grid=4, refine=0).mean
    found = judge([picture], scene, replace(BOX, silhouette="unknown"), perceive=False).verdict
    assert (found.word, found.findings[0].name) == ("bug", fault)


def test_a_rasteriser_has_no_fault_of_rays(ball: Scene) -> None:
    faults = [each for each in models(ball) if each.kind == "fault"]
    told = {each.name for each in possible(faults, replace(DECLARATION, depth="fixed24", hit_error=0.0))}
    assert told.isdisjoint({"no_epsilon", "epsilon_too_large", "epsilon_not_scaled", "shadow_ray_culled"})
    assert {"albedo", "no_shadow", "flat_normals"} <= told
    assert {each.name for each in possible(faults, DECLARATION)} == {each.name for each in faults}


@pytest.mark.parametrize("fault", ["no_epsilon", "shadow_ray_culled"])
def test_what_a_rasteriser_cannot_have_is_not_told_of_its_picture(studio: Any, fault: str) -> None:
    scene = replace(studio.scene("acne/sphere"), width=64, height=64)
    picture = trace_picture(*configured(scene, (model(scene, fault).as_drawn(),)))
    found = judge([picture], scene, replace(DECLARATION, depth="fixed24", hit_error=0.0), perceive=False).verdict
    assert not {"no_epsilon", "shadow_ray_culled"} & {each.name for each in found.findings}


@pytest.mark.parametrize(
    ("name", "variants"),
    [("phong/lobes", {}), ("phong/floor_lobes", {}), ("separation/t_highlight", {"part": "both"})],
)
@pytest.mark.sweep_except("phong/floor_lobes-variants1", "separation/t_highlight-variants2")
def test_a_lost_highlight_needs_no_limitations(studio: Any, name: str, variants: dict[str, str]) -> None:
    scene = replace(studio.scene(name, **variants), width=64, height=64)
    declaration = replace(BOX, lobe="unknown", normalised="unknown", highlight="unknown", interpolation="unknown")
    found = judge([predict(scene, [model(scene, "specular_missing")]).mean], scene, declaration, perceive=False).verdict
    assert [each.name for each in found.findings] in (["specular_missing"], ["halfway_not_normalised"])


# --- faults of texels, faces and lights ------------------------------------------------------------------------------

MESHES = ("terminator/sphere", "terminator/bowl", "phong/interpolation")
TEXTURED = ("texture/uneven_quad", "texture/perspective_floor", "calibration/card")


@pytest.mark.parametrize(
    ("name", "fault"),
    [
        *((each, fault) for each in MESHES for fault in ("cracks", "face_missing")),
        *((each, fault) for each in TEXTURED for fault in ("texel_centre", "texture_nearest", "flipped_v")),
        *((each, "light_negated") for each in ("phong/interpolation", "phong/lobes", "separation/cutoff")),
    ],
)
@pytest.mark.parametrize("sampled", [False, True], ids=["point", "box"])
@pytest.mark.sweep_except(
    "point-terminator/sphere-face_missing",
    "point-phong/interpolation-cracks",
    "point-phong/interpolation-face_missing",
    "point-texture/uneven_quad-texture_nearest",
    "point-texture/perspective_floor-texel_centre",
    "point-texture/perspective_floor-flipped_v",
    "point-separation/cutoff-light_negated",
    "box-terminator/bowl-face_missing",
    "box-phong/interpolation-cracks",
    "box-texture/perspective_floor-texture_nearest",
    "box-calibration/card-texel_centre",
    "box-calibration/card-flipped_v",
    "box-phong/lobes-light_negated",
    "box-separation/cutoff-light_negated",
)
def test_a_fault_of_parts_is_named(studio: Any, name: str, fault: str, *, sampled: bool) -> None:
    size = 128 if fault == "texture_nearest" and sampled else 64  # a texture that is made smaller shows no texel
    scene = replace(studio.scene(name), width=size, height=size)
    for each in [each for each in models(scene) if each.name == fault]:
        draw = configured(scene, (each,))
        picture = trace_envelope(*draw, grid=4, refine=0).mean if sampled else trace_picture(*draw)
        found = judge([picture], scene, BOX if sampled else DECLARATION, perceive=False).verdict
        told = fault if picture.any() else "black"  # lights from behind may light nothing that is seen
        assert (found.word, found.findings[0].name) == ("bug", told), each.claim


@pytest.mark.parametrize("name", TEXTURED)
@pytest.mark.sweep_except("texture/perspective_floor", "calibration/card")
def test_a_power_in_the_place_of_srgbs_curve_is_named(studio: Any, name: str) -> None:
    """Of a texture, and of the picture."""
    scene = replace(studio.scene(name), width=64, height=64)
    textures = tuple(replace(each, colour_space="sRGB") for each in scene.textures)
    scene = replace(scene, textures=textures)
    picture = trace_picture(*configured(scene, (model(scene, "texture_decoded_by_power"),)))
    assert judge([picture], scene, DECLARATION, perceive=False).verdict.findings[0].name == "texture_decoded_by_power"
    right = np.clip(np.asarray(predict(scene).point, np.float64), 0.0, 1.0)
    for wrong, cause in (
        (encoded(right) ** 2.2, "decoded_by_power"),
        (decode_srgb(right ** (1 / 2.2)), "encoded_by_power"),
    ):
        found = judge([wrong], scene, DECLARATION, perceive=False).verdict
        assert found.findings[0].name == cause


def test_one_edit_has_one_model(studio: Any) -> None:
    """n + 2/2 and n + 8/8 are the same number."""
    scene = studio.scene("phong/lobes")
    assert len([each for each in models(scene) if each.name == "normalisation_precedence"]) == 1


def test_a_flipped_texture_is_told_from_a_picture_that_is_upside_down(studio: Any) -> None:
    scene = replace(studio.scene("texture/uneven_quad"), width=64, height=64)
    upright = predict(scene).mean
    assert judge([upright[::-1]], scene, BOX, perceive=False).verdict.findings[0].name == "upside_down"
