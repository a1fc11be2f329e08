"""visibility/near_clip: thin sheets above a floor, with the near plane ever closer to the eye."""

from __future__ import annotations

from notabug.scenes_usd.authoring import stage as usd
from notabug.scenes_usd.authoring.shapes import grid, moved
from notabug.scenes_usd.authoring.usda import indent, number, vector

CARD = {
    "class": "visibility",
    "claim": (
        "A depth buffer of b bits resolves z^2 (1/near - 1/far) / 2^b: the nearer the near plane, the more of these "
        "sheets, each ten times as high above the floor as the one before, break up or sink into it. A ray tracer "
        "shows the same picture with every near plane."
    ),
    "figure": "9 (near clipping)",
    "cites": "Woo, Pearce and Ouellette 1996, section on visibility inconsistency",
}

NEAR = ("1", ".1", ".01", ".001", ".0001")
FAR = 100.0
EYE = (0.0, 3.2, 6.4)
# x of the centre, height above the floor, material
SHEETS = ((-1.65, 1e-5, "Red"), (-0.55, 1e-4, "Yellow"), (0.55, 1e-3, "Green"), (1.65, 1e-2, "Blue"))


def files() -> dict[str, bytes]:
    """The scene's files by their path below scenes_usd."""
    camera = (
        'def Camera "Camera"\n{\n'
        f"    float focalLength = {number(usd.APERTURE / (2 * 0.38))}\n"
        f"    float horizontalAperture = {number(usd.APERTURE)}\n"
        f"    float verticalAperture = {number(usd.APERTURE)}\n"
        '    token projection = "perspective"\n'
        f"{indent(usd.placed(EYE, usd.looking((0.0, -3.4, -6.4))))}"
        "}"
    )
    points, faces = moved(grid(24, 24, 9.0, 9.0), (0.0, 0.0, -4.0))
    parts = [
        camera,
        usd.point_light(EYE, 400.0),  # at the eye: no shadow is seen
        usd.materials(
            usd.lambert("Grey", (0.6, 0.6, 0.58)),
            usd.lambert("Red", (0.7, 0.18, 0.13)),
            usd.lambert("Yellow", (0.72, 0.56, 0.14)),
            usd.lambert("Green", (0.16, 0.52, 0.24)),
            usd.lambert("Blue", (0.16, 0.34, 0.7)),
        ),
        usd.mesh("Floor", points, faces, material="Grey"),
        *(_sheet(*sheet) for sheet in SHEETS),
        usd.variant_set(
            "near", {each: usd.over("Camera", f"float2 clippingRange = {vector((float(each), FAR))}") for each in NEAR}
        ),
    ]
    metadata = usd.selected(near=".1")
    return {"visibility/near_clip.usda": usd.stage(CARD, parts, requires=("point_light",), metadata=metadata)}


def _sheet(x: float, height: float, material: str) -> str:
    corners: list[usd.Row] = [
        (x - 0.45, height, 1.9),
        (x + 0.45, height, 1.9),
        (x + 0.45, height, -1.9),
        (x - 0.45, height, -1.9),
    ]
    return usd.mesh(f"Sheet{material}", corners, [(0, 1, 2, 3)], material=material)
