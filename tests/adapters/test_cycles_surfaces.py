"""What Cycles makes of UsdPreviewSurface and of UsdLux' lights, pixel by pixel against the in-house tracer."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from notabug.adapters.base import Quality, UnsupportedError
from notabug.adapters.cycles import Cycles, check_lights
from notabug.references.predict import predict
from notabug.references.tracer.envelope import trace_picture
from notabug.scenes_usd.scene import Emitter, Light, Material, Preview, Scene, Shaping, Sphere, Texture

ALBEDO = (0.8, 0.5, 0.1)
EXACT = 2e-3  # of a pixel's value: what float32 and Cycles' textures make; medians are below 1e-4
RANDOM = 0.02  # of a picture's mean, of 16 x 16 samples a pixel


def grey(values: Any) -> Any:
    return np.repeat(np.asarray(values, float)[..., None], 3, axis=2)


TEXTURES = (
    Texture(Path("m.exr"), grey([[0.0, 1.0]])),
    Texture(Path("r.exr"), grey([[0.4], [0.8], [0.6]])),
    Texture(
        Path("n.exr"),
        np.array([[(0.3, 0.1, 0.9), (-0.2, 0.4, 0.8)], [(0.0, -0.5, 0.7), (0.1, 0.2, 1.0)], [(0, 0, 1)] * 2]),
    ),
)
SURFACES = {
    "metal": Preview(metallic=1.0, roughness=0.35),
    "dielectric": Preview(roughness=0.5, ior=1.7),
    "between": Preview(metallic=0.4, roughness=0.3),
    "specular": Preview(specular_workflow=True, specular=(0.2, 0.4, 0.6), roughness=0.6),
    "clearcoat": Preview(roughness=0.7, clearcoat=0.8, clearcoat_roughness=0.3),
    "maps": Preview(metallic_map=0, roughness_map=1),
    "normals": Preview(roughness=0.5, normal_map=2),
    "emission": Preview(roughness=0.6, emission=(0.2, 0.05, 0.7)),
    "emission map": Preview(roughness=0.6, emission_map=1),
}


def scene_of(stage: Any, surface: Preview | None, lights: Any = None, *, ball: bool = False, side: int = 24) -> Scene:
    """A floor, or a floor with an exact ball, under two lights without a size."""
    lights = lights or [stage.point((2.0, 1.0, 4.0), (60.0, 50.0, 40.0)), stage.distant((-1, -1, 2), (0.5, 0.5, 0.5))]
    uv = np.array([(0.0, 0.0), (3.0, 0.0), (3.0, 3.0), (0.0, 3.0)])
    floor = stage.quad(half=4.0, at=(0, 0, -1), uv=uv)
    objects = [floor, Sphere("/Scene/Ball", 1.0, 0, np.eye(4))] if ball else [floor]
    made: Scene = stage.scene(
        objects, lights, stage.camera((1, -4, 3)), [Material("/Scene/Look", ALBEDO, preview=surface)], TEXTURES,
        size=(side, side),
    )  # fmt: skip
    return made


def correlated(scene: Scene) -> Scene:
    """With the masking that Cycles has."""
    return replace(
        scene,
        materials=tuple(
            each if each.preview is None else replace(each, preview=replace(each.preview, masking="correlated"))
            for each in scene.materials
        ),
    )


def off(got: Any, expected: Any) -> Any:
    """By how much of their value the pixels of ``got`` differ, (h, w)."""
    return (np.abs(got - expected) / np.maximum(expected, 0.02 * expected.max())).max(axis=2)


@pytest.mark.slow
@pytest.mark.parametrize("name", SURFACES)
@pytest.mark.sweep_except("between", "clearcoat", "normals")
def test_a_preview_surface_term_by_term(name: str, stage: Any, cycles: Cycles) -> None:
    scene = correlated(scene_of(stage, SURFACES[name]))
    expected, picture = trace_picture(scene), stage.draw(cycles, scene)
    assert expected.max() > 0.3
    assert off(picture, expected).max() < EXACT
    assert np.median(off(picture, expected)) < EXACT / 10.0
    assert off(trace_picture(replace(scene, materials=(Material("/L", ALBEDO),))), expected).max() > 20.0 * EXACT


@pytest.mark.slow
def test_a_sphere_is_exact(stage: Any, cycles: Cycles) -> None:
    scene = correlated(scene_of(stage, SURFACES["dielectric"], ball=True, side=48))
    wrong = off(stage.draw(cycles, scene), trace_picture(scene)) > EXACT
    assert wrong.sum() <= 2, "the shadow's edge"


@pytest.mark.slow
@pytest.mark.parametrize("orthographic", [False, True])
@pytest.mark.sweep_except("True")
def test_a_camera_beside_its_axis(orthographic: bool, stage: Any, cycles: Cycles) -> None:
    scene = correlated(scene_of(stage, SURFACES["dielectric"], ball=True, side=48))
    tan = 2.0 if orthographic else scene.camera.tan_x
    camera = replace(scene.camera, orthographic=orthographic, tan_x=tan, tan_y=tan, shift_x=0.2, shift_y=-0.1)
    wide = replace(camera, tan_x=1.5 * tan)
    for moved in (replace(scene, camera=camera), replace(scene, camera=wide, width=72)):
        assert (off(stage.draw(cycles, moved), trace_picture(moved)) > EXACT).sum() <= 3


@pytest.mark.slow
def test_opacity_shares_a_surface_with_what_lies_behind(stage: Any, cycles: Cycles) -> None:
    scene = correlated(scene_of(stage, SURFACES["between"]))
    clear = replace(scene, materials=(replace(scene.materials[0], opacity=0.5),))
    picture = stage.draw(cycles, clear, Quality(samples=256, seeds=(0,)))
    assert abs(picture.mean() / (0.5 * trace_picture(scene).mean()) - 1.0) < RANDOM


SKY = Texture(
    Path("sky.exr"), np.random.default_rng(3).uniform(0.0, 1.0, (4, 8, 3)) * np.linspace(1.0, 0.2, 4)[:, None, None]
)
TURNED = np.array([[0.8, 0.6, 0.0], [0.0, 0.0, 1.0], [0.6, -0.8, 0.0]])
SLANTED = np.array([[1.0, 0.0, 0.0], [0.0, 0.6, -0.8], [0.0, 0.8, 0.6]])
DOWN = (-1.0 / 6.0**0.5, -1.0 / 6.0**0.5, -2.0 / 6.0**0.5)
BEAM = Shaping(cone=35.0, softness=0.5, focus=3.0, tint=(0.2, 0.0, 0.1))


def light(kind: Any, axes: Any = None, **more: Any) -> Light:
    shape = {name: more.pop(name) for name in ("half_angle", "texture") if name in more}
    emitter = Emitter(axes=np.asarray(np.diag([0.5] * 3) if axes is None else axes, float), **shape)
    said = {"intensity": (3.0, 2.0, 1.0), "position": (1.5, 1.0, 3.0), "direction": (0.0, 0.0, -1.0)} | more
    return Light("/Scene/Key", kind, emitter=emitter, **said)


LIGHTS = {
    "sphere": light("sphere"),
    "rect": light("rect", np.diag([0.8, 0.4, 1.0]) @ SLANTED, position=(0.5, -1.0, 3.0)),
    "ellipse": light("disk", np.diag([0.8, 0.4, 1.0]) @ SLANTED, position=(0.5, -1.0, 3.0)),
    "cylinder": light("cylinder", np.diag([0.8, 0.4, 0.4]) @ TURNED),
    "mirrored cylinder": light("cylinder", np.diag([-0.8, 0.4, 0.4]) @ TURNED),
    "thin cylinder": light("cylinder", np.diag([1.5, 0.004, 0.004]) @ TURNED, intensity=(300.0, 200.0, 100.0)),
    "thin rect": light(
        "rect", np.diag([1.5, 4e-4, 1.0]) @ SLANTED, position=(0.5, -1.0, 3.0), intensity=(900.0, 600.0, 300.0)
    ),
    "thin ellipse": light(
        "disk", np.diag([1.5, 4e-4, 1.0]) @ SLANTED, position=(0.5, -1.0, 3.0), intensity=(900.0, 600.0, 300.0)
    ),
    "sun": light("sun", half_angle=np.radians(3.0), direction=DOWN, intensity=(300.0, 200.0, 100.0)),
    "wide sun": light("sun", half_angle=np.radians(40.0), direction=DOWN),
    "dome": light("dome", np.eye(3)),
    "dome's picture": light("dome", TURNED, texture=SKY),
    "multipliers": light("sphere", diffuse=0.3, specular=2.0),
    "beam": light("sphere", position=(0.0, 0.0, 3.0), shaping=BEAM),
    "sharp beam": light("sphere", position=(0.0, 0.0, 3.0), shaping=Shaping(cone=35.0)),
    "linked": light("sphere", unlit=("/Scene/Ball",)),
    "shadow linked": light("sphere", unshadowing=("/Scene/Ball",)),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", LIGHTS)
@pytest.mark.sweep_except("ellipse", "thin cylinder", "dome's picture")
def test_a_light_with_a_size_sends_as_much_as_it_should(name: str, stage: Any, cycles: Cycles) -> None:
    """In every channel, in the whole picture and in each quarter of it."""
    scene = correlated(scene_of(stage, Preview(roughness=0.45), [LIGHTS[name]], ball=True))
    picture = stage.draw(cycles, scene, Quality(samples=16, seeds=(0, 1)))
    expected = predict(scene).mean
    for rows in (slice(0, 12), slice(12, 24)):
        for columns in (slice(0, 12), slice(12, 24)):
            got, meant = (each[rows, columns].mean(axis=(0, 1)) for each in (picture, expected))
            assert np.abs(got - meant).max() < RANDOM * expected.mean()


@pytest.mark.slow
@pytest.mark.parametrize(
    "lamp",
    [
        Light("/Scene/Key", "point", (30.0, 20.0, 10.0), (0.5, 0.0, 3.0), shaping=Shaping(cone=35.0, softness=0.5)),
        Light("/Scene/Key", "distant", (3.0, 2.0, 1.0), direction=DOWN, diffuse=0.3, specular=2.0),
        Light("/Scene/Key", "point", (30.0, 20.0, 10.0), (1.0, 1.0, 3.0), unlit=("/Scene/Ball",)),
    ],
    ids=["beam", "multipliers", "linked"],
)
@pytest.mark.sweep_except("multipliers")
def test_a_light_without_a_size_to_the_pixel(lamp: Light, stage: Any, cycles: Cycles) -> None:
    scene = correlated(scene_of(stage, SURFACES["dielectric"], [lamp], ball=True, side=32))
    expected = trace_picture(scene)
    assert off(trace_picture(replace(scene, lights=(Light("/K", lamp.kind, lamp.intensity, lamp.position,
                                                          lamp.direction),))), expected).max() > 0.1  # fmt: skip
    assert (off(stage.draw(cycles, scene), expected) > EXACT).sum() <= 3


@pytest.mark.parametrize(
    ("lamp", "expected"),
    [
        (light("sphere", np.diag([0.5, 0.5, 0.6])), "a sphere under a similarity"),
        (light("rect", np.array([[1.0, 0.0, 0.0], [0.5, 1.0, 0.0], [0.0, 0.0, 1.0]])), "at right angles"),
        (light("sun", half_angle=1.2), "120 degrees"),
        (light("dome", np.eye(3), unlit=("/Scene/Ball",)), "links lights to objects"),
    ],
)
def test_lights_that_blender_lacks_are_refused(lamp: Light, expected: str, stage: Any) -> None:
    scene = scene_of(stage, None, [lamp])
    with pytest.raises(UnsupportedError, match=expected):
        check_lights(scene, centres=False)


def test_a_sphere_too_far_away_is_refused(stage: Any, tmp_path: Path) -> None:
    scene = scene_of(stage, None, ball=True)
    far = replace(scene, camera=stage.camera((1e5, 0, 0)))
    with pytest.raises(UnsupportedError, match="radii from the camera"):
        Cycles().render(far, tmp_path, Quality(samples=1))


def test_one_sample_of_a_light_with_a_size_is_refused(stage: Any, tmp_path: Path) -> None:
    with pytest.raises(UnsupportedError, match="more than 1 sample"):
        Cycles().render(scene_of(stage, None, [LIGHTS["rect"]]), tmp_path, Quality(samples=1))
