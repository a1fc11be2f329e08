"""Direct light from lights with a size against closed forms, each within the bound that comes with it."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from notabug.references.predict import preview
from notabug.references.tracer.envelope import Envelope, Options, trace_envelope, trace_picture
from notabug.references.tracer.probe import probe
from notabug.scenes_usd.emitters import area, resized, side
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
    Shaping,
    Sphere,
)
from notabug.scenes_usd.transform import rotation, transformed

WHITE = Material("/White", (1.0, 1.0, 1.0))
ROUNDED = 2e-12  # of a radiance: what float64 leaves of a closed form
QUARTER = 0.25 * 0.004  # of a radiance: what a reference is asked for, see precision.asked


def quad(*corners: tuple[float, float, float]) -> Mesh:
    return Mesh("/Quad", np.array(corners, float), np.array([4], np.int32), np.arange(4, dtype=np.int32), 0)


def floor(size: float = 50.0) -> Mesh:
    return quad((-size, -size, 0.0), (size, -size, 0.0), (size, size, 0.0), (-size, size, 0.0))


def light(kind: str, axes: object = 1.0, at: tuple[float, float, float] = (0, 0, 2), **rest: object) -> Light:
    """A light of radiance 1; ``axes`` are lengths, or row vectors."""
    frame = np.asarray(axes, float)
    frame = frame if frame.ndim == 2 else np.diag(np.broadcast_to(frame, 3))
    emitter = Emitter(frame, half_angle=float(rest.pop("half", 0.0)))  # type: ignore[arg-type]
    return Light("/Light", kind, (1.0, 1.0, 1.0), position=at, emitter=emitter, **rest)  # type: ignore[arg-type]


def seen(
    lamp: Light, *objects: Object, material: Material = WHITE, at: tuple[float, float] = (0.0, 0.0), width: float = 1e-9
) -> Envelope:
    """The envelope of one pixel, ``width`` wide, that looks straight down on the point ``at`` of a floor at z = 0."""
    frame = np.eye(4)
    frame[3, :3] = at[0], at[1], 0.5
    camera = Camera("/Camera", frame, width / 2, width / 2, 0.01, 100.0, orthographic=True)
    scene = Scene("x", Path(), {}, Card("own", ""), camera, 1, 1, objects or (floor(),), (lamp,), (material,))
    return trace_envelope(scene, Options(), most=1024)


def within(found: Envelope, expected: float) -> None:
    """The mean is ``expected`` within the bound that is stored with it and a quarter of the verdict's tolerance."""
    mean, bound = float(found.mean[0, 0, 0]), float(found.bound[0, 0, 0])
    assert abs(mean - expected) <= max(bound, ROUNDED) + QUARTER * expected, (mean, expected, bound)
    assert bound <= 4 * QUARTER * max(expected, 0.02), "a bound beyond the tolerance says nothing"


def polygon(points: Floats, x: float = 0.0, y: float = 0.0) -> float:
    """Lambert's formula: the irradiance at (x, y, 0) of a polygon of radiance 1 that is all above the horizon."""
    to = points - (x, y, 0.0)
    to = to / np.linalg.norm(to, axis=1, keepdims=True)
    total = 0.0
    for u, v in zip(to, np.roll(to, -1, axis=0), strict=True):
        across = np.cross(u, v)
        angle = math.atan2(float(np.linalg.norm(across)), float(u @ v))
        total += angle * float(across[2]) / float(np.linalg.norm(across))
    return abs(total) / 2.0


def corners(lamp: Light) -> Floats:
    assert lamp.emitter is not None
    x, y, _ = lamp.emitter.axes
    return np.array([np.array(lamp.position) + a * x + b * y for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))])


def clipped(points: Floats, normal: Floats, offset: float) -> Floats:
    """What of a convex polygon lies where ``normal`` @ p >= ``offset`` (Sutherland and Hodgman 1974)."""
    kept = []
    for p, q in zip(points, np.roll(points, -1, axis=0), strict=True):
        a, b = float(normal @ p) - offset, float(normal @ q) - offset
        if a >= 0:
            kept.append(p)
        if a * b < 0:
            kept.append(p + a / (a - b) * (q - p))
    return np.array(kept)


# --- closed forms -------------------------------------------------------------------------------------------------


def test_a_uniform_dome_sends_pi_times_its_radiance() -> None:
    found = seen(light("dome"))
    assert found.mean[0, 0] == pytest.approx([1.0] * 3, abs=1e-12)
    half = quad((0.0, -1e3, -1e3), (0.0, 1e3, -1e3), (0.0, 1e3, 1e3), (0.0, -1e3, 1e3))
    within(seen(light("dome"), floor(), half, at=(0.1, 0.0)), 0.5)


@pytest.mark.parametrize("half", [1e-3, 0.1, 1.0, math.pi / 2])
def test_a_distant_light_with_an_angle(half: float) -> None:
    """Straight above: the radiance times sin^2 of half the angle; at the horizon half of it."""
    within(seen(light("sun", half=half)), math.sin(half) ** 2)


@pytest.mark.parametrize("radius", [0.01, 0.5, 1.9])
@pytest.mark.parametrize("x", [0.0, 3.0])
def test_a_sphere_over_a_plane(radius: float, x: float) -> None:
    """All above the horizon: its solid angle's projection is pi (r / d)^2 cos."""
    distance = math.hypot(2.0, x)
    within(seen(light("sphere", radius), at=(x, 0.0)), (radius / distance) ** 2 * 2.0 / distance)


@pytest.mark.parametrize("radius", [0.01, 0.5, 4.0])
def test_a_disk_on_its_axis(radius: float) -> None:
    within(seen(light("disk", radius)), radius**2 / (radius**2 + 4.0))


SHEARED = np.array([[0.7, 0.2, 0.1], [-0.3, 0.9, 0.2], [0.0, 0.1, 1.0]])


@pytest.mark.parametrize("axes", [np.diag([0.5, 0.5, 1]), np.diag([0.01, 0.01, 1.0]), np.diag([3.0, 0.1, 1]), SHEARED])
@pytest.mark.parametrize("x", [0.0, 2.0])
def test_a_rectangle_by_lamberts_formula(axes: Floats, x: float) -> None:
    lamp = light("rect", axes)
    within(seen(lamp, at=(x, 0.5)), polygon(corners(lamp), x, 0.5) / math.pi)


def test_a_rectangle_that_stands_on_the_plane_and_shines_to_one_side() -> None:
    axes = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])  # its -z is -x
    lamp = light("rect", axes, at=(0.0, 0.0, 0.0), direction=(-1.0, 0.0, 0.0))
    above = clipped(corners(lamp), np.array([0.0, 0.0, 1.0]), 0.0)
    within(seen(lamp, at=(-0.7, 0.2)), polygon(above, -0.7, 0.2) / math.pi)
    assert seen(lamp, at=(0.7, 0.2)).mean[0, 0, 0] == 0.0, "nothing of its back"


@pytest.mark.parametrize("edge", [-0.2, 0.0, 0.13])
def test_a_rectangle_half_hidden_by_an_edge(edge: float) -> None:
    """What an edge leaves of a rectangle is a polygon: clipped by the plane through the point and the edge."""
    lamp = light("rect", 0.5)
    wall = quad((edge, -9.0, 1.0), (9.0, -9.0, 1.0), (9.0, 9.0, 1.0), (edge, 9.0, 1.0))
    left = clipped(corners(lamp), np.array([-1.0, 0.0, 0.0]), -2.0 * edge)  # x <= 2 edge at twice the height
    within(seen(lamp, floor(), wall), polygon(left) / math.pi)


def test_a_cylinder_far_away_and_its_area() -> None:
    """Far from it a cylinder is its silhouette, 2 r by its length."""
    lamp = light("cylinder", (0.5, 0.02, 0.02), at=(0.0, 0.0, 40.0))
    within(seen(lamp), 1.0 * 0.04 / 40.0**2 / math.pi)
    assert area(lamp) == pytest.approx(2 * math.pi * 0.02 * 1.0)


def test_areas_under_any_transform() -> None:
    assert area(light("sphere", 2.0)) == pytest.approx(16 * math.pi)
    a, c = 1.0, 3.0  # a prolate ellipsoid: 2 pi a^2 (1 + c / (a e) asin e)
    e = math.sqrt(1 - a * a / (c * c))
    assert area(light("sphere", (a, a, c))) == pytest.approx(2 * math.pi * a * a * (1 + c / (a * e) * math.asin(e)))
    assert area(light("rect", SHEARED)) == pytest.approx(4 * np.linalg.norm(np.cross(SHEARED[0], SHEARED[1])))
    assert area(light("disk", 0.5)) == pytest.approx(math.pi / 4)
    assert area(light("sun", half=2.0)) == pytest.approx(math.pi * (2 - math.sin(2.0) ** 2)), "beyond a hemisphere"
    mirrored = light("rect", np.diag([-1.0, 1.0, 1.0])).emitter
    assert mirrored is not None
    assert side(mirrored) == pytest.approx([0, 0, -1]), "a mirrored rectangle shines to its own -z"


def test_an_ellipsoid_is_its_points() -> None:
    """An affine sphere against a sum over the points of its surface that are seen."""
    axes = np.array([[0.9, 0.1, 0.0], [-0.1, 0.3, 0.2], [0.0, -0.1, 0.5]])
    heights, weights = np.polynomial.legendre.leggauss(400)
    turn = (np.arange(800) + 0.5) * (2 * math.pi / 800)
    up, round_ = np.meshgrid(heights, turn, indexing="ij")
    flat = np.sqrt(1 - up**2)
    unit = np.stack([flat * np.cos(round_), flat * np.sin(round_), up], axis=2)
    normals = unit @ np.linalg.inv(axes).T
    points = unit @ axes + (0.0, 0.0, 2.0)
    distance = np.linalg.norm(points, axis=2)
    cosine = np.maximum(-(normals * points).sum(axis=2) / distance, 0.0)  # times the surface's growth
    grown = abs(np.linalg.det(axes))
    share = (cosine * points[..., 2] / distance / distance**2).sum(axis=1) @ weights * grown * 2 * math.pi / 800
    within(seen(light("sphere", axes)), float(share) / math.pi)


# --- highlights, beams, mirrors -------------------------------------------------------------------------------------


def test_a_highlight_of_a_dome_is_what_the_surface_reflects_of_it() -> None:
    """A metal under a uniform dome: the directional albedo of GGX, against a sum over the half space."""
    for roughness in (0.05, 0.3, 0.8):
        material = Material("/Metal", (1.0, 1.0, 1.0), preview=Preview(metallic=1.0, roughness=roughness))
        alpha = roughness**2
        # straight from above V = N: H has half the angle of L; Smith's G of both directions
        step = math.pi / 4 / 200_000
        angle = (np.arange(200_000) + 0.5) * step  # of H, to 45 degrees
        ch, sh = np.cos(angle), np.sin(angle)
        nl = np.cos(2 * angle)
        d = alpha**2 / (math.pi * (ch**2 * alpha**2 + sh**2) ** 2)
        g = 2 * nl / (nl + np.sqrt(alpha**2 + (1 - alpha**2) * nl**2))
        total = (d * g / 4 * np.sin(2 * angle) * 2 * 2 * math.pi).sum() * step
        within(seen(light("dome"), material=material), float(total))


def test_a_mirror_smooth_metal_shows_the_light_itself() -> None:
    """What is narrower than the light reflects its radiance: where the mirrored direction meets it, and only there."""
    material = Material("/Metal", (1.0, 1.0, 1.0), preview=Preview(metallic=1.0, roughness=0.0))
    within(seen(light("sphere", 0.5), material=material), 1.0)
    assert seen(light("sphere", 0.5), material=material, at=(0.8, 0.0)).mean[0, 0, 0] < 1e-3


@pytest.mark.parametrize("lobe", ["phong", "blinn"])
def test_a_phong_lobe_of_a_distant_light_with_an_angle(lobe: str) -> None:
    exponent, half = 40.0, 0.15
    material = replace(WHITE, diffuse=(0.0, 0.0, 0.0), specular=(1.0, 1.0, 1.0), exponent=exponent, lobe=lobe)  # type: ignore[arg-type]
    scale = 1.0 if lobe == "phong" else 0.5  # the halfway vector turns by half as much
    nodes, weights = np.polynomial.legendre.leggauss(64)
    angle = (nodes + 1) * half / 2
    total = (np.cos(scale * angle) ** exponent * np.sin(angle)) @ weights * half / 2 * 2
    within(seen(light("sun", half=half), material=material), float(total))


def test_beams_and_multipliers() -> None:
    plain = Light("/Light", "point", (1.0, 1.0, 1.0), position=(0.0, 0.0, 2.0))
    for lamp in (plain, light("sphere", 0.001)):
        whole = float(seen(lamp).mean[0, 0, 0])

        def share(beam: Shaping, x: float = 0.0, lamp: Light = lamp, whole: float = whole) -> float:
            here = float(seen(lamp, at=(x, 0.0)).mean[0, 0, 0])
            return float(seen(replace(lamp, shaping=beam), at=(x, 0.0)).mean[0, 0, 0]) / here

        assert whole > 0
        assert share(Shaping(cone=30.0)) == pytest.approx(1.0, abs=1e-6)
        assert share(Shaping(cone=30.0), 2.0) == 0.0, "45 degrees off"
        assert share(Shaping(cone=60.0, softness=0.5), 2.0) == pytest.approx(0.5, abs=1e-3), "halfway from 30 to 60"
        assert share(Shaping(focus=2.0), 2.0) == pytest.approx(0.5, abs=1e-3), "the squared cosine of 45 degrees"
        assert share(Shaping(focus=2.0, tint=(1.0, 1.0, 1.0)), 2.0) == pytest.approx(1.0, abs=1e-3)
        assert seen(replace(lamp, diffuse=0.25)).mean[0, 0, 0] == pytest.approx(0.25 * whole, rel=1e-6)
        assert seen(replace(lamp, specular=0.25)).mean[0, 0, 0] == pytest.approx(whole, rel=1e-6)


def test_a_light_is_lit_by_in_mirrors_and_is_not_seen_itself() -> None:
    mirror = Material("/Mirror", (0.0, 0.0, 0.0), mirror=(1.0, 1.0, 1.0))
    ceiling = replace(quad((-9, -9, 4.0), (-9, 9, 4.0), (9, 9, 4.0), (9, -9, 4.0)), material=1)
    frame = np.eye(4)
    frame[3, 2] = 0.5
    camera = Camera("/Camera", frame, 5e-10, 5e-10, 0.01, 100.0, orthographic=True)
    lamp = light("sphere", 0.5)
    scene = Scene("x", Path(), {}, Card("own", ""), camera, 1, 1, (floor(), ceiling), (lamp,), (mirror, WHITE))
    within(trace_envelope(scene, Options(), most=1024), 0.25**2)  # the ceiling's light, through where the lamp is


# --- how it is summed -----------------------------------------------------------------------------------------------


def penumbra(lamp: Light, size: int = 12) -> Scene:
    frame = np.eye(4)
    frame[3, 2] = 6.0
    camera = Camera("/Camera", frame, 0.4, 0.4, 0.1, 100.0)
    ball = Sphere("/Ball", 0.4, 0, np.eye(4) + np.outer([0, 0, 0, 1], [0.3, 0.2, 0.8, 0]))
    return Scene("x", Path(), {}, Card("own", ""), camera, size, size, (floor(), ball), (lamp,), (WHITE,))


def test_the_bound_holds_in_penumbras() -> None:
    """Against 40 times as many directions, at other places of each pixel."""
    scene = penumbra(light("rect", 0.8, at=(0.5, -0.3, 3.0)))
    found = trace_envelope(scene, Options(), most=1024)
    many = np.mean([trace_picture(scene, samples=512, seed=seed) for seed in range(2)], axis=0)
    noise = 4.0 * np.sqrt(found.variance / 1024.0)
    off = np.abs(found.mean - many) - noise - found.bound - QUARTER * (found.mean + 0.125 * found.mean.max())
    assert off.max() <= 0.0
    assert (found.bound > 0).any(), "it is not exact"


def test_the_result_is_the_same_for_any_number_of_threads() -> None:
    scene = penumbra(light("disk", 0.8, at=(0.5, -0.3, 3.0)))
    one, two = (trace_envelope(scene, Options(), most=256, threads=threads) for threads in (1, 2))
    for name, values in one.arrays().items():
        assert np.array_equal(values, two.arrays()[name]), name


def test_single_precision_is_the_same_light() -> None:
    for kind in ("sphere", "rect", "disk", "cylinder", "dome"):
        scene = penumbra(light(kind, 0.3, at=(0.5, -0.3, 3.0)), 6)
        double, single = (trace_picture(scene, dtype=dtype) for dtype in (np.float64, np.float32))
        assert np.abs(double - single).max() <= 2e-2 * double.max(), kind  # a direction beside an edge may differ
        assert np.median(np.abs(double - single)) <= 1e-5 * double.max(), kind


def test_a_smaller_light_of_the_same_power_goes_to_a_point() -> None:
    lamp = light("sphere", 0.5)
    point = Light("/Light", "point", (math.pi * 0.25,) * 3, position=(0.0, 0.0, 2.0))
    small = resized(lamp, 1e-3, keep_power=True)
    assert seen(small).mean[0, 0, 0] == pytest.approx(float(seen(point).mean[0, 0, 0]), rel=1e-6)
    assert seen(resized(lamp, 2.0, keep_power=False)).mean[0, 0, 0] == pytest.approx(4 * 0.0625, rel=1e-3)


def test_a_probe_tells_of_a_light_with_a_size() -> None:
    scene = penumbra(light("sphere", 0.5, at=(0.0, 0.0, 3.0)))
    told = probe(scene, Options(), 1.0, 1.0).lights[0]
    assert told.share == pytest.approx(1.0)
    assert sum(told.diffuse) > 0
    hidden: Callable[[float, float], float] = lambda x, y: probe(scene, Options(), x, y).lights[0].share  # noqa: E731
    assert min(hidden(x, y) for x in (6.0, 7.0, 8.0) for y in (4.0, 5.0, 6.0)) < 1.0


@pytest.mark.parametrize("kind", ["rect", "cylinder", "sun", "point"])
def test_a_scene_that_is_moved_turned_and_scaled_shows_the_same_light(kind: str) -> None:
    beam = {} if kind == "sun" else {"shaping": Shaping(cone=70.0, softness=0.3, focus=1.5)}
    lamp = light(kind, (0.5, 0.3, 0.3), at=(0.5, -0.3, 3.0), half=0.2, **beam)
    lamp = replace(lamp, emitter=None) if kind == "point" else lamp
    scene = replace(penumbra(lamp, 6), objects=(floor(),))
    matrix = np.eye(4)
    matrix[:3, :3] = rotation((1.0, 2.0, -0.5), 70.0)[:3, :3] * 3.0
    matrix[3] = 4.0, -2.0, 1.0, 1.0
    one, other = (trace_picture(each) for each in (scene, transformed(scene, matrix)))
    assert other == pytest.approx(one, rel=5e-3, abs=1e-3 * one.max())


def test_previews_look_in_fewer_directions_and_differ_alike() -> None:
    """What a preview is for, a difference to another one, is nearly that of references; a point's is the very same."""
    scene = penumbra(light("rect", 0.8, at=(0.5, -0.3, 3.0)))
    brighter = replace(scene, lights=(replace(scene.lights[0], intensity=(1.05,) * 3),))
    larger = replace(scene, lights=(resized(scene.lights[0], 2.0, keep_power=True),))
    for other in (brighter, larger):
        wanted, found = (draw(other) - draw(scene) for draw in (trace_picture, preview))
        cosine = float((wanted * found).sum() / np.sqrt((wanted**2).sum() * (found**2).sum()))
        assert cosine > 0.99
    assert not np.array_equal(trace_picture(scene).astype(np.float32), preview(scene)), "fewer directions"
    point = penumbra(Light("/Light", "point", (9.0,) * 3, position=(0.5, -0.3, 3.0)))
    assert np.array_equal(preview(point), trace_picture(point).astype(np.float32))
