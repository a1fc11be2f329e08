"""area_shadows/penumbra: a pillar that stands on a floor and a card above it, under a light with a size."""

from __future__ import annotations

from notabug.scenes_usd.authoring import stage as usd
from notabug.scenes_usd.authoring.area_shadows import CITES, SIZE, area_light
from notabug.scenes_usd.authoring.shapes import box

CARD = {
    "class": "area_shadows",
    "claim": (
        "A penumbra begins as a line where the pillar stands and widens with the distance from what throws it, as wide "
        "as the light is seen from there. It falls smoothly from light to shadow: a light that n x n points stand for "
        "shows n x n hard shadows. How large the light is changes no pixel far from a shadow."
    ),
    "cites": CITES,
}
PLACE, TOWARDS = (-1.4, 2.6, 0.9), (1.4, -2.6, -0.9)
SIZES = (".3", ".9")
SHAPES = ("Rect", "Sphere", "Disk")


def _sized(size: str) -> str:
    lines = [f"float inputs:{name} = {size}" for name in ("width", "height")]
    return usd.over("Lamp", *lines, f"float inputs:radius = {float(size) / 2:g}")


def files() -> dict[str, bytes]:
    """The scene's files by their path below scenes_usd."""
    floor = [(-3.0, 0.0, 3.0), (3.0, 0.0, 3.0), (3.0, 0.0, -3.0), (-3.0, 0.0, -3.0)]
    card = [(-0.9, 0.6, 0.9), (-0.2, 0.6, 0.9), (-0.2, 0.6, 0.2), (-0.9, 0.6, 0.2)]
    power = {"Rect": 18.0, "Disk": 18.0, "Sphere": 72.0}  # a sphere shows a quarter of its area to each side
    parts = [
        usd.camera((0.9, 4.2, 3.6), usd.looking((-0.95, -4.2, -3.5)), 0.3, (0.1, 100.0)),
        usd.materials(
            usd.lambert("Grey", (0.62, 0.62, 0.6)),
            usd.lambert("Blue", (0.25, 0.4, 0.7)),
            usd.lambert("Amber", (0.8, 0.5, 0.1)),
        ),
        usd.mesh("Floor", floor, [(0, 1, 2, 3)], material="Grey"),
        usd.mesh("Pillar", *box((0.0, 0.0, -0.5), (0.2, 0.9, -0.3)), material="Amber"),
        usd.mesh("Card", card, [(0, 1, 2, 3)], material="Blue"),
        usd.variant_set(
            "shape", {each.lower(): area_light(each, PLACE, usd.looking(TOWARDS), power[each]) for each in SHAPES}
        ),
        usd.variant_set("size", {each: _sized(each) for each in SIZES}),
    ]
    metadata = usd.selected(shape="rect", size=".9")
    return {"area_shadows/penumbra.usda": usd.stage(CARD, parts, requires=("shadows",), metadata=metadata, size=SIZE)}
