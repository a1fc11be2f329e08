"""terminator/mirror_sphere: a mirror ball of facets in a room: reflected rays that run into the ball itself."""

from __future__ import annotations

from collections.abc import Callable

from notabug.scenes_usd.authoring import stage as usd
from notabug.scenes_usd.authoring.reflection import Reflection, reflection
from notabug.scenes_usd.authoring.shapes import box, lat_long
from notabug.scenes_usd.authoring.usda import block

CARD = {
    "class": "terminator",
    "claim": (
        "A view ray mirrored about the interpolated normal can point into the facets that stand for the smooth ball: "
        "towards its outline the reflected room breaks off in steps, as large as the facets are."
    ),
    "figure": "3",
    "cites": "Woo, Pearce and Ouellette 1996, figure 3 and the terminator section; Whitted 1980",
}

TESSELLATIONS = ((8, 4), (16, 8), (24, 12), (48, 24))
DEFAULT = "24x12"
TILT = (-18.0, -7.0, -15.0)


def files() -> dict[str, bytes]:
    """The scene's files by their path below scenes_usd."""
    return {
        "terminator/mirror_sphere.usda": in_a_room(
            CARD, reflection("Ball", Reflection(mirror=0.85)), ("normals", "point_light", "mirror")
        )
    }


def in_a_room(card: dict[str, str], material: str, requires: tuple[str, ...]) -> bytes:
    """The stage of a ball of the material Ball, over tiles, between a red and a green wall, before more tiles."""
    parts = [
        usd.camera((0.0, 1.5, 4.6), usd.looking((0.0, -0.62, -4.6)), 0.37, (0.1, 100.0)),
        usd.point_light((-1.0, 7.0, 9.0), 1900.0),
        usd.materials(
            material,
            usd.lambert("Light", (0.68, 0.66, 0.6)),
            usd.lambert("Dark", (0.2, 0.22, 0.26)),
            usd.lambert("Red", (0.6, 0.16, 0.12)),
            usd.lambert("Green", (0.2, 0.48, 0.2)),
            usd.lambert("Blue", (0.3, 0.4, 0.6)),
            usd.lambert("White", (0.6, 0.62, 0.64)),
            usd.lambert("Yellow", (0.6, 0.5, 0.14)),
        ),
        *_tiles("Floor", ("Light", "Dark"), 1.5, lambda a, b: (a, 0.0, -b), (-3.0, -3.0), (4, 4)),
        *_tiles("Back", ("Blue", "White"), 1.0, lambda a, b: (a, b, -3.0), (-3.0, 0.0), (6, 5)),
        usd.mesh(
            "Left", [(-3.0, 0.0, 3.0), (-3.0, 0.0, -3.0), (-3.0, 5.0, -3.0), (-3.0, 5.0, 3.0)], ONE, material="Red"
        ),
        usd.mesh(
            "Right", [(3.0, 0.0, -3.0), (3.0, 0.0, 3.0), (3.0, 5.0, 3.0), (3.0, 5.0, -3.0)], ONE, material="Green"
        ),
        usd.mesh("Block", *box((1.35, 0.0, 0.3), (1.85, 0.8, 0.8)), material="Yellow"),
        block('def Xform "Ball"', usd.placed((0.0, 1.05, 0.0), TILT)),
        usd.variant_set("tessellation", {f"{n}x{m}": usd.over("Ball", _ball(n, m)) for n, m in TESSELLATIONS}),
    ]
    return usd.stage(card, parts, requires=requires, metadata=usd.selected(tessellation=DEFAULT))


ONE = [(0, 1, 2, 3)]


def _tiles(
    name: str,
    tones: tuple[str, str],
    side: float,
    place: Callable[[float, float], usd.Row],
    corner: tuple[float, float],
    count: tuple[int, int],
) -> list[str]:
    """Squares in two tones, a mesh for each; ``place`` puts a point of the pattern into space."""
    drawn = []
    for parity, tone in enumerate(tones):
        squares = [(i, j) for j in range(count[1]) for i in range(count[0]) if (i + j) % 2 == parity]
        points = [
            place(corner[0] + side * (i + a), corner[1] + side * (j + b))
            for i, j in squares
            for a, b in ((0, 0), (1, 0), (1, 1), (0, 1))
        ]
        faces = [tuple(range(4 * k, 4 * k + 4)) for k in range(len(squares))]
        drawn.append(usd.mesh(f"{name}{tone}", points, faces, material=tone))
    return drawn


def _ball(n: int, m: int) -> str:
    points, faces = lat_long(n, m)
    return usd.mesh("Mesh", points, faces, normals=points, material="Ball")
