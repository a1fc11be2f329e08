"""Camera and light from the bounds of what is to be seen: for scenes about a mesh that came without either."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from notabug.scenes_usd.scene import Camera, Card, Floats, Light, Material, Mesh, Object, Scene, Texture

FILL = 0.85  # share of the half picture that the bounds reach at most
LIT = 3.0  # W/m^2 at the middle of the bounds: a white surface face on then has the radiance .95
NEAR, FAR = 0.01, 100.0  # clipping planes over the camera's distance
LIGHT_AWAY = 3.0  # distance of the light from the middle, over the bounds' half diagonal
CLAIM = "a mesh from elsewhere looks as the contract says"


def look_at(eye: Floats, target: Floats, up: Floats, roll: float = 0.0) -> Floats:
    """The (4, 4) matrix, row vectors, of a camera at ``eye`` that looks at ``target``, turned by ``roll`` degrees."""
    back = (eye - target) / np.linalg.norm(eye - target)
    right = np.cross(up, back)
    if np.linalg.norm(right) < 1e-6:  # straight from above or below: any direction is right
        right = np.cross(np.eye(3)[np.abs(back).argmin()], back)
    right /= np.linalg.norm(right)
    above = np.cross(back, right)
    cos, sin = math.cos(math.radians(roll)), math.sin(math.radians(roll))
    matrix = np.eye(4)
    matrix[:3, :3] = cos * right + sin * above, cos * above - sin * right, back
    matrix[3, :3] = eye
    return matrix


def direction(azimuth: float, elevation: float, up: str = "Y") -> Floats:
    """The unit vector at ``azimuth`` degrees round the axis ``up`` and ``elevation`` degrees above the level."""
    a, e = math.radians(azimuth), math.radians(elevation)
    x, y, z = math.cos(e) * math.sin(a), math.sin(e), math.cos(e) * math.cos(a)
    return np.array([x, y, z] if up == "Y" else [x, -z, y])


def fitting_distance(points: Floats, target: Floats, axes: Floats, tan_x: float, tan_y: float, fill: float) -> float:
    """How far from ``target`` a camera with the rows ``axes`` (right, up, back) sees all ``points`` (n, 3).

    They then reach at most ``fill`` of the way from the picture's middle to its border.
    """
    x, y, z = ((points - target) @ axes.T).T
    return float(max((z + np.abs(x) / (fill * tan_x)).max(), (z + np.abs(y) / (fill * tan_y)).max()))


def bounds_of(objects: Sequence[Object]) -> tuple[Floats, Floats]:
    """The lowest and the highest corner of the box round ``objects``, world space."""
    corners = []
    for shape in objects:
        if isinstance(shape, Mesh):
            corners.append(shape.points)
        else:
            reach = shape.radius * np.linalg.norm(shape.to_world[:3, :3], axis=0)
            corners.append(np.stack([shape.to_world[3, :3] - reach, shape.to_world[3, :3] + reach]))
    every = np.concatenate(corners)
    return every.min(axis=0), every.max(axis=0)


def camera_for(
    objects: Sequence[Object],
    width: int,
    height: int,
    *,
    azimuth: float = 30.0,
    elevation: float = 25.0,
    tangent: float = 0.4,
    up: str = "Y",
) -> Camera:
    """A camera that sees ``objects`` whole; ``tangent`` is that of half the angle of view along the width."""
    low, high = bounds_of(objects)
    middle, reach = (low + high) / 2.0, float(np.linalg.norm(high - low)) / 2.0 or 1.0
    tan_x, tan_y = tangent, tangent * height / width
    above = np.array([0.0, 1.0, 0.0] if up == "Y" else [0.0, 0.0, 1.0])
    towards = direction(azimuth, elevation, up)
    corners = np.array([[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])])
    axes = look_at(middle + towards, middle, above)[:3, :3]
    away = max(fitting_distance(corners, middle, axes, tan_x, tan_y, FILL), 1e-3 * reach)
    return Camera(
        path="/Scene/Camera",
        to_world=look_at(middle + away * towards, middle, above),
        tan_x=tan_x,
        tan_y=tan_y,
        near=NEAR * away,
        far=FAR * away,
    )


def framed(
    objects: Sequence[Object],
    materials: Sequence[Material],
    textures: Sequence[Texture] = (),
    *,
    name: str = "mesh",
    size: tuple[int, int] = (96, 96),
    azimuth: float = 30.0,
    elevation: float = 25.0,
    tangent: float = 0.4,
    up: str = "Y",
) -> Scene:
    """A scene of ``objects`` with a camera that sees them whole, a point light beside the camera, and a card.

    ``tangent`` is that of half the angle of view along the picture's width.
    """
    low, high = bounds_of(objects)
    middle, reach = (low + high) / 2.0, float(np.linalg.norm(high - low)) / 2.0 or 1.0
    width, height = size
    camera = camera_for(objects, width, height, azimuth=azimuth, elevation=elevation, tangent=tangent, up=up)
    far = LIGHT_AWAY * reach
    x, y, z = (middle + far * direction(azimuth + 40.0, elevation + 25.0, up)).tolist()
    light = Light("/Scene/Light", "point", (LIT * far**2,) * 3, position=(x, y, z))
    return Scene(
        id=name,
        path=Path(f"{name}.usda"),
        variants={},
        card=Card("terminator", CLAIM),
        camera=camera,
        width=width,
        height=height,
        objects=tuple(objects),
        lights=(light,),
        materials=tuple(materials),
        textures=tuple(textures),
    )
