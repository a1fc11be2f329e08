"""Both renderers against closed forms in float64, pixel by pixel.

Tolerances are the renderers' number formats: half a step of a 16-bit integer for POV-Ray (7.7e-6), float32 for Mitsuba.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from notabug.adapters.base import Adapter, Declaration
from notabug.scenes_usd.scene import Sphere, Texture

HALF_STEP = 0.51 / 65535


@pytest.fixture(params=["povray", "mitsuba"])
def adapter(request: pytest.FixtureRequest) -> Adapter:
    return request.getfixturevalue(request.param)


def close(picture: Any, expected: Any, adapter: Adapter, relative: float = 2e-6) -> None:
    """Every pixel within the adapter's number format and ``relative``."""
    step = HALF_STEP if adapter.name == "povray" else 1e-7
    excess = np.abs(picture - expected) - step - relative * np.abs(expected)
    assert excess.max() <= 0, (
        f"{excess.max():.3g} beyond the tolerance at {np.unravel_index(excess.argmax(), excess.shape)}"
    )


def test_floor_under_a_point_light(stage: Any, adapter: Adapter) -> None:
    light = stage.point((0.5, 0.3, 2.0))
    scene = stage.scene([stage.quad()], [light], stage.camera((0, -3, 4)))
    picture = stage.draw(adapter, scene)
    E, cosine = stage.lit(stage.on_plane(scene), np.array([0.0, 0.0, 1.0]), light)
    expected = np.repeat((0.8 * E * cosine / np.pi)[..., None], 3, axis=2)
    close(picture, expected, adapter)


def test_two_lights_in_colour(stage: Any, adapter: Adapter) -> None:
    lights = [stage.distant((0.3, -0.2, 1.0), (1.5, 1.0, 0.25)), stage.point((-1, 1, 3), (2, 4, 8))]
    scene = stage.scene([stage.quad()], lights, stage.camera((1, -2, 4)))
    picture = stage.draw(adapter, scene)
    P, N = stage.on_plane(scene), np.array([0.0, 0.0, 1.0])
    expected = 0.0
    for light in lights:
        E, cosine = stage.lit(P, N, light)
        expected = expected + 0.8 / np.pi * (E * cosine)[..., None] * np.array(light.intensity) / light.intensity[0]
    close(picture, expected, adapter)


@pytest.mark.parametrize("size", [(64, 64), (96, 48)])
@pytest.mark.sweep_except("povray-size1", "mitsuba-size0")
def test_sphere_covers_the_pixels_whose_centres_see_it(stage: Any, adapter: Adapter, size: tuple[int, int]) -> None:
    turn = np.eye(4)
    turn[:3, :3] = 0.7 * np.array([[0.6, 0.8, 0], [-0.8, 0.6, 0], [0, 0, 1]])
    turn[3, :3] = 0.4, -0.3, 0.2
    ball = Sphere("/Scene/Ball", 1.5, 0, turn)
    light = stage.distant((0.2, 0.1, 1.0))
    camera = stage.camera((0.5, -1.0, 4.0), (0.2, 0, 0))
    camera = stage.replace(camera, tan_y=camera.tan_x * size[1] / size[0])
    scene = stage.scene([ball], [light], camera, size=size)
    picture = stage.draw(adapter, scene)[..., 0]
    hit, P, N = stage.on_sphere(scene, ball)
    E, cosine = stage.lit(P, N, light)
    expected = np.where(hit, 0.8 / np.pi * E * cosine, 0.0)
    assert ((picture > 0) != (expected > 0)).sum() <= 2
    both = (picture > 1e-3) & (expected > 1e-3)
    assert np.abs(picture - expected)[both].max() < 2e-5


def test_interpolated_normals_and_flat_facets(stage: Any, adapter: Adapter) -> None:
    """With N.L = N.V the ball's every visible pixel is lit; its normals are those of a numpy ray caster."""
    ball = stage.ball()
    camera = stage.camera((1.0, -3.0, 2.0))
    light = stage.point(tuple(camera.to_world[3, :3]), (30, 30, 30))
    for mesh in (ball, stage.replace(ball, normals=None)):
        scene = stage.scene([mesh], [light], camera)
        picture = stage.draw(adapter, scene)[..., 0]
        hit, P, N, facing = cast(*stage.rays(scene), mesh)
        E, cosine = stage.lit(P, N, light)
        expected = np.where(hit, 0.8 / np.pi * E * cosine, 0.0)
        sure = hit & (facing > 0.05)
        assert sure.sum() > 800
        assert ((picture > 0) & ~hit).sum() <= 2
        assert np.abs(picture - expected)[sure].max() < 3e-5


def test_equal_normals_that_are_not_the_planes(stage: Any, adapter: Adapter) -> None:
    """POV-Ray left alone draws them flat."""
    light = stage.distant((0.3, 0.0, 1.0))
    for normal in ((0.6, 0.0, 0.8), (0.0, 0.28, -0.96)):
        tilted = stage.replace(stage.quad(), normals=np.tile(np.array(normal), (4, 1)))
        scene = stage.scene([tilted], [light], stage.camera((0, 0, 5)), size=(16, 16))
        side = np.sign(normal[2])
        expected = 0.8 / np.pi * side * (np.array(normal) @ -np.array(light.direction))
        assert np.abs(stage.draw(adapter, scene) - expected).max() < 4e-5


@pytest.mark.parametrize(("towards", "value"), [((0.8, 0, 0.6), 0.0), ((-0.8, 0, 0.6), 0.892035)])
@pytest.mark.sweep_except("povray-towards1-0.892035", "mitsuba-towards0-0.0")
def test_silhouette_normals_are_flipped(stage: Any, adapter: Adapter, towards: Any, value: float) -> None:
    """A normal 100 degrees from the viewer is turned round: dark where it faces the light, lit where it does not."""
    declared: Declaration = adapter.declaration(stage.centres)
    assert declared.silhouette == "flip"
    angle = np.radians(100)
    away = np.tile([np.sin(angle), 0.0, np.cos(angle)], (4, 1))
    camera = stage.camera((0, 0, 500), tan=1e-3)
    white = stage.replace(stage.grey(), diffuse=(1.0, 1.0, 1.0))
    scene = stage.scene(
        [stage.replace(stage.quad(), normals=away)],
        [stage.distant(towards, (np.pi,) * 3)],
        camera,
        [white],
        size=(8, 8),
    )
    assert stage.draw(adapter, scene) == pytest.approx(value, abs=1e-4)


@pytest.mark.parametrize("wraps", [("repeat", "repeat"), ("clamp", "clamp"), ("clamp", "repeat")])
@pytest.mark.sweep_except("povray-wraps1", "mitsuba-wraps0", "mitsuba-wraps2")
def test_texture_is_the_bilinear_lookup(stage: Any, adapter: Adapter, wraps: tuple[Any, Any]) -> None:
    """A texture of 8 x 5 random texels with uv from -0.7 to 1.9, one unlike the other: orientation and borders too."""
    pixels = np.random.default_rng(1).random((5, 8, 3))
    texture = Texture(Path("t.png"), pixels, *wraps)
    lo, hi = np.array([-0.7, -1.2]), np.array([1.9, 1.6])
    uv = np.array([[lo[0], lo[1]], [hi[0], lo[1]], [hi[0], hi[1]], [lo[0], hi[1]]])
    shown = stage.replace(stage.grey(), texture=0)
    light = stage.distant((0, 0, 1), (np.pi,) * 3)
    scene = stage.scene([stage.quad(2.5, uv=uv)], [light], stage.camera((0, 0, 5)), [shown], [texture])
    picture = stage.draw(adapter, scene)
    at = lo + (stage.on_plane(scene)[..., :2] / 5 + 0.5) * (hi - lo)
    expected = bilinear(pixels, at, wraps)
    assert np.abs(picture - expected).max() < (1.6e-5 if adapter.name == "povray" else 8e-6)


def test_texture_brighter_than_one(stage: Any, adapter: Adapter) -> None:
    texture = Texture(Path("t.png"), np.full((2, 2, 3), 3.5))
    uv = np.array([[0, 0], [1, 0], [1, 1], [0, 1.0]])
    shown = stage.replace(stage.grey(), texture=0)
    scene = stage.scene(
        [stage.quad(uv=uv)], [stage.distant((0, 0, 1))], stage.camera((0, 0, 5)), [shown], [texture], size=(8, 8)
    )
    assert stage.draw(adapter, scene) == pytest.approx(3.5 / np.pi, rel=6e-5)


def test_a_quad_is_cut_from_corner_0_to_2(stage: Any, adapter: Adapter) -> None:
    """uv that no affine map gives: each half shows its own triangle's interpolation."""
    assert adapter.declaration(stage.centres).ngon_split == "02"
    ramp = np.repeat(np.linspace(0, 1, 64)[None, :, None], 3, axis=2)
    uv = np.array([[0.1, 0.5], [0.1, 0.5], [0.9, 0.5], [0.1, 0.5]])
    shown = stage.replace(stage.grey(), texture=0)
    light = stage.distant((0, 0, 1), (np.pi,) * 3)
    texture = Texture(Path("t.png"), ramp, "clamp", "clamp")
    scene = stage.scene([stage.quad(2.5, uv=uv)], [light], stage.camera((0, 0, 5)), [shown], [texture])
    picture = stage.draw(adapter, scene)[..., 0]
    x, y = np.moveaxis(stage.on_plane(scene)[..., :2] / 5 + 0.5, -1, 0)
    u = 0.1 + 0.8 * np.minimum(x, y)
    expected = (u * 64 - 0.5) / 63
    assert np.abs(picture - expected).max() < 2e-5


def test_shadow_of_a_blocker(stage: Any, adapter: Adapter) -> None:
    light = stage.point((0.0, 0.0, 3.0))
    camera = stage.camera((0, -4, 3))
    scene = stage.scene([stage.quad(), stage.quad(0.5, (0, 0, 1.5), 0)], [light], camera)
    picture = stage.draw(adapter, scene)[..., 0]
    O, D = stage.rays(scene)  # noqa: E741 - origin
    P = stage.on_plane(scene)
    E, cosine = stage.lit(P, np.array([0.0, 0.0, 1.0]), light)
    over = O + D * ((1.5 - O[2]) / D[..., 2])[..., None]
    hidden = np.abs(over[..., :2]).max(-1) < 0.5 + 1e-3
    shadow = np.abs(P[..., :2]).max(-1)
    expected = np.where(shadow < 1.0, 0.0, 0.8 / np.pi * E * cosine)
    sure = ~hidden & (np.abs(shadow - 1.0) > 1e-3) & (shadow < 8.9)
    assert (expected[sure] == 0).sum() > 50
    assert np.abs(picture - expected)[sure].max() < 2e-5


def cast(O: Any, D: Any, mesh: Any) -> tuple[Any, Any, Any, Any]:  # noqa: E741 - origin
    """Brute force: hit, point, unit shading normal and N.V of the nearest triangle; n-gons as fans from corner 0."""
    fans, start = [], 0
    for count in mesh.counts:
        fans += [(start, start + k, start + k + 1) for k in range(1, count - 1)]
        start += count
    best = np.full(D.shape[:-1], np.inf)
    N = np.zeros_like(D)
    for fan in fans:
        a, b, c = mesh.points[mesh.corners[list(fan)]]
        p = np.cross(D, c - a)
        determinant = p @ (b - a)
        with np.errstate(divide="ignore", invalid="ignore"):
            u = p @ (O - a) / determinant
            q = np.cross(O - a, b - a)
            v = D @ q / determinant
            t = (c - a) @ q / determinant
            hit = (u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0) & (t < best)
        if mesh.normals is None:
            normal = np.broadcast_to(np.cross(b - a, c - a), D.shape)
        else:
            n0, n1, n2 = mesh.normals[list(fan)]
            normal = (1 - u - v)[..., None] * n0 + u[..., None] * n1 + v[..., None] * n2
        best = np.where(hit, t, best)
        N = np.where(hit[..., None], normal, N)
    hit = np.isfinite(best)
    N = np.where(hit[..., None], N, -D)
    N = N / np.linalg.norm(N, axis=-1, keepdims=True)
    return hit, O + np.where(hit, best, 1.0)[..., None] * D, N, -(N * D).sum(-1)


def bilinear(pixels: Any, uv: Any, wraps: tuple[str, str]) -> Any:
    """The lookup by definition: texel centres at half-integers, row 0 at v = 1."""
    height, width = pixels.shape[:2]
    x, y = uv[..., 0] * width - 0.5, (1 - uv[..., 1]) * height - 0.5
    column, row = np.floor(x).astype(int), np.floor(y).astype(int)
    f, g = (x - column)[..., None], (y - row)[..., None]

    def texel(row: Any, column: Any) -> Any:
        column = column % width if wraps[0] == "repeat" else np.clip(column, 0, width - 1)
        row = row % height if wraps[1] == "repeat" else np.clip(row, 0, height - 1)
        return pixels[row, column]

    upper = texel(row, column) * (1 - f) + texel(row, column + 1) * f
    lower = texel(row + 1, column) * (1 - f) + texel(row + 1, column + 1) * f
    return upper * (1 - g) + lower * g
