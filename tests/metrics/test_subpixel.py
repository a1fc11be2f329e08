"""The grid on which rasterisers put corners: what it admits, that it must be declared, and what it does not hide."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from notabug.references.models.subpixel import BITS, models
from notabug.references.raster.picture import RasterOptions, raster_picture
from notabug.scenes_usd.scene import Camera, Floats, Mesh, Scene


def on_grid(scene: Scene, bits: int) -> Scene:
    """``scene`` with its corners moved, at the same depth, to where such a rasteriser puts them."""
    camera, size = scene.camera, np.array([scene.width, scene.height])

    def snapped(mesh: Mesh) -> Mesh:
        return replace(mesh, points=_snapped(mesh.points, camera, size, bits))

    return replace(scene, objects=tuple(snapped(shape) for shape in scene.objects if isinstance(shape, Mesh)))


def _snapped(points: Floats, camera: Camera, size: Any, bits: int) -> Floats:
    seen = (points - camera.to_world[3, :3]) @ camera.to_world[:3, :3].T
    half = -seen[:, 2:] * np.array([camera.tan_x, camera.tan_y])
    pixels = (seen[:, :2] / half + 1.0) / 2.0 * size
    grid = np.round(pixels * 2**bits) / 2**bits
    moved = np.column_stack([(grid / size * 2.0 - 1.0) * half, seen[:, 2]])
    return np.ascontiguousarray(moved @ camera.to_world[:3, :3] + camera.to_world[3, :3])


@pytest.mark.parametrize("bits", BITS)
@pytest.mark.parametrize("name", ["texture/uneven_quad", "texture_space/wrap", "texture_space/seam"])
def test_a_snapped_picture_lies_between_those_that_are_moved_by_half_a_step(studio: Any, name: str, bits: int) -> None:
    scene = replace(studio.scene(name), width=96, height=96)
    model = next(made for made in models(scene) if made.when == ("subpixel_bits", str(bits)))
    bounds = np.array([raster_picture(value.edit(scene)) for value in model.values()])
    least, most = bounds.min(axis=0), bounds.max(axis=0)
    picture, plain = raster_picture(on_grid(scene, bits)), raster_picture(scene)
    off = np.maximum(least - picture, picture - most).max(axis=2)
    moved = np.abs(picture - plain).max(axis=2)
    assert (moved > 1e-4 * plain.max()).sum() > 200
    assert (off > 1e-4 * plain.max()).sum() < 0.002 * (moved > 1e-4 * plain.max()).sum()
    assert off.max() < 1e-3 * plain.max()  # of kinks between texels three times as much is lost by corners alone


def pictured(scene: Scene, bits: int = 4) -> list[Any]:
    return [raster_picture(on_grid(scene, bits)).astype(np.float32)]


def test_it_is_a_limitation_where_it_is_declared_and_a_bug_elsewhere(studio: Any) -> None:
    scene = replace(studio.scene("texture/perspective_floor"), width=96, height=96)
    declared = replace(studio.point, precision="float32", shadows="none", ngon_split="02")
    told = replace(declared, subpixel_bits=4)
    found = studio.verdict(pictured(scene), scene, told)
    assert (found.word, [finding.name for finding in found.findings]) == ("limitation", ["subpixel_grid"])
    assert studio.verdict(pictured(scene), scene, declared).word == "bug"


# of a flat card a moved camera shows what a shifted lens does
@pytest.mark.parametrize(("fault", "names"), [("shift", ["pixel_shift", "camera_moved"]), ("gain", ["light_gain"])])
def test_it_hides_no_fault(studio: Any, fault: str, names: list[str]) -> None:
    scene = replace(studio.scene("calibration/card"), width=96, height=96)
    declared = replace(studio.point, precision="float32", shadows="none", ngon_split="02", subpixel_bits=4)
    shifted = replace(scene, camera=replace(scene.camera, shift_x=scene.camera.shift_x + 0.3 * 2.0 / 96))
    [picture] = pictured(shifted if fault == "shift" else scene)
    found = studio.verdict([picture * np.float32(1.03 if fault == "gain" else 1.0)], scene, declared)
    assert found.word == "bug"
    assert found.findings[0].name in (*names, "unexplained")


def test_a_scene_without_a_mesh_has_none(studio: Any) -> None:
    scene = studio.scene("calibration/card")
    assert not list(models(replace(scene, objects=())))
    assert [made.when for made in models(scene)] == [("subpixel_bits", str(bits)) for bits in BITS]


@pytest.mark.parametrize(
    ("name", "size", "depth"),
    [
        ("visibility/coincident_spheres", 128, "fixed24"),
        ("visibility/coincident_spheres", 128, "float32"),
        ("visibility/coincident_spheres", 96, "fixed24"),
        ("visibility/coincident_planes", 96, "fixed24"),
    ],
)
@pytest.mark.sweep_except("visibility/coincident_spheres-128-float32", "visibility/coincident_planes-96-fixed24")
def test_of_surfaces_that_coincide_the_grid_moves_each(studio: Any, name: str, size: int, depth: Any) -> None:
    """Which of two surfaces a pixel shows is open, and so is where within half a step it is shown."""
    scene = replace(studio.scene(name), width=size, height=size)
    declared = replace(
        studio.point, precision="float32", shadows="none", ngon_split="02", depth=depth, coincident="unknown"
    )
    told = replace(declared, subpixel_bits=4)
    picture = raster_picture(on_grid(scene, 4), RasterOptions(depth=depth), dtype="float32").astype(np.float32)
    found = studio.verdict([picture], scene, told, naming=False)
    assert found.word == "limitation"
    assert "coincident_surfaces" in [finding.name for finding in found.findings]
    if size == 96:  # a search that finds nothing takes long
        wrong = picture * np.float32(1.02)
        assert studio.verdict([wrong], scene, told, naming=False).word == "bug"
