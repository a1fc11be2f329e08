"""Mitsuba's own GGX against the in-house tracer's: ``roughconductor`` where it is all metal, else its D and G."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from notabug.adapters.base import Quality, UnsupportedError
from notabug.adapters.mitsuba_job import job
from notabug.adapters.povray import PovRay
from notabug.adapters.registry import needs
from notabug.references.tracer.envelope import trace_picture
from notabug.references.tracer.options import Options
from notabug.scenes_usd.scene import Material, Preview, Texture

ALBEDO = (0.8, 0.5, 0.1)
METAL = Preview(metallic=1.0, roughness=0.35)
MAPPED = Preview(metallic_map=0, roughness_map=1)
OTHERS = {
    "dielectric": Preview(roughness=0.5, ior=1.7),
    "half metal": Preview(metallic=0.4, roughness=0.3),
    "specular": Preview(specular_workflow=True, specular=(0.2, 0.4, 0.6), roughness=0.6),
    "clearcoat": Preview(roughness=0.7, clearcoat=0.8, clearcoat_roughness=0.3),
    "mapped": MAPPED,
}


def scene_of(stage: Any, surface: Preview, **look: Any) -> Any:
    """A floor and a ball under two lights."""
    lights = [stage.point((2.0, 1.0, 4.0), (60.0, 50.0, 40.0)), stage.distant((-1, -1, 2), (0.5, 0.5, 0.5))]
    uv = np.array([(0.0, 0.0), (3.0, 0.0), (3.0, 3.0), (0.0, 3.0)])
    floor = stage.quad(half=4.0, at=(0, 0, -1), uv=uv)
    textures = [Texture(Path("m.exr"), grey([[0.0, 1.0]])), Texture(Path("r.exr"), grey([[0.4], [0.8], [0.6]]))]
    looks = [Material("/Scene/Look", ALBEDO, preview=surface, **look)]
    return stage.scene([stage.replace(stage.ball(), uv=None), floor], lights, stage.camera((1, -4, 3)), looks, textures)


def grey(values: Any) -> Any:
    return np.repeat(np.asarray(values, float)[..., None], 3, axis=2)


def differ(stage: Any, adapter: Any, scene: Any) -> Any:
    """The pixels whose relative difference from the in-house tracer's is more than float32 makes."""
    expected = trace_picture(scene, Options(shadows="facets", silhouette="flip"))
    picture = stage.draw(adapter, scene)
    assert expected.max() > 0.5
    return (np.abs(picture - expected) > 2e-5 + 2e-4 * expected).any(axis=2)


def test_metal_is_mitsubas_own_rough_conductor(stage: Any, mitsuba: Any) -> None:
    scene = scene_of(stage, METAL)
    document, _ = job(scene, Quality(samples=1))
    assert not document["looks"]["0"]["scripted"], "no line of it is ours"
    assert differ(stage, mitsuba, scene).sum() <= 8, "pixels through which an edge of a facet or of a shadow passes"
    twice = replace(scene, materials=(replace(scene.materials[0], preview=replace(METAL, roughness=0.35**2)),))
    assert (np.abs(stage.draw(mitsuba, twice) - stage.draw(mitsuba, scene)) > 0.05).any()


@pytest.mark.parametrize("name", OTHERS)
def test_the_other_surfaces_by_mitsubas_distribution(name: str, stage: Any, mitsuba: Any) -> None:
    scene = scene_of(stage, OTHERS[name])
    if name == "mapped":  # of the floor alone: the ball has no coordinates
        scene = replace(scene, objects=scene.objects[1:])
    assert differ(stage, mitsuba, scene).sum() <= 8


NORMALS = Texture(
    Path("n.exr"), np.array([[(0.3, 0.1, 0.9), (-0.2, 0.4, 0.8)], [(0.0, -0.5, 0.7), (0.1, 0.2, 1.0)], [(0, 0, 1)] * 2])
)
GLOWING = {
    "constant": Preview(metallic=1.0, roughness=0.4, emission=(0.2, 0.05, 0.7)),
    "a map": Preview(roughness=0.6, emission_map=1),
}


@pytest.mark.parametrize("name", GLOWING)
@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.sweep_except("False-constant", "True-a map")
def test_what_surfaces_emit(name: str, turned: bool, stage: Any, mitsuba: Any) -> None:
    """From both sides, and without light for others."""
    scene = scene_of(stage, GLOWING[name])
    scene = replace(scene, objects=scene.objects[1:]) if name == "a map" else scene
    if turned:  # the floor is seen from below
        scene = replace(scene, camera=stage.camera((1, -4, -4), (0, 0, -1)))
    assert differ(stage, mitsuba, scene).sum() <= 8
    dark = replace(scene, materials=(replace(scene.materials[0], preview=Preview(roughness=0.4)),))
    assert (stage.draw(mitsuba, scene) - stage.draw(mitsuba, dark)).max() > 0.1


@pytest.mark.parametrize("surface", [METAL, Preview(roughness=0.5)], ids=["metal", "dielectric"])
def test_normal_maps_are_mitsubas_own(surface: Preview, stage: Any, mitsuba: Any) -> None:
    scene = scene_of(stage, replace(surface, normal_map=2))
    scene = replace(scene, objects=scene.objects[1:], textures=(*scene.textures, NORMALS))
    assert differ(stage, mitsuba, scene).sum() <= 8
    plain = replace(scene, materials=(replace(scene.materials[0], preview=surface),))
    assert (np.abs(stage.draw(mitsuba, plain) - stage.draw(mitsuba, scene)) > 0.05).any()


def test_what_mitsuba_cannot_say_of_maps_is_refused(stage: Any) -> None:
    scene = scene_of(stage, Preview(normal_map=2))
    scene = replace(scene, objects=scene.objects[1:], textures=(*scene.textures, NORMALS))
    clear = replace(scene, materials=(replace(scene.materials[0], opacity=0.5),))
    with pytest.raises(UnsupportedError, match="lets no light through"):
        job(clear, Quality(samples=1))
    glowing = replace(clear, materials=(replace(clear.materials[0], preview=GLOWING["constant"]),))
    with pytest.raises(UnsupportedError, match="emit"):
        job(glowing, Quality(samples=1))


def test_what_a_renderer_lacks_is_said(stage: Any, tmp_path: Path) -> None:
    assert needs(scene_of(stage, METAL)) >= {"ggx"}
    assert not needs(scene_of(stage, METAL)) & {"dielectric", "emission", "normal_map"}
    whole = Preview(emission=(0.0, 0.1, 0.0), normal_map=0)
    assert needs(scene_of(stage, whole)) >= {"ggx", "dielectric", "emission", "normal_map", "uv", "texture"}
    with pytest.raises(UnsupportedError, match="needs ggx"):
        PovRay().render(scene_of(stage, METAL), tmp_path, Quality(samples=1))
