"""What a light says of its shadow map: read, written, exported, and refused where it is no number that can be meant."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from notabug.adapters.export.description import describe
from notabug.scenes_usd.errors import NotabugError
from notabug.scenes_usd.reader import find, read_scene
from notabug.scenes_usd.scene import ShadowMap
from notabug.scenes_usd.writer import write_scene

VARIANTS = {"bias": ".3", "normal_bias": ".05", "resolution": "64"}


def changed(folder: Path, old: str, new: str) -> Path:
    text = find("shadow_map/box").read_text(encoding="utf-8")
    assert old in text
    path = folder / "own.usda"
    path.write_text(text.replace(old, new), encoding="utf-8")
    return path


def test_variants_are_the_numbers_that_they_are_called_by() -> None:
    (light,) = read_scene("shadow_map/box", VARIANTS).lights
    assert light.shadow_map == ShadowMap(64, pytest.approx(0.3), pytest.approx(0.05))  # type: ignore[arg-type]
    (point,) = read_scene("shadow_map/thin_wall").lights
    assert (point.kind, point.shadow_map) == ("point", ShadowMap(256, pytest.approx(0.2)))  # type: ignore[arg-type]


def test_it_comes_back_from_a_file_and_goes_into_an_export(tmp_path: Path) -> None:
    scene = read_scene("shadow_map/box", VARIANTS)
    again = read_scene(write_scene(scene, tmp_path / "again.usda"))
    assert again.lights[0].shadow_map == scene.lights[0].shadow_map
    (light,) = describe(scene)["lights"]
    said = {key: pytest.approx(x) for key, x in {"resolution": 64, "bias": 0.3, "normal_bias": 0.05}.items()}
    assert light["shadow_map"] == said
    plain = replace(scene, lights=(replace(scene.lights[0], shadow_map=None),))
    assert "shadow_map" not in describe(plain)["lights"][0]


def test_a_light_that_names_no_resolution_says_nothing(tmp_path: Path) -> None:
    path = changed(tmp_path, "custom int notabug:shadowMap:resolution", "custom int notabug:shadowMap:other")
    assert read_scene(path).lights[0].shadow_map is None


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("notabug:shadowMap:resolution = 256", "notabug:shadowMap:resolution = -1"),
        ("notabug:shadowMap:resolution = 256", "notabug:shadowMap:resolution = 1000000"),
        ("float notabug:shadowMap:bias = 0.03", "float notabug:shadowMap:bias = -0.03"),
        ("float notabug:shadowMap:bias = 0.03", 'string notabug:shadowMap:bias = "small"'),
        ("float notabug:shadowMap:normalBias = 0\n", "float notabug:shadowMap:normalBias = nan\n"),
    ],
)
def test_what_cannot_be_meant_is_refused_by_name(tmp_path: Path, old: str, new: str) -> None:
    with pytest.raises(NotabugError, match="notabug:shadowMap"):
        read_scene(changed(tmp_path, old, new))
