"""Domes with a picture against closed forms, each within the bound that comes with it."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from notabug.references.models.dome import models
from notabug.references.tracer.envelope import Options, trace_envelope, trace_picture
from notabug.references.tracer.skies import skies
from notabug.scenes_usd.scene import (
    Camera,
    Card,
    Emitter,
    Floats,
    Light,
    Material,
    Mesh,
    Object,
    Preview,
    Scene,
    Sphere,
    Texture,
)
from notabug.scenes_usd.transform import rotation, transformed

WHITE = Material("/White", (1.0, 1.0, 1.0))
QUARTER = 0.25 * 0.004  # of a radiance: what a reference is asked for, see precision.asked
Z_UP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])  # a dome's pole along +z, as UsdLux turns it


def picture(pixels: object) -> Texture:
    made = np.asarray(pixels, float)
    return Texture(
        Path("sky"), np.ascontiguousarray(np.broadcast_to(made[..., None], (*made.shape, 3))), "repeat", "clamp"
    )


def dome(pixels: object, axes: Floats = Z_UP) -> Light:
    return Light("/Dome", "dome", (1.0, 1.0, 1.0), emitter=Emitter(axes, texture=picture(pixels)))


def level(up: tuple[float, float, float] = (0.0, 0.0, 1.0), size: float = 2.0) -> Mesh:
    """A square about the origin, which faces ``up``."""
    x = np.cross(up, np.eye(3)[np.abs(up).argmin()])
    x /= np.linalg.norm(x)
    y = np.cross(up, x)
    points = size * np.array([-x - y, x - y, x + y, -x + y])
    return Mesh("/Floor", points, np.array([4], np.int32), np.arange(4, dtype=np.int32), 0)


def facing(
    light: Light, up: tuple[float, float, float], *more: Object, material: Material = WHITE, most: int = 1024
) -> tuple[float, float]:
    """Mean and bound of a pixel that looks straight down on a surface which faces ``up``."""
    z = np.asarray(up, float)
    x = np.cross(z, np.eye(3)[np.abs(z).argmin()])
    x /= np.linalg.norm(x)
    frame = np.eye(4)
    frame[:3, :3] = x, np.cross(z, x), z
    frame[3, :3] = 0.5 * z
    camera = Camera("/Camera", frame, 5e-10, 5e-10, 0.01, 100.0, orthographic=True)
    scene = Scene("x", Path(), {}, Card("own", ""), camera, 1, 1, (level(up), *more), (light,), (material,))
    found = trace_envelope(scene, Options(), most=most)
    return float(found.mean[0, 0, 0]), float(found.bound[0, 0, 0])


def within(found: tuple[float, float], expected: float) -> None:
    mean, bound = found
    assert abs(mean - expected) <= bound + 2 * QUARTER * max(expected, 0.02), (mean, expected, bound)
    assert bound <= 4 * QUARTER * max(expected, 0.02), "a bound beyond the tolerance says nothing"


def summed(pixels: Floats, normal: Floats, axes: Floats = Z_UP) -> float:
    """Irradiance over pi of the bilinear map ``pixels`` (h, w), by a fine midpoint rule that cuts every texel alike."""
    h, w = pixels.shape
    steps = max(12, 1200 // h)
    u, v = ((np.arange(n * steps) + 0.5) / (n * steps) for n in (w, h))
    x, y = u * w - 0.5, v * h - 0.5
    left, upper = np.floor(x).astype(int), np.floor(y).astype(int)
    a, b = x - left, y - upper
    rows = [np.clip(upper + k, 0, h - 1) for k in (0, 1)]
    columns = [(left + k) % w for k in (0, 1)]
    value = sum(
        (b if j else 1 - b)[:, None] * (a if i else 1 - a)[None] * pixels[rows[j]][:, columns[i]]
        for i in (0, 1)
        for j in (0, 1)
    )
    longitude, latitude = math.pi * (1 - 2 * u), math.pi * (0.5 - v)
    local = np.stack(
        [
            np.cos(latitude)[:, None] * np.sin(longitude),
            np.sin(latitude)[:, None] + 0 * longitude,
            np.cos(latitude)[:, None] * np.cos(longitude),
        ],
        axis=2,
    )
    cosine = np.maximum(local @ axes @ np.asarray(normal, float), 0.0)
    solid = np.cos(latitude)[:, None] * (math.pi / len(v)) * (2 * math.pi / len(u))
    return float((value * cosine * solid).sum() / math.pi)


UPS = [(0.0, 0.0, 1.0), (1.0, 0.0, 0.0), (0.6, -0.48, 0.64), (0.0, -1.0, 0.0)]


@pytest.mark.parametrize("up", UPS)
def test_a_constant_picture_is_the_constant_dome(up: tuple[float, float, float]) -> None:
    light = dome(np.full((4, 8), 0.7))
    plain = Light("/Dome", "dome", (0.7, 0.7, 0.7), emitter=Emitter())
    (mean, bound), (other, _) = facing(light, up), facing(plain, up)
    assert mean == pytest.approx(other, rel=1e-12)
    assert bound <= 1e-12, "and its bound is as small"


def test_a_constant_picture_in_the_shade_is_the_constant_dome() -> None:
    ball = Sphere("/Ball", 0.4, 0, np.eye(4) + np.outer([0, 0, 0, 1], [0.3, 0.2, 0.6, 0]))
    plain = Light("/Dome", "dome", (1.0, 1.0, 1.0), emitter=Emitter())
    one, other = (facing(each, (0.0, 0.0, 1.0), ball) for each in (dome(np.full((4, 8), 1.0)), plain))
    assert abs(one[0] - other[0]) <= one[1] + other[1] + QUARTER


def test_a_hemisphere_of_white() -> None:
    """A surface that faces away from the axis by an angle sees (1 + cos) / 2 of it, as of a sky over a slope."""
    rows = np.zeros((256, 4))
    rows[:128] = 1.0  # the edge is one row wide, half of it on each side
    for angle in (0.0, 0.5, 1.2, math.pi / 2):
        up = (math.sin(angle), 0.0, math.cos(angle))
        within(facing(dome(rows), up), (1 + math.cos(angle)) / 2)


def test_half_of_the_longitudes_is_white() -> None:
    """From longitude 0 to pi: towards +x of the dome's own frame, the left half of the picture."""
    columns = np.zeros((8, 512))
    columns[:, :256] = 1.0
    for turn in (0.0, 1.0, math.pi):  # a wall that faces +x, turns away, and faces -x
        up = (math.cos(turn), math.sin(turn), 0.0)
        within(facing(dome(columns), up), (1 + math.cos(turn)) / 2)


def test_a_cosine_lobe_over_a_lambertian_plane() -> None:
    """Radiance max(cos, 0) about the pole: the integral of cos^2 over the half space over pi is 2/3."""
    rows = 256
    latitude = math.pi * (0.5 - (np.arange(rows) + 0.5) / rows)
    within(facing(dome(np.repeat(np.maximum(np.sin(latitude), 0.0)[:, None], 4, axis=1)), (0.0, 0.0, 1.0)), 2 / 3)


@pytest.mark.parametrize("up", UPS)
@pytest.mark.parametrize("kind", ["noise", "sun", "two texels"])
def test_any_picture_against_a_sum_over_its_texels(kind: str, up: tuple[float, float, float]) -> None:
    pixels = np.random.default_rng(3).uniform(0.0, 1.0, (16, 32))
    if kind == "sun":
        pixels[5, 21] = 400.0
    if kind == "two texels":
        pixels = np.array([[1.0, 0.2], [0.0, 3.0], [0.5, 0.0]])
    within(facing(dome(pixels), up), summed(pixels, np.asarray(up)))


def test_where_the_picture_lies() -> None:
    """+Y is the upper row, +Z the middle of the picture, +X a quarter from the left, as UsdLux quotes OpenEXR."""
    identity = np.eye(3)
    for (row, column), up in (
        ((0, 0), (0.0, 1.0, 0.0)),
        ((31, 0), (0.0, -1.0, 0.0)),
        ((16, 32), (0.0, 0.0, 1.0)),
        ((16, 16), (1.0, 0.0, 0.0)),
        ((16, 48), (-1.0, 0.0, 0.0)),
        ((16, 0), (0.0, 0.0, -1.0)),
    ):
        pixels = np.zeros((32, 64))
        pixels[row, (slice(None) if row in (0, 31) else column)] = 1.0
        ways = [tuple(sign * row) for row in np.eye(3) for sign in (1.0, -1.0)]
        bright = {way: facing(dome(pixels, identity), way, most=64)[0] for way in ways}
        assert max(bright, key=lambda way: bright[way]) == up


def test_a_small_sun_in_the_picture_casts_a_shadow_and_a_highlight() -> None:
    """One texel of 32 x 64 at the zenith's row: a blocker right over the point leaves the rest of the sky."""
    pixels = np.full((32, 64), 0.1)
    pixels[4, 10] = 500.0
    longitude, latitude = math.pi * (1 - 2 * 10.5 / 64), math.pi * (0.5 - 4.5 / 32)
    sun = (
        np.array(
            [math.cos(latitude) * math.sin(longitude), math.sin(latitude), math.cos(latitude) * math.cos(longitude)]
        )
        @ Z_UP
    )
    ball = Sphere("/Ball", 0.4, 0, np.eye(4) + np.outer([0, 0, 0, 1], [*(1.0 * sun), 0]))
    lit, shaded = facing(dome(pixels), (0.0, 0.0, 1.0)), facing(dome(pixels), (0.0, 0.0, 1.0), ball)
    within(lit, summed(pixels, np.array([0.0, 0.0, 1.0])))
    # what is left is the even sky without the ball's cap: (sin of its half angle)^2 of it, times the cosine
    within(shaded, 0.1 * (1 - 0.4**2 * float(sun[2])))
    metal = Material("/Metal", (1.0, 1.0, 1.0), preview=Preview(metallic=1.0, roughness=0.05))
    seen = facing(dome(np.full((4, 8), 0.3)), (0.0, 0.0, 1.0), material=metal)
    plain = facing(Light("/D", "dome", (0.3,) * 3, emitter=Emitter()), (0.0, 0.0, 1.0), material=metal)
    assert seen[0] == pytest.approx(plain[0], rel=2e-3)


def test_shares_of_the_directions() -> None:
    """What is sampled is what is told: the shares of texels and rows end at one."""
    pixels = np.random.default_rng(1).uniform(0.0, 1.0, (7, 12)) ** 8
    found = skies([dome(pixels)], lambda array: np.ascontiguousarray(array, np.float64))
    assert found is not None
    assert found.weight.sum() == pytest.approx(1.0)
    assert found.rows[-1] == pytest.approx(1.0)
    assert found.cells.reshape(7, 12)[:, -1] == pytest.approx(np.ones(7))
    assert 0.0 < found.share[0] <= 0.75
    assert skies([Light("/D", "dome", (1.0,) * 3, emitter=Emitter())], np.ascontiguousarray) is None


def scene_of(light: Light) -> Scene:
    frame = np.eye(4)
    frame[3, 2] = 6.0
    camera = Camera("/Camera", frame, 0.4, 0.4, 0.1, 100.0)
    ball = Sphere("/Ball", 0.8, 0, np.eye(4))
    return Scene("x", Path(), {}, Card("own", ""), camera, 12, 12, (ball,), (light,), (WHITE,))


def test_the_bound_holds_in_the_shade_of_a_picture() -> None:
    """Against many times as many directions, at other places of each pixel."""
    pixels = np.random.default_rng(3).uniform(0, 0.5, (16, 32)) ** 2
    pixels[4, 21] = 60.0
    ball = Sphere("/Ball", 0.4, 0, np.eye(4) + np.outer([0, 0, 0, 1], [0.3, 0.2, 0.8, 0]))
    scene = replace(scene_of(dome(pixels)), objects=(level(size=9.0), ball))
    found = trace_envelope(scene, Options(), most=1024)
    many = np.mean([trace_picture(scene, samples=512, seed=seed) for seed in range(2)], axis=0)
    noise = 4.0 * np.sqrt(found.variance / 1024.0)
    off = np.abs(found.mean - many) - noise - found.bound - QUARTER * (found.mean + 0.125 * found.mean.max())
    assert off.max() <= 0.0
    assert np.median(found.bound) <= 2 * QUARTER * found.mean.max()


def test_two_domes_and_single_precision() -> None:
    rng = np.random.default_rng(2)
    a, b = dome(rng.uniform(0, 1, (8, 16))), dome(rng.uniform(0, 1, (4, 6)) ** 4, np.eye(3))
    both = trace_picture(replace(scene_of(a), lights=(a, b)), samples=64)
    alone = trace_picture(scene_of(a), samples=64) + trace_picture(scene_of(b), samples=64)
    assert both == pytest.approx(alone, rel=0.02, abs=1e-3)
    single = trace_picture(scene_of(a), samples=4, dtype=np.float32)
    assert single == pytest.approx(trace_picture(scene_of(a), samples=4), rel=1e-2, abs=1e-4)


def test_a_scene_that_is_turned_and_scaled_shows_the_same_sky() -> None:
    scene = scene_of(dome(np.random.default_rng(5).uniform(0, 1, (8, 16))))
    matrix = rotation((1.0, 2.0, -0.5), 70.0)
    matrix[:3, :3] *= 3.0
    one, other = (trace_picture(each, samples=16) for each in (scene, transformed(scene, matrix)))
    assert other == pytest.approx(one, rel=2e-2, abs=1e-3)


def test_the_faults_are_there_where_there_is_a_picture_alone() -> None:
    names = [model.name for model in models(scene_of(dome(np.ones((4, 8)))))]
    assert names.count("dome_turned") == 3
    assert "dome_map_as_srgb" in names
    assert "dome_map_as_raw" not in names
    assert not list(models(scene_of(Light("/D", "dome", (1.0,) * 3, emitter=Emitter()))))
