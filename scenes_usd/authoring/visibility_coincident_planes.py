"""visibility/coincident_planes: two sheets in one plane that overlap."""

from __future__ import annotations

from notabug.scenes_usd.authoring import stage as usd
from notabug.scenes_usd.authoring.shapes import cells
from notabug.scenes_usd.authoring.usda import block, number

CARD = {
    "class": "visibility",
    "claim": (
        "Where two sheets lie in one plane nothing says which is in front: cut into the same triangles one of them "
        "wins everywhere, cut along other diagonals their depths round differently and the colours mix in stripes. "
        "The first in the scene is the declared winner; raised by a gap it wins with everybody."
    ),
    "figure": "9",
    "cites": "Woo, Pearce and Ouellette 1996, Table 1 and figure 9",
}

GAPS = ("0", "1e-6", "1e-3")
EYE = (0.4, 3.2, 3.2)
CELL, ROWS = 0.3, 6
COLUMNS = {"First": (0, 7), "Second": (3, 10)}  # of ten


def files() -> dict[str, bytes]:
    """The scene's files by their path below scenes_usd."""
    sheets = [
        block('def Xform "First"', raisable()),
        block('def Xform "Second"'),
    ]
    parts = [
        usd.camera(EYE, usd.looking((-0.4, -3.2, -3.2)), 0.33, (0.1, 100.0)),
        usd.point_light(EYE, 210.0),  # at the eye: no shadow is seen
        usd.materials(usd.lambert("Red", (0.72, 0.2, 0.14)), usd.lambert("Blue", (0.16, 0.34, 0.7))),
        block('def Xform "Sheets"', usd.placed(turn=(7.0, 25.0, 4.0)), *sheets),
        usd.variant_set("gap", {gap: usd.over("Sheets/First", raised(float(gap))) for gap in GAPS}),
        usd.variant_set(
            "triangulation",
            {
                "same": usd.over("Sheets", _sheet("First", "Red", "02"), _sheet("Second", "Blue", "02")),
                "other": usd.over("Sheets", _sheet("First", "Red", "02"), _sheet("Second", "Blue", "13")),
            },
        ),
    ]
    metadata = usd.selected(gap="0", triangulation="other")
    return {"visibility/coincident_planes.usda": usd.stage(CARD, parts, requires=("point_light",), metadata=metadata)}


def raisable() -> str:
    """The transform of a prim that a variant will raise."""
    return 'uniform token[] xformOpOrder = ["xformOp:translate"]'


def raised(gap: float) -> str:
    """The opinion of such a variant."""
    return f"double3 xformOp:translate = (0, {number(gap)}, 0)"


def _sheet(name: str, material: str, diagonal: str) -> str:
    """Level cells between two columns, each cut from corner 0 to 2 or from 1 to 3."""
    left, right = COLUMNS[name]
    wide = right - left
    points: list[usd.Row] = [
        (CELL * (left + i - 5), 0.0, CELL * (j - ROWS / 2)) for j in range(ROWS + 1) for i in range(wide + 1)
    ]
    faces: list[tuple[int, ...]] = []
    for a, b, c, d in cells(wide, ROWS):
        faces += [(a, d, c), (a, c, b)] if diagonal == "02" else [(a, d, b), (b, d, c)]
    return usd.over(name, usd.mesh("Mesh", points, faces, material=material))
