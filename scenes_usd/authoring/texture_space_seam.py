"""texture_space/seam: a drum whose texture comes round to where it began, in the middle of the picture."""

from __future__ import annotations

import math

from notabug.scenes_usd.authoring import stage as usd
from notabug.scenes_usd.authoring.texture_spaces import CITES, REQUIRES, SIZE, looked_up, painted, space, wraps
from notabug.scenes_usd.authoring.usda import integers, vectors

CARD = {
    "class": "texture_space",
    "claim": (
        "Where a texture comes round to its beginning, the points of one edge have two texture coordinates: the "
        "picture goes on across it as if nothing were there. A mesh with one coordinate a point squeezes the whole "
        "picture, reversed, into the last column of faces; a filter that ends at the picture's border leaves a line."
    ),
    "cites": f"{CITES}; Catmull 1974, A subdivision algorithm for computer display of curved surfaces",
}

COLUMNS = ("9", "27")  # so that no face is seen whose normals turn away from the viewer or the light
ROWS = 3
RADIUS, HEIGHT = 0.9, 1.5
TURNS = (2.0, 1.0)  # how often the picture is repeated round the drum, and up


def files() -> dict[str, bytes]:
    """The scene's files by their path below scenes_usd."""
    parts = [
        usd.camera((0.0, 0.5, 5.2), usd.looking((0.0, -0.5, -5.2)), 0.24, (0.1, 100.0)),
        usd.distant_light(usd.looking((0.0, -0.9, -5.2)), 3.2),
        usd.materials(painted("Letters", space("raw"), looked_up("Letters", "Coordinates"), *wraps("repeat", "clamp"))),
        usd.variant_set("columns", {each: drum(int(each)) for each in COLUMNS}),
    ]
    data = usd.stage(CARD, parts, requires=(*REQUIRES, "normals"), metadata=usd.selected(columns="9"), size=SIZE)
    return {"texture_space/seam.usda": data}


def drum(columns: int) -> str:
    """An open cylinder of ``columns`` faces round, whose first points are its last ones, seen from the seam's side."""
    points: list[usd.Row] = []
    normals: list[usd.Row] = []
    for row in range(ROWS + 1):
        for column in range(columns):
            angle = math.tau * column / columns
            points.append((RADIUS * math.sin(angle), HEIGHT * (row / ROWS - 0.5), RADIUS * math.cos(angle)))
            normals.append((math.sin(angle), 0.0, math.cos(angle)))
    faces = []
    uv: list[usd.Row] = []
    for row in range(ROWS):
        for column in range(columns):
            after = (column + 1) % columns
            faces.append(
                (
                    row * columns + column,
                    row * columns + after,
                    (row + 1) * columns + after,
                    (row + 1) * columns + column,
                )
            )
            corners = ((column, row), (column + 1, row), (column + 1, row + 1), (column, row + 1))
            uv += [(TURNS[0] * k / columns, TURNS[1] * j / ROWS) for k, j in corners]
    distinct = sorted(set(uv))
    lines = [
        f'texCoord2f[] primvars:st = {vectors(distinct)} (\n    interpolation = "faceVarying"\n)',
        f"int[] primvars:st:indices = {integers(distinct.index(each) for each in uv)}",
    ]
    return usd.mesh("Drum", points, faces, material="Letters", normals=normals, lines=lines)
