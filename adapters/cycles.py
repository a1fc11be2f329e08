"""Cycles, Blender's path tracer, through its Python module bpy (GPL), in an environment and a process of its own.

It draws direct light on Lambert surfaces and on UsdPreviewSurface. ``terminator_offset`` is Blender's own remedy for
facets that shadow each other: 0.1 where nobody changes it, 0 here, so that the limitation is seen that it hides.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from notabug.adapters.base import Declaration, Found, Quality, Render, UnsupportedError
from notabug.adapters.child_job import Edit, Script
from notabug.adapters.environment import environment_python, version_in
from notabug.adapters.registry import register
from notabug.adapters.requirements import check_supported
from notabug.adapters.spheres import centre_and_radius
from notabug.adapters.textures import same_wraps
from notabug.scenes_usd.scene import Camera, Emitter, Light, Scene

DEFAULT_SAMPLES = 16
LEAST_SIDE = 4  # pixels; Blender draws no fewer, whatever it is asked for
ON_A_LIGHT = 16  # samples for each that is asked for, where a light has a size: each looks at one place on it
_WIDEST = math.radians(60.0)  # half of a sun's angle: a far ball that is wider would reach into the scene
FARTHEST = 2e4  # radii of an exact sphere from the camera: at 1e4 Cycles' float32 hits are right, at 1e5 they are not
_SQUARE = 1e-6  # relative deviation from square pixels: one that float32 cannot show


@dataclass(frozen=True, slots=True)
class Cycles:
    """Cycles, by default 16 random samples a pixel under a box filter, for each seed; all seeds in one process.

    With ``samples`` 1 it draws pixel centres, once.

    Attributes
    ----------
    terminator_offset : Blender's ``shadow_terminator_geometry_offset``, of every object.
    bump_correction : Blender's ``use_bump_map_correction``, of every material: highlights of mapped normals are raised,
        and their diffuse light fades towards the surface's horizon.
    python : the interpreter that has bpy; by default that of ``notabug install cycles``, else this one.
    keep_jobs : keep the folder with the job of every picture.
    edit : what is done to the job before Cycles reads it; a fault to be detected, for tests.
    """

    name: str = "cycles"
    terminator_offset: float = 0.0
    bump_correction: bool = False
    python: str = ""
    keep_jobs: bool = False
    edit: Edit | None = None
    capabilities: frozenset[str] = frozenset(
        {"mesh", "sphere", "normals", "uv", "texture", "point_light", "distant_light", "opacity", "shadows"}
        | {"orthographic", "aperture_offset", "ggx", "dielectric", "emission", "normal_map"}
        | {"opacity_map", "cutout"}
        | {"sphere_light", "rect_light", "disk_light", "cylinder_light", "sun_light", "dome_light", "dome_texture"}
        | {"light_beam", "light_multipliers", "light_link"}
    )
    install: str = "notabug install cycles"

    def declaration(self, quality: Quality) -> Declaration:
        point = quality.samples == 1
        return Declaration(
            precision="float32",
            filter="point" if point else "box",
            radius=0.0 if point else 0.5,
            quantum=2.0**-24,
            relative_quantum=True,
            noisy=not point,
            samples=quality.samples or DEFAULT_SAMPLES,
            ngon_split="02",
            mapped_away="raised" if self.bump_correction else "keep",
            bump_light="softened_diffuse" if self.bump_correction else "cut",
            tangents="triangle",
            normal_level="127.5",
            coincident="unknown",
            opacity_shadow="attenuate",
            texture_filter="bilinear",
            opacity_filter="separate",
            masking="correlated",
            coordinates="float32",
        )

    def find(self) -> Found:
        python = self._python()
        return Found(f"bpy {version_in(python, 'bpy', where=self.name, install=self.install)}", python)

    def render(self, scene: Scene, out: Path, quality: Quality) -> tuple[Render, ...]:
        check_supported(self, scene)
        _check_pixels(self.name, scene.camera, scene.width / scene.height)
        if min(scene.width, scene.height) < LEAST_SIDE:
            raise UnsupportedError(
                "a picture that is too small",
                where=f"adapter {self.name!r}",
                expected=f"{LEAST_SIDE} pixels along each side, as Blender has them at least",
                got=f"{scene.width} x {scene.height}",
            )
        check_lights(scene, centres=quality.samples == 1)
        _check_spheres(scene)
        self.find()
        samples = quality.samples or DEFAULT_SAMPLES
        seeds = (quality.seeds or (0,))[: 1 if samples == 1 else None]
        script = Script(self.name, self._python(), "cycles_child.py", {}, self.keep_jobs, self.edit, served=True)
        settings = {
            "threads": quality.threads,
            "terminator_offset": self.terminator_offset,
            "bump_correction": self.bump_correction,
            "on_a_light": ON_A_LIGHT if any(light.emitter is not None for light in scene.lights) else 1,
        }
        return script.render(same_wraps(scene), out, quality, settings, "Cycles", samples=samples, seeds=seeds)

    def _python(self) -> str:
        return self.python or environment_python("cycles")


def _check_pixels(name: str, camera: Camera, aspect: float) -> None:
    if abs(camera.tan_y * aspect / camera.tan_x - 1.0) > _SQUARE:
        raise UnsupportedError(
            "pixels that are not square",
            where=f"adapter {name!r}",
            expected=f"an aperture {aspect:g} times as wide as high",
            got=f"{camera.tan_x / camera.tan_y:g}",
        )


def _check_spheres(scene: Scene) -> None:
    """Raise UnsupportedError for an ellipsoid, and for a sphere so far away that its surface is lost in rounding."""
    for shape in scene.spheres:
        centre, radius = centre_and_radius(shape)
        distance = float(np.linalg.norm(np.asarray(centre) - scene.camera.to_world[3, :3])) / max(radius, 1e-300)
        if distance > FARTHEST:
            raise UnsupportedError(
                "Cycles' point clouds lose the surface of a far sphere in rounding",
                where=shape.path,
                expected=f"at most {FARTHEST:g} radii from the camera",
                got=f"{distance:.3g}",
                do="make it a mesh",
            )


def check_lights(scene: Scene, *, centres: bool) -> None:
    """Raise UnsupportedError where Blender has no lamp for one of ``scene``'s lights."""
    sized = next((light for light in scene.lights if light.emitter is not None), None)
    if sized is not None and centres:
        raise UnsupportedError(
            "Cycles chooses at random where on a light a shadow ray goes",
            where=sized.path,
            expected="more than 1 sample per pixel for a light with a size",
            got="1",
            do="raise the samples",
        )
    for light in scene.lights:
        if light.emitter is not None:
            _check_shape(light, light.emitter)


def _check_shape(light: Light, emitter: Emitter) -> None:
    lengths = np.linalg.norm(emitter.axes, axis=1)
    cosines = np.abs(emitter.axes @ emitter.axes.T / np.outer(lengths, lengths) - np.eye(3))
    if light.kind == "sphere" and max(cosines.max(), np.ptp(lengths) / lengths.max()) > _SQUARE:
        raise _unlike(light, "a sphere under a similarity")
    if light.kind in ("rect", "disk") and cosines[0, 1] > _SQUARE:
        raise _unlike(light, "a width and a height at right angles")
    if light.kind == "sun" and emitter.half_angle > _WIDEST:
        raise _unlike(light, "an angle of at most 120 degrees")
    if light.kind == "dome" and light.is_linked:
        raise _unlike(light, "a dome that lights all: Blender links lights to objects, and its world to none")


def _unlike(light: Light, expected: str) -> UnsupportedError:
    return UnsupportedError(f"Blender has no such {light.kind} light", where=light.path, expected=expected)


register(Cycles())
