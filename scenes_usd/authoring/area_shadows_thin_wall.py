"""area_shadows/thin_wall: a wall thinner than a bias between a light with a size and a floor."""

from __future__ import annotations

from notabug.scenes_usd.authoring import stage as usd
from notabug.scenes_usd.authoring.area_shadows import CITES, SIZE, area_light
from notabug.scenes_usd.authoring.shapes import box

CARD = {
    "class": "area_shadows",
    "claim": (
        "The floor behind a wall is dark up to the wall's foot, however thin the wall is, and also where it is a sheet "
        "that faces the light. A shadow ray that starts farther from its surface than the wall is thick lets a line of "
        "light through along the foot. Farther behind the wall the penumbra of its upper edge begins."
    ),
    "cites": f"{CITES}; King 2004, Shadow mapping tricks and traps, in GPU Gems",
}
LEFT, RIGHT, HEIGHT, NEAR = -1.0, 0.9, 0.7, 0.1  # of the wall; NEAR is its lit side's z
EYE, AHEAD = (1.4, 3.2, -2.6), usd.looking((-1.45, -3.1, 2.3))
LIGHT = "float inputs:width = 0.8\nfloat inputs:height = 0.6"
SHEET: list[usd.Row] = [(LEFT, 0.0, NEAR), (RIGHT, 0.0, NEAR), (RIGHT, HEIGHT, NEAR), (LEFT, HEIGHT, NEAR)]


def _wall(thick: str) -> str:
    depth = float(thick)
    if not depth:  # a sheet that faces the light
        return usd.mesh("Wall", SHEET, [(0, 1, 2, 3)], material="Green")
    return usd.mesh("Wall", *box((LEFT, 0.0, NEAR - depth), (RIGHT, HEIGHT, NEAR)), material="Green")


def files() -> dict[str, bytes]:
    """The scene's files by their path below scenes_usd."""
    floor = [(-2.5, 0.0, 2.5), (2.5, 0.0, 2.5), (2.5, 0.0, -2.5), (-2.5, 0.0, -2.5)]
    parts = [
        usd.camera(EYE, AHEAD, 0.27, (0.1, 100.0)),
        area_light("Rect", (-0.3, 1.6, 1.7), usd.looking((0.3, -1.4, -1.7)), 15.0, LIGHT),
        usd.distant_light(AHEAD, 0.35),  # from the camera: what it does not reach is not seen
        usd.materials(usd.lambert("Grey", (0.62, 0.62, 0.6)), usd.lambert("Green", (0.35, 0.6, 0.35))),
        usd.mesh("Floor", floor, [(0, 1, 2, 3)], material="Grey"),
        usd.variant_set("thick", {each: _wall(each) for each in ("0", ".01", ".1")}),
    ]
    metadata = usd.selected(thick=".01")
    return {"area_shadows/thin_wall.usda": usd.stage(CARD, parts, requires=("shadows",), metadata=metadata, size=SIZE)}
