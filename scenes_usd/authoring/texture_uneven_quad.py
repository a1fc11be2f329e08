"""texture/uneven_quad: one irregular quadrilateral under a checkerboard, whole, cut in two, or cut in n x n cells."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from notabug.scenes_usd.authoring import stage as usd
from notabug.scenes_usd.authoring.png import png
from notabug.scenes_usd.authoring.usda import block

CARD = {
    "class": "texture",
    "claim": (
        "A quadrilateral maps its texture by the bilinear patch of its corners; cut into two triangles, each maps half "
        "of the texture linearly, so the pattern kinks at the diagonal and stretches where the triangles differ most, "
        "and a fine enough grid of cells brings the patch back."
    ),
    "figure": "10, 11",
    "cites": "Woo, Pearce and Ouellette 1996, Table 1, figures 10 and 11",
}

CORNERS = usd.as_float32([(-1.6, -1.05, 0.0), (1.65, -0.8, 0.0), (0.55, 0.95, 0.0), (-0.1, 1.15, 0.0)])
UV = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]
TURN = (-24.0, 21.0, 0.0)  # degrees about x, then y: oblique to the camera, so perspective shows
GRIDS = (2, 4, 8, 15, 30)
CROWDING = 0.5

LIGHT, DARK = (217, 209, 196), (61, 66, 82)
MARKS = {  # (column, row from the top of the picture): colour
    (0, 0): (217, 51, 41),
    (6, 0): (46, 158, 64),
    (1, 1): (51, 82, 209),
    (7, 3): (230, 184, 38),
    (2, 5): (158, 56, 178),
    (5, 6): (38, 166, 173),
    (0, 7): (235, 122, 31),
}


def files() -> dict[str, bytes]:
    """The scene's files by their path below scenes_usd."""
    quad = block('def Xform "Quad"', usd.placed(turn=TURN))
    whole = [(0, 1, 2, 3)]
    variants = {
        "quad": _variant(usd.mesh("Mesh", CORNERS, whole, uv=UV, material="Checker")),
        "split02": _variant(usd.mesh("Mesh", CORNERS, [(0, 1, 2), (0, 2, 3)], uv=UV, material="Checker"), guide=True),
        "split13": _variant(usd.mesh("Mesh", CORNERS, [(0, 1, 3), (1, 2, 3)], uv=UV, material="Checker"), guide=True),
        **{f"grid{n}": _variant(_mesh(*_grid(n)), guide=True) for n in GRIDS},
        "uneven8": _variant(_mesh(*_grid(8, CROWDING)), guide=True),
    }
    parts = [
        usd.camera((-0.05, 0.05, 4.4), (), 0.41, (0.1, 100.0)),
        usd.distant_light((-26.0, 17.0, 0.0), 3.0),
        usd.materials(usd.textured("Checker", "./textures/uneven_quad.png")),
        quad,
        usd.variant_set("split", variants),
    ]
    metadata = 'variants = {\n    string split = "quad"\n}\nprepend variantSets = "split"'
    return {
        "texture/uneven_quad.usda": usd.stage(
            CARD, parts, requires=("mesh", "texture", "uv", "distant_light"), metadata=metadata
        ),
        "texture/textures/uneven_quad.png": png(checker()),
    }


def checker() -> npt.NDArray[np.uint8]:
    """(64, 64, 3): 8 x 8 cells of two tones, seven of them coloured so that no flip, turn or swap looks the same."""
    cells = np.empty((8, 8, 3), np.uint8)
    for row in range(8):
        for column in range(8):
            cells[row, column] = MARKS.get((column, row), LIGHT if (row + column) % 2 else DARK)
    return np.kron(cells, np.ones((8, 8, 1), np.uint8))


def bilinear(u: float, v: float) -> tuple[float, ...]:
    """The point of the patch at (u, v)."""
    weights = ((1 - u) * (1 - v), u * (1 - v), u * v, (1 - u) * v)
    return tuple(sum(w * corner[k] for w, corner in zip(weights, CORNERS, strict=True)) for k in range(3))


def _grid(n: int, crowding: float = 0.0) -> tuple[list[usd.Row], list[tuple[int, ...]], list[usd.Row]]:
    """Points, triangles and uv of n x n cells, each cut along its diagonal from (0, 0) to (1, 1).

    ``crowding``, below 1, moves the lines of the grid together where u and v are small.
    """
    lines = [(1 - crowding) * i / n + crowding * (i / n) ** 2 for i in range(n + 1)]
    uv: list[usd.Row] = [(u, v) for v in lines for u in lines]
    faces: list[tuple[int, ...]] = []
    for j in range(n):
        for i in range(n):
            a = j * (n + 1) + i
            b, c, d = a + 1, a + n + 2, a + n + 1
            faces += [(a, b, c), (a, c, d)]
    return [bilinear(u, v) for u, v in uv], faces, uv


def _mesh(points: list[usd.Row], faces: list[tuple[int, ...]], uv: list[usd.Row]) -> str:
    return usd.mesh("Mesh", points, faces, uv=uv, material="Checker")


def _variant(drawn: str, *, guide: bool = False) -> str:
    """``drawn`` below /Scene/Quad; with ``guide`` the whole quad beside it, named as the intent."""
    intent = ""
    parts = []
    if guide:
        intent = (
            "(\n    customData = {\n        dictionary notabug = {\n"
            '            string intent = "/Scene/Quad/Intent"\n        }\n    }\n) '
        )
        purpose = ['uniform token purpose = "guide"']
        parts.append(usd.mesh("Intent", CORNERS, [(0, 1, 2, 3)], uv=UV, material="Checker", lines=purpose))
    parts.append(drawn)
    body = "\n\n".join(parts)
    inner = "\n".join("        " + line if line else "" for line in body.split("\n"))
    return f'{intent}{{\n    over "Quad"\n    {{\n{inner}\n    }}\n}}'
