"""The corpus is what its scripts write, and its pictures have no symmetry that a fault could hide behind."""

from __future__ import annotations

import importlib.util
import itertools
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from notabug.scenes_usd.authoring import __main__ as authoring
from notabug.scenes_usd.authoring import simplify
from notabug.scenes_usd.authoring.calibration_card import target
from notabug.scenes_usd.authoring.png import png
from notabug.scenes_usd.authoring.shapes import Shape, bowl, box, cylinder, grid, lat_long, slab
from notabug.scenes_usd.authoring.texture_simplified import CELLS, FACES, MESHES, height, read_obj
from notabug.scenes_usd.authoring.texture_uneven_quad import checker
from notabug.scenes_usd.authoring.usda import integers, number
from notabug.scenes_usd.catalogue import scenes
from notabug.scenes_usd.picture import read_picture
from notabug.scenes_usd.reader import CORPUS, read_scene
from notabug.scenes_usd.scene import Light


def test_regeneration_is_identical(capsys: pytest.CaptureFixture[str]) -> None:
    assert authoring.main(["--check"]) == 0
    assert capsys.readouterr().out == "identical\n"


def test_check_finds_a_difference(tmp_path: Path) -> None:
    names = authoring.differing(tmp_path)
    assert "terminator/sphere.usda" in names
    for name in names:
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_bytes((CORPUS / name).read_bytes())
    assert authoring.differing(tmp_path) == []
    (tmp_path / names[0]).write_bytes(b"")
    assert authoring.differing(tmp_path) == [names[0]]


def test_every_corpus_file_has_a_script() -> None:
    found = {str(path.relative_to(CORPUS)) for kind in ("usda", "png") for path in CORPUS.glob(f"*/**/*.{kind}")}
    assert found == set(authoring.all_files())


@pytest.mark.parametrize("picture", [checker(), target()], ids=["checker", "target"])
def test_no_symmetry(picture: np.ndarray[Any, Any]) -> None:
    """The eight ways to place a square and the six orders of channels give 48 different pictures."""
    turns = [np.rot90(each, k) for each in (picture, picture[:, ::-1]) for k in range(4)]
    seen = {turn[:, :, list(order)].tobytes() for turn in turns for order in itertools.permutations(range(3))}
    assert len(seen) == 48


def test_png_reads_back(tmp_path: Path) -> None:
    pixels = np.random.default_rng(0).integers(0, 256, (160, 150, 3), np.uint8)  # more than one stored block
    path = tmp_path / "noise.png"
    path.write_bytes(png(pixels))
    picture = read_picture(path)
    np.testing.assert_array_equal(np.rint(picture.pixels * 255), pixels)
    assert (picture.channels, picture.quantum) == (3, 1 / 255)


@pytest.mark.parametrize(
    ("x", "text"), [(0.1, "0.1"), (-0.0, "0"), (1e-17, "0"), (1 / 3, "0.33333334"), (100.0, "100"), (-2.5, "-2.5")]
)
def test_numbers(x: float, text: str) -> None:
    assert number(x) == text
    assert np.float32(text) == np.float32(round(x, 8))


def test_long_arrays_are_broken() -> None:
    assert integers(range(3)) == "[0, 1, 2]"
    assert integers(range(30)).count("\n") == 3


def irradiance(light: Light, distance: float) -> float:
    return max(light.intensity) / (distance**2 if light.kind == "point" else 1.0)


@pytest.mark.parametrize("scene", ["terminator/sphere", "texture/uneven_quad", "calibration/card"])
def test_nothing_clips(scene: str) -> None:
    """16-bit pictures clip at 1: brightest albedo, nearest point, light face on stays below."""
    read = read_scene(scene)
    (light,) = read.lights
    for mesh in read.meshes:
        material = read.materials[mesh.material]
        albedo = read.textures[material.texture].pixels.max() if material.texture >= 0 else max(material.diffuse)
        distance = float(np.linalg.norm(mesh.points - light.position, axis=1).min())
        if mesh.path != "/Scene/Floor":  # its corners are not where the light falls steepest
            assert 0.5 < albedo * irradiance(light, distance) / np.pi < 0.95


CLOSED = {
    "lat_long": (lat_long(24, 12), 4 * np.pi / 3),
    "box": (box((-1.0, 0.0, -0.5), (1.0, 0.5, 0.5)), 1.0),
    "cylinder": (cylinder(48, 0.5, 2.0), 0.5 * np.pi),
    "slab": (slab(5, 1.0, 0.5), 2.0),
}


def volume(shape: Shape) -> float:
    """Signed, positive where faces are counter-clockwise seen from outside."""
    points = np.array(shape[0])
    return float(
        sum(
            np.linalg.det(points[[face[0], face[i], face[i + 1]]]) / 6
            for face in shape[1]
            for i in range(1, len(face) - 1)
        )
    )


@pytest.mark.parametrize("name", CLOSED)
def test_shapes_are_closed_and_face_outwards(name: str) -> None:
    shape, expected = CLOSED[name]
    edges = [(a, b) for face in shape[1] for a, b in zip(face, (*face[1:], face[0]), strict=True)]
    assert len(set(edges)) == len(edges)
    assert {(b, a) for a, b in edges} == set(edges)
    assert volume(shape) == pytest.approx(
        expected, rel=0.01 if name == "cylinder" else 0.08 if name == "lat_long" else 1e-12
    )
    if name == "lat_long":
        assert volume(shape) < 4 * np.pi / 3


def test_bowl_faces_its_centre() -> None:
    points, faces = bowl(24, 12)
    assert max(y for _, y, _ in points) == pytest.approx(0.0, abs=1e-12)
    assert len(faces) == 24 * 11
    for face in faces:
        a, b, c = (np.array(points[corner]) for corner in face)
        assert np.cross(b - a, c - a) @ (a + b + c) < 0


def test_grid_faces_up() -> None:
    points, faces = grid(3, 2, 1.5, 1.0)
    areas = [np.cross(*(np.array(points[face[k]]) - points[face[0]] for k in (1, 2)))[1] / 2 for face in faces]
    assert min(areas) > 0
    assert sum(areas) == pytest.approx(6.0)


def test_own_shaders_have_a_fallback() -> None:
    """What another renderer sees of a notabug:Reflection material is a UsdPreviewSurface."""
    from pxr import Usd, UsdShade

    found = 0
    for each in scenes():
        stage = Usd.Stage.Open(str(each.path))
        for prim in stage.Traverse():
            material = UsdShade.Material(prim)
            if material and material.GetSurfaceOutput("notabug"):
                shader = material.ComputeSurfaceSource()[0]
                assert shader.GetShaderId() == "UsdPreviewSurface", prim.GetPath()
                found += 1
    assert found >= 9


@pytest.mark.parametrize("name", ["with_uv", "without_uv"])
def test_simplified_meshes(name: str) -> None:
    """FACES triangles over the same square, with points of the relief itself."""
    points, uv, faces = read_obj(MESHES / f"simplified_{name}.obj")
    assert len(faces) == FACES
    assert len(uv) == len(points)
    assert volume(([(x, 0.0, z) for x, _, z in points], faces)) == pytest.approx(0.0)
    plan = [
        np.cross(*(np.array(points[face[k]])[[2, 0]] - np.array(points[face[0]])[[2, 0]] for k in (1, 2)))
        for face in faces
    ]
    assert sum(plan) / 2 == pytest.approx(4.0, rel=1e-5)
    for x, y, z in points:
        assert y == pytest.approx(height(x, z), abs=1e-6)
        assert (x + 1) * CELLS / 2 == pytest.approx(round((x + 1) * CELLS / 2), abs=1e-4)


@pytest.mark.skipif(importlib.util.find_spec("pymeshlab") is None, reason="pip install 'notabug[mesh]'")
def test_simplifying_again_is_identical(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(simplify, "MESHES", tmp_path)
    assert simplify.main() == 0
    for path in tmp_path.iterdir():
        again, stored = (read_obj(each) for each in (path, MESHES / path.name))
        assert again[2] == stored[2], "another version of pymeshlab may collapse other edges: look before checking in"
        np.testing.assert_allclose(again[0], stored[0], atol=1e-6)


def test_without_pymeshlab_the_meshes_stay(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(simplify, "MESHES", tmp_path)
    monkeypatch.setattr(simplify, "PROGRAM", "import pymeshlab_that_is_not_there")
    assert simplify.main() == 1
    assert "kept as it is" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())
