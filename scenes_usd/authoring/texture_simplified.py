"""texture/simplified: a relief with a swirl in its texture, whole and with a sixth of its triangles.

The two simplified meshes lie beside the scene as .obj files that ``python -m notabug.scenes_usd.authoring.simplify``
made.
"""

from __future__ import annotations

import math
from pathlib import Path

from notabug.scenes_usd.authoring import stage as usd
from notabug.scenes_usd.authoring.shapes import Shape, grid
from notabug.scenes_usd.authoring.usda import block, indent

CARD = {
    "class": "texture",
    "claim": (
        "Where a surface is flat, taking triangles away changes nothing but the texture: simplified by its shape "
        "alone this relief loses the points that carry the swirl of its uv, and the pattern tears along the large "
        "triangles that are left; counting uv as a part of the shape keeps them with as few triangles."
    ),
    "figure": "texture section",
    "cites": "Woo, Pearce and Ouellette 1996; Garland and Heckbert 1998; Cignoni et al. 2008 (MeshLab)",
}

CELLS = 40
FACES = 500  # of 3,200
MESHES = Path(__file__).resolve().parent.parent / "texture" / "meshes"
HILL = (-0.42, -0.3, 0.12, 0.15)  # x, z, height, radius
SWIRL = (0.38, 0.2, 1.15, 0.42)  # x, z, radians at the centre, radius


def files() -> dict[str, bytes]:
    """The scene's files by their path below scenes_usd; the checker is perspective_floor's."""
    points, faces = relief()
    uv = [coordinates(x, z) for x, _, z in points]
    intent = _mesh("Intent", points, faces, uv, ['uniform token purpose = "guide"'])
    variants = {"full": _drawn(_mesh("Mesh", points, faces, uv))}
    for name in ("with_uv", "without_uv"):
        corners, wedges, triangles = read_obj(MESHES / f"simplified_{name}.obj")
        variants[name] = _standing_in(_drawn(_mesh("Mesh", corners, triangles, wedges)))
    parts = [
        usd.camera((0.15, 3.1, 2.6), usd.looking((-0.15, -3.1, -2.6)), 0.28, (0.1, 100.0)),
        usd.distant_light(usd.looking((0.45, -1.0, -0.2)), 3.2),
        usd.materials(usd.textured("Checker", "./textures/checker.png")),
        block('def Xform "Relief"', intent),
        usd.variant_set("simplified", variants),
    ]
    return {
        "texture/simplified.usda": usd.stage(
            CARD,
            parts,
            requires=("mesh", "normals", "texture", "uv", "distant_light"),
            metadata=usd.selected(simplified="without_uv"),
        )
    }


def height(x: float, z: float) -> float:
    """One round hill on a plain."""
    cx, cz, top, radius = HILL
    return top * math.exp(-((x - cx) ** 2 + (z - cz) ** 2) / (2 * radius**2))


def normal(x: float, z: float) -> usd.Row:
    """The upward unit normal of the relief."""
    cx, cz, _, radius = HILL
    slope = height(x, z) / radius**2
    n = (slope * (x - cx), 1.0, slope * (z - cz))
    length = math.sqrt(sum(each * each for each in n))
    return tuple(each / length for each in n)


def coordinates(x: float, z: float) -> usd.Row:
    """uv: the plan of the relief, turned about the swirl's centre by an angle that fades towards the edges."""
    cx, cz, turn, radius = SWIRL
    dx, dz = x - cx, z - cz
    fade = max(0.0, 1.0 - (dx * dx + dz * dz) / radius**2) ** 2
    c, s = math.cos(turn * fade), math.sin(turn * fade)
    return ((cx + c * dx - s * dz + 1) / 2, (1 - (cz + s * dx + c * dz)) / 2)


def relief() -> Shape:
    """The whole relief."""
    points, faces = grid(CELLS, CELLS, 1.0, 1.0)
    return [(x, height(x, z), z) for x, _, z in points], faces


def read_obj(path: Path) -> tuple[list[usd.Row], list[usd.Row], list[tuple[int, ...]]]:
    """Points, uv per point and triangles of what ``simplify`` wrote."""
    rows: dict[str, list[list[str]]] = {"v": [], "vt": [], "f": []}
    for line in path.read_text(encoding="ascii").splitlines():
        kind, *words = line.split()
        if kind in rows:
            rows[kind].append(words)
    points, uv = ([tuple(map(float, words)) for words in rows[kind]] for kind in ("v", "vt"))
    return points, uv, [tuple(int(word.split("/")[0]) - 1 for word in words) for words in rows["f"]]


def _mesh(
    name: str, points: list[usd.Row], faces: list[tuple[int, ...]], uv: list[usd.Row], lines: list[str] | None = None
) -> str:
    normals = [normal(x, z) for x, _, z in points]
    return usd.mesh(name, points, faces, normals=normals, uv=uv, material="Checker", lines=lines or ())


def _drawn(text: str) -> str:
    return "{\n" + indent(block('over "Relief"', text)) + "\n}"


def _standing_in(text: str) -> str:
    """A variant whose card names the whole relief as what is meant."""
    return (
        "(\n    customData = {\n        dictionary notabug = {\n"
        '            string intent = "/Scene/Relief/Intent"\n        }\n    }\n) ' + text
    )
