"""Faults of the camera: field of view, aspect, position, near plane."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import lru_cache

import numpy as np

from notabug.references.models.model import Model, in_strengths
from notabug.scenes_usd.scene import Camera, Scene

_USD = "UsdGeomCamera: apertures, focalLength, clippingRange; UsdRenderSettings: aspectRatioConformPolicy"


def models(scene: Scene) -> Iterator[Model]:
    """Models of any scene."""
    yield in_strengths(
        lambda strength: _fault(
            "field_of_view",
            f"the field of view is {strength:.4g} times too wide",
            lambda each: replace(each, tan_x=each.tan_x * strength, tan_y=each.tan_y * strength),
        ),
        1.02,
        neutral=1.0,
    )
    for start in (1.02, 0.75, 4 / 3):  # from a slight one no step leads to that of another shape of picture
        yield in_strengths(
            lambda strength: _fault(
                "aspect",
                f"the picture is {strength:.4g} times too tall",
                lambda each: replace(each, tan_y=each.tan_y * strength),
            ),
            start,
            neutral=1.0,
        )
    if abs(scene.camera.tan_x / scene.camera.tan_y - 1.0) > 1e-3:
        ratio = scene.camera.tan_x / scene.camera.tan_y
        yield _fault(
            "field_of_view_axis",
            "the field of view is applied to the wrong axis",
            lambda each: replace(each, tan_x=each.tan_x * ratio, tan_y=each.tan_y * ratio),
        )
    for axis in range(3):
        yield in_strengths(
            lambda strength, axis=axis: _fault(  # type: ignore[misc]
                "camera_moved",
                f"the camera is off along its {'xyz'[axis]} by {strength:.3g} of the scene's size",
                _moved(axis, strength * _size(scene)),
            ),
            0.01,
        )


def _fault(name: str, claim: str, change: Callable[[Camera], Camera]) -> Model:
    return Model(
        name=name,
        kind="fault",
        claim=claim,
        cites=_USD,
        edit=lambda scene: replace(scene, camera=change(scene.camera)),
    )


@lru_cache(maxsize=4)
def _size(scene: Scene) -> float:
    """The width of what the camera sees of the objects' middle."""
    points = [each.points.mean(axis=0) for each in scene.meshes] + [each.to_world[3, :3] for each in scene.spheres]
    middle = np.mean(points, axis=0) if points else np.zeros(3)
    return float(2.0 * scene.camera.tan_x * np.linalg.norm(middle - scene.camera.to_world[3, :3]))


def _moved(axis: int, step: float) -> Callable[[Camera], Camera]:
    def change(camera: Camera) -> Camera:
        matrix = camera.to_world.copy()
        matrix[3, :3] += step * matrix[axis, :3]
        return replace(camera, to_world=matrix)

    return change
