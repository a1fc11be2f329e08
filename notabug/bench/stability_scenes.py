"""The stages of the stability sweeps: small scenes, each a function of the one number that is swept.

Every stage is turned by a generic angle, so that no coordinate is exact by luck.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from notabug.scenes_usd.scene import Camera, Card, Floats, Light, Material, Mesh, Scene, Texture
from notabug.scenes_usd.transform import rotation, transformed, translation

SIDE = 96
TARGET = (0.0, 0.6, 0.0)
TOWARDS_EYE = (0.0, 0.6, 0.8)
HALF_WIDTH = 2.0  # of the picture, at the target
DISTANCE = 6.0  # from the target to the eye, unless it is swept
FACET = 0.5  # typical edge of the ball's facets and the block's
NEAR_GAP = 1e-3  # of the sheets under the near plane
STRIP = 0.5  # width of a sliver
CLEARANCE = 0.1  # of ball and block above the floor
_GENERIC = rotation((1.0, 2.0, -0.7), 33.0)
_CARD = Card("calibration", "A stability sweep's stage.")
_TEXELS = 64


def mesh(name: str, points: Floats, faces: Sequence[Sequence[int]], material: int, uv: Floats | None = None) -> Mesh:
    """A mesh of flat facets; ``uv`` (p, 2) per point."""
    corners = np.array([each for face in faces for each in face], np.int32)
    return Mesh(
        path=f"/Scene/{name}",
        points=np.ascontiguousarray(points, np.float64),
        counts=np.array([len(face) for face in faces], np.int32),
        corners=corners,
        material=material,
        uv=None if uv is None else np.ascontiguousarray(uv[corners]),
    )


def sheet(name: str, half: float, height: float, material: int, cells: int = 1) -> Mesh:
    """A horizontal square of cells x cells quads, facing up."""
    at = np.linspace(-half, half, cells + 1)
    points = np.array([(x, height, z) for z in at for x in at])
    row = cells + 1
    faces = [
        (j * row + i, (j + 1) * row + i, (j + 1) * row + i + 1, j * row + i + 1)
        for j in range(cells)
        for i in range(cells)
    ]
    return mesh(name, points, faces, material)


def ball(name: str, centre: tuple[float, float, float], radius: float, material: int) -> Mesh:
    """An icosahedron, each facet cut into four: 80 flat facets."""
    g = (1.0 + math.sqrt(5.0)) / 2.0
    points: list[tuple[float, float, float]] = [(-1, g, 0), (1, g, 0), (-1, -g, 0), (1, -g, 0), (0, -1, g), (0, 1, g)]
    points += [(0, -1, -g), (0, 1, -g), (g, 0, -1), (g, 0, 1), (-g, 0, -1), (-g, 0, 1)]
    faces = [(0, 11, 5), (0, 5, 1), (0, 1, 7), (0, 7, 10), (0, 10, 11), (1, 5, 9), (5, 11, 4), (11, 10, 2)]
    faces += [(10, 7, 6), (7, 1, 8), (3, 9, 4), (3, 4, 2), (3, 2, 6), (3, 6, 8), (3, 8, 9), (4, 9, 5), (2, 4, 11)]
    faces += [(6, 2, 10), (8, 6, 7), (9, 8, 1)]
    place = [np.asarray(point, np.float64) / math.hypot(1.0, g) for point in points]
    middle: dict[tuple[int, int], int] = {}

    def between(a: int, b: int) -> int:
        key = (min(a, b), max(a, b))
        if key not in middle:
            half = place[a] + place[b]
            place.append(half / np.linalg.norm(half))
            middle[key] = len(place) - 1
        return middle[key]

    cut = []
    for a, b, c in faces:
        ab, bc, ca = between(a, b), between(b, c), between(c, a)
        cut += [(a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca)]
    return mesh(name, np.array(place) * radius + np.asarray(centre), cut, material)


def block(name: str, centre: tuple[float, float, float], half: float, material: int) -> Mesh:
    points = np.array([(x, y, z) for x in (-half, half) for y in (-half, half) for z in (-half, half)])
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return mesh(name, points + np.asarray(centre), faces, material)


def camera(distance: float = DISTANCE, half_width: float = HALF_WIDTH, near: float | None = None) -> Camera:
    """Looking at the target from ``distance``; the picture is 2 ``half_width`` wide there at every distance."""
    z = np.asarray(TOWARDS_EYE)
    x = np.array([1.0, 0.0, 0.0])
    matrix = np.eye(4)
    matrix[0, :3], matrix[1, :3], matrix[2, :3] = x, np.cross(z, x), z
    matrix[3, :3] = np.asarray(TARGET) + distance * z
    tangent = half_width / distance
    return Camera("/Scene/Camera", matrix, tangent, tangent, near or distance / 10.0, distance * 10.0)


def lamp(position: tuple[float, float, float], irradiance: float) -> Light:
    """A point light that gives ``irradiance`` at the target, face on."""
    power = irradiance * float(((np.asarray(position) - np.asarray(TARGET)) ** 2).sum())
    return Light("/Scene/Light", "point", (power, power, power), position=position)


def lambert(name: str, *colour: float) -> Material:
    r, g, b = colour
    return Material(f"/Scene/Materials/{name}", (r, g, b))


_MATERIALS = (lambert("Grey", 0.5, 0.5, 0.5), lambert("Red", 0.7, 0.2, 0.15), lambert("Blue", 0.15, 0.3, 0.7))


def _scene(name: str, objects: tuple[Mesh, ...], light: Light, lens: Camera, **more: object) -> Scene:
    made = Scene(name, Path(f"{name}.usda"), {}, _CARD, lens, SIDE, SIDE, objects, (light,), _MATERIALS)
    return transformed(replace(made, **more), _GENERIC)  # type: ignore[arg-type]


def still_life(distance: float = DISTANCE) -> Scene:
    """A faceted ball and a block just above a floor, under a point light that throws their shadows into view."""
    objects = (
        sheet("Floor", 3.0, 0.0, 0, cells=4),
        ball("Ball", (-0.8, 0.7 + CLEARANCE, 0.0), 0.7, 1),
        block("Block", (0.9, 0.45 + CLEARANCE, 0.2), 0.45, 2),
    )
    return _scene("still_life", objects, lamp((2.4, 4.5, 1.6), 2.5), camera(distance))


def far_camera(distance: float) -> Scene:
    """The still life from ``distance``, through an ever longer lens."""
    return still_life(distance)


def offset(by: float) -> Scene:
    """The still life moved by about ``by`` along every axis."""
    return transformed(still_life(), translation(by, 0.8 * by, -0.7 * by))


def scaled(by: float) -> Scene:
    """The still life, ``by`` times as large: light, clipping planes and camera go along."""
    return transformed(still_life(), np.diag([by, by, by, 1.0]))


def low_light(degrees: float) -> Scene:
    """A floor of 8 x 8 facets under parallel light that comes in at ``degrees``, as bright on it at every angle."""
    angle = math.radians(degrees)
    direction = (-0.8 * math.cos(angle), -math.sin(angle), -0.6 * math.cos(angle))
    power = 1.5 / math.sin(angle)
    light = Light("/Scene/Light", "distant", (power, power, power), direction=direction)
    return _scene("low_light", (sheet("Floor", 4.0, 0.0, 0, cells=8),), light, camera())


def near_gap(gap: float) -> Scene:
    """A red sheet ``gap`` above a grey floor."""
    objects = (sheet("Floor", 3.0, 0.0, 0), _tilted("Sheet", gap))
    return _scene("near_gap", objects, lamp((2.4, 4.5, 1.6), 2.5), camera())


def near_plane(near: float) -> Scene:
    """A sheet a thousandth above a floor, with the near plane ``near`` from the eye."""
    objects = (sheet("Floor", 3.0, 0.0, 0), _tilted("Sheet", NEAR_GAP))
    return _scene("near_plane", objects, lamp((2.4, 4.5, 1.6), 2.5), camera(near=near))


def _tilted(name: str, height: float) -> Mesh:
    """A sheet whose triangles share no edge with the floor's."""
    flat = sheet(name, 1.1, height, 1)
    return replace(flat, points=flat.points @ rotation((0.0, 1.0, 0.0), 27.0)[:3, :3])


def slivers(aspect: float) -> Scene:
    """A floor of strips in three colours, each two triangles ``aspect`` times as long as wide."""
    width = STRIP
    length = width * aspect
    strips = []
    for colour in range(3):
        points: list[tuple[float, float, float]] = []
        faces: list[tuple[int, int, int]] = []
        for number in range(colour, 12, 3):
            x0, x1 = (number - 6) * width, (number - 5) * width
            base = len(points)
            points += [(x0, 0.0, length / 2), (x1, 0.0, length / 2), (x1, 0.0, -length / 2), (x0, 0.0, -length / 2)]
            faces += [(base, base + 1, base + 2), (base, base + 2, base + 3)]
        strips.append(mesh(f"Strips{colour}", np.array(points), faces, colour))
    turned = tuple(replace(strip, points=strip.points @ rotation((0, 1, 0), 19.0)[:3, :3]) for strip in strips)
    return _scene("slivers", turned, lamp((2.4, 4.5, 1.6), 2.5), camera())


def highlight(exponent: float) -> Scene:
    """The highlight on a floor; the picture narrows with it, so that its shape is the same for every exponent."""
    material = replace(_MATERIALS[0], diffuse=(0.1, 0.1, 0.1), specular=(0.6, 0.6, 0.6), exponent=exponent)
    half = 1.2 / math.sqrt(exponent)
    floor = sheet("Floor", 8.0, TARGET[1], 0)
    light = lamp((0.0, TARGET[1] + 0.6 * DISTANCE, -0.8 * DISTANCE), 2.0)  # the mirror image of the eye
    return _scene("highlight", (floor,), light, camera(half_width=half), materials=(material,))


def texture_far_out(magnitude: float) -> Scene:
    """A floor with a smooth repeating texture; whole numbers about ``magnitude`` are added to its uv."""
    at = (np.arange(_TEXELS) + 0.5) / _TEXELS * 2.0 * math.pi
    wave = 0.5 + 0.4 * np.sin(at)[:, None] * np.cos(at)[None, :]
    pixels = np.repeat(wave[:, :, None], 3, axis=2)
    flat = sheet("Floor", 3.0, 0.0, 0)
    shift = np.round(magnitude) if magnitude > 1.0 else 0.0
    uv = np.array([(0.0, 1.0), (0.0, 0.0), (1.0, 0.0), (1.0, 1.0)]) + np.array([shift, -shift])
    floor = replace(flat, uv=np.ascontiguousarray(uv))
    material = replace(_MATERIALS[0], texture=0, diffuse=(1.0, 1.0, 1.0))
    texture = Texture(Path("wave.exr"), np.ascontiguousarray(pixels))
    light = lamp((2.4, 4.5, 1.6), 2.5)
    return _scene("texture_far_out", (floor,), light, camera(), materials=(material,), textures=(texture,))


def headlit(scene: Scene) -> Scene:
    """``scene`` with a lamp at the eye in the place of its lights: no shadow can be seen, only what is there."""
    eye = scene.camera.to_world[3, :3]
    nearest = min(float(np.linalg.norm(each.points.mean(axis=0) - eye)) for each in scene.meshes)
    power = 2.0 * nearest**2
    x, y, z = eye.tolist()
    return replace(scene, lights=(Light("/Scene/Light", "point", (power, power, power), position=(x, y, z)),))
