"""The z-buffer against closed forms: coverage, clipping, depth formats and what they can tell apart."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any, get_args

import numpy as np
import pytest

from notabug.references.raster.picture import DepthFormat, RasterOptions, raster_depth, raster_picture
from notabug.references.tracer.envelope import trace_picture
from notabug.references.tracer.options import Options
from notabug.scenes_usd.errors import SceneError
from notabug.scenes_usd.scene import Camera, Card, Floats, Light, Material, Mesh, Scene, Sphere

SIDE = 96
FORMATS = get_args(DepthFormat)


def camera(eye: Any, target: Any = (0, 0, 0), near: float = 0.1, far: float = 100.0, tan: float = 0.5) -> Camera:
    z = np.array(eye, float) - np.array(target, float)
    z /= np.linalg.norm(z)
    x = np.cross((0.0, 1.0, 0.0), z)
    x /= np.linalg.norm(x)
    to_world = np.eye(4)
    to_world[:3, :3] = x, np.cross(z, x), z
    to_world[3, :3] = eye
    return Camera("/Camera", to_world, tan, tan, near, far)


def quad(points: Any, material: int = 0) -> Mesh:
    corners = np.arange(len(points), dtype=np.int32)
    return Mesh("/Quad", np.array(points, float), np.array([len(points)], np.int32), corners, material)


def sheet(half: float, z: float, material: int = 0, start: int = 0) -> Mesh:
    """A square that faces +z; ``start`` 1 has it cut along the other diagonal."""
    return quad(np.roll([[-half, -half, z], [half, -half, z], [half, half, z], [-half, half, z]], -start, 0), material)


def scene(objects: Any, view: Camera, *, side: int = SIDE, opacity: float = 1.0) -> Scene:
    """Under white light along the view; the second material has another colour, and ``opacity``."""
    light = Light("/Sun", "distant", (np.pi,) * 3, direction=tuple(-view.to_world[2, :3]))
    looks = (Material("/Red", (1.0, 0.1, 0.1)), Material("/Green", (0.1, 1.0, 0.1), opacity=opacity))
    card = Card("calibration", "made by hand")
    return Scene("hand/made", Path("m.usda"), {}, card, view, side, side, tuple(objects), (light,), looks)


def torus(around: int = 40, across: int = 16) -> Mesh:
    """A torus of quads, which hides parts of itself."""
    u, v = np.arange(around) / around * 2 * np.pi, np.arange(across) / across * 2 * np.pi
    U, V = np.meshgrid(u, v, indexing="ij")
    points = np.stack([(1 + 0.4 * np.cos(V)) * np.cos(U), (1 + 0.4 * np.cos(V)) * np.sin(U), 0.4 * np.sin(V)], -1)
    index = np.arange(around * across).reshape(around, across)
    right, up = np.roll(index, -1, 0), np.roll(index, -1, 1)
    corners = np.stack([index, right, np.roll(right, -1, 1), up], -1).reshape(-1).astype(np.int32)
    return Mesh("/Torus", points.reshape(-1, 3), np.full(around * across, 4, np.int32), corners, 0)


def ray_distance(view: Camera, side: int = SIDE) -> Floats:
    """Depth along the axis (h, w) at which the pixel centres' rays meet z = 0."""
    y, x = np.mgrid[0:side, 0:side] + 0.5
    D = np.stack([(2 * x / side - 1) * view.tan_x, (1 - 2 * y / side) * view.tan_y, -np.ones_like(x)], -1)
    world = D @ view.to_world[:3, :3]
    distance: Floats = -view.to_world[3, 2] / world[..., 2]
    return distance


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_coverage_is_that_of_rays_through_the_pixel_centres(dtype: Any) -> None:
    shown = scene([torus(), sheet(9.0, -0.7, 1)], camera((0.6, -2.5, 2.0)), side=256)
    picture = raster_picture(shown, RasterOptions(depth="float32"), dtype=dtype)
    rays = trace_picture(shown, Options(shadows="none"))
    assert (np.abs(picture - rays).max(-1) > 1e-3).sum() <= 2


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_a_common_edge_is_drawn_once(dtype: Any) -> None:
    """Edges through sample points: a fan of triangles about a pixel centre, each sample in exactly one of them."""
    angle = np.arange(16) / 16 * 2 * np.pi
    rim = np.stack([np.cos(angle), np.sin(angle), np.zeros(16)], -1) * 0.35
    fan = [quad([[0.0, 0, 0], rim[k], rim[(k + 1) % 16]], 1) for k in range(16)]
    shown = scene(fan, camera((0, 0, 1)), side=65, opacity=0.5)  # the middle pixel's centre is the hub
    values = np.unique(raster_picture(shown, RasterOptions(depth="exact"), dtype=dtype)[..., 1].round(5))
    assert values.tolist() == [0.0, 0.5]  # 0.75 where two cover a sample


def test_top_left_rule() -> None:
    """A square whose edges run through sample points owns those on its top and its left edge only."""
    one = 1.0 / 8.0  # a pixel, at distance 1 and tan 0.5
    shown = scene([quad(np.array([[-1.5, -1.5, 0], [1.5, -1.5, 0], [1.5, 1.5, 0], [-1.5, 1.5, 0]]) * one)],
                  camera((0, 0, 1)), side=8)  # fmt: skip
    covered = raster_depth(shown, RasterOptions(depth="exact")).object == 0
    expected = np.zeros((8, 8), bool)
    expected[2:5, 2:5] = True  # sample points at 2.5, 3.5, 4.5 and not 5.5
    assert np.array_equal(covered, expected)


@pytest.mark.parametrize("depth", FORMATS)
@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_triangles_are_clipped_at_the_near_and_the_far_plane(depth: DepthFormat, dtype: Any) -> None:
    """A floor from behind the camera to beyond the far plane is seen exactly between the planes."""
    view = camera((0, -6, 1.5), (0, 0, 0.3), near=2.5, far=9.0)
    z = ray_distance(view)
    seen = (z >= 2.5) & (z <= 9.0)
    assert 0.2 < seen.mean() < 0.8
    covered = raster_depth(scene([sheet(500.0, 0.0)], view), RasterOptions(depth=depth), dtype=dtype).object == 0
    edge = (np.abs(z - 2.5) < 1e-3) | (np.abs(z - 9.0) < 1e-3)
    assert not (covered != seen)[~edge].any()


@pytest.mark.parametrize("depth", FORMATS)
def test_stored_depths(depth: DepthFormat) -> None:
    n, f = 0.5, 40.0
    view = camera((0.5, -3, 2), near=n, far=f)
    z = ray_distance(view)
    found = raster_depth(scene([sheet(6.0, 0.0)], view), RasterOptions(depth=depth))
    z, stored = z[found.object == 0], found.depth[found.object == 0]
    d = n * (f - z) / ((f - n) * z) if depth == "reversed32" else f * (z - n) / ((f - n) * z)
    if depth.startswith("fixed"):
        steps = 2.0 ** int(depth[5:]) - 1
        assert np.abs(stored * steps - np.round(stored * steps)).max() < 1e-6
        assert np.abs(stored - d).max() <= 0.5 / steps + 1e-12
    elif depth == "exact":
        assert np.abs(stored - d).max() < 1e-14
    else:
        assert np.array_equal(stored, stored.astype(np.float32))
        assert (np.abs(stored - d) <= np.spacing(d.astype(np.float32)) / 2 + 1e-14).all()


def dz(z: Any, depth: DepthFormat, n: float, f: float) -> Any:
    """The step in z that changes the stored depth by one unit: |dz/dd| = z^2 (f - n)/(n f) = z^2 (1/n - 1/f)."""
    slope = z * z * (1.0 / n - 1.0 / f)
    if depth.startswith("fixed"):
        return slope / 2.0 ** int(depth[5:])
    d = n * (f - z) / ((f - n) * z) if depth == "reversed32" else f * (z - n) / ((f - n) * z)
    return slope * np.spacing(np.float32(d))


@pytest.mark.parametrize("depth", ["fixed16", "fixed24", "float32", "reversed32"])
@pytest.mark.parametrize(("n", "f", "distance"), [(0.1, 100.0, 7.3), (0.01, 1000.0, 3.1), (1.0, 50.0, 31.0)])
@pytest.mark.sweep_except(
    "0.1-100.0-7.3-fixed16", "0.1-100.0-7.3-float32", "0.01-1000.0-3.1-fixed24", "1.0-50.0-31.0-reversed32"
)
def test_the_step_of_a_depth_buffer(depth: DepthFormat, n: float, f: float, distance: float) -> None:
    """dz = z^2 (1/n - 1/f) / 2^b for fixed point: sheets are told apart by their depths from that gap on."""
    step = float(dz(distance, depth, n, f))
    view = camera((0, 0, distance), near=n, far=f)

    def stored(below: float) -> float:
        return float(raster_depth(scene([sheet(99.0, -below)], view, side=1), RasterOptions(depth=depth)).depth[0, 0])

    values = np.array([stored(gap) for gap in np.linspace(0.0, 16.0 * step, 129)])
    steps = len(np.unique(values)) - 1
    assert 14 <= steps <= 18


@pytest.mark.parametrize("depth", ["fixed16", "fixed24", "float32", "reversed32"])
def test_sheets_closer_than_a_step_stripe_and_farther_ones_do_not(depth: DepthFormat) -> None:
    """The nearer sheet is drawn last, so wherever both have the same depth the farther one stays."""
    n, f = 0.05, 200.0
    view = camera((1.7, -3.4, 4.6), near=n, far=f)
    z = ray_distance(view)
    distance = float(np.linalg.norm(view.to_world[3, :3]))
    middle = np.abs(z - distance) < 0.02 * distance
    step = float(dz(distance, depth, n, f)) * distance / view.to_world[3, 2]  # along the sheets' normal

    def lost(gap: float) -> float:
        shown = scene([sheet(9.0, 0.0), sheet(9.0, gap, 1)], view)
        return float((raster_depth(shown, RasterOptions(depth=depth)).object == 0)[middle].mean())

    assert 0.4 < lost(0.25 * step) < 1.0
    assert lost(4.0 * step) == 0.0


def test_the_tie_rule() -> None:
    """The same triangles twice: no stripes; the first or the last drawn wins everywhere."""
    shown = scene([sheet(0.4, 0.0), sheet(0.4, 0.0, 1)], camera((1.7, -3.4, 4.6)))
    for depth in FORMATS:
        for tie, winner in (("less", 0), ("less_equal", 1)):
            owner = raster_depth(shown, RasterOptions(depth=depth, tie=tie)).object  # type: ignore[arg-type]
            assert set(np.unique(owner)) == {-1, winner}


@pytest.mark.parametrize(
    ("dtype", "depth", "stripes"),
    [
        (np.float32, "float32", True),
        (np.float32, "reversed32", True),
        (np.float32, "fixed24", True),
        (np.float64, "exact", True),
        (np.float64, "fixed24", False),  # stored with fewer bits than it is computed with, the noise rounds away
    ],
)
def test_coplanar_quads_with_other_diagonals_stripe(dtype: Any, depth: DepthFormat, stripes: bool) -> None:
    shown = scene([sheet(0.8, 0.0), sheet(0.8, 0.0, 1, start=1)], camera((1.7, -3.4, 4.6)))
    owner = raster_depth(shown, RasterOptions(depth=depth), dtype=dtype).object
    second = (owner == 1).sum() / (owner >= 0).sum()
    assert (0.02 < second < 0.6) if stripes else second < 1e-3
    same = replace(shown, objects=(sheet(0.8, 0.0, 0, start=1), sheet(0.8, 0.0, 1, start=1)))
    assert not (raster_depth(same, RasterOptions(depth=depth), dtype=dtype).object == 1).any()


def test_what_needs_rays_is_refused() -> None:
    shown = scene([sheet(1.0, 0.0)], camera((0, 0, 3)))
    with pytest.raises(SceneError, match="spheres"):
        raster_picture(replace(shown, objects=(Sphere("/Ball", 1.0, 0, np.eye(4)),)))
    glass = Material("/Glass", (0.0,) * 3, transmission=(1.0,) * 3)
    with pytest.raises(SceneError, match="/Glass"):
        raster_picture(replace(shown, materials=(glass,)))
    with pytest.raises(ValueError, match="square"):
        raster_picture(shown, samples=3)
    assert not raster_picture(replace(shown, objects=())).any()
