"""acne/sphere: a ball lit from far to the right, seen from near and far, near the origin and far from it."""

from __future__ import annotations

from notabug.scenes_usd.authoring import stage as usd
from notabug.scenes_usd.authoring.shapes import lat_long
from notabug.scenes_usd.authoring.usda import block, number, vector

CARD = {
    "class": "acne",
    "claim": (
        "A hit point is off its surface by the rounding of a long ray, or of large coordinates; where the light only "
        "grazes the surface, down the middle of this ball, a shadow ray from such a point finds the surface again, "
        "and no reasonable epsilon helps. The picture is the same from every distance and at every offset."
    ),
    "figure": "1, 2",
    "cites": "Woo, Pearce and Ouellette 1996, Table 1, figures 1 and 2; Amanatides and Mitchell 1990",
}

CAMERA_DISTANCES = ("10", "1e2", "1e3", "1e4", "1e5", "1e6", "1e7")
LIGHT_DISTANCES = ("1e2", "1e4", "1e6")
WORLD_OFFSETS = ("0", "1e2", "1e3", "1e4", "1e5", "1e6")
TO_LIGHT = (0.96, 0.12, 0.24)  # nearly a right angle to the view
LIT = 4.1  # irradiance at the origin, face on
TILT = (-18.0, -7.0, -15.0)


def files() -> dict[str, bytes]:
    """The scene's files by their path below scenes_usd."""
    smooth = usd.mesh("Mesh", *lat_long(64, 32), normals=lat_long(64, 32)[0], material="Clay")
    exact = usd.sphere("Sphere", 1.0, "Clay")
    offsets = {name: _offset(float(name)) for name in WORLD_OFFSETS}
    parts = [
        'uniform token[] xformOpOrder = ["xformOp:translate"]',
        usd.orbiting_camera((0.0, 0.0, 0.0), (0.0, 0.0, 0.0)),
        _far_light(),
        usd.materials(usd.lambert("Clay", (0.65, 0.6, 0.5)), usd.lambert("Grey", (0.5, 0.5, 0.5))),
        wall(),
        block('def Xform "Ball"', usd.placed(turn=TILT)),
        usd.distances(1.4, CAMERA_DISTANCES),
        usd.variant_set("light_distance", {name: _light_at(float(name)) for name in LIGHT_DISTANCES}),
        usd.variant_set("surface", {"mesh": usd.over("Ball", smooth), "sphere": usd.over("Ball", exact)}),
        usd.variant_set("world_offset", offsets),
    ]
    metadata = usd.selected(camera_distance="10", light_distance="1e2", surface="mesh", world_offset="0")
    return {"acne/sphere.usda": usd.stage(CARD, parts, requires=("point_light",), metadata=metadata)}


def wall() -> str:
    """/Scene/Wall behind the ball, so far that the ball's shadow falls outside the picture."""
    corners: list[usd.Row] = [(-3.0, -3.0, -1.6), (3.0, -3.0, -1.6), (3.0, 3.0, -1.6), (-3.0, 3.0, -1.6)]
    return usd.mesh("Wall", corners, [(0, 1, 2, 3)], material="Grey")


def _far_light() -> str:
    """/Scene/Light, a point; where and how bright, ``_light_at`` says."""
    return (
        'def SphereLight "Light"\n{\n'
        "    bool inputs:normalize = 1\n"
        "    bool treatAsPoint = 1\n"
        '    uniform token[] xformOpOrder = ["xformOp:translate"]\n'
        "}"
    )


def _light_at(distance: float) -> str:
    """The text of a variant: the light ``distance`` along TO_LIGHT, as bright at the origin from everywhere."""
    place, intensity = lamp(distance)
    return usd.over(
        "Light", f"float inputs:intensity = {number(intensity)}", f"double3 xformOp:translate = {vector(place)}"
    )


def lamp(distance: float) -> tuple[usd.Row, float]:
    """Where the light is and UsdLux's intensity, four times the radiant intensity."""
    place = tuple(distance * x for x in TO_LIGHT)
    return place, 4 * LIT * sum(x * x for x in place)


def _offset(by: float) -> str:
    return f"double3 xformOp:translate = {vector((by, by, by))}"
