"""Scenes that are not in the corpus, as a team would bring them: no renderer that is sound is said to have a bug."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from notabug.adapters.base import Adapter, Quality
from notabug.adapters.inhouse import InHouse
from notabug.scenes_usd.authoring.png import png
from notabug.scenes_usd.authoring.shapes import Shape, box, cylinder
from notabug.scenes_usd.authoring.stage import (
    camera,
    distant_light,
    lambert,
    looking,
    materials,
    mesh,
    placed,
    point_light,
    stage,
    textured,
)
from notabug.scenes_usd.authoring.usda import block, vectors
from notabug.scenes_usd.reader import read_scene
from notabug.scenes_usd.scene import Scene

SIZE = (112, 112)
EYE = (0.0, 3.0, 6.5)
CAMERA = camera(EYE, looking((0.0, -3.0, -6.5)), 0.3, (0.1, 100.0))
SUN = distant_light(looking((-1.0, -0.9, -0.55)), 3.0)
CLAY = lambert("Clay", (0.65, 0.55, 0.45))
GREY = lambert("Grey", (0.5, 0.5, 0.5))
FLOOR = mesh("Floor", [(-6, 0, 6), (6, 0, 6), (6, 0, -9), (-6, 0, -9)], [(0, 1, 2, 3)], material="Grey")
OUTSIDE: dict[str, Callable[[], list[str]]] = {}
QUALITY = Quality()


def outside(make: Callable[[], list[str]]) -> Callable[[], list[str]]:
    """Registers a scene under its function's name."""
    OUTSIDE[make.__name__] = make
    return make


def wound(rings: list[list[tuple[float, ...]]], closed: bool) -> Shape:
    """A surface of quads between ``rings`` of as many points each; ``closed``: the last ring joins the first."""
    n = len(rings[0])
    last = len(rings) if closed else len(rings) - 1
    corners = [(j, i, (j + 1) % len(rings), (i + 1) % n) for j in range(last) for i in range(n)]
    faces: list[tuple[int, ...]] = [(j * n + i, k * n + i, k * n + h, j * n + h) for j, i, k, h in corners]
    return [point for ring in rings for point in ring], faces


def torus(n: int, m: int) -> tuple[Shape, list[tuple[float, ...]]]:
    """Radii .8 and .33 about z, with its normals; ``n`` facets around, ``m`` about the tube."""
    rings, normals = [], []
    for j in range(n):
        a = 2 * math.pi * j / n
        tube = [2 * math.pi * i / m for i in range(m)]
        rings.append(
            [((0.8 + 0.33 * math.cos(b)) * math.cos(a), (0.8 + 0.33 * math.cos(b)) * math.sin(a), 0.33 * math.sin(b))
             for b in tube]
        )  # fmt: skip
        normals += [(math.cos(b) * math.cos(a), math.cos(b) * math.sin(a), math.sin(b)) for b in tube]
    return wound(rings, closed=True), normals


def capsule(n: int, m: int) -> tuple[Shape, list[tuple[float, ...]]]:
    """Radius .45, 1.9 high, upright, cut off just before the poles, with its normals."""
    rings, normals = [], []
    for j in range(2 * m):
        theta = math.pi * (0.02 + 0.96 * (j if j < m else j - 1) / (2 * m - 2))
        lift = 0.5 if j < m else -0.5
        turns = [2 * math.pi * i / n for i in range(n)]
        ring = [(math.sin(theta) * math.sin(a), math.cos(theta), math.sin(theta) * math.cos(a)) for a in turns]
        rings.append([(0.45 * x, 0.45 * y + lift, 0.45 * z) for x, y, z in ring])
        normals += ring
    return wound(rings, closed=False), normals


@outside
def torus_and_capsule() -> list[str]:
    ring, ring_normals = torus(28, 14)
    pill, pill_normals = capsule(20, 6)
    return [
        *(SUN, materials(CLAY, GREY), FLOOR),
        block('def Xform "Ring"', placed((-0.9, 1.2, 0.2), (20.0, 25.0, 0.0)),
              mesh("Mesh", *ring, normals=ring_normals, material="Clay")),
        block('def Xform "Pill"', placed((1.1, 1.0, -0.3), (0.0, 0.0, -12.0)),
              mesh("Mesh", *pill, normals=pill_normals, material="Clay")),
    ]  # fmt: skip


def drum(name: str = "Mesh") -> str:
    """A cylinder whose side is smooth and whose ends are flat: normals by face corner."""
    n = 20
    points, faces = cylinder(n, 0.7, 1.3)
    smooth = [(x / 0.7, 0.0, z / 0.7) for x, _, z in points]
    ends = {n: (0.0, -1.0, 0.0), n + 1: (0.0, 1.0, 0.0)}
    normals = [ends.get(f, smooth[corner]) for f, face in enumerate(faces) for corner in face]
    line = f'normal3f[] primvars:normals = {vectors(normals)} (\n    interpolation = "faceVarying"\n)'
    return mesh(name, points, faces, material="Clay", lines=(line,))


@outside
def cylinder_by_face_corner() -> list[str]:
    body = block('def Xform "Drum"', placed((0.1, 0.6, 0.0), (28.0, 0.0, 24.0)), drum())
    return [SUN, materials(CLAY, GREY), FLOOR, body]


@outside
def mirrored_and_stretched_instances() -> list[str]:
    """One drum, three times: as it is, mirrored in x, and drawn out along its own axes before it is turned."""

    def instance(name: str, x: float, scale: tuple[float, ...]) -> str:
        lines = (
            f"double3 xformOp:translate = ({x}, 0.75, 0)\n"
            "float3 xformOp:rotateXYZ = (30, 10, 24)\n"
            f"float3 xformOp:scale = ({', '.join(map(str, scale))})\n"
            'uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateXYZ", "xformOp:scale"]'
        )
        return block(f'def Xform "{name}" (\n    instanceable = true\n    references = </Scene/Drum>\n)', lines)

    return [
        *(SUN, materials(CLAY, GREY), FLOOR),
        block('class Xform "Drum"', drum()),
        instance("Plain", -1.25, (0.6, 0.6, 0.6)),
        instance("Mirrored", 0.1, (-0.6, 0.6, 0.6)),
        instance("Stretched", 1.3, (0.8, 0.5, 0.3)),
    ]


@outside
def two_coloured_lights() -> list[str]:
    ring, normals = torus(36, 18)
    second = point_light((3.0, 4.0, 1.0), 90.0).replace('"Light"', '"Second"')
    tint = "color3f inputs:color = ({})\n    float inputs:intensity"
    return [
        point_light((-3.5, 3.5, 2.0), 110.0).replace("float inputs:intensity", tint.format("1, 0.35, 0.2")),
        second.replace("float inputs:intensity", tint.format("0.2, 0.5, 1")),
        *(materials(CLAY, GREY), FLOOR),
        block('def Xform "Ring"', placed((0.0, 1.2, 0.0), (60.0, 15.0, 0.0)),
              mesh("Mesh", *ring, normals=normals, material="Clay")),
    ]  # fmt: skip


@outside
def uneven_photograph() -> list[str]:
    corners = [(-1.7, -1.0, 0.0), (1.5, -1.1, 0.0), (0.9, 0.7, 0.0), (-0.6, 1.1, 0.0)]
    uv = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]
    paper = mesh("Paper", corners, [(0, 1, 2, 3)], uv=uv, material="Photo")
    turned = block('def Xform "Wall"', placed((0.0, 0.4, 0.0), (-35.0, 15.0, 0.0)), paper)
    return [distant_light(looking((0.2, -0.5, -1.0)), 3.0), materials(textured("Photo", "photo.png")), turned]


@outside
def slab_on_a_floor() -> list[str]:
    body = mesh("Mesh", *box((-0.9, 0.0, -0.7), (0.9, 0.5, 0.7)), material="Smoke")
    slab = block('def Xform "Slab"', placed((0.0, 0.0, 0.2), (0.0, 22.0, 0.0)), body)
    return [SUN, materials(GREY, lambert("Smoke", (0.2, 0.3, 0.4), 0.5)), FLOOR, slab]


def photograph(side: int = 64) -> bytes:
    """Amplitudes fall as 1/f in three correlated channels, as in photographs (Field 1987)."""
    random = np.random.default_rng(1996)
    fx, fy = np.meshgrid(np.fft.fftfreq(side), np.fft.rfftfreq(side), indexing="ij")
    fall = 1.0 / np.maximum(np.hypot(fx, fy), 1.0 / side)
    layers = [np.fft.irfft2(fall * np.exp(2j * np.pi * random.random(fall.shape)), (side, side)) for _ in range(4)]
    pixels = np.stack([layers[0] + 0.3 * each for each in layers[1:]], axis=-1)
    low, high = pixels.min(), pixels.max()
    return png(np.round(20 + 215 * (pixels - low) / (high - low)).astype(np.uint8))


@pytest.fixture(scope="module")
def brought(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Scene]:
    """The scene of the given name, read from a file of its own."""
    folder = tmp_path_factory.mktemp("outside")
    (folder / "photo.png").write_bytes(photograph())
    found: dict[str, Scene] = {}

    def read(name: str) -> Scene:
        if name not in found:
            path = folder / f"{name}.usda"
            words = {"class": "terminator", "claim": "A team's own scene."}
            path.write_bytes(stage(words, [CAMERA, *OUTSIDE[name]()], size=SIZE))
            found[name] = read_scene(str(path))
        return found[name]

    return read


@pytest.fixture(params=["inhouse", "povray", "mitsuba"])
def renderer(request: pytest.FixtureRequest) -> Adapter:
    if request.param == "inhouse":
        return InHouse()
    found: Adapter = request.getfixturevalue(request.param)
    return found


@pytest.mark.parametrize("name", OUTSIDE)
@pytest.mark.sweep_except(
    "inhouse-torus_and_capsule",
    "inhouse-cylinder_by_face_corner",
    "inhouse-mirrored_and_stretched_instances",
    "inhouse-two_coloured_lights",
    "inhouse-uneven_photograph",
    "povray-cylinder_by_face_corner",
    "mitsuba-slab_on_a_floor",
)
def test_a_sound_renderer_has_no_bug(
    studio: Any, brought: Callable[[str], Scene], renderer: Adapter, name: str
) -> None:
    scene = brought(name)
    pictures = studio.draw(renderer, scene, QUALITY)
    verdict = studio.verdict(pictures, scene, renderer.declaration(QUALITY))
    assert verdict.word in ("pass", "limitation"), (verdict.message, verdict.findings)


@pytest.mark.parametrize("name", OUTSIDE)
def test_a_light_too_bright_is_a_bug_there_too(studio: Any, brought: Callable[[str], Scene], name: str) -> None:
    """The negative control: a fault that each of these scenes can show."""
    scene = brought(name)
    first, *others = scene.lights
    r, g, b = first.intensity
    lights = (replace(first, intensity=(1.03 * r, 1.03 * g, 1.03 * b)), *others)
    pictures = studio.draw(InHouse(), replace(scene, lights=lights), QUALITY)
    assert studio.verdict(pictures, scene, InHouse().declaration(QUALITY), naming=False).word == "bug"
