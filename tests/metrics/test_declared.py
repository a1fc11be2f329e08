"""What a renderer may do is a limitation where it is declared or nothing is, and a bug where something else is.

Each limitation has its neighbours: a fault beside it, or in its own pixels, stays a bug.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from notabug.adapters import declared
from notabug.adapters.base import Declaration, Pixels, Quality
from notabug.metrics.verdict import Verdict
from notabug.references.models.coordinates import moved, sideways
from notabug.references.models.model import Model, models
from notabug.references.predict import configured
from notabug.references.tracer.envelope import trace_picture
from notabug.references.tracer.options import Options
from notabug.scenes_usd.authoring.shapes import box
from notabug.scenes_usd.authoring.stage import (
    camera,
    distant_light,
    lambert,
    looking,
    materials,
    mesh,
    point_light,
    stage,
)
from notabug.scenes_usd.reader import read_scene
from notabug.scenes_usd.scene import Mesh, Scene

POINT = Declaration("float64", "point", 0.0, 2.0**-24, relative_quantum=True, noisy=False)
UNKNOWN = replace(POINT, **declared.unknown())
UNKNOWN_CROSSINGS = replace(POINT, crossings=UNKNOWN.crossings)  # and all else declared, which leaves less to try
SIDE = 44  # pixels: enough to see each thing of a scene, and half of what 64 cost


def drawn(scene: Scene, *chosen: Model) -> Pixels:
    return np.asarray(trace_picture(*configured(scene, chosen)), np.float32)


def switched(scene: Scene, **options: Any) -> Pixels:
    return np.asarray(trace_picture(scene, Options(**options)), np.float32)


def kinds(verdict: Verdict) -> tuple[str, list[str]]:
    return verdict.word, [each.name for each in verdict.findings]


def named(scene: Scene, name: str) -> list[Model]:
    return [each for each in models(scene) if each.name == name]


@pytest.fixture(scope="module")
def judged(studio: Any) -> Callable[..., Verdict]:
    """The verdict on a picture; a bug is given a name only where the test looks at it, which takes long."""
    return lambda picture, scene, declaration, naming=False: studio.verdict(
        [picture], scene, declaration, naming=naming
    )


# --- crossings ----------------------------------------------------------------------------------------------------


def sheet(name: str, half: float, height: float, material: str, *, turned: bool = False) -> str:
    corners = [(-half, height, half), (half, height, half), (half, height, -half), (-half, height, -half)]
    return mesh(name, corners, [(3, 2, 1, 0) if turned else (0, 1, 2, 3)], material=material)


def made(folder: Path, parts: list[str]) -> Scene:
    path = folder / "made.usda"
    path.write_bytes(stage({"class": "visibility", "claim": "Made for a test."}, parts))
    scene = read_scene(str(path), {})
    return replace(scene, width=SIDE, height=SIDE)


EYE = (1.4, 2.2, 2.8)
VIEW = camera(EYE, looking((-1.4, -2.5, -2.8)), 0.42, (0.1, 100.0))


@pytest.fixture(scope="module")
def sheets(tmp_path_factory: pytest.TempPathFactory) -> Callable[[float], Scene]:
    """Two half-transparent sheets over a floor, one turned upside down, ``gap`` apart, and a pole beside them."""

    def scene(gap: float) -> Scene:
        pole = mesh("Pole", *box((1.0, -0.8, 0.9), (1.15, 0.1, 1.05)), material="Grey")
        parts = [
            VIEW,
            point_light((1.5, 3.5, 1.0), 240.0),
            materials(lambert("Grey", (0.5, 0.5, 0.5)), lambert("Red", (0.6, 0.15, 0.1), 0.5)),
            sheet("Up", 0.8, 0.0, "Red"),
            sheet("Down", 0.8, -gap, "Red", turned=True),
            sheet("Floor", 2.0, -0.8, "Grey"),
            pole,
        ]
        return made(tmp_path_factory.mktemp("sheets"), parts)

    return scene


@pytest.fixture(scope="module")
def panes(tmp_path_factory: pytest.TempPathFactory) -> Scene:
    """Two panes of clear glass 2e-4 apart over a floor."""
    parts = [
        VIEW,
        distant_light(looking((-0.5, -1.0, 0.2)), 2.5),
        materials(lambert("Grey", (0.5, 0.5, 0.5)), lambert("Glass", (0.3, 0.3, 0.3), 0.5)),
        mesh("Upper", *box((-0.7, 0.06, -0.7), (0.7, 0.12, 0.7)), material="Glass"),
        mesh("Lower", *box((-0.7, -0.0002, -0.7), (0.7, 0.0598, 0.7)), material="Glass"),
        sheet("Floor", 2.0, -0.8, "Grey"),
    ]
    scene = made(tmp_path_factory.mktemp("panes"), parts)
    glass = {"diffuse": (0.0, 0.0, 0.0), "opacity": 1.0, "transmission": (0.9, 0.9, 0.9), "ior": 1.5}
    return replace(
        scene, materials=tuple(replace(each, **glass) if each.opacity < 1 else each for each in scene.materials)
    )


@pytest.mark.parametrize("gap", [0.0, 1e-7, 2e-4])
@pytest.mark.parametrize("declaration", [UNKNOWN, replace(POINT, crossings="once")], ids=["unknown", "once"])
@pytest.mark.sweep_except("unknown-0.0", "once-1e-07", "once-0.0002")
def test_close_sheets_may_be_crossed_once(
    sheets: Callable[[float], Scene], judged: Callable[..., Verdict], gap: float, declaration: Declaration
) -> None:
    scene = sheets(gap)
    picture = switched(scene, shadow_gap=1e-3, ray_gap=1e-3 if gap > 1e-6 else 0.0)
    verdict = judged(picture, scene, declaration)
    assert kinds(verdict) == ("limitation", ["crossed_once"])
    assert ("crossings=once" in verdict.message) == (declaration is UNKNOWN)
    each = judged(picture, scene, replace(POINT, crossings="each"))
    assert each.word == "bug"


def test_a_fault_beside_close_sheets_stays_a_bug(
    sheets: Callable[[float], Scene], judged: Callable[..., Verdict]
) -> None:
    scene = sheets(0.0)
    picture = switched(scene, shadow_gap=1e-3)
    poleless = replace(scene, objects=tuple(each for each in scene.objects if "Pole" not in each.path))
    word, names = kinds(judged(switched(poleless, shadow_gap=1e-3), scene, UNKNOWN, naming=True))
    assert word == "bug"
    assert "object_missing" in names
    inside = np.abs(picture - switched(scene)).max(axis=2) > 1e-3
    assert inside.sum() > 100
    for gain, declaration in ((0.9, UNKNOWN), (1.1, UNKNOWN_CROSSINGS)):  # in the very pixels of the limitation
        verdict = judged(np.where(inside[..., None], np.float32(gain) * picture, picture), scene, declaration)
        assert verdict.word == "bug"
    apart = sheets(0.02)  # no epsilon that is declared or reasonable is so large
    assert judged(switched(apart, shadow_gap=0.05, ray_gap=0.05), apart, UNKNOWN_CROSSINGS).word == "bug"


@pytest.mark.parametrize("loses", ["crossings", "objects"])
def test_close_panes_may_be_crossed_once(panes: Scene, judged: Callable[..., Verdict], loses: Any) -> None:
    attenuates = replace(POINT, crossings="once", epsilon=1e-3, glass_shadow="attenuate")
    picture = switched(panes, shadow_gap=1e-3, gap_loses=loses, transparent_shadows="glass")
    word, names = kinds(judged(picture, panes, attenuates))
    assert word == "limitation"
    assert "crossed_once" in names
    assert judged(picture * np.float32(1.03), panes, attenuates).word == "bug"
    assert judged(picture, panes, replace(attenuates, epsilon=1e-5)).word == "bug"


@pytest.mark.parametrize("scene_of", ["sheets", "panes"])
def test_povray_passes_over_what_lies_close(
    scene_of: str, request: pytest.FixtureRequest, studio: Any, povray: Any
) -> None:
    found = request.getfixturevalue(scene_of)
    scene = found(0.0) if scene_of == "sheets" else found
    verdict = studio.verdict(studio.draw(povray, scene), scene, povray.declaration(Quality()))
    assert verdict.word == "limitation"
    assert "crossed_once" in [each.name for each in verdict.findings]


def test_a_scene_without_transparency_has_no_crossings(studio: Any) -> None:
    scene = studio.scene("terminator/sphere")
    for name in ("crossed_once", "bounce_limit", "nearest_texel"):
        assert not named(scene, name)


# --- bounces ------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def corner(studio: Any) -> Scene:
    return replace(studio.scene("mirror/corner"), width=SIDE, height=SIDE)


@pytest.mark.parametrize("n", [0, 1])
def test_a_bounce_limit_is_named_with_its_number(corner: Scene, judged: Callable[..., Verdict], n: int) -> None:
    picture = switched(corner, bounces=n)
    verdict = judged(picture, corner, UNKNOWN)
    assert kinds(verdict) == ("limitation", ["bounce_limit"])
    assert f"bounces={n}" in verdict.message
    assert kinds(judged(picture, corner, replace(POINT, bounces=n))) == ("limitation", ["bounce_limit"])
    assert judged(picture, corner, POINT).word == "bug"  # eight are declared
    assert judged(picture, corner, replace(POINT, bounces=1 - n)).word == "bug"


def test_mirrors_of_another_colour_are_no_bounce_limit(corner: Scene, judged: Callable[..., Verdict]) -> None:
    dim = tuple(
        replace(each, mirror=tuple(0.8 * v for v in each.mirror))  # type: ignore[arg-type]
        for each in corner.materials
    )
    for n in (1, 8):
        assert judged(switched(replace(corner, materials=dim), bounces=n), corner, UNKNOWN).word == "bug"


@pytest.mark.parametrize("n", [1, 2])
def test_passages_through_sheets_may_count_as_bounces(
    sheets: Callable[[float], Scene], judged: Callable[..., Verdict], n: int
) -> None:
    scene = sheets(0.2)
    picture = switched(scene, bounces=n - 1, counted_passages=True)
    verdict = judged(picture, scene, UNKNOWN)
    assert kinds(verdict) == ("limitation", ["bounce_limit"])
    assert "bounces_count=passages" in verdict.message
    assert judged(picture, scene, replace(UNKNOWN, bounces_count="reflections")).word == "bug"


# --- colours at corners -------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def ball(studio: Any) -> Scene:
    """A smooth ball of triangles and quads, over a floor that a pole shadows."""
    return replace(studio.scene("terminator/sphere", tessellation="16x8"), width=SIDE, height=SIDE)


@pytest.mark.parametrize("name", ["gouraud_interpolation", "gouraud_pixel_shadows", "gouraud_unshadowed"])
def test_colours_are_interpolated_in_several_ways(ball: Scene, judged: Callable[..., Verdict], name: str) -> None:
    for place, model in enumerate(named(ball, name)):
        picture = drawn(ball, model)
        declaration = replace(POINT, **dict(model.conditions))
        word, names = kinds(judged(picture, ball, declaration))
        assert word == "limitation"
        assert name in names
        word, names = kinds(judged(picture, ball, UNKNOWN))
        assert word == "limitation"
        assert any(each.startswith("gouraud") for each in names)
        assert judged(picture, ball, replace(POINT, interpolation="phong")).word == "bug"
        if place == 0:  # nothing excuses it, and to find that out of a picture of unknown making takes seconds
            assert judged(picture * np.float32(1.05), ball, UNKNOWN).word == "bug"


def test_a_quads_colours_are_bilinear_or_cut(ball: Scene, sheets: Callable[[float], Scene]) -> None:
    assert all("ngon_split" not in dict(each.also) for each in named(ball, "gouraud_interpolation")[:1])  # triangles
    scene = sheets(0.2)
    bilinear, first, second = named(scene, "gouraud_interpolation")
    assert [dict(each.also).get("ngon_split") for each in (bilinear, first, second)] == ["", "02", "13"]
    pictures = [drawn(scene, each) for each in (bilinear, first, second)]
    for a, b in ((0, 1), (0, 2), (1, 2)):
        assert np.abs(pictures[a] - pictures[b]).max() > 0.01


def test_flat_meshes_may_be_lit_at_their_corners(ball: Scene, judged: Callable[..., Verdict]) -> None:
    everywhere = next(
        each for each in named(ball, "gouraud_interpolation") if dict(each.also)["gouraud_meshes"] == "all"
    )
    picture = drawn(ball, everywhere)
    assert judged(picture, ball, UNKNOWN).word == "limitation"
    smooth = replace(UNKNOWN, gouraud_meshes="smooth")
    assert judged(picture, ball, smooth).word == "bug"


# --- what a renderer lacks ----------------------------------------------------------------------------------------


@pytest.mark.parametrize(("tessellation", "size"), [("16x8", 160), ("8x4", 128)])
def test_silhouettes_of_a_renderer_without_shadows(
    studio: Any, judged: Callable[..., Verdict], tessellation: str, size: int
) -> None:
    ball = replace(studio.scene("terminator/sphere", tessellation=tessellation), width=size, height=size)
    smooth = (each for each in ball.objects if isinstance(each, Mesh) and each.normals is not None)
    alone = replace(ball, objects=tuple(smooth))
    picture = switched(alone, silhouette="flip", shadows="none")
    asked = switched(alone, silhouette="flip")
    assert (np.abs(picture - asked).max(axis=2) > 1e-3).sum() > 8, "flipped normals are in shadow here"
    for declaration in (UNKNOWN, replace(POINT, shadows="none"), replace(POINT, shadows="none", silhouette="flip")):
        assert kinds(judged(picture, alone, declaration)) == ("pass", ["silhouette_flip"])
    assert judged(picture, alone, replace(POINT, silhouette="flip")).word == "bug"  # it casts shadows


def test_shadows_may_be_declared_away_and_are_not_unknown(ball: Scene, judged: Callable[..., Verdict]) -> None:
    picture = switched(ball, shadows="none")
    assert kinds(judged(picture, ball, UNKNOWN, naming=True)) == ("bug", ["no_shadow"])
    assert kinds(judged(picture, ball, replace(POINT, shadows="none"))) == ("limitation", ["unshadowed"])
    without = replace(POINT, shadows="none")
    told = {each.name for each in models(ball) if each.kind == "fault" and each.open_to(without)}
    assert not told & {"no_shadow", "no_epsilon", "epsilon_too_large", "shadow_ray_culled", "shadow_ray_unbounded"}
    assert "light_gain" in told


# --- textures and lobes -------------------------------------------------------------------------------------------


def test_the_nearest_texel_is_a_convention(studio: Any, judged: Callable[..., Verdict]) -> None:
    scene = replace(studio.scene("texture/perspective_floor"), width=SIDE, height=SIDE)
    picture = switched(scene, texels="nearest")
    assert kinds(judged(picture, scene, UNKNOWN)) == ("pass", ["nearest_texel"])
    other = judged(picture, scene, replace(POINT, texture_filter="bilinear"))
    assert other.word in ("bug", "inconclusive")  # a nearest texel may look like noise
    assert other.triggers
    shifted = drawn(scene, *named(scene, "shifted_uv")[:1], *named(scene, "nearest_texel"))
    assert judged(shifted, scene, UNKNOWN).triggers


def test_a_lobe_may_be_normalised_by_n_plus_2_over_8(studio: Any, judged: Callable[..., Verdict]) -> None:
    scene = replace(studio.scene("phong/lobes"), width=SIDE, height=SIDE)
    (model,) = named(scene, "lobe_normalised_n2over8")
    verdict = judged(drawn(scene, model), scene, UNKNOWN)
    assert kinds(verdict) == ("limitation", ["lobe_normalised_n2over8"])
    assert "normalised=n2over8" in verdict.message


# --- float32 ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("distance", ["1e2", "1e3"])
def test_hits_on_spheres_are_off_by_what_cancels(studio: Any, distance: str) -> None:
    """Dots that float32's plain quadratic makes are acne where it is declared or nothing is, else a bug."""
    scene = replace(studio.scene("acne/sphere", surface="sphere", camera_distance=distance), width=SIDE, height=SIDE)
    base = replace(POINT, precision="float32", hit_error=-1.0)
    (acne,) = named(scene, "acne")
    plain, stable = (acne.under(replace(base, sphere_roots=each)) for each in ("discriminant", "stable"))
    assert plain.options["sphere_error"] > 0 == stable.options["sphere_error"]
    reference = trace_picture(scene)
    reaches = [
        int((np.abs(trace_picture(scene, Options(**each.options)) - reference).max(axis=2) > 1e-3).sum())
        for each in (plain, stable)
    ]
    assert reaches[0] > 3 * reaches[1]
    assert acne.under(POINT).options["sphere_error"] < 1e-14  # in float64 nothing to speak of


@pytest.mark.parametrize("offset", [1e5, 1e6])
def test_float32_coordinates_move_what_is_far_from_the_origin(
    ball: Scene, judged: Callable[..., Verdict], offset: float
) -> None:
    scene = away(ball, offset)
    assert sideways(scene) > 0.0
    rounded = drawn(rounded_scene(scene))
    assert (rounded != drawn(scene)).any()
    held = replace(POINT, coordinates="float32")
    assert kinds(judged(rounded, scene, held))[0] in ("limitation", "pass")
    assert judged(rounded * np.float32(1.05), scene, held).word == "bug"
    ball_lost = replace(scene, objects=tuple(each for each in scene.objects if each.normals is None))
    assert 0 < len(ball_lost.objects) < len(scene.objects)
    assert judged(drawn(rounded_scene(ball_lost)), scene, held).word == "bug"


def away(scene: Scene, offset: float) -> Scene:
    """``scene`` with everything moved along all three axes; of few facets, for each prediction moves them all anew."""
    objects = tuple(replace(each, points=each.points + offset) for each in scene.objects if isinstance(each, Mesh))
    assert len(objects) == len(scene.objects)
    place = scene.camera.to_world.copy()
    place[3, :3] += offset
    lights = tuple(replace(each, position=tuple(value + offset for value in each.position)) for each in scene.lights)
    return replace(scene, objects=objects, lights=lights, camera=replace(scene.camera, to_world=place))


def rounded_scene(scene: Scene) -> Scene:
    """``scene`` with every coordinate in float32, as one renderer rounds them."""
    objects = tuple(
        replace(each, points=each.points.astype(np.float32).astype(np.float64)) if isinstance(each, Mesh) else each
        for each in scene.objects
    )
    place = scene.camera.to_world.copy()
    place[3, :3] = place[3, :3].astype(np.float32)
    return replace(scene, objects=objects, camera=replace(scene.camera, to_world=place))


def test_near_the_origin_no_coordinate_moves(studio: Any) -> None:
    for name in ("terminator/sphere", "acne/sphere", "texture/uneven_quad", "visibility/standing"):
        assert not named(studio.scene(name), "float32_coordinates")
    scene = studio.scene("acne/sphere", world_offset="1e5")
    points = np.concatenate([each.points for each in moved(0)(scene).meshes])
    apart = np.abs(points - np.concatenate([each.points for each in scene.meshes]))
    assert 0.0 < apart.max() <= 2.0 * np.spacing(np.float32(1e5)) * 1.01


# --- depth --------------------------------------------------------------------------------------------------------


def test_an_unknown_depth_buffer_may_be_any(studio: Any, judged: Callable[..., Verdict]) -> None:
    from notabug.adapters.zbuffer import ZBuffer

    scene = replace(studio.scene("visibility/near_clip", near=".001"), width=SIDE, height=SIDE)
    for depth in ("fixed16", "fixed24"):
        renderer = ZBuffer(depth=depth)  # type: ignore[arg-type]
        (picture,) = studio.draw(renderer, scene)
        unknown = replace(renderer.declaration(Quality()), depth="unknown")
        assert judged(picture, scene, unknown).word == judged(picture, scene, renderer.declaration(Quality())).word
        assert judged(picture, scene, replace(unknown, depth="reversed32")).word == "bug"
