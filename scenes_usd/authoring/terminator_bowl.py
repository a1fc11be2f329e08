"""terminator/bowl: the inside of a hollow hemisphere, whose own rim throws a shadow into it."""

from __future__ import annotations

from notabug.scenes_usd.authoring import stage as usd
from notabug.scenes_usd.authoring.shapes import bowl
from notabug.scenes_usd.authoring.terminator_sphere import TESSELLATIONS
from notabug.scenes_usd.authoring.usda import block

CARD = {
    "class": "terminator",
    "claim": (
        "The rim's shadow inside a hollow bowl is a real one, though it is the bowl's own: what forgives facets their "
        "self-shadow on a convex ball must not take it away. Lifting the points along their normals, the usual "
        "remedy, moves its edge; only a finer mesh brings it to the true curve."
    ),
    "figure": "3",
    "cites": "Woo, Pearce and Ouellette 1996, figure 3; Snyder and Barr 1987",
}

DEFAULT = "24x12"
EYE = (0.5, 5.4, 4.2)
TURN = (0.0, 11.0, 0.0)  # about the axis: the light falls between the lines of longitude


def files() -> dict[str, bytes]:
    """The scene's files by their path below scenes_usd."""
    floor = usd.mesh(
        "Floor",
        [(-9.0, -1.05, 7.0), (9.0, -1.05, 7.0), (9.0, -1.05, -9.0), (-9.0, -1.05, -9.0)],
        [(0, 1, 2, 3)],
        material="Grey",
    )
    parts = [
        usd.camera(EYE, usd.looking((-0.5, -5.75, -4.2)), 0.2, (0.1, 100.0)),
        usd.point_light((5.5, 9.0, -4.5), 1900.0),
        usd.materials(usd.lambert("Glaze", (0.6, 0.66, 0.7)), usd.lambert("Grey", (0.5, 0.5, 0.5))),
        floor,
        block('def Xform "Bowl"', usd.placed(turn=TURN)),
        usd.variant_set("tessellation", {f"{n}x{m}": usd.over("Bowl", _bowl(n, m)) for n, m in TESSELLATIONS}),
    ]
    metadata = usd.selected(tessellation=DEFAULT)
    return {"terminator/bowl.usda": usd.stage(CARD, parts, requires=("normals", "point_light"), metadata=metadata)}


def _bowl(n: int, m: int) -> str:
    points, faces = bowl(n, m)
    return usd.mesh("Mesh", points, faces, normals=[tuple(-x for x in point) for point in points], material="Glaze")
