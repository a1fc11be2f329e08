"""shadow_map/thin_wall: walls and a roof thinner than a bias, round a corner of a room, under a point light."""

from __future__ import annotations

from notabug.scenes_usd.authoring.shadow_maps import CITES, SIZE, defaults, map_sets
from notabug.scenes_usd.authoring.shapes import box
from notabug.scenes_usd.authoring.stage import camera, lambert, looking, materials, mesh, point_light, stage

CARD = {
    "class": "shadow_map",
    "claim": (
        "A bias that is larger than a wall is thick lets light through the wall's foot and along the seam beneath a "
        "roof. A point light's map is six squares, whose texels grow with the distance. The floor behind the wall is "
        "dark up to the wall itself."
    ),
    "cites": CITES,
}


def files() -> dict[str, bytes]:
    """The scene's files by their path below scenes_usd."""
    floor = [(-2.5, 0.0, 2.5), (2.5, 0.0, 2.5), (2.5, 0.0, -2.5), (-2.5, 0.0, -2.5)]
    parts = [
        camera((3.6, 3.6, 3.4), looking((-3.5, -3.3, -3.5)), 0.34, (0.1, 100.0)),
        point_light((-1.7, 2.3, -0.4), 80.0),
        materials(
            lambert("Grey", (0.62, 0.62, 0.6)), lambert("Green", (0.35, 0.6, 0.35)), lambert("Amber", (0.8, 0.5, 0.1))
        ),
        mesh("Floor", floor, [(0, 1, 2, 3)], material="Grey"),
        mesh("Wall", *box((-0.2, 0.0, -1.2), (-0.17, 1.0, 1.1)), material="Green"),
        mesh("Roof", *box((-0.2, 1.0, -1.2), (0.6, 1.02, -0.1)), material="Amber"),
        *map_sets(("0", ".03", ".2"), ("0", ".05")),
    ]
    data = stage(CARD, parts, requires=("point_light", "shadows"), metadata=defaults(".2", "0"), size=SIZE)
    return {"shadow_map/thin_wall.usda": data}
