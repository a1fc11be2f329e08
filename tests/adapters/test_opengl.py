"""OpenGL on a real context: shading, coverage, and the depth buffer read back, against closed forms and our own."""

from __future__ import annotations

import importlib.metadata
from pathlib import Path
from typing import Any, get_args

import numpy as np
import pytest

import notabug.adapters.opengl
from notabug.adapters.base import Quality, RendererError, RendererMissingError, UnsupportedError
from notabug.adapters.opengl import OpenGL
from notabug.adapters.opengl_job import DepthFormat
from notabug.references.raster.picture import RasterOptions, raster_depth, raster_picture
from notabug.scenes_usd.picture import read_picture
from notabug.scenes_usd.scene import Texture

FORMATS = get_args(DepthFormat)
GREEN, RED = (0.1, 1.0, 0.1), (1.0, 0.1, 0.1)


def pair(stage: Any, second: Any, **lens: Any) -> Any:
    """A red sheet, and ``second``, green, under a light from straight above."""
    camera = stage.replace(stage.camera((1.7, -3.4, 4.6)), **lens)
    colours = [stage.replace(stage.grey(), diffuse=RED), stage.replace(stage.grey(), diffuse=GREEN)]
    return stage.scene(
        [stage.quad(1.0), stage.replace(second, material=1)],
        [stage.distant((0, 0, 1))],
        camera,
        colours,
        size=(128, 128),
    )


def turned(stage: Any, quad: Any) -> Any:
    """The same square, which is cut along the other diagonal."""
    return stage.replace(quad, points=np.roll(quad.points, -1, axis=0))


def share(picture: Any) -> float:
    """Of what is covered, the share that is green."""
    covered = picture.max(-1) > 0
    return float((covered & (picture[..., 1] > picture[..., 0])).sum() / covered.sum())


def test_found(opengl: OpenGL) -> None:
    found = opengl.find()
    assert found.version.startswith(f"moderngl {importlib.metadata.version('moderngl')} (")


@pytest.mark.parametrize("samples", [1, 9])
def test_floor_under_a_point_light(stage: Any, opengl: OpenGL, samples: int) -> None:
    light = stage.point((0.5, 0.3, 2.0))
    scene = stage.scene([stage.quad()], [light], stage.camera((0, -3, 4)))
    picture = stage.draw(opengl, scene, Quality(samples=samples))
    side = 64 * round(samples**0.5)
    finer = stage.replace(scene, width=side, height=side)
    E, cosine = stage.lit(stage.on_plane(finer), np.array([0.0, 0.0, 1.0]), light)
    expected = (0.8 * E * cosine / np.pi).reshape(64, side // 64, 64, side // 64).mean(axis=(1, 3))
    assert np.abs(picture / expected[..., None] - 1.0).max() < 1e-5
    assert np.median(np.abs(picture / expected[..., None] - 1.0)) < 1e-6


@pytest.mark.parametrize("normals", [True, False])
@pytest.mark.parametrize(("lobe", "weighted", "exponent"), [("phong", False, 20.0), ("blinn", True, 33.5)])
@pytest.mark.sweep_except("phong-False-20.0-False", "blinn-True-33.5-True")
def test_bodies_are_the_rasterisers(
    stage: Any, opengl: OpenGL, normals: bool, lobe: Any, weighted: bool, exponent: float
) -> None:
    ball = stage.ball() if normals else stage.replace(stage.ball(), normals=None)
    shiny = stage.replace(
        stage.grey(0.5), specular=(0.7, 0.5, 0.3), lobe=lobe, exponent=exponent, cosine_weighted=weighted
    )
    lights = [stage.distant((0.3, -0.6, 0.5), (1.5, 1.0, 0.5)), stage.point((1.0, -2.5, 2.0))]
    scene = stage.scene([ball], lights, stage.camera((1.0, -3.0, 2.0)), [shiny], size=(256, 256))
    picture, expected = stage.draw(opengl, scene), raster_picture(scene)
    assert ((picture > 0).any(-1) != (expected > 0).any(-1)).sum() <= 2
    off = np.abs(picture - expected).max(-1)
    assert (off > (2e-5 if exponent == 20.0 else 3e-4) * expected.max()).sum() <= 4  # pow() is coarse


@pytest.mark.parametrize("wraps", [("repeat", "repeat"), ("clamp", "repeat")])
def test_texture_is_the_bilinear_lookup(stage: Any, opengl: OpenGL, wraps: Any) -> None:
    pixels = np.random.default_rng(1).random((5, 8, 3)) * 3.0
    texture = Texture(Path("t.png"), pixels, *wraps)
    lo, hi = np.array([-0.7, -1.2]), np.array([1.9, 1.6])
    uv = np.array([[lo[0], lo[1]], [hi[0], lo[1]], [hi[0], hi[1]], [lo[0], hi[1]]])
    shown = stage.replace(stage.grey(), texture=0)
    light = stage.distant((0, 0, 1), (np.pi,) * 3)
    scene = stage.scene([stage.quad(2.5, uv=uv)], [light], stage.camera((0, 0, 5)), [shown], [texture])
    at = (lo + (stage.on_plane(scene)[..., :2] / 5 + 0.5) * (hi - lo)) * [8, -5] + [-0.5, 5 - 0.5]
    column, row = np.floor(at).astype(int).transpose(2, 0, 1)
    f, g = (at - np.floor(at)).transpose(2, 0, 1)[..., None]

    def texel(row: Any, column: Any) -> Any:
        return pixels[row % 5, column % 8 if wraps[0] == "repeat" else np.clip(column, 0, 7)]

    upper = texel(row, column) * (1 - f) + texel(row, column + 1) * f
    lower = texel(row + 1, column) * (1 - f) + texel(row + 1, column + 1) * f
    assert np.abs(stage.draw(opengl, scene) - upper * (1 - g) - lower * g).max() < 3e-5


@pytest.mark.parametrize("depth", FORMATS)
def test_stored_depths_are_the_rasterisers(stage: Any, opengl: OpenGL, depth: DepthFormat) -> None:
    """Within the rounding of float32 arithmetic on [0, 1], which is more than a step of 24 bits and less than of 16."""
    camera = stage.replace(stage.camera((0.3, -2.5, 1.2)), near=0.5, far=8.0)
    light = stage.distant((0, 0, 1))
    scene = stage.scene([stage.quad()], [light], camera, size=(128, 128))  # through the near and the far plane
    found = stage.replace(opengl, depth=depth).depth_buffer(scene, stage.out)
    expected = raster_depth(scene, RasterOptions(depth=depth))
    clear = 0.0 if depth == "reversed32" else 1.0
    assert ((found != clear) != (expected.object == 0)).sum() <= 2
    both = (found != clear) & (expected.object == 0)
    assert 0.3 < both.mean() < 0.9
    off = np.abs(found - expected.depth)[both].max()
    if depth == "fixed16":
        assert off < 1.01 / 65535
    else:
        assert off < (8.0 if depth != "reversed32" else 3.0) * 2.0**-24  # measured: 3 and 1
    if depth.startswith("fixed"):
        steps = found * (2.0 ** int(depth[5:]) - 1)
        assert np.abs(steps - np.round(steps)).max() < 0.01


@pytest.mark.parametrize(
    ("depth", "n"),
    [
        ("fixed16", 0.1),
        ("fixed16", 0.01),
        ("fixed24", 0.1),
        ("fixed24", 0.001),
        ("float32", 0.1),
        ("reversed32", 0.001),
    ],
)
def test_the_step_of_the_real_depth_buffer(stage: Any, opengl: OpenGL, depth: DepthFormat, n: float) -> None:
    """dz = z^2 (1/n - 1/f) / 2^b: counted on a floor that passes slowly through many depths.

    A float32 buffer rounds like 24 bits where its values are close to 1, nearly everywhere. With near at 1 the step is
    part of the depth, whatever the near plane; what is left is the rounding of the floor's own corners, 50 / 2^24.
    """
    f = 100.0
    camera = stage.replace(stage.camera((0, 0, 4.0), (3.0, 0, 0)), near=n, far=f)
    scene = stage.scene([stage.quad(50.0)], [stage.distant((0, 0, 1))], camera, size=(128, 128))
    stored = stage.replace(opengl, depth=depth).depth_buffer(scene, stage.out)
    O, D = stage.rays(scene)  # noqa: E741 - origin
    along = D @ -camera.to_world[2, :3]
    z = -O[2] / D[..., 2] * along
    per_depth = z**2 * (1 / n - 1 / f)
    dz = 50.0 / 2.0**24 if depth == "reversed32" else per_depth / 2.0 ** (16 if depth == "fixed16" else 24)
    exact = n * (f - z) / ((f - n) * z) if depth == "reversed32" else f * (z - n) / ((f - n) * z)
    off = (stored - exact) * per_depth / dz  # in steps
    print(f"\n{depth}, near {n}: off by at most {np.abs(off).max():.2f} steps, the median {np.median(np.abs(off)):.2f}")
    assert np.abs(off).max() <= (1.01 if depth == "fixed16" else 10.0)
    if depth == "fixed16":
        assert np.abs(off).max() > 0.45  # and not a finer buffer than that


def test_coplanar_quads_stripe_unless_they_have_the_same_triangles(stage: Any, opengl: OpenGL) -> None:
    stripes = share(stage.draw(opengl, pair(stage, turned(stage, stage.quad(1.0)))))
    assert 0.02 < stripes < 0.7
    assert share(stage.draw(opengl, pair(stage, stage.quad(1.0)))) == 0.0  # the first drawn wins


@pytest.mark.parametrize("depth", ["fixed24", "float32", "reversed32"])
@pytest.mark.sweep_except("fixed24", "reversed32")
def test_a_near_plane_too_near_lets_a_floor_show_through(stage: Any, opengl: OpenGL, depth: DepthFormat) -> None:
    """A green sheet 1e-4 above a red floor is all that may be seen; only reversed z is right at every near plane."""
    seen = []
    for near in (0.1, 0.01, 0.001, 0.0001):
        scene = pair(stage, stage.quad(1.0, (0, 0, 1e-4)), near=near, far=100.0)
        seen.append(share(stage.draw(stage.replace(opengl, depth=depth), scene)))
    if depth == "reversed32":
        assert min(seen) > 0.99
    else:
        assert seen[0] > 0.99
        assert seen[3] < 0.9


def test_transparent_surfaces_are_composited_from_the_front(stage: Any, opengl: OpenGL) -> None:
    """Two sheets, in either order of drawing, also where they coincide: then the first drawn is in front."""
    unshadowed = stage.replace(opengl, capabilities=opengl.capabilities | {"shadows"})  # transparent sheets cast some
    looks = [stage.grey(0.2), stage.replace(stage.grey(0.8), opacity=0.5), stage.replace(stage.grey(1.0), opacity=0.25)]
    for place, depth in enumerate(FORMATS):
        for gap in (0.5, 0.0)[place > 0 :]:  # only where sheets coincide may the format matter
            floor, B, C = stage.quad(), stage.quad(9, (0, 0, 1), 1), stage.quad(9, (0, 0, 1 + gap), 2)
            for drawn in ([floor, B, C], [C, B, floor]):
                scene = stage.scene(drawn, [], stage.camera((0.5, 0.2, 5)), looks, size=(32, 32))
                eye = stage.point(tuple(scene.camera.to_world[3, :3]), (50.0,) * 3)
                found = stage.draw(stage.replace(unshadowed, depth=depth), stage.replace(scene, lights=(eye,)))
                expected = raster_picture(stage.replace(scene, lights=(eye,)), RasterOptions(depth=depth))
                assert np.abs(found / expected - 1.0).max() < 1e-5, (depth, gap)


def test_a_picture_in_tiles_has_no_seams(stage: Any, opengl: OpenGL) -> None:
    """400 x 300 pixels of 6 x 6 samples are more than one tile."""
    camera = stage.camera((1.0, -3.0, 2.0))
    camera = stage.replace(camera, tan_y=camera.tan_x * 0.75)
    scene = stage.scene([stage.ball()], [stage.distant((0.3, -0.6, 0.5))], camera, size=(400, 300))
    picture = stage.draw(opengl, scene, Quality(samples=36))
    off = np.abs(picture - raster_picture(scene, RasterOptions(), samples=36)).max(-1)
    assert (off > 1e-4).sum() <= 12  # at the silhouette a sample of 36 may differ
    assert off.max() < 0.1


def test_repeatable_and_declared(stage: Any, opengl: OpenGL) -> None:
    scene = pair(stage, turned(stage, stage.quad(1.0)))
    first, second = (stage.draw(opengl, scene, Quality(samples=1, threads=n)) for n in (0, 1))
    assert np.array_equal(first, second)
    declared = stage.replace(opengl, depth="float32").declaration(Quality())
    assert (declared.filter, declared.noisy, declared.depth) == ("point", False, "float32")
    assert not stage.draw(opengl, stage.replace(scene, objects=())).any()
    assert not stage.draw(opengl, stage.replace(scene, lights=())).any()


def test_what_it_cannot_draw_is_named(stage: Any) -> None:
    scene = pair(stage, stage.quad(0.3, (0, 0, 0.5)))
    slanting = stage.replace(scene, lights=(stage.distant((1, 0, 1)),))
    with pytest.raises(UnsupportedError, match="shadows"):
        OpenGL().render(slanting, stage.out, Quality())


def test_missing_package_or_driver_says_how_to_get_it(stage: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    def version(name: str) -> str:
        raise importlib.metadata.PackageNotFoundError(name)

    install = r"pip install notabug\[opengl\]; apt install libegl1 libgl1 libgl1-mesa-dri"
    monkeypatch.setattr(importlib.metadata, "version", lambda name: "5.0")
    with pytest.raises(RendererMissingError, match=f"libEGL(.|\n)*{install}"):
        OpenGL(python=child(stage.out, "echo cannot load libEGL.so.1; exit 1")).find()
    monkeypatch.setattr(importlib.metadata, "version", version)
    for use in (OpenGL().find, lambda: OpenGL().render(pair(stage, stage.quad(1.0)), stage.out, Quality())):
        with pytest.raises(RendererMissingError, match=install):
            use()


def child(folder: Path, script: str) -> str:
    path = folder / "fake-python"
    path.write_text(f"#!/bin/sh\n{script}\n")
    path.chmod(0o755)
    return str(path)


@pytest.mark.parametrize(
    ("script", "message"),
    [
        ("echo done", "left no picture"),
        ("echo shader >&2; exit 1", r"exit code 1(.|\n)*shader"),
        ("kill -ABRT $$", "SIGABRT"),
    ],
)
def test_child_that_fails(stage: Any, monkeypatch: pytest.MonkeyPatch, script: str, message: str) -> None:
    monkeypatch.setattr(notabug.adapters.opengl.importlib.metadata, "version", lambda name: "5.0")
    (stage.out / "opengl-seed0.exr").write_text("the picture of another run")
    with pytest.raises(RendererError, match=message):
        OpenGL(python=child(stage.out, script)).render(pair(stage, stage.quad(1.0)), stage.out, Quality())
    assert not (stage.out / "opengl-seed0.exr").exists()


def test_the_probe_is_asked_once(stage: Any, opengl: OpenGL) -> None:
    assert opengl.find() == opengl.find()
    assert notabug.adapters.opengl._probe.cache_info().hits > 0
    (render,) = opengl.render(pair(stage, stage.quad(1.0)), stage.out, Quality())
    assert read_picture(render.image).pixels.shape == (128, 128, 3)
