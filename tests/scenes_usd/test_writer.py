"""What is written reads back as the same scene."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from notabug.scenes_usd.catalogue import scenes
from notabug.scenes_usd.reader import read_scene
from notabug.scenes_usd.scene import Mesh, Scene, Texture
from notabug.scenes_usd.transform import transformed, translation
from notabug.scenes_usd.writer import write_scene

EXACT = ("phong/lobes", "separation/t_highlight", "mirror/corner", "visibility/standing", "texture/perspective_floor")


@pytest.mark.parametrize("suffix", [".usda", ".usdc"])
@pytest.mark.parametrize("name", EXACT)
def test_a_scene_comes_back_bit_by_bit(name: str, suffix: str, tmp_path: Path) -> None:
    scene = read_scene(name)
    assert read_scene(write_scene(scene, tmp_path / f"again{suffix}")).digest() == scene.digest()


@pytest.mark.parametrize("name", [each.id for each in scenes()])
def test_every_scene_comes_back_to_rounding(name: str, tmp_path: Path) -> None:
    scene = read_scene(name)
    again = read_scene(write_scene(scene, tmp_path / "again.usda"))
    assert same(scene, again)
    assert again.card == scene.card
    assert (again.intent is None) == (scene.intent is None)


def same(a: Scene, b: Scene) -> bool:
    """Alike to float32's rounding of normals."""
    assert [each.path for each in a.objects] == [each.path for each in b.objects]
    assert [each.path for each in a.materials] == [each.path for each in b.materials]
    np.testing.assert_allclose(a.camera.to_world, b.camera.to_world, atol=1e-15)
    assert (a.camera.tan_x, a.camera.near, a.width) == (b.camera.tan_x, b.camera.near, b.width)
    for p, q in zip(a.lights, b.lights, strict=True):
        assert (p.kind, p.intensity, p.shadow_map) == (q.kind, q.intensity, q.shadow_map)
        np.testing.assert_allclose(p.direction, q.direction, atol=1e-15)
    for one, two in zip(a.objects, b.objects, strict=True):
        assert a.materials[one.material] == b.materials[two.material] or one.path == two.path
        if isinstance(one, Mesh) and isinstance(two, Mesh):
            np.testing.assert_allclose(one.points, two.points, rtol=1e-14, atol=1e-14)
            np.testing.assert_array_equal(one.corners, two.corners)
            if one.normals is not None and two.normals is not None:
                np.testing.assert_allclose(one.normals, two.normals, atol=1e-7)
    return True


def test_a_mirrored_mesh_keeps_its_winding(tmp_path: Path) -> None:
    scene = read_scene("visibility/standing")
    flip = np.diag([-1.0, 1.0, 1.0, 1.0])
    objects = tuple(replace(each, to_world=flip) if isinstance(each, Mesh) else each for each in scene.objects)
    again = read_scene(write_scene(replace(scene, objects=objects), tmp_path / "again.usda"))
    for one, two in zip(objects, again.objects, strict=True):
        if isinstance(one, Mesh) and isinstance(two, Mesh):
            np.testing.assert_array_equal(one.corners, two.corners)
            np.testing.assert_allclose(one.points, two.points, atol=1e-7)


def test_points_far_from_the_origin_keep_their_digits(tmp_path: Path) -> None:
    """float32 holds 1e6 + x to 0.06 only."""
    scene = transformed(read_scene("phong/floor_lobes"), translation(1e6, 0.0, 0.0))
    again = read_scene(write_scene(scene, tmp_path / "again.usda"))
    for one, two in zip(scene.meshes, again.meshes, strict=True):
        np.testing.assert_allclose(one.points, two.points, atol=1e-6)


def test_a_texture_without_a_file_gets_one(tmp_path: Path) -> None:
    scene = read_scene("texture/perspective_floor")
    pixels = np.linspace(0.0, 1.0, 48).reshape(4, 4, 3)
    edited = replace(scene, textures=(Texture(Path("nowhere"), pixels),))
    again = read_scene(write_scene(edited, tmp_path / "again.usda"))
    np.testing.assert_allclose(again.textures[0].pixels, pixels, atol=1e-7)
