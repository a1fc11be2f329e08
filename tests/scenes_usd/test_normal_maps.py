"""The scenes of normal maps: what their variants say, and that their maps hold what their claims speak of."""

from __future__ import annotations

import numpy as np
import pytest

from notabug.scenes_usd.reader import read_scene
from notabug.scenes_usd.scene import Scene


def the_map(scene: Scene) -> np.ndarray:
    previews = [scene.materials[each.material].preview for each in scene.objects]
    (index,) = {each.normal_map for each in previews if each is not None}
    return scene.textures[index].pixels


@pytest.mark.parametrize(("name", "said"), [("bytes", 256.0 / 255.0 - 1.0), ("level", 0.0)])
def test_the_identity_is_what_bytes_and_bias_make(name: str, said: float) -> None:
    texels = the_map(read_scene("normal_maps/identity", {"map": name}))
    assert texels[..., :2] == pytest.approx(said, abs=1e-7)
    assert texels[..., 2] == pytest.approx(1.0, abs=1e-7)


def test_without_the_map_the_surface_is_the_same() -> None:
    mapped, plain = (read_scene("normal_maps/identity", {"map": name}) for name in ("bytes", "none"))
    for one, other in zip(mapped.objects, plain.objects, strict=True):
        with_map, without = mapped.materials[one.material], plain.materials[other.material]
        assert with_map.preview is not None
        assert without.preview is not None
        assert without.preview.normal_map == -1
        assert (with_map.diffuse, with_map.preview.roughness) == (without.diffuse, without.preview.roughness)


def test_bumps_are_unit_vectors_up_to_bytes_and_steep() -> None:
    texels = the_map(read_scene("normal_maps/bumps"))
    assert np.linalg.norm(texels, axis=2) == pytest.approx(1.0, abs=0.01)
    lean = np.degrees(np.arccos(np.clip(texels[..., 2], -1.0, 1.0)))
    assert 60.0 < lean.max() < 63.0
    assert texels[..., :2].mean() == pytest.approx(0.0, abs=0.005), "as steep on every side"
    # on the right of a bump, half way out, it leans to the right; above, upwards
    half = len(texels) // 2
    assert texels[half, half + 12, 0] > 0.5
    assert texels[half - 12, half, 1] > 0.5


def test_the_far_strip_faces_away_from_the_light_and_its_bumps_do_not() -> None:
    scene = read_scene("normal_maps/bumps")
    near, far = scene.meshes
    towards = -np.asarray(scene.lights[0].direction)
    normals = [np.cross(mesh.points[1] - mesh.points[0], mesh.points[3] - mesh.points[0]) for mesh in (near, far)]
    assert normals[0] @ towards > 0 > normals[1] @ towards


@pytest.mark.parametrize("tile", ["curved", "plane"])
def test_half_of_the_tile_has_mirrored_coordinates_without_stretch(tile: str) -> None:
    (mesh,) = read_scene("normal_maps/mirrored_uv", {"tile": tile}).meshes
    assert mesh.uv is not None
    x, y = mesh.points[mesh.corners, 0], mesh.points[mesh.corners, 1]
    assert mesh.uv[:, 0] == pytest.approx(1.5 * np.abs(x), abs=1e-5)
    assert mesh.uv[:, 1] == pytest.approx(1.5 * (y + 1.0), abs=1e-5)


def test_gentle_bumps_lean_less_than_the_view_and_medium_ones_more() -> None:
    """The low camera looks from 18 degrees above the strips."""
    steepest = {}
    for slope in ("steep", "medium", "gentle"):
        texels = the_map(read_scene("normal_maps/bumps", {"slope": slope}))
        steepest[slope] = float(np.degrees(np.arccos(texels[..., 2].min())))
    assert steepest["gentle"] < 14.0 < 18.0 < 29.0 < steepest["medium"] < 31.0 < steepest["steep"]
