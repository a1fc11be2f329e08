"""acne/mirror: a mirror seen from near and far: reflected rays, too, start a little off their surface."""

from __future__ import annotations

from notabug.scenes_usd.authoring import stage as usd
from notabug.scenes_usd.authoring.reflection import Reflection, reflection
from notabug.scenes_usd.authoring.shapes import box, grid, moved
from notabug.scenes_usd.authoring.usda import block

CARD = {
    "class": "acne",
    "claim": (
        "A reflected ray that starts behind its mirror meets the mirror again and shows a dot of what lies there; "
        "how many do grows with the distance that the first ray has travelled. The picture is the same from every "
        "distance, but for the perspective."
    ),
    "figure": "1",
    "cites": "Woo, Pearce and Ouellette 1996, Table 1; Haines 1989; Whitted 1980",
}

TILT = (13.0, 29.0, -8.0)  # of the whole scene: no coordinate of the mirror is constant, so none is exact by luck


def files() -> dict[str, bytes]:
    """The scene's files by their path below scenes_usd."""
    points, faces = moved(grid(24, 24, 2.4, 2.4), (0.0, 0.0, 0.7))
    wall: list[usd.Row] = [(-6.0, -6.0, -1.9), (6.0, -6.0, -1.9), (6.0, 6.0, -1.9), (-6.0, 6.0, -1.9)]
    parts = [
        usd.placed(turn=TILT),
        usd.orbiting_camera((0.0, 0.12, 0.0), (-24.0, 0.0, 0.0)),
        usd.distant_light(usd.looking((-0.5, -0.75, -0.9)), 4.0),
        usd.materials(
            reflection("Mirror", Reflection(mirror=0.85)),
            usd.lambert("Wall", (0.4, 0.44, 0.5)),
            usd.lambert("Red", (0.68, 0.2, 0.14)),
            usd.lambert("Yellow", (0.68, 0.55, 0.16)),
        ),
        usd.mesh("Mirror", points, faces, material="Mirror"),
        usd.mesh("Wall", wall, [(0, 1, 2, 3)], material="Wall"),
        block('def Xform "Block"', usd.placed((0.55, 0.25, -0.65), (0.0, 33.0, 0.0)), _block()),
        usd.sphere("Ball", 0.42, "Red", usd.placed((-0.5, 0.52, -0.5))),
        usd.distances(1.5, ("10", "1e3", "1e5", "1e7")),
    ]
    return {
        "acne/mirror.usda": usd.stage(
            CARD, parts, requires=("mirror", "distant_light"), metadata=usd.selected(camera_distance="10")
        )
    }


def _block() -> str:
    return usd.mesh("Mesh", *box((-0.35, 0.0, -0.35), (0.35, 0.55, 0.35)), material="Yellow")
