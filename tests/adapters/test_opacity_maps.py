"""Opacity from a map, drawn by Mitsuba and Cycles, against the in-house tracer's; and what others say of it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from notabug.adapters.base import Quality, UnsupportedError
from notabug.adapters.export.description import describe
from notabug.adapters.inhouse import InHouse
from notabug.adapters.mitsuba import Mitsuba
from notabug.adapters.mitsuba_job import job
from notabug.adapters.povray import PovRay
from notabug.adapters.registry import adapters, needs
from notabug.adapters.textures import same_wraps
from notabug.references.tracer.envelope import trace_picture
from notabug.references.tracer.options import Options
from notabug.scenes_usd.scene import Material, Preview, Texture

LEAF = np.array([[0.1, 0.9, 0.3], [0.8, 0.6, 0.0], [0.2, 1.0, 0.7]])
UV = np.array([(0.1, 0.2), (0.9, 0.2), (0.9, 0.8), (0.1, 0.8)])
WORDS = {0.0: "opacity_map", 0.5: "cutout"}


def mask(values: Any = LEAF, wrap: Any = "clamp") -> Texture:
    return Texture(Path("leaf.exr"), np.repeat(np.asarray(values)[..., None], 3, axis=2), wrap, wrap)


def scene_of(stage: Any, cutoff: float, preview: Preview | None = None, **look: Any) -> Any:
    """A painted sheet with holes over a floor, under two lights, both seen from one side of it."""
    lights = [stage.point((2.0, -1.0, 5.0), (60.0, 50.0, 40.0)), stage.distant((1, -1, 2), (0.5, 0.5, 0.5))]
    floor = stage.quad(half=6.0, at=(0, 0, -1), uv=None)
    sheet = replace(stage.quad(half=1.6, at=(0, 0, 0.2), uv=UV), material=1, path="/Scene/Sheet")
    colours = Texture(Path("c.exr"), np.array([[(0.9, 0.2, 0.1), (0.1, 0.8, 0.2)], [(0.2, 0.1, 0.9), (0.9, 0.9, 0.1)]]))
    painted = Material("/Scene/Leaf", (1.0,) * 3, 0, preview=preview, opacity_map=1, cutoff=cutoff, **look)
    looks = [stage.grey(), painted]
    pictures = [replace(colours, wrap_s="clamp", wrap_t="clamp"), mask()]
    return stage.scene([floor, sheet], lights, stage.camera((1, -4, 5)), looks, pictures)


def off(stage: Any, adapter: Any, scene: Any) -> Any:
    """The share of pixels whose difference from the in-house tracer's is more than float32 makes."""
    expected = trace_picture(scene, Options(shadows="facets", silhouette="flip"))
    picture = stage.draw(adapter, scene)
    assert expected.max() > 0.5
    return (np.abs(picture - expected) > 5e-4 + 1e-3 * expected).any(axis=2).mean()


EDGES = 0.01  # of the pixels, whose centre an edge of the sheet, its holes or their shadows passes through


@pytest.mark.parametrize("cutoff", WORDS)
@pytest.mark.parametrize("surface", [None, Preview(roughness=0.5)], ids=["matt", "glossy"])
def test_mitsuba(cutoff: float, surface: Preview | None, stage: Any, mitsuba: Any) -> None:
    scene = scene_of(stage, cutoff, surface)
    assert off(stage, mitsuba, scene) <= EDGES
    whole = replace(scene, materials=(scene.materials[0], replace(scene.materials[1], opacity_map=-1)))
    assert (np.abs(trace_picture(whole) - trace_picture(scene)) > 0.05).any(axis=2).mean() > 0.05


@pytest.mark.slow
@pytest.mark.parametrize("surface", [None, Preview(roughness=0.5)], ids=["matt", "glossy"])
def test_cycles_cuts(surface: Preview | None, stage: Any, cycles: Any) -> None:
    assert off(stage, cycles, scene_of(stage, 0.5, surface)) <= EDGES


@pytest.mark.slow
def test_cycles_fades(stage: Any, cycles: Any) -> None:
    """Which of the surface and what lies behind it a sample shows is random."""
    scene = scene_of(stage, 0.0)
    expected = trace_picture(scene, samples=64, seed=1)
    picture = stage.draw(cycles, scene, Quality(samples=256, seeds=(0,)))
    noise = np.abs(picture - expected)
    assert noise.mean() < 0.02 * expected.max()
    assert abs(picture.mean() / expected.mean() - 1.0) < 0.01


def test_a_threshold_as_large_as_the_map_leaves_it_whole(stage: Any, mitsuba: Any) -> None:
    scene = scene_of(stage, float(np.float32(128 / 255)))
    equal = replace(scene, textures=(scene.textures[0], mask([[128 / 255]])))
    whole = replace(equal, materials=(scene.materials[0], replace(scene.materials[1], opacity_map=-1, cutoff=0.0)))
    np.testing.assert_allclose(stage.draw(mitsuba, equal), stage.draw(mitsuba, whole), rtol=1e-4, atol=1e-6)


@pytest.mark.parametrize("cutoff", WORDS)
def test_who_draws_maps_of_opacity(cutoff: float, stage: Any, tmp_path: Path) -> None:
    scene = scene_of(stage, cutoff)
    assert needs(scene) & {"opacity", "opacity_map", "cutout"} == {WORDS[cutoff]}
    able = {name for name, adapter in adapters().items() if WORDS[cutoff] in adapter.capabilities}
    assert able == {"inhouse", "mitsuba", "cycles"}
    with pytest.raises(UnsupportedError, match=WORDS[cutoff]):
        PovRay().render(scene, tmp_path, Quality(samples=1))
    assert np.isfinite(stage.draw(InHouse(), scene)).all()


def test_mitsubas_own_mask_has_no_threshold(stage: Any, tmp_path: Path) -> None:
    with pytest.raises(UnsupportedError, match="no threshold"):
        Mitsuba(opacity="mask").render(scene_of(stage, 0.5), tmp_path, Quality(samples=1))
    document, _ = job(scene_of(stage, 0.0), Quality(samples=1), mask=True)
    assert document["looks"]["1"]["opacity_map"] == 1


@pytest.mark.parametrize("also", [{"mirror": (0.5,) * 3}, {"transmission": (0.5,) * 3, "ior": 1.2}])
def test_mitsuba_refuses_a_map_where_rays_go_on(also: dict[str, Any], stage: Any) -> None:
    with pytest.raises(UnsupportedError, match="a map of opacity on a surface that mirrors"):
        job(scene_of(stage, 0.5, **also), Quality(samples=16))


def test_scenes_say_it_only_where_there_is_one(stage: Any) -> None:
    floor, leaf = describe(scene_of(stage, 0.5))["materials"]  # type: ignore[misc]
    assert (leaf["opacity_map"], leaf["cutoff"]) == (1, 0.5)
    assert not {"opacity_map", "cutoff"} & set(floor)


def test_a_map_that_is_repeated_for_its_border_moves_its_mesh(stage: Any) -> None:
    """Of a renderer with one wrap mode for both axes, as the texture of a colour does."""
    scene = scene_of(stage, 0.5)
    mixed = replace(mask(), wrap_s="repeat")
    alone = replace(scene.materials[1], texture=-1, diffuse=(0.5,) * 3, opacity_map=1)
    scene = replace(scene, materials=(scene.materials[0], alone), textures=(scene.textures[0], mixed))
    beyond = replace(scene.objects[1], uv=scene.objects[1].uv * 2.0 - 0.5)
    scene = replace(scene, objects=(scene.objects[0], beyond))
    moved = same_wraps(scene)
    assert moved.textures[1].wrap_s == moved.textures[1].wrap_t == "repeat"
    np.testing.assert_allclose(trace_picture(moved), trace_picture(scene), atol=1e-9)
