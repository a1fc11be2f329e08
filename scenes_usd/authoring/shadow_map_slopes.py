"""shadow_map/slopes: a fan of ramps, from level to nearly along the light, with plates that throw shadows over them."""

from __future__ import annotations

import math

from notabug.scenes_usd.authoring.shadow_maps import CITES, SIZE, defaults, map_sets
from notabug.scenes_usd.authoring.shapes import Shape, box, joined
from notabug.scenes_usd.authoring.stage import Row, camera, distant_light, lambert, looking, materials, mesh, stage

CARD = {
    "class": "shadow_map",
    "claim": (
        "The bias that a shadow map needs grows with the tangent of the angle between surface and light: one that "
        "clears the level ramp leaves stripes on the steep ones, and one that clears those takes the feet of the "
        "plates' shadows away. Every ramp is evenly lit but for its plate's shadow."
    ),
    "cites": CITES,
}

SLOPES = (0.0, 25.0, 45.0, 58.0)  # degrees; they rise away from the viewer, and the light comes over their tops
WIDTH, LENGTH, FRONT = 0.8, 2.4, 1.2
LIGHT = (0.12, -1.0, 0.45)


def files() -> dict[str, bytes]:
    """The scene's files by their path below scenes_usd."""
    ramps = [_ramp(index, math.radians(slope)) for index, slope in enumerate(SLOPES)]
    plates = [_plate(index, math.radians(slope)) for index, slope in enumerate(SLOPES)]
    parts = [
        camera((0.0, 4.2, 6.2), looking((0.0, -3.5, -6.1)), 0.26, (0.1, 100.0)),
        distant_light(looking(LIGHT), 3.2),
        materials(lambert("Sand", (0.75, 0.7, 0.6)), lambert("Red", (0.7, 0.25, 0.2))),
        mesh("Ramps", *joined(ramps), material="Sand"),
        mesh("Plates", *joined(plates), material="Red"),
        *map_sets(("0", ".02", ".15"), ("0", ".04")),
    ]
    data = stage(CARD, parts, requires=("distant_light", "shadows"), metadata=defaults(".02", "0"), size=SIZE)
    return {"shadow_map/slopes.usda": data}


def _left(index: int) -> float:
    return (index - len(SLOPES) / 2.0) * (WIDTH + 0.06)


def _ramp(index: int, slope: float) -> Shape:
    """A rectangle that rises away from the viewer, towards the light."""
    left, run, rise = _left(index), LENGTH * math.cos(slope), LENGTH * math.sin(slope)
    points: list[Row] = [
        (left, 0.0, FRONT),
        (left + WIDTH, 0.0, FRONT),
        (left + WIDTH, rise, FRONT - run),
        (left, rise, FRONT - run),
    ]
    return points, [(0, 1, 2, 3)]


def _plate(index: int, slope: float) -> Shape:
    """A thin plate that stands in the ramp, halfway up, across it."""
    middle, z = _left(index) + WIDTH / 2.0, FRONT - LENGTH * math.cos(slope) / 2.0
    foot = LENGTH * math.sin(slope) / 2.0
    return box((middle - 0.22, foot - 0.1, z - 0.02), (middle + 0.22, foot + 0.4, z))
