"""A random scene inside the contract, written as a .usda file: the same bytes for a seed and a number everywhere."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

import numpy as np

from notabug.bench.generality.decks import BENT_QUADS, Traits, generator, traits
from notabug.bench.generality.defects import with_defects
from notabug.bench.generality.looks import Look, colour, look, picture
from notabug.bench.generality.placing import Place, matrix_op, placed
from notabug.bench.generality.shapes import SHAPES, Floats, Shape, floor, sheet
from notabug.runs.folders import write_text
from notabug.scenes_usd.authoring.png import png
from notabug.scenes_usd.authoring.stage import APERTURE, materials, stage
from notabug.scenes_usd.authoring.usda import block, indent, integers, number, vector, vectors
from notabug.scenes_usd.framing import FAR, NEAR, direction, fitting_distance, look_at

LEAST, MOST = 48, 96  # pixels along the longer side
LIT = 3.6  # W/m^2 that all lights together give face on at the middle
APART = 2.1  # between the middles of things that stand side by side, whose sizes are about 1
CLOSED = ("box", "torus", "ball", "sphere", "capsule", "extrusion")
CLAIM = "a random scene of the generality bench looks as the contract says"


def write_random_scene(seed: int, index: int, folder: Path) -> Path:
    """Write scene ``index`` of ``seed`` and its textures into ``folder``; the path of the scene."""
    folder.mkdir(parents=True, exist_ok=True)
    rng, what = generator(seed, index), traits(seed, index)
    things, looks = _things(rng, what)
    for each in looks:
        if each.texture:
            (folder / each.texture).write_bytes(png(picture(rng)))
    size = _size(rng, what)
    eye = float(rng.uniform(0.0, 360.0))
    corners = np.concatenate([thing.corners for thing in things if not thing.ground])
    camera, middle, away = _camera(rng, corners, size, eye)
    lights = _lights(rng, what, middle, max(away / 2.0, 2.0), eye)
    turned = 'float xformOp:rotateX = 90\nuniform token[] xformOpOrder = ["xformOp:rotateX"]'
    world = block(
        'def Xform "World"', *([turned] if what.up == "Z" else []), camera, *lights, *(t.text for t in things)
    )
    text = stage(
        {"class": "terminator", "claim": CLAIM},
        [world, materials(*(each.text for each in looks))],
        size=size,
        up=what.up,
    ).decode()
    path = folder / f"random-{seed}-{index:04}.usda"
    write_text(path, text.replace("</Scene/Camera>", "</Scene/World/Camera>"))
    return path


class _Thing:
    """A drawn prim: its text, the corners of its bounds in the world, and whether it is the ground."""

    def __init__(self, text: str, corners: Floats, *, ground: bool = False) -> None:
        self.text, self.corners, self.ground = text, corners, ground


def _things(rng: np.random.Generator, what: Traits) -> tuple[list[_Thing], list[Look]]:
    things, looks = [], []
    count = int(what.objects)
    turn = float(rng.uniform(0.0, 2 * math.pi))
    for k in range(count):
        shape, kind, cells = what.shape, what.look, what.cells
        if k:  # the first is dealt, the others are drawn
            shape = str(rng.choice([*CLOSED, "sheet"]))
            kind = str(rng.choice(["lambert", "textured", "phong", "blinn", "mirror", "opacity"]))
            cells = str(rng.choice(["triangles", "quads", "ngons"]))
        if kind == "glass" and shape == "sheet":
            shape = "box"  # one sheet has no inside
        if kind == "textured" and shape == "sphere":
            kind = "phong"  # a sphere has no coordinates
        angle = turn + 2 * math.pi * k / max(count, 2)
        around = 0.0 if count == 1 else APART / 2 / math.sin(math.pi / max(count, 2))
        high = float(rng.uniform(1.0, 1.7))
        where = np.array([around * math.sin(angle), high, around * math.cos(angle)])
        looks.append(look(rng, f"Look{k}", kind, wrap=what.wrap, colours=what.colours, file=f"texture{k}.png"))
        place = placed(rng, what.transform, where, float(rng.uniform(0.6, 0.95)))
        things.append(
            _thing(rng, what, f"Thing{k}", shape, cells, place, textured=kind == "textured", degenerate=not k)
        )
    if what.floor != "none":
        kind = {"plain": "lambert", "textured": "textured", "shiny": str(rng.choice(["phong", "mirror"]))}[what.floor]
        looks.append(look(rng, "Ground", kind, wrap=what.wrap, colours=what.colours, file="ground.png"))
        half = rng.uniform(2.5, 4.0, 2)
        cells = "triangles" if what.cells == "triangles" else "quads"
        ground = floor(int(rng.integers(1, 5)), float(half[0]), float(half[1]), cells)
        points = np.asarray(ground.points, np.float32).astype(np.float64)
        text = _mesh(rng, "Ground", "Ground", ground, points, ground.normals, ground.faces, what.normals, kind, ())
        things.append(_Thing(text, points, ground=True))
    return things, looks


def _thing(
    rng: np.random.Generator,
    what: Traits,
    name: str,
    kind: str,
    cells: str,
    place: Place,
    *,
    textured: bool,
    degenerate: bool,
) -> _Thing:
    material = name.replace("Thing", "Look")
    matrix = place.matrix
    if kind == "sphere":
        reach = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
        how = what.placing if what.placing != "baked" else "matrix"
        lines = [f"rel material:binding = </Scene/Materials/{material}>", "double radius = 1"]
        return _Thing(_under(how, name, "Sphere", lines, place), reach @ matrix[:3, :3] + matrix[3, :3])
    shape = sheet(rng, cells, bent=BENT_QUADS) if kind == "sheet" else SHAPES[kind](rng, cells)
    if what.degenerate == "yes" and degenerate:
        shape = with_defects(rng, shape)
    world = shape.points @ matrix[:3, :3] + matrix[3, :3]
    look_of = "textured" if textured else "lambert"
    if what.placing != "baked":
        text = _mesh(rng, name, material, shape, shape.points, shape.normals, shape.faces, what.normals, look_of, ())
        lines = text.split("\n")[2:-1]
        return _Thing(_under(what.placing, name, "Mesh", [line[4:] for line in lines], place), world)
    normals = shape.normals @ np.linalg.inv(matrix[:3, :3]).T
    faces, extra = shape.faces, tuple[str, ...]()
    order = np.arange(len(normals))
    if np.linalg.det(matrix[:3, :3]) < 0:  # points that were mirrored are seen from behind: say so, or turn the faces
        if rng.uniform() < 0.5:
            extra = ('uniform token orientation = "leftHanded"',)
        else:
            starts = np.cumsum([0, *(len(face) for face in faces)])
            order = np.concatenate([order[a:b][::-1] for a, b in pairwise(starts)])
            faces = tuple(tuple(reversed(face)) for face in faces)
    turned = Shape(world, faces, normals[order], shape.uv[order], shape.closed)
    return _Thing(_mesh(rng, name, material, turned, world, turned.normals, faces, what.normals, look_of, extra), world)


def _under(how: str, name: str, kind: str, lines: Sequence[str], place: Place) -> str:
    """A prim with the ops of ``place``: all in one matrix, or stacked on those of a parent."""
    bound = ' (\n    prepend apiSchemas = ["MaterialBindingAPI"]\n)'
    if how == "matrix":
        return block(f'def {kind} "{name}"{bound}', "\n".join([*lines, place.whole()]))
    inner = block(f'def {kind} "{name}"{bound}', "\n".join([*lines, place.own()]))
    return block(f'def Xform "{name}Place"', place.parent(), inner)


def _mesh(
    rng: np.random.Generator,
    name: str,
    material: str,
    shape: Shape,
    points: Floats,
    normals: Floats,
    faces: Sequence[Sequence[int]],
    kind: str,
    look_of: str,
    extra: Sequence[str],
) -> str:
    corners = np.array([each for face in faces for each in face], np.int64)
    body = [
        f"rel material:binding = </Scene/Materials/{material}>",
        f"int[] faceVertexCounts = {integers(len(face) for face in faces)}",
        f"int[] faceVertexIndices = {integers(corners)}",
        f"point3f[] points = {vectors(points.tolist())}",
        'uniform token subdivisionScheme = "none"',
        *extra,
    ]
    if kind == "vertex":
        sums = np.zeros_like(points)
        np.add.at(sums, corners, normals / np.linalg.norm(normals, axis=1, keepdims=True))
        lengths = np.linalg.norm(sums, axis=1, keepdims=True)
        body.append(_primvar("normal3f[] normals", np.where(lengths > 1e-6, sums, [0.0, 1.0, 0.0]), "vertex"))
    elif kind == "faceVarying":
        own = "normal3f[] primvars:normals" if rng.uniform() < 0.3 else "normal3f[] normals"
        body.append(_primvar(own, normals, "faceVarying"))
    if look_of == "textured":
        tiles = round(float(rng.uniform(0.6, 2.5)), 3) if rng.uniform() < 0.5 else 1.0
        uv = shape.uv * tiles
        distinct, indices = np.unique(uv, axis=0, return_inverse=True)
        if rng.uniform() < 0.3:
            body.append(
                f"{_primvar('texCoord2f[] primvars:st', distinct, 'faceVarying')}\n"
                f"int[] primvars:st:indices = {integers(indices.ravel())}"
            )
        else:
            body.append(_primvar("texCoord2f[] primvars:st", uv, "faceVarying"))
    text = indent("\n".join(body))
    return f'def Mesh "{name}" (prepend apiSchemas = ["MaterialBindingAPI"])\n{{\n{text}\n}}'


def _primvar(head: str, rows: Floats, interpolation: str) -> str:
    lengths = np.linalg.norm(rows, axis=1, keepdims=True) if "normal" in head else 1.0
    return f'{head} = {vectors((rows / lengths).tolist())} (\n    interpolation = "{interpolation}"\n)'


def _size(rng: np.random.Generator, what: Traits) -> tuple[int, int]:
    longer = int(rng.integers(LEAST, MOST + 1))
    shorter = longer if what.frame == "square" else max(LEAST // 2, round(longer * float(rng.uniform(0.55, 0.9))))
    return (shorter, longer) if what.frame == "tall" else (longer, shorter)


def _camera(
    rng: np.random.Generator, corners: Floats, size: tuple[int, int], azimuth: float
) -> tuple[str, Floats, float]:
    """The camera's text, the middle of what it looks at, and its distance from there."""
    tan_x = float(rng.uniform(0.2, 0.7))
    tan_y = tan_x * size[1] / size[0]
    towards = direction(azimuth, float(rng.uniform(8.0, 60.0)))
    middle = (corners.min(axis=0) + corners.max(axis=0)) / 2
    up = np.array([0.0, 1.0, 0.0])
    axes = look_at(middle + towards, middle, up)[:3, :3]
    away = fitting_distance(corners, middle, axes, tan_x, tan_y, float(rng.uniform(0.7, 1.2)))
    roll = float(rng.uniform(-15.0, 15.0)) if rng.uniform() < 0.3 else 0.0
    matrix = look_at(middle + away * towards, middle, up, roll)
    text = (
        'def Camera "Camera"\n{\n'
        f"    float2 clippingRange = {vector((NEAR * away, FAR * away))}\n"
        f"    float focalLength = {number(APERTURE / (2 * tan_x))}\n"
        f"    float horizontalAperture = {number(APERTURE)}\n"
        f"    float verticalAperture = {number(APERTURE * size[1] / size[0])}\n"
        '    token projection = "perspective"\n'
        f"{indent(matrix_op(matrix))}\n"
        "}"
    )
    return text, middle, away


def _lights(rng: np.random.Generator, what: Traits, middle: Floats, near: float, eye: float) -> list[str]:
    kinds = {
        "point": ["point"],
        "distant": ["distant"],
        "two": ["point", "distant"],
        "three": ["point", "point", "distant"],
    }
    chosen = kinds[what.lights]
    made = []
    for k, kind in enumerate(chosen):
        side = eye + float(rng.uniform(-110.0, 110.0))  # not straight from behind: a black picture shows nothing
        towards = direction(side, float(rng.uniform(25.0, 80.0)))
        tint = colour(rng, 0.7, 1.0) if rng.uniform() < 0.4 else (1.0, 1.0, 1.0)
        power = LIT / len(chosen) * float(rng.uniform(0.7, 1.2))
        if kind == "point":
            away = near * float(rng.uniform(1.2, 3.0))
            lines = [
                f"color3f inputs:color = {vector(tint)}",
                f"float inputs:intensity = {number(4.0 * power * away**2)}",
                "bool inputs:normalize = 1",
                "bool treatAsPoint = 1",
                f"double3 xformOp:translate = {vector(middle + away * towards)}",
                'uniform token[] xformOpOrder = ["xformOp:translate"]',
            ]
            made.append(block(f'def SphereLight "Light{k}"', "\n".join(lines)))
        else:
            lines = [
                "float inputs:angle = 0",
                f"color3f inputs:color = {vector(tint)}",
                f"float inputs:intensity = {number(power)}",
                matrix_op(look_at(middle + towards, middle, np.array([0.0, 1.0, 0.0]))),
            ]
            made.append(block(f'def DistantLight "Light{k}"', "\n".join(lines)))
    return made
