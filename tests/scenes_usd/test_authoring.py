"""The corpus is what its scripts write, and its pictures have no symmetry that a fault could hide behind."""

from __future__ import annotations

import itertools
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from notabug.scenes_usd.authoring import __main__ as authoring
from notabug.scenes_usd.authoring.calibration_card import target
from notabug.scenes_usd.authoring.png import png
from notabug.scenes_usd.authoring.texture_uneven_quad import checker
from notabug.scenes_usd.authoring.usda import integers, number
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
