"""normal_maps/bumps: steep bumps under a low light and a low camera, on a level strip and on one that faces away."""

from __future__ import annotations

import math

import numpy as np

from notabug.scenes_usd.authoring import stage as usd
from notabug.scenes_usd.authoring.normal_maps import CITES, Floats, encoded, mapped, places
from notabug.scenes_usd.authoring.png import png

CARD = {
    "class": "normal_maps",
    "claim": (
        "Mapped normals of bumps on a flat strip face away from a low camera; on a strip that is turned away from the "
        "light some face the light. Light from below a surface does not reach its bumps, so the far strip is black; a "
        "bump whose normal faces away from the camera is lit as its normal says, and no facet of it reflects."
    ),
    "cites": CITES,
}
TEXELS = 64
WIDE = (160, 80)
RADIUS = 0.42  # of a bump, in cells of the map
STEEPEST = {"steep": 62.0, "medium": 30.0, "gentle": 12.0}  # degrees that its normals lean half way down
ELEVATION = 16.0  # degrees of the light above the near strip


def files() -> dict[str, bytes]:
    """The scene's files by their path below scenes_usd."""
    down = math.radians(ELEVATION)
    cameras = {"low": _seen(18.0), "high": _seen(40.0)}
    slopes = {name: usd.over("Materials/Bumps/Normals", f"asset inputs:file = @{_file(name)}@") for name in STEEPEST}
    parts = [
        usd.distant_light(usd.looking((math.cos(down), -math.sin(down), -0.12)), 3.2),
        usd.materials(mapped("Bumps", "", (0.75, 0.5, 0.3), roughness=0.45)),
        _strip("Near", 0.0, (0.04, 1.04)),
        _strip("Far", 24.0, (-1.04, -0.04)),
        usd.variant_set("camera", cameras),
        usd.variant_set("slope", slopes),
    ]
    return {
        **{
            f"normal_maps/textures/{name}.png": png(encoded(bumps(TEXELS, steepest)))
            for name, steepest in STEEPEST.items()
        },
        "normal_maps/bumps.usda": usd.stage(
            CARD,
            parts,
            requires=("uv", "normal_map", "distant_light"),
            metadata=usd.selected(camera="low", slope="steep"),
            size=WIDE,
        ),
    }


def _seen(elevation: float) -> str:
    """The camera at ``elevation`` degrees, 4.4 away from the middle of both strips, looking there."""
    angle = math.radians(elevation)
    eye = (0.0, 4.4 * math.sin(angle), 4.4 * math.cos(angle))
    return usd.camera(eye, (-elevation, 0.0, 0.0), 0.3, (0.1, 100.0), aspect=WIDE[0] / WIDE[1])


def _strip(name: str, turn: float, z: tuple[float, float]) -> str:
    """A rectangle between two z, turned about the z axis towards +x by ``turn`` degrees: 4 by 2 cells."""
    angle = math.radians(turn)
    x, y = math.cos(angle), -math.sin(angle)
    points: list[usd.Row] = [(-x, -y, z[1]), (x, y, z[1]), (x, y, z[0]), (-x, -y, z[0])]
    uv: list[usd.Row] = [(0.0, 0.0), (4.0, 0.0), (4.0, 2.0), (0.0, 2.0)]
    return usd.mesh(name, usd.as_float32(points), [(0, 1, 2), (0, 2, 3)], material="Bumps", uv=uv)


def _file(slope: str) -> str:
    return f"./textures/{slope}.png"


def bumps(size: int, steepest: float) -> Floats:
    """Normals (size, size, 3) of a round bump: level in its middle and beside it, steepest at half its radius."""
    u, v = places(size)
    x, y = u - 0.5, v - 0.5
    r = np.hypot(x, y)
    lean = math.tan(math.radians(steepest)) * np.sin(np.pi * np.clip(r / RADIUS, 0.0, 1.0))
    along = np.where(r > 0, 1.0 / np.maximum(r, 1e-12), 0.0)
    return np.stack([lean * x * along, lean * y * along, np.ones_like(r)], axis=2)
