"""acne/grazing_plane: a plane that the light only just reaches, with small blocks that throw long shadows on it."""

from __future__ import annotations

import math

from notabug.scenes_usd.authoring import stage as usd
from notabug.scenes_usd.authoring.shapes import Shape, grid, joined
from notabug.scenes_usd.authoring.usda import number, vector

CARD = {
    "class": "acne",
    "claim": (
        "The lower the light stands over a plane, the farther a shadow ray runs before it has left the plane by as "
        "much as its origin is off it; an epsilon that still prevents dots at a twentieth of a degree lets light in "
        "under small blocks. The plane is as bright at every elevation, since the light is made stronger."
    ),
    "figure": "1",
    "cites": "Woo, Pearce and Ouellette 1996, Table 1 and figure 1; Haines 1989",
}

ELEVATIONS = ("5", "1", ".5", ".1", ".05")  # degrees
DEFAULT = "1"
LIT = 2.9  # irradiance of the plane
AZIMUTH = 12.0  # degrees: the shadows run towards the viewer, and a little to the side
TILT = (13.0, 29.0, -8.0)  # of the whole scene: no coordinate of the plane is constant, so none is exact by luck
# x, z, half width, depth, height of each block
BLOCKS = (
    (-1.15, -0.55, 0.16, 0.3, 0.05),
    (-0.55, 0.35, 0.1, 0.18, 0.012),
    (-0.1, -0.9, 0.2, 0.34, 0.022),
    (0.45, 0.1, 0.12, 0.24, 0.035),
    (0.95, -0.4, 0.18, 0.3, 0.008),
    (1.2, 0.6, 0.08, 0.16, 0.02),
)


def files() -> dict[str, bytes]:
    """The scene's files by their path below scenes_usd."""
    points, faces = grid(24, 24, 2.6, 3.2)
    parts = [
        usd.placed(turn=TILT),
        usd.orbiting_camera((0.0, 0.0, 0.1), (-38.0, 0.0, 0.0)),
        (
            'def DistantLight "Light"\n{\n'
            "    float inputs:angle = 0\n"
            '    uniform token[] xformOpOrder = ["xformOp:rotateXYZ"]\n'
            "}"
        ),
        usd.materials(usd.lambert("Sand", (0.8, 0.74, 0.62)), usd.lambert("Blue", (0.32, 0.46, 0.72))),
        usd.mesh("Plane", points, faces, material="Sand"),
        usd.mesh("Blocks", *joined([_block(*block) for block in BLOCKS]), material="Blue"),
        usd.distances(1.5, ("10", "1e3", "1e5")),
        usd.variant_set("light_elevation", {elevation: _light(float(elevation)) for elevation in ELEVATIONS}),
    ]
    metadata = usd.selected(camera_distance="10", light_elevation=DEFAULT)
    return {"acne/grazing_plane.usda": usd.stage(CARD, parts, requires=("distant_light",), metadata=metadata)}


def _light(elevation: float) -> str:
    """The text of a variant: light from beyond the plane, ``elevation`` degrees above it."""
    up, turn = math.radians(elevation), math.radians(AZIMUTH)
    down: usd.Row = (math.cos(up) * math.sin(turn), -math.sin(up), math.cos(up) * math.cos(turn))
    return usd.over(
        "Light",
        f"float inputs:intensity = {number(LIT / math.sin(up))}",
        f"float3 xformOp:rotateXYZ = {vector(usd.looking(down))}",
    )


def _block(x: float, z: float, half: float, depth: float, height: float) -> Shape:
    """A flat wedge: its back faces the light, its two sides, which the viewer sees, meet in front, in the shade."""
    corners = ((x - half, z), (x + half, z), (x, z + depth))
    points: list[usd.Row] = [(cx, y, cz) for y in (0.0, height) for cx, cz in corners]
    return points, [(3, 5, 4), (0, 3, 4, 1), (1, 4, 5, 2), (2, 5, 3, 0)]
