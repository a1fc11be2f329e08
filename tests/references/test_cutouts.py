"""Opacity from a map, and surfaces that it cuts: against closed forms, and against meshes that end where a map does."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from notabug.references.models.model import edit_materials
from notabug.references.tracer.envelope import Envelope, trace_envelope, trace_picture
from notabug.references.tracer.options import Options
from notabug.references.tracer.precision import MOST
from notabug.scenes_usd.scene import Camera, Emitter, Floats, Light, Material, Scene, Texture

SIZE = 32  # pixels
SHEET, FLOOR = 0.8, 0.5  # albedos
UP = ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0))
DOWN = (0.0, 0.0, -1.0)


def above(side: float = 1.0) -> Camera:
    """An orthographic camera that looks down on -side .. side."""
    place = np.eye(4)
    place[3, 2] = 5.0
    return Camera("/Camera", place, side, side, 1e-3, 1e6, orthographic=True)


def texture(*rows: Any, wrap: Any = "clamp") -> Texture:
    return Texture(Path("mask"), np.repeat(np.array(rows, float)[..., None], 3, axis=2), wrap, wrap)


def sheet(make: Any, mask: Texture, lights: list[Light], *, cutoff: float = 0.0, **more: Any) -> Scene:
    """A sheet at z = 1 with uv 0 .. 1 over -1 .. 1, whose opacity is ``mask``, over a floor."""
    looks = [
        Material("/Floor", (FLOOR,) * 3),
        Material("/Sheet", (SHEET,) * 3, opacity_map=0, cutoff=cutoff),
    ]
    objects = [make.rectangle(0.0, 50.0), make.rectangle(1.0, 1.0, material=1, uv=UP)]
    scene: Scene = make.scene(objects, lights, above(0.9), materials=looks, textures=[mask], size=SIZE, **more)
    return scene


def centres() -> Floats:
    return 0.9 * ((np.arange(SIZE) + 0.5) / SIZE * 2.0 - 1.0)


def straight_down(make: Any) -> list[Light]:
    return [make.distant(DOWN, math.pi)]


@pytest.mark.parametrize("full", [False, True])
@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_a_ramp_blends_linearly_in_what_is_seen_and_in_its_shadow(make: Any, dtype: Any, full: bool) -> None:
    """The light comes along the view: of the floor behind opacity o there is seen (1 - o)^2."""
    scene = sheet(make, texture((0.1, 0.7)), straight_down(make), full=full)
    x = (centres() + 1.0) / 2.0  # of the sheet's width; the texels' centres are at a quarter and three quarters
    o = 0.1 + 0.6 * np.clip((x - 0.25) / 0.5, 0.0, 1.0)
    expected = np.broadcast_to(o * SHEET + (1.0 - o) ** 2 * FLOOR, (SIZE, SIZE))
    drawn = trace_envelope(scene, dtype=dtype, refine=0).point[..., 0]
    np.testing.assert_allclose(drawn, expected, atol=1e-12 if dtype == np.float64 else 2e-6)


def test_a_smooth_ramp_and_its_smooth_shadow_are_no_edges(make: Any) -> None:
    scene = sheet(make, texture((0.1, 0.7)), [make.distant((0.3, 0.0, -1.0), math.pi)])
    envelope = trace_envelope(scene)
    inside = np.abs(centres()) < 0.6
    assert not envelope.edge[:, inside].any()
    rim = replace(scene, camera=above(1.2))
    assert trace_envelope(rim).edge.any(), "where the sheet ends there is one, of what is seen and of the shadow"


def slanted() -> tuple[Texture, Floats]:
    """Four texels whose mixture is affine, o = a x + b y + c in the sheet's units, and (a, b, c)."""
    a, b, c = 0.7, 0.3, 0.5  # over the cell between the four texels' centres, -1/2 .. 1/2 of the sheet
    rows = [[a * x + b * y + c for x in (-0.5, 0.5)] for y in (0.5, -0.5)]
    return texture(*rows), np.array([a, b, c])


def covered(line: Floats, cutoff: float, side: float) -> Floats:
    """The share (n, n) of each pixel of -side .. side in which a x + b y + c >= cutoff, by clipping its square."""
    shares = np.zeros((SIZE, SIZE))
    step = 2.0 * side / SIZE
    for row in range(SIZE):
        for column in range(SIZE):
            x, y = -side + column * step, side - (row + 1) * step
            corners = [(x, y), (x + step, y), (x + step, y + step), (x, y + step)]
            kept = []
            for here, there in zip(corners, corners[1:] + corners[:1], strict=True):
                f, g = (line[0] * p[0] + line[1] * p[1] + line[2] - cutoff for p in (here, there))
                if f >= 0:
                    kept.append(here)
                if f * g < 0:
                    kept.append(tuple(p + f / (f - g) * (q - p) for p, q in zip(here, there, strict=True)))
            around = zip(kept, kept[1:] + kept[:1], strict=True)
            shares[row, column] = 0.5 * sum(p[0] * q[1] - p[1] * q[0] for p, q in around) / step**2
    return shares


@pytest.mark.parametrize("cutoff", [0.5, 0.42])
@pytest.mark.parametrize("light", [DOWN, (0.0, 0.0, 1.0)])
def test_a_threshold_cuts_along_a_straight_line_whose_pixels_are_known(make: Any, cutoff: float, light: Any) -> None:
    """Every pixel's mean is within its bound, and within a tenth of what an edge may be off, of the covered area.

    The light comes along the view, so that the shadow lies behind the sheet; or from below, and the sheet, which is
    seen from the other side, is dark, as the floor is.
    """
    mask, line = slanted()
    scene = sheet(make, mask, [make.distant(light, math.pi)], cutoff=cutoff)
    scene = replace(scene, camera=above(0.5), objects=scene.objects[::-1])
    share = covered(line, cutoff, 0.5)
    lit = light == DOWN
    expected = share * SHEET + (1.0 - share) * FLOOR if lit else np.zeros_like(share)
    envelope = trace_envelope(scene, most=MOST)
    partly = (share > 0) & (share < 1)
    assert partly.sum() > 30
    off = np.abs(envelope.mean[..., 0] - expected)
    assert (off <= envelope.bound[..., 0] + 1e-12).all()
    assert off.max() <= 0.02 * abs(SHEET - FLOOR)
    if lit:
        well = (share > 0.05) & (share < 0.95)
        assert envelope.edge[well].all(), "its pixels are edges of what is seen"


def test_shadows_of_a_cutout_lie_where_the_line_is_projected(make: Any) -> None:
    mask, line = slanted()
    scene = sheet(make, mask, [make.distant((0.5, 0.0, -1.0), math.pi)], cutoff=0.5)
    below = replace(above(0.5), to_world=scene.camera.to_world.copy())
    below.to_world[3] = (0.5, 0.0, 0.5, 1.0)  # between sheet and floor: the shadow of x lies at x + 0.5
    scene = replace(scene, camera=below)
    share = covered(line, 0.5, 0.5)
    envelope = trace_envelope(scene, most=MOST)
    expected = (1.0 - share) * FLOOR
    off = np.abs(envelope.mean[..., 0] * math.sqrt(1.25) - expected)
    assert (off <= 1.2 * envelope.bound[..., 0] + 1e-12).all()
    partly = (share > 0.05) & (share < 0.95)
    assert envelope.cast[partly].mean() > 0.9, "edges of a shadow"


# --- a map that cuts is a mesh that ends there --------------------------------------------------------------------

LIGHTS = {
    "distant": Light("/Sun", "distant", (math.pi,) * 3, direction=(0.36, 0.0, -math.sqrt(1 - 0.36**2))),
    "point": Light("/Lamp", "point", (9.0,) * 3, (-1.0, 0.4, 3.0)),
    "rectangle": Light(
        "/Panel", "rect", (4.0,) * 3, (-0.5, 0.2, 3.0), emitter=Emitter(np.diag([0.4, 0.3, 1.0])), direction=DOWN
    ),
}


def alike(make: Any, light: str, look: Material, **more: Any) -> tuple[Scene, Scene]:
    """A sheet that its map cuts at x = 0, and one that ends there."""
    step = texture((0.0, 0.0, 1.0, 1.0))  # half at the middle, between the second texel and the third
    floor = Material("/Floor", (FLOOR,) * 3, **more)
    materials = [floor, replace(look, opacity_map=0, cutoff=0.5)]
    points = [(-1.0, -1.0, 1.0), (1.0, -1.0, 1.0), (1.0, 1.0, 1.0), (-1.0, 1.0, 1.0)]
    normals = [(-0.2, 0.0, 1.0), (0.2, 0.0, 1.0), (0.2, 0.0, 1.0), (-0.2, 0.0, 1.0)]
    cut = make.mesh(points, [(0, 1, 2), (0, 2, 3)], 1, normals=normals, uv=UP, path="/Sheet")
    half = [(0.0, *p[1:]) if p[0] < 0 else p for p in points]
    middle = [(0.0, 0.0, 1.0) if p[0] < 0 else p for p in normals]
    real = make.mesh(half, [(0, 1, 2), (0, 2, 3)], 1, normals=middle, uv=UP, path="/Sheet")
    camera = make.camera((0.3, -2.0, 4.0), (0.0, 0.0, 0.5), 0.3)
    scene = make.scene(
        [make.rectangle(0.0, 6.0), cut], [LIGHTS[light]], camera, materials=materials, textures=[step], size=SIZE
    )
    whole = [floor, look]
    return scene, replace(scene, objects=(scene.objects[0], real), materials=tuple(whole))


def same(one: Envelope, other: Envelope, within: float) -> None:
    np.testing.assert_allclose(one.point, other.point, atol=within)
    np.testing.assert_allclose(one.mean, other.mean, atol=within)


@pytest.mark.parametrize("light", LIGHTS)
@pytest.mark.parametrize("floor", [{}, {"mirror": (0.6,) * 3}], ids=["matt floor", "mirror"])
def test_a_cutout_is_a_mesh_that_ends_there(make: Any, light: str, floor: dict[str, Any]) -> None:
    """In what is seen, in its shadow, and in mirrors; a light with a size is the same cubature in both."""
    cut, real = alike(make, light, Material("/Sheet", (SHEET,) * 3), **floor)
    # normals of the half sheet are bent otherwise between its corners: flat ones are alike to rounding
    flat = [
        replace(
            scene,
            objects=(scene.objects[0], replace(scene.objects[1], normals=None)),
        )
        for scene in (cut, real)
    ]
    one, other = (trace_envelope(scene) for scene in flat)
    same(one, other, 1e-9 * one.point.max())
    np.testing.assert_array_equal(one.edge, other.edge)
    np.testing.assert_array_equal(one.cast, other.cast)


@pytest.mark.parametrize(
    "look",
    [
        Material("/Sheet", (0.0,) * 3, mirror=(0.7,) * 3),
        Material("/Sheet", (0.1,) * 3, transmission=(0.7,) * 3, ior=1.3),
        Material("/Sheet", (SHEET,) * 3, specular=(0.5,) * 3, exponent=20.0),
    ],
    ids=["mirror", "glass", "phong"],
)
def test_every_part_of_a_material_is_cut(make: Any, look: Material) -> None:
    cut, real = (
        replace(scene, objects=(scene.objects[0], replace(scene.objects[1], normals=None)))
        for scene in alike(make, "point", look)
    )
    same(trace_envelope(cut), trace_envelope(real), 1e-9)


def test_what_is_cut_away_counts_as_no_passage(make: Any) -> None:
    """A hundred sheets with a hole before one another, more than the passages through opacity that a path may have."""
    hole = texture((0.0,))
    objects = [make.rectangle(0.0), *(make.rectangle(0.01 * k, 2.0, material=1, uv=UP) for k in range(1, 101))]
    looks = [Material("/Floor", (FLOOR,) * 3), Material("/Sheet", (SHEET,) * 3, opacity_map=0, cutoff=0.5)]
    scene = make.scene(objects, straight_down(make), above(), materials=looks, textures=[hole], size=4)
    np.testing.assert_allclose(trace_picture(scene), FLOOR, atol=1e-12)
    clear = edit_materials(scene, lambda each: replace(each, cutoff=0.0))
    np.testing.assert_allclose(trace_picture(clear), FLOOR, atol=1e-12)


@pytest.mark.parametrize("first", ["sheet", "wall"])
def test_a_hole_in_the_plane_of_a_wall_shows_the_wall(make: Any, first: str) -> None:
    """Of coincident surfaces the first of the scene wins where it is there, and the other one where it is not."""
    step = texture((0.0, 0.0, 1.0, 1.0))
    looks = [Material("/Wall", (FLOOR,) * 3), Material("/Sheet", (SHEET,) * 3, opacity_map=0, cutoff=0.5)]
    objects = [make.rectangle(1.0, 3.0), make.rectangle(1.0, 1.0, material=1, uv=UP)]
    objects = objects[::-1] if first == "sheet" else objects
    scene = make.scene(objects, straight_down(make), above(0.9), materials=looks, textures=[step], size=SIZE)
    expected = np.where(centres() > 0, SHEET if first == "sheet" else FLOOR, FLOOR)
    np.testing.assert_allclose(trace_picture(scene)[..., 0], np.broadcast_to(expected, (SIZE, SIZE)), atol=1e-12)


@pytest.mark.parametrize(
    ("cutoff", "options", "shaded"),
    [
        (0.5, {}, False),
        (0.5, {"transparent_shadows": "opaque"}, False),
        (0.5, {"whole_cutouts": True}, True),
        (0.0, {"transparent_shadows": "opaque"}, True),
        (0.0, {"whole_cutouts": True}, False),
    ],
)
def test_shadows_of_holes(make: Any, cutoff: float, options: dict[str, Any], shaded: bool) -> None:
    """A hole casts no shadow unless nobody asks the map; who takes clear surfaces for opaque does so of fading ones."""
    scene = sheet(make, texture((0.0,)), straight_down(make), cutoff=cutoff)
    np.testing.assert_allclose(trace_picture(scene, Options(**options)), 0.0 if shaded else FLOOR, atol=1e-12)


def test_the_gap_of_shadow_rays_counts_no_holes(make: Any) -> None:
    scene = sheet(make, texture((0.0, 0.0, 0.6, 0.6)), straight_down(make))
    plain = trace_picture(scene)
    np.testing.assert_allclose(trace_picture(scene, Options(shadow_gap=1e-6)), plain, atol=1e-12)
    objects = Options(shadow_gap=1e-6, gap_loses="objects")
    np.testing.assert_allclose(trace_picture(scene, objects), plain, atol=1e-12)


def test_a_shadow_map_sees_through_holes(make: Any) -> None:
    scene = sheet(make, texture((0.0, 0.0, 1.0, 1.0)), straight_down(make), cutoff=0.5)
    plain = trace_picture(scene)
    np.testing.assert_allclose(trace_picture(scene, Options(shadow_map="moved", map_bias=1e-3)), plain, atol=1e-12)


def test_associated_texels_bleed_nothing(make: Any) -> None:
    """Red beside clear blue: straight colours mix to purple at the border; associated ones are red throughout."""
    colours = np.array([[(1.0, 0.0, 0.0), (0.0, 0.0, 1.0)]])
    mask = np.repeat(np.array([[1.0, 0.0]])[..., None], 3, axis=2)
    looks = [Material("/Sheet", (1.0,) * 3, 0, opacity_map=1)]
    pictures = [Texture(Path("colours"), colours, "clamp", "clamp"), Texture(Path("mask"), mask, "clamp", "clamp")]
    scene = make.scene(
        [make.rectangle(1.0, 1.0, uv=UP)],
        straight_down(make),
        above(0.9),
        materials=looks,
        textures=pictures,
        size=SIZE,
    )
    o = np.clip(1.0 - ((centres() + 1.0) / 2.0 - 0.25) / 0.5, 0.0, 1.0)
    straight = trace_picture(scene)[0]
    np.testing.assert_allclose(straight, np.stack([o * o, 0 * o, o * (1 - o)], axis=1), atol=1e-12)
    multiplied = replace(scene, textures=(replace(pictures[0], pixels=colours * mask), pictures[1]))
    associated = trace_picture(multiplied, Options(associated=True))[0]
    np.testing.assert_allclose(associated, np.stack([o, 0 * o, 0 * o], axis=1), atol=1e-12)


def test_a_threshold_of_a_texels_own_value_leaves_it_whole(make: Any) -> None:
    """128 of 255 is as much as the float32 nearest to it, which is the larger number."""
    cutoff = float(np.float32(128 / 255))
    assert cutoff > 128 / 255
    scene = sheet(make, texture((128 / 255,)), straight_down(make), cutoff=cutoff)
    np.testing.assert_allclose(trace_picture(scene), SHEET, atol=1e-12)
    above_it = edit_materials(scene, lambda each: replace(each, cutoff=128.01 / 255))
    np.testing.assert_allclose(trace_picture(above_it), FLOOR, atol=1e-12)
