"""Reflected and refracted rays: their own facets are forgiven, real reflections of a body in itself are not."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from notabug.references.tracer.envelope import trace_picture
from notabug.references.tracer.options import Options
from notabug.scenes_usd.reader import read_scene
from notabug.scenes_usd.scene import Material, Mesh

FORGIVING = Options()
PLAIN = Options(self_reflection=True, self_refraction=True)
MIRROR = Material("/Mirror", (0.0, 0.0, 0.0), mirror=(0.8, 0.8, 0.8))
VISIBLE = 0.01


def lat_long(make: Any, n: int, m: int, centre: Any = (0.0, 0.0, 0.0), path: str = "/Ball") -> Mesh:
    from notabug.scenes_usd.authoring.shapes import lat_long as shape

    points, faces = shape(n, m)
    mesh: Mesh = make.mesh(np.array(points) + centre, faces, 0, points, path=path)
    return mesh


def torus(make: Any, n: int, m: int) -> Mesh:
    """Of radii 1 and 0.4, a mirror that sees itself across the hole."""
    a, b = np.meshgrid(2 * np.pi * np.arange(n) / n, 2 * np.pi * np.arange(m) / m, indexing="ij")
    normal = np.stack([np.cos(a) * np.cos(b), np.sin(a) * np.cos(b), np.sin(b)], axis=-1).reshape(-1, 3)
    points = np.stack([np.cos(a), np.sin(a), 0 * a], axis=-1).reshape(-1, 3) + 0.4 * normal
    faces = [
        [i * m + j, (i + 1) % n * m + j, (i + 1) % n * m + (j + 1) % m, i * m + (j + 1) % m]
        for i in range(n)
        for j in range(m)
    ]
    cut = [each for f in faces for each in ((f[0], f[1], f[2]), (f[0], f[2], f[3]))]
    mesh: Mesh = make.mesh(points, cut, 0, normal)
    return mesh


@pytest.mark.parametrize("scene", ["terminator/mirror_sphere", "terminator/glass_sphere"])
def test_finer_facets_leave_less_to_forgive(scene: str) -> None:
    """The finer the facets, the less there is to forgive."""
    read = {each: read_scene(scene, {"tessellation": each}) for each in ("8x4", "24x12")}
    read = {name: replace(each, width=128, height=128) for name, each in read.items()}
    changed = {}
    for name, each in read.items():
        smooth, plain = trace_picture(each, FORGIVING), trace_picture(each, PLAIN)
        changed[name] = int((np.abs(smooth - plain).max(axis=2) > VISIBLE).sum())
    print(f"\n{scene}: pixels whose rays meet their own facets {changed}")
    assert changed["8x4"] > changed["24x12"] > 0


def test_a_mirror_ball_of_facets_reflects_its_room_to_the_rim(make: Any) -> None:
    """All that is reflected lies outside a convex body: an environment that is white all around shows no dark pixel."""
    ball = lat_long(make, 12, 6)
    white = Material("/White", (1.0, 1.0, 1.0))
    room = make.sphere((0, 0, 0), 50.0, 1)
    camera = make.camera((0.3, 1.0, 6.0), (0, 0, 0), 0.2)
    lamps = [make.point(each, 2500.0 * np.pi) for each in ((20.0, 25, 10), (-20.0, 25, 10), (0.0, -30, -20))]
    scene = make.scene([ball, room], lamps, camera, materials=(MIRROR, white), size=96)
    forgiven, plain = trace_picture(scene, FORGIVING)[..., 0], trace_picture(scene, PLAIN)[..., 0]
    changed = np.abs(forgiven - plain) > VISIBLE
    assert changed.sum() > 20
    assert (forgiven[changed] > 0.05).mean() > 0.95
    assert np.median(plain[changed]) < 0.8 * np.median(forgiven[changed])


def test_two_balls_still_reflect_each_other(make: Any) -> None:
    """Other meshes are never forgiven: as one sees them with the plain tracer, but for the rims."""
    balls = [lat_long(make, 48, 24, (x, 0, 0), f"/Ball{x}") for x in (-1.05, 1.05)]
    floor = make.rectangle(-3.0, 30.0, 1)
    camera = make.camera((0, 0.5, 9), (0, 0, 0), 0.3)
    white = Material("/White", (1.0, 1.0, 1.0))
    scene = make.scene([*balls, floor], [make.distant((0.2, -0.3, -1))], camera, materials=(MIRROR, white), size=96)
    alone = [make.scene([each, floor], scene.lights, camera, materials=(MIRROR, white), size=96) for each in balls]
    together = trace_picture(scene, FORGIVING)[..., 0]
    seen = [np.abs(together - trace_picture(each, FORGIVING)[..., 0]) > VISIBLE for each in alone]
    assert min(each.sum() for each in seen) > 300  # each ball, and its picture in the other
    assert (np.abs(together - trace_picture(scene, PLAIN)[..., 0]) > VISIBLE).sum() < 60


def test_a_torus_still_reflects_itself(make: Any) -> None:
    """What it reflects of itself across its hole is far beyond a facet's sagitta: nearly all of it stays."""
    white = Material("/White", (1.0, 1.0, 1.0))
    floor = make.rectangle(-2.0, 30.0, 1)
    camera = make.camera((0, -2.5, 5), (0, 0, 0), 0.3, (0, 0, 1))
    scene = make.scene(
        [torus(make, 64, 32), floor], [make.distant((0.2, 0.3, -1))], camera, materials=(MIRROR, white), size=96
    )
    forgiving, plain = (trace_picture(scene, each)[..., 0] for each in (FORGIVING, PLAIN))
    itself = _twice(scene, plain, PLAIN)
    changed = itself & (np.abs(forgiving - plain) > VISIBLE)
    print(f"\n{itself.sum()} pixels reflect the torus in the torus, forgiving changes {changed.sum()} of them")
    assert itself.sum() > 60
    assert changed.sum() < 0.1 * itself.sum()


def _twice(scene: Any, once: Any, options: Options) -> Any:
    """Pixels whose light came over more than one mirror: half the mirror leaves less than half of their light."""
    half = replace(scene, materials=(replace(MIRROR, mirror=(0.4,) * 3), scene.materials[1]))
    return (trace_picture(half, options)[..., 0] < 0.4 * once) & (once > 0.02)


@pytest.mark.parametrize("gap", [0.0, 1e-6])
def test_the_shadow_of_glass_has_the_colour_of_what_it_lets_through(make: Any, gap: float) -> None:
    """Each of two panes lets T of a channel through, not the mean of the channels; a ball is crossed twice."""
    through = (0.9, 0.5, 0.2)
    glass = Material("/Glass", (0.0, 0.0, 0.0), transmission=through, ior=1.0)
    panes = [make.rectangle(z, 1.0) for z in (1.0, 1.2)]
    ball = make.sphere((6.0, 0.0, 2.0), 1.0)
    floor = make.rectangle(-1.0, 30.0, 1)
    sun = make.distant((0, 0, -1), np.pi)
    camera = make.camera((0, -20.0, 12.0), (0, 0, 0), 0.5, (0, 0, 1))
    white = Material("/White", (1.0, 1.0, 1.0))
    options = Options(transparent_shadows="glass", shadow_gap=gap)
    scene = make.scene([*panes, ball, floor], [sun], camera, materials=(glass, white))
    shadows = np.unique(trace_picture(scene, options).reshape(-1, 3).round(6), axis=0)
    assert any(np.allclose(each, np.square(through), atol=1e-5) for each in shadows)
    grey = np.square(np.mean(through))
    assert not np.isclose(shadows, grey, atol=1e-5).all(axis=1).any()


@pytest.mark.parametrize("how", [{}, {"shadow_gap": 1e-3}, {"start": "absolute", "epsilon": 1e-4}])
def test_the_inside_of_a_ball_lies_in_the_balls_own_shadow(make: Any, how: dict[str, Any]) -> None:
    """Light that falls on its inner side has crossed the outer one: an opaque ball keeps all of it, others a share."""
    lamp = make.point((0.0, 0.0, 8.0), 64.0 * np.pi)
    within = make.camera((0.0, 0.0, 0.0), (0.3, 0.0, -1.0), 0.4)
    for opacity in (1.0, 0.25):
        shell = Material("/Shell", (1.0, 1.0, 1.0), opacity=opacity)
        scene = make.scene([make.sphere((0, 0, 0), 1.0)], [lamp], within, materials=(shell,), size=8)
        bare = make.scene([make.sphere((0, 0, 0), 1.0)], [lamp], within, materials=(shell,), size=8)
        lit = trace_picture(bare, Options(shadows="none"))
        seen = trace_picture(scene, Options(**how))
        assert lit.min() > 0.0
        assert np.allclose(seen, (1.0 - opacity) * lit, atol=1e-9)
    from_lamp = make.camera((0.0, 0.0, 0.0), (0.3, 0.0, 1.0), 0.4)  # a lamp inside lights it without a shadow
    lamp = make.point((0.2, 0.0, -0.2), 1.0)
    scene = make.scene([make.sphere((0, 0, 0), 1.0)], [lamp], from_lamp, size=8)
    assert np.array_equal(trace_picture(scene, Options(**how)), trace_picture(scene, Options(shadows="none")))
