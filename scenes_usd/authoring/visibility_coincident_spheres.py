"""visibility/coincident_spheres: two balls of one size in one place."""

from __future__ import annotations

from notabug.scenes_usd.authoring import stage as usd
from notabug.scenes_usd.authoring.shapes import lat_long
from notabug.scenes_usd.authoring.usda import block, number, vector
from notabug.scenes_usd.authoring.visibility_coincident_planes import GAPS

CARD = {
    "class": "visibility",
    "claim": (
        "Two balls fill the same space in two colours. Placed alike they tie everywhere; with one of them turned "
        "about its centre, which changes nothing but the rounding, each pixel may pick another winner. The first in "
        "the scene is the declared winner; larger by a gap it wins with everybody."
    ),
    "figure": "9",
    "cites": "Woo, Pearce and Ouellette 1996, Table 1 and figure 9",
}

N, M = 48, 24
EYE = (0.0, 0.0, 6.0)
STEPS = 7  # of 360 / N degrees: the turned mesh has its points where the other one has its own
PLACED = 'uniform token[] xformOpOrder = ["xformOp:rotateXYZ", "xformOp:scale"]'


def files() -> dict[str, bytes]:
    """The scene's files by their path below scenes_usd."""
    points, faces = lat_long(N, M)
    meshes = {
        name: usd.mesh("Mesh", points, faces, normals=points, material=_colour(name)) for name in ("First", "Second")
    }
    exact = {name: usd.sphere("Sphere", 1.0, _colour(name)) for name in ("First", "Second")}
    parts = [
        usd.camera(EYE, (), 0.2, (0.1, 100.0)),
        usd.point_light(EYE, 320.0),  # at the eye: no shadow is seen
        usd.materials(usd.lambert("Red", (0.72, 0.2, 0.14)), usd.lambert("Blue", (0.16, 0.34, 0.7))),
        block(
            'def Xform "Balls"',
            usd.placed(turn=(25.0, 0.0, 12.0)),
            *(block(f'def Xform "{name}"', PLACED) for name in ("First", "Second")),
        ),
        usd.variant_set("gap", {gap: usd.over("Balls/First", _scale(1.0 + float(gap))) for gap in GAPS}),
        usd.variant_set("surface", {name: _pair(each) for name, each in (("mesh", meshes), ("sphere", exact))}),
        usd.variant_set("transform", {"same": _turn(0.0), "turned": _turn(STEPS * 360.0 / N)}),
    ]
    metadata = usd.selected(gap="0", surface="mesh", transform="turned")
    return {"visibility/coincident_spheres.usda": usd.stage(CARD, parts, requires=("point_light",), metadata=metadata)}


def _colour(name: str) -> str:
    return {"First": "Red", "Second": "Blue"}[name]


def _pair(drawn: dict[str, str]) -> str:
    return usd.over("Balls", *(usd.over(name, text) for name, text in drawn.items()))


def _scale(by: float) -> str:
    return f"double3 xformOp:scale = {vector((by, by, by))}"


def _turn(degrees: float) -> str:
    first = usd.over("First", "float3 xformOp:rotateXYZ = (0, 0, 0)")
    second = usd.over(
        "Second", f"float3 xformOp:rotateXYZ = (0, {number(degrees)}, 0)", "double3 xformOp:scale = (1, 1, 1)"
    )
    return usd.over("Balls", first, second)
