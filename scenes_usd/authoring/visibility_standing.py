"""visibility/standing: a box and a cylinder of coloured film that stand exactly on the floor."""

from __future__ import annotations

from notabug.scenes_usd.authoring import stage as usd
from notabug.scenes_usd.authoring.shapes import box, cylinder
from notabug.scenes_usd.authoring.usda import block
from notabug.scenes_usd.authoring.visibility_coincident_planes import GAPS, raisable, raised

CARD = {
    "class": "visibility",
    "claim": (
        "Through the sides of a transparent box one sees its bottom, which lies exactly in the floor: whether the "
        "bottom's colour is there, the floor's, or a mixture from pixel to pixel, and whether the floor under it is "
        "in shade, no rule decides. Raised by a gap the bottom is there with everybody."
    ),
    "figure": "9",
    "cites": "Woo, Pearce and Ouellette 1996, Table 1 and figure 9",
}

EYE = (1.2, 3.3, 5.2)


def files() -> dict[str, bytes]:
    """The scene's files by their path below scenes_usd."""
    floor = usd.mesh(
        "Floor",
        [(-7.0, 0.0, 5.0), (7.0, 0.0, 5.0), (7.0, 0.0, -9.0), (-7.0, 0.0, -9.0)],
        [(0, 1, 2, 3)],
        material="Grey",
    )
    standing = [
        block(
            'def Xform "Box"',
            usd.placed((-0.85, 0.0, 0.1), (0.0, 28.0, 0.0)),
            usd.mesh("Mesh", *box((-0.6, 0.0, -0.6), (0.6, 1.1, 0.6)), material="Amber"),
        ),
        block(
            'def Xform "Cylinder"',
            usd.placed((0.95, 0.0, -0.2)),
            usd.mesh("Mesh", *cylinder(48, 0.62, 1.25), material="Azure"),
        ),
    ]
    parts = [
        usd.camera(EYE, usd.looking((-1.2, -2.85, -5.2)), 0.33, (0.1, 100.0)),
        usd.point_light((-3.2, 7.5, 3.6), 1150.0),
        usd.materials(
            usd.lambert("Grey", (0.62, 0.62, 0.6)),
            usd.lambert("Amber", (0.8, 0.5, 0.1), 0.4),
            usd.lambert("Azure", (0.14, 0.4, 0.8), 0.4),
        ),
        floor,
        block('def Xform "Standing"', raisable(), *standing),
        usd.variant_set("gap", {gap: usd.over("Standing", raised(float(gap))) for gap in GAPS}),
    ]
    metadata = usd.selected(gap="0")
    return {"visibility/standing.usda": usd.stage(CARD, parts, requires=("opacity", "point_light"), metadata=metadata)}
