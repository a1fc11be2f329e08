"""shadow_map/box: a box, a standing plate and a table on a floor, under a distant light."""

from __future__ import annotations

from notabug.scenes_usd.authoring.shadow_maps import CITES, SIZE, defaults, map_sets
from notabug.scenes_usd.authoring.shapes import box, joined
from notabug.scenes_usd.authoring.stage import camera, distant_light, lambert, looking, materials, mesh, stage

CARD = {
    "class": "shadow_map",
    "claim": (
        "A shadow map compares depths in texels: without a bias the floor is striped by its own shadow, with a large "
        "one the plate's shadow starts beside the plate, and at any bias a shadow's edge has the steps of the texels. "
        "Shadow rays show none of it, at every resolution and every bias."
    ),
    "cites": CITES,
}

EYE = (2.6, 3.4, 4.8)


def files() -> dict[str, bytes]:
    """The scene's files by their path below scenes_usd."""
    table = joined(
        [
            box((0.5, 0.5, -1.3), (1.4, 0.56, -0.5)),
            box((0.56, 0.0, -1.24), (0.64, 0.5, -1.16)),
            box((1.26, 0.0, -0.64), (1.34, 0.5, -0.56)),
        ]
    )
    parts = [
        camera(EYE, looking((-2.6, -3.25, -4.8)), 0.26, (0.1, 100.0)),
        distant_light(looking((0.75, -1.0, -0.4)), 3.0),
        materials(
            lambert("Grey", (0.62, 0.62, 0.6)), lambert("Amber", (0.8, 0.5, 0.1)), lambert("Blue", (0.3, 0.45, 0.75))
        ),
        mesh("Floor", [(-3, 0, 3), (3, 0, 3), (3, 0, -3), (-3, 0, -3)], [(0, 1, 2, 3)], material="Grey"),
        mesh("Box", *box((-1.1, 0.0, -0.9), (-0.4, 0.6, -0.2)), material="Amber"),
        mesh("Plate", *box((-0.6, 0.0, 0.7), (0.3, 0.7, 0.73)), material="Amber"),
        mesh("Table", *table, material="Blue"),
        *map_sets(("0", ".03", ".3"), ("0", ".05")),
    ]
    data = stage(CARD, parts, requires=("distant_light", "shadows"), metadata=defaults(".03", "0"), size=SIZE)
    return {"shadow_map/box.usda": data}
