"""Pictures of the rasteriser against closed forms and against the ray tracer, which shares its shading only."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from notabug.references.raster.picture import RasterOptions, raster_picture
from notabug.references.tracer.envelope import trace_picture
from notabug.references.tracer.options import Options
from notabug.scenes_usd.scene import Camera, Card, Light, Material, Mesh, Scene, Texture
from notabug.scenes_usd.triangulate import Diagonal, split_ngons

EXACT = RasterOptions(depth="exact")


def camera(eye: Any, target: Any = (0, 0, 0)) -> Camera:
    z = np.array(eye, float) - np.array(target, float)
    z /= np.linalg.norm(z)
    x = np.cross((0.0, 1.0, 0.0), z)
    x /= np.linalg.norm(x)
    to_world = np.eye(4)
    to_world[:3, :3] = x, np.cross(z, x), z
    to_world[3, :3] = eye
    return Camera("/Camera", to_world, 0.5, 0.5, 0.05, 100.0)


def quad(points: Any, uv: Any = None, normals: Any = None, material: int = 0) -> Mesh:
    corners = np.arange(4, dtype=np.int32)
    uv = None if uv is None else np.array(uv, float)
    return Mesh("/Quad", np.array(points, float), np.array([4], np.int32), corners, material, normals, uv)


FLOOR = quad([[-9, -9, 0], [9, -9, 0], [9, 9, 0], [-9, 9, 0]])
UNEVEN = quad([[-1, -1, 0], [1, -1, 0.3], [0.3, 1, 0.6], [-0.2, 0.8, 0]], [[0, 0], [1, 0], [1, 1], [0, 1]])
SUN = Light("/Sun", "distant", (1.5, 1.2, 0.9), direction=(-0.36, -0.48, -0.8))
LAMP = Light("/Lamp", "point", (6.0, 5.0, 4.0), position=(0.5, 0.3, 2.0))


def scene(objects: Any, lights: Any, *materials: Material, eye: Any = (1.0, -3.0, 4.0), texture: Any = None) -> Scene:
    textures = () if texture is None else (Texture(Path("t.png"), texture),)
    looks = materials or (Material("/Grey", (0.8, 0.6, 0.4), texture=len(textures) - 1),)
    card = Card("calibration", "made by hand")
    return Scene(
        "hand/made", Path("m.usda"), {}, card, camera(eye), 64, 64, tuple(objects), tuple(lights), looks, textures
    )


def ball(around: int = 16, high: int = 8) -> Mesh:
    """A unit sphere of quads, triangles at the poles, with the sphere's normals."""
    theta, phi = np.linspace(0, np.pi, high + 1), np.arange(around) / around * 2 * np.pi
    T, P = np.meshgrid(theta, phi, indexing="ij")
    points = np.stack([np.sin(T) * np.cos(P), np.sin(T) * np.sin(P), np.cos(T)], -1).reshape(-1, 3)
    index = np.arange(len(points)).reshape(high + 1, around)
    faces = [
        [index[i, j], index[i + 1, j], index[i + 1, (j + 1) % around], index[i, (j + 1) % around]]
        for i in range(high)
        for j in range(around)
    ]
    faces = [[f[k] for k in range(4) if not (f[0] < around and k == 3) and not (f[1] >= high * around and k == 2)]
             for f in faces]  # fmt: skip
    corners = np.concatenate(faces).astype(np.int32)
    return Mesh("/Ball", points, np.array([len(f) for f in faces], np.int32), corners, 0, points[corners])


def on_floor(shown: Scene) -> Any:
    side = shown.width
    y, x = np.mgrid[0:side, 0:side] + 0.5
    D = np.stack([x / side - 0.5, 0.5 - y / side, -np.ones_like(x)], -1) @ shown.camera.to_world[:3, :3]
    O = shown.camera.to_world[3, :3]  # noqa: E741 - origin
    return O + D * (-O[2] / D[..., 2])[..., None]


@pytest.mark.parametrize(("dtype", "relative"), [(np.float64, 1e-12), (np.float32, 1e-5)])
def test_lambert_floor_under_a_point_light(dtype: Any, relative: float) -> None:
    shown = scene([FLOOR], [LAMP])
    to = np.array(LAMP.position) - on_floor(shown)
    square = (to * to).sum(-1)
    falling = to[..., 2] / square**1.5
    expected = falling[..., None] * np.array([0.8, 0.6, 0.4]) * np.array(LAMP.intensity) / np.pi
    found = raster_picture(shown, dtype=dtype)
    assert np.abs(found / expected - 1.0).max() < relative


def looks(lobe: Any, exponent: float, weighted: bool) -> Material:
    return Material(
        "/Shiny", (0.5, 0.4, 0.3), specular=(0.6, 0.5, 0.4), exponent=exponent, lobe=lobe, cosine_weighted=weighted
    )


@pytest.mark.parametrize("lobe", ["phong", "blinn"])
@pytest.mark.parametrize("weighted", [False, True])
@pytest.mark.parametrize("silhouette", ["keep", "flip", "black"])
def test_shading_is_the_tracers(lobe: str, weighted: bool, silhouette: Any) -> None:
    shown = scene([ball()], [LAMP, SUN], looks(lobe, 20.0, weighted))
    found = raster_picture(shown, replace(EXACT, silhouette=silhouette))
    cut = replace(shown, objects=tuple(split_ngons(each, "02") for each in shown.meshes))
    rays = trace_picture(cut, Options(shadows="none", silhouette=silhouette))
    off = np.abs(found - rays).max(-1)
    assert (off > 1e-9).sum() <= 2
    assert off[off < 1e-9].max() < 1e-12
    assert (found > 0).any(-1).sum() > 300


@pytest.mark.parametrize("diagonal", ["02", "13"])
@pytest.mark.parametrize("affine", [False, True])
def test_uv_with_and_without_perspective_are_the_tracers(diagonal: Diagonal, affine: bool) -> None:
    texture = np.random.default_rng(3).random((8, 8, 3))
    shown = scene([UNEVEN], [SUN], eye=(0.4, -1.6, 1.2), texture=texture)
    found = raster_picture(shown, replace(EXACT, diagonal=diagonal, affine=affine))
    cut = replace(shown, objects=(split_ngons(UNEVEN, diagonal),))
    rays = trace_picture(cut, Options(shadows="none", affine=affine))
    off = np.abs(found - rays).max(-1)
    assert (off > 1e-9).sum() <= 2
    assert off[off < 1e-9].max() < 1e-11
    other = raster_picture(shown, replace(EXACT, diagonal=diagonal, affine=not affine))
    assert (np.abs(found - other).max(-1) > 0.02).mean() > 0.1


def test_affine_uv_are_linear_on_the_screen() -> None:
    """A ramp over one triangle: its second difference along a row vanishes without perspective, and only then."""
    ramp = np.repeat(np.linspace(0, 1, 256)[None, :, None], 3, axis=2)
    tilted = quad([[-3, -3, -3], [3, -3, 0], [3, 3, 2], [-3, 3, -1]], [[0.1, 0], [0.9, 0], [0.9, 1], [0.1, 1]])
    white = Light("/Sun", "distant", (np.pi,) * 3, direction=(0.0, 0.0, -1.0))
    shown = scene([tilted], [white], eye=(0, 0, 4), texture=ramp)
    bends = []
    for affine in (False, True):
        row = raster_picture(shown, replace(EXACT, affine=affine))[50, 30:60, 0]
        assert (row > 0).all()
        bends.append(np.abs(np.diff(row, 2)).max())
    assert bends[0] > 1e-4
    assert bends[1] < 1e-12


@pytest.mark.parametrize("lobe", ["phong", "blinn"])
def test_gouraud_interpolates_the_light_of_the_corners(lobe: str) -> None:
    """On a quad seen straight on: bilinear weights of two triangles, and the tracer's light at the corners."""
    normals = np.array([[0.3, 0.1, 1], [-0.2, 0.2, 1], [0.1, -0.4, 1], [0, 0.2, 1]], float)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    patch = quad([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], normals=normals)
    material = looks(lobe, 8.0, False)
    shown = scene([patch], [LAMP], material, eye=(0, 0, 4))
    found = raster_picture(shown, replace(EXACT, normals="gouraud"))
    corner = []
    for P, N in zip(patch.points, normals, strict=True):
        L = np.array(LAMP.position) - P
        E = np.array(LAMP.intensity) / (L @ L)
        L, V = L / np.linalg.norm(L), np.array([0, 0, 4.0]) - P
        V = V / np.linalg.norm(V)
        H = (L + V) / np.linalg.norm(L + V)
        cosine = max(0.0, float(2 * (N @ L) * (N @ V) - L @ V if lobe == "phong" else N @ H))
        corner.append(E / np.pi * (np.array(material.diffuse) * (N @ L) + np.array(material.specular) * cosine**8))
    x, y = np.moveaxis(on_floor(shown)[..., :2] / 2 + 0.5, -1, 0)
    c0, c1, c2, c3 = corner
    x, y = x[..., None], y[..., None]
    lower, upper = c0 + x * (c1 - c0) + y * (c2 - c1), c0 + y * (c3 - c0) + x * (c2 - c3)
    inside = ((x > 0) & (x < 1) & (y > 0) & (y < 1))[..., 0] & (np.abs(x - y)[..., 0] > 1e-9)
    assert inside.sum() > 800
    assert np.abs(found - np.where(y < x, lower, upper))[inside].max() < 1e-12
    flat = raster_picture(shown, replace(EXACT, normals="flat"))
    facets = scene([replace(patch, normals=None)], [LAMP], material, eye=(0, 0, 4))
    assert np.abs(flat - raster_picture(facets, EXACT)).max() < 1e-12


def test_transparent_surfaces_are_composited_from_the_front() -> None:
    """Two sheets of opacity 0.5 and 0.25 over a floor, in either order of drawing, also where they coincide."""
    white = Light("/Sun", "distant", (np.pi,) * 3, direction=(0.0, 0.0, -1.0))
    materials = [Material("/A", (0.2,) * 3), Material("/B", (0.8,) * 3, opacity=0.5)]
    materials.append(Material("/C", (1.0,) * 3, opacity=0.25))
    square = np.array([[-9, -9, 0], [9, -9, 0], [9, 9, 0], [-9, 9, 0]], float)
    for gap in (0.5, 0.0):
        B, C = (quad(square + np.array([0, 0, z]), material=k) for z, k in ((1, 1), (1 + gap, 2)))
        for drawn in ([FLOOR, B, C], [C, B, FLOOR]):
            found = raster_picture(scene(drawn, [white], *materials), EXACT)
            front = (1.0, 0.25, 0.8, 0.5) if gap or drawn[0] is C else (0.8, 0.5, 1.0, 0.25)
            expected = front[0] * front[1] + (1 - front[1]) * (front[2] * front[3] + (1 - front[3]) * 0.2)
            assert np.abs(found - expected).max() < 1e-12


def test_a_grid_of_samples_is_the_mean_of_a_larger_picture() -> None:
    shown = scene([ball()], [SUN])
    large = raster_picture(replace(shown, width=192, height=192), EXACT).reshape(64, 3, 64, 3, 3).mean(axis=(1, 3))
    assert np.abs(raster_picture(shown, EXACT, samples=9) - large).max() < 1e-12
    alone, many = (raster_picture(shown, EXACT, samples=16, threads=threads) for threads in (1, 3))
    assert np.array_equal(alone, many)


@pytest.mark.parametrize("light", [SUN, replace(LAMP, position=(1.5, 1.0, 4.0))])
def test_a_shadow_map_casts_the_shadow_that_rays_cast(light: Light) -> None:
    sheet = quad(np.array([[-0.6, -0.5, 1.0], [0.5, -0.7, 1.2], [0.6, 0.6, 1.1], [-0.5, 0.5, 0.9]]))
    shown = scene([replace(FLOOR, points=FLOOR.points / 3), sheet], [light])
    mapped = raster_picture(shown, replace(EXACT, shadow_map=1024, shadow_bias=0.02)).max(-1)
    cut = replace(shown, objects=tuple(split_ngons(each, "02") for each in shown.meshes))
    rays = trace_picture(cut, Options(shadows="facets")).max(-1)
    unshadowed = trace_picture(cut, Options(shadows="none")).max(-1)
    assert ((rays == 0) & (unshadowed > 0)).sum() > 100
    off = np.abs(mapped - rays) > 1e-9
    assert off.sum() <= 12  # cells of the map along the shadow's border


def test_a_shadow_map_without_bias_has_acne_and_with_it_a_terminator_that_steps() -> None:
    """Half a cell's depth is the error of a nearest look-up: no bias is acne, a large one eats the contact shadow."""
    body = ball(12, 6)
    shown = scene([body], [replace(SUN, direction=(-0.8, 0.6, 0.0))])
    lit = raster_picture(shown, EXACT).max(-1) > 0
    dark = [
        float(
            ((raster_picture(shown, replace(EXACT, shadow_map=256, shadow_bias=b)).max(-1) == 0) & lit).sum()
            / lit.sum()
        )
        for b in (0.0, 0.03, 0.5)
    ]
    assert dark[0] > 0.3
    assert 0.0 < dark[1] < 0.1  # the facets shadow the smooth surface, as under rays
    assert dark[2] == 0.0
