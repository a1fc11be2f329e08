"""Faults of the camera: field of view, aspect, position, near plane."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np

from notabug.references.models.model import Model, in_strengths
from notabug.scenes_usd.once import once
from notabug.scenes_usd.scene import Camera, Floats, Scene

_USD = "UsdGeomCamera: apertures, focalLength, clippingRange; UsdRenderSettings: aspectRatioConformPolicy"
HALF_SLACK = (
    0.06  # pixels: a shift this near to half a pixel is called half a pixel; aliased edges are off by up to .05
)


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
    size = _size(scene)

    def jointly(shares: Floats) -> Model:
        x, y, z = shares
        claim = f"the camera is off by ({x:.3g}, {y:.3g}, {z:.3g}) of the scene's size along its own axes"
        return _fault("camera_moved", claim, _moved(shares * size))

    for axis in range(3):
        model = in_strengths(
            lambda strength, axis=axis: _fault(  # type: ignore[misc]
                "camera_moved",
                f"the camera is off along its {'xyz'[axis]} by {strength:.3g} of the scene's size",
                _moved(np.eye(3)[axis] * strength * size),
            ),
            0.01,
        )
        yield replace(model, jointly=jointly, axes=3)


def pixel_shift(scene_width: int, scene_height: int, right: float, down: float) -> Model:
    """The fault of rays that go beside their pixels, so that the picture is moved by pixels to the right and down.

    A shift moves all depths alike, a moved camera does not.
    """

    def change(camera: Camera) -> Camera:
        x, y = 2.0 * right / scene_width, 2.0 * down / scene_height
        return replace(camera, shift_x=camera.shift_x - x, shift_y=camera.shift_y + y)

    return replace(_fault("pixel_shift", shift_message(right, down), change), moves=(right, down))


def unlisted(scene: Scene) -> Iterator[Model]:
    """Faults that the judge makes at a strength that it has measured, and so finds in no list: a shift of the picture.

    They are made again by their strengths, as those that ``models`` lists.
    """

    def shift(strengths: Floats) -> Model:
        right, down = (float(strength) for strength in strengths)
        return pixel_shift(scene.width, scene.height, right, down)

    yield replace(shift(np.zeros(2)), jointly=shift, axes=2)


def shift_message(right: float, down: float) -> str:
    """What a shift of the whole picture by pixels means in words."""
    x, y = (round(each, 2) + 0.0 for each in (right, down))  # no negative zeros
    said = f"the picture is shifted by ({x:+.2f}, {y:+.2f}) pixels (right, down)"
    if any(on_half(each) and abs(each) > HALF_SLACK for each in (right, down)) and all(map(on_half, (right, down))):
        return f"{said}: rays through pixel corners, not centres"
    return said


def on_half(pixels: float) -> bool:
    """Whether a shift is 0 or half a pixel, as far as it can be measured."""
    return min(abs(abs(pixels) - 0.5), abs(pixels)) <= HALF_SLACK


def half_if_near(pixels: float) -> float:
    """A measured shift, or 0 or half a pixel where it cannot be told from that."""
    return round(2.0 * pixels) / 2.0 + 0.0 if on_half(pixels) else pixels


def _fault(name: str, claim: str, change: Callable[[Camera], Camera]) -> Model:
    return Model(
        name=name,
        kind="fault",
        claim=claim,
        cites=_USD,
        edit=lambda scene: replace(scene, camera=change(scene.camera)),
    )


@once
def _size(scene: Scene) -> float:
    """The width of what the camera sees of the objects' middle."""
    points = [mesh.points.mean(axis=0) for mesh in scene.meshes] + [sphere.to_world[3, :3] for sphere in scene.spheres]
    middle = np.mean(points, axis=0) if points else np.zeros(3)
    away = float(np.linalg.norm(middle - scene.camera.to_world[3, :3]))
    return float(2.0 * scene.camera.tan_x * scene.camera.spans(away))


def _moved(step: Floats) -> Callable[[Camera], Camera]:
    """A camera moved by ``step`` (3,) along its own axes."""

    def change(camera: Camera) -> Camera:
        matrix = camera.to_world.copy()
        matrix[3, :3] += step @ matrix[:3, :3]
        return replace(camera, to_world=matrix)

    return change
