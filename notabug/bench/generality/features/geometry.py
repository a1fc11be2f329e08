"""Geometry of exports as text: cages of subdivision surfaces, subsets, instances, and the solids that UsdGeom has."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from notabug.bench.generality.features.decks import Features
from notabug.bench.generality.placing import Place
from notabug.bench.generality.shapes import SHAPES, Floats, Shape
from notabug.scenes_usd.authoring.usda import block, integers, number, vector, vectors

BOUND = ' (\n    prepend apiSchemas = ["MaterialBindingAPI"]\n)'
SOLIDS = ("Cube", "Sphere", "Cylinder", "Cone", "Capsule", "Plane")
REACH = np.array([[x, y, z] for x in (-1.2, 1.2) for y in (-1.2, 1.2) for z in (-1.2, 1.2)])  # of a solid, about


def bound(material: str) -> str:
    return f"rel material:binding = </Export/Looks/{material}>"


def mesh_lines(rng: np.random.Generator, what: Features, kind: str, shape: Shape, *, uv: bool) -> list[str]:
    """The lines of a mesh that is ``shape``; ``kind`` is a card of the deck of geometry."""
    corners = shape.corners
    lines = [
        f"int[] faceVertexCounts = {integers(len(face) for face in shape.faces)}",
        f"int[] faceVertexIndices = {integers(corners)}",
        f"point3f[] points = {vectors(shape.points.tolist())}",
    ]
    if kind in ("catmullClark", "creased"):
        if rng.uniform() < 0.5:  # what a file does not say is catmullClark
            lines.append('uniform token subdivisionScheme = "catmullClark"')
        lines.append(f'uniform token interpolateBoundary = "{rng.choice(["edgeAndCorner", "edgeOnly"])}"')
        if kind == "creased":
            lines += _creases(rng, shape)
    else:
        scheme = kind if kind in ("loop", "bilinear") else "none"
        lines.append(f'uniform token subdivisionScheme = "{scheme}"')
        if scheme == "none" and rng.uniform() < 0.7:
            lines.append(_primvar("normal3f[] primvars:normals", shape.normals, "faceVarying"))
    if rng.uniform() < 0.2:
        lines.append("uniform bool doubleSided = 1")
    if uv:
        distinct, indices = np.unique(shape.uv, axis=0, return_inverse=True)
        lines.append(_primvar(f"texCoord2f[] primvars:{what.coordinates}", distinct, "faceVarying"))
        lines.append(f"int[] primvars:{what.coordinates}:indices = {integers(indices.ravel())}")
    return lines


def drawn_shape(rng: np.random.Generator, kind: str) -> Shape:
    """A random shape whose faces suit ``kind``: quads of a cage, triangles for Loop, any for a plain mesh."""
    if kind in ("catmullClark", "creased"):
        return SHAPES[str(rng.choice(["box", "torus", "extrusion", "sheet"]))](rng, str(rng.choice(["quads", "ngons"])))
    if kind == "loop":
        return SHAPES[str(rng.choice(["box", "torus", "ball"]))](rng, "triangles")
    if kind == "bilinear":
        return SHAPES[str(rng.choice(["box", "torus", "sheet"]))](rng, "quads")
    return SHAPES[str(rng.choice(sorted(SHAPES)))](rng, str(rng.choice(["triangles", "quads", "ngons"])))


def thing(
    rng: np.random.Generator,
    what: Features,
    name: str,
    kind: str,
    place: Place,
    material: str,
    second: str,
    *,
    uv: bool,
) -> tuple[list[str], Floats]:
    """The prims of one thing of ``kind``, and the corners (n, 3) of its bounds in the world."""
    matrix = place.matrix
    if kind == "solid":
        solid = str(rng.choice(SOLIDS))
        text = block(f'def {solid} "{name}"{BOUND}', "\n".join([*_solid(rng, solid), bound(material), place.whole()]))
        return [text], REACH @ matrix[:3, :3] + matrix[3, :3]
    shape = drawn_shape(rng, kind)
    world = shape.points @ matrix[:3, :3] + matrix[3, :3]
    lines = mesh_lines(rng, what, kind, shape, uv=uv)
    if kind == "subsets":
        cut = max(1, len(shape.faces) // 2)
        parts = [np.arange(cut), np.arange(cut, len(shape.faces))]
        subsets = [
            block(
                f'def GeomSubset "part{k}"{BOUND}',
                'uniform token elementType = "face"\nuniform token familyName = "materialBind"\n'
                f"int[] indices = {integers(faces)}\n{bound(look)}",
            )
            for k, (faces, look) in enumerate(zip(parts, (material, second), strict=True))
            if len(faces)
        ]
        return [
            block(f'def Mesh "{name}"{BOUND}', "\n".join([*lines, bound(material), place.whole()]), *subsets)
        ], world
    if kind in ("instancer", "instances"):
        prototype = block(f'def Mesh "Shape"{BOUND}', "\n".join([*lines, bound(material)]))
        return _copies(rng, name, kind, place, prototype, shape.points)
    if rng.uniform() < 0.5:
        return [block(f'def Mesh "{name}"{BOUND}', "\n".join([*lines, bound(material), place.whole()]))], world
    inner = block(f'def Mesh "{name}"{BOUND}', "\n".join([*lines, bound(material), place.own()]))
    return [block(f'def Xform "{name}Place"', place.parent(), inner)], world


def _copies(
    rng: np.random.Generator, name: str, kind: str, place: Place, prototype: str, points: Floats
) -> tuple[list[str], Floats]:
    """Two or three smaller copies of a prototype side by side, by a point instancer or as instances of a class."""
    count = int(rng.integers(2, 4))
    offsets = [np.array([1.3 * (k - (count - 1) / 2), 0.0, 0.0]) for k in range(count)]
    sizes = rng.uniform(0.35, 0.6, count)
    matrix = place.matrix
    world = np.concatenate(
        [(size * points + offset) @ matrix[:3, :3] + matrix[3, :3] for size, offset in zip(sizes, offsets, strict=True)]
    )
    if kind == "instancer":
        lines = [
            f"point3f[] positions = {vectors([offset.tolist() for offset in offsets])}",
            f"float3[] scales = {vectors([[size] * 3 for size in sizes.tolist()])}",
            f"int[] protoIndices = {integers([0] * count)}",
            f"rel prototypes = </Export/{name}/Prototypes/Shape>",
            place.whole(),
        ]
        return [
            block(f'def PointInstancer "{name}"', "\n".join(lines), block('def Scope "Prototypes"', prototype))
        ], world
    copies = [
        block(
            f'def Xform "Copy{k}" (\n    instanceable = true\n    prepend inherits = </Export/_{name}>\n)',
            f"double3 xformOp:translate = {vector(offset)}\n"
            f"float3 xformOp:scale = {vector([size] * 3)}\n"
            'uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:scale"]',
        )
        for k, (offset, size) in enumerate(zip(offsets, sizes.tolist(), strict=True))
    ]
    return [block(f'class Xform "_{name}"', prototype), block(f'def Xform "{name}"', place.whole(), *copies)], world


def _solid(rng: np.random.Generator, kind: str) -> list[str]:
    if kind == "Cube":
        return [f"double size = {number(float(rng.uniform(1.0, 1.8)))}"]
    if kind == "Sphere":
        return [f"double radius = {number(float(rng.uniform(0.6, 1.0)))}"]
    axis = f'uniform token axis = "{rng.choice(["X", "Y", "Z"])}"'
    if kind == "Plane":
        sides = [float(side) for side in rng.uniform(1.2, 2.2, 2)]
        return [axis, f"double width = {number(sides[0])}", f"double length = {number(sides[1])}"]
    height, radius = float(rng.uniform(0.6, 1.4)), float(rng.uniform(0.4, 0.7))
    if kind == "Capsule":
        height = height / 2
    return [axis, f"double height = {number(height)}", f"double radius = {number(radius)}"]


def _creases(rng: np.random.Generator, shape: Shape) -> list[str]:
    """A few edges of ``shape`` as creases, sharp for good or for some levels."""
    edges = sorted(
        {(min(a, b), max(a, b)) for face in shape.faces for a, b in zip(face, face[1:] + face[:1], strict=True)}
    )
    chosen = rng.permutation(len(edges))[: max(1, len(edges) // 4)]
    sharp = [float(rng.choice([0.7, 1.5, 2.0, 10.0])) for _ in chosen]
    return [
        f"int[] creaseIndices = {integers([point for k in chosen for point in edges[int(k)]])}",
        f"int[] creaseLengths = {integers([2] * len(chosen))}",
        f"float[] creaseSharpnesses = [{', '.join(number(value) for value in sharp)}]",
    ]


def _primvar(head: str, rows: Floats | Sequence[Sequence[float]], interpolation: str) -> str:
    return f'{head} = {vectors(np.asarray(rows).tolist())} (\n    interpolation = "{interpolation}"\n)'
