"""area_shadows/near_light: a floor close beneath a long light, a rod between them, and a board beside it."""

from __future__ import annotations

from notabug.scenes_usd.authoring.area_shadows import CITES, SIZE, area_light
from notabug.scenes_usd.authoring.shapes import box
from notabug.scenes_usd.authoring.stage import camera, lambert, looking, materials, mesh, selected, stage, variant_set

CARD = {
    "class": "area_shadows",
    "claim": (
        "Close to a light, nearer than a part of it is wide, the floor is lit evenly along it. A light that n x n "
        "points stand for shows a spot beneath each of them, and the rod's shadow n times. Points that lie on the "
        "light's edges light the floor beyond its ends too brightly. It shines down only: the board behind it is dark "
        "above it."
    ),
    "cites": CITES,
}
LENGTH, WIDTH = 1.6, 0.3


def _over_floor(height: str) -> str:
    size = f"float inputs:width = {LENGTH}\nfloat inputs:height = {WIDTH}"
    return area_light("Rect", (0.0, float(height), 0.0), (-90.0, 0.0, 0.0), 0.7, size)


def files() -> dict[str, bytes]:
    """The scene's files by their path below scenes_usd."""
    floor = [(-1.6, 0.0, 1.6), (1.6, 0.0, 1.6), (1.6, 0.0, -1.6), (-1.6, 0.0, -1.6)]
    board = [(-1.2, 0.0, -0.7), (1.2, 0.0, -0.7), (1.2, 1.0, -0.7), (-1.2, 1.0, -0.7)]
    parts = [
        camera((0.0, 3.0, 2.4), looking((0.0, -3.0, -2.35)), 0.34, (0.1, 100.0)),
        materials(lambert("Grey", (0.62, 0.62, 0.6)), lambert("Red", (0.7, 0.25, 0.2))),
        mesh("Floor", floor, [(0, 1, 2, 3)], material="Grey"),
        mesh("Board", board, [(0, 1, 2, 3)], material="Grey"),
        mesh("Rod", *box((0.25, 0.04, -0.6), (0.33, 0.1, 0.6)), material="Red"),
        variant_set("height", {each: _over_floor(each) for each in (".2", ".6")}),
    ]
    metadata = selected(height=".2")
    return {"area_shadows/near_light.usda": stage(CARD, parts, requires=("shadows",), metadata=metadata, size=SIZE)}
