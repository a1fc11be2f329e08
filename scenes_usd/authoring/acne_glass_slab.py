"""acne/glass_slab: coloured bars through a slab of glass: refracted rays that must not meet the face they leave."""

from __future__ import annotations

from notabug.scenes_usd.authoring import stage as usd
from notabug.scenes_usd.authoring.reflection import Reflection, reflection
from notabug.scenes_usd.authoring.shapes import slab
from notabug.scenes_usd.authoring.usda import block

CARD = {
    "class": "acne",
    "claim": (
        "A refracted ray that starts in front of its face instead of behind it meets the face again and is bent "
        "twice, so the bars behind the glass break up into dots; how many grows with the distance that the first "
        "ray has travelled."
    ),
    "figure": "1",
    "cites": "Woo, Pearce and Ouellette 1996, Table 1; Haines 1989; Whitted 1980",
}

TILT = (13.0, 29.0, -8.0)  # of the whole scene: no coordinate of the slab is constant, so none is exact by luck
BARS = (("Red", -1.5), ("Yellow", -0.9), ("Green", -0.3), ("Red", 0.3), ("Yellow", 0.9), ("Green", 1.5))


def files() -> dict[str, bytes]:
    """The scene's files by their path below scenes_usd."""
    wall: list[usd.Row] = [(-4.0, -4.0, -2.5), (4.0, -4.0, -2.5), (4.0, 4.0, -2.5), (-4.0, 4.0, -2.5)]
    bars = [_bar(f"Bar{i}", *each) for i, each in enumerate(BARS)]
    glass = usd.mesh("Slab", *slab(20, 1.0, 0.5), material="Glass")
    parts = [
        usd.placed(turn=TILT),
        usd.orbiting_camera((0.0, 0.0, 0.0), (0.0, 0.0, 0.0)),
        usd.distant_light(
            usd.looking((2.0, -0.6, -1.0)), 6.0
        ),  # so far from the side that no shadow of the slab is seen
        usd.materials(
            reflection("Glass", Reflection(transmission=0.9, ior=1.5)),
            usd.lambert("Wall", (0.75, 0.75, 0.72)),
            usd.lambert("Red", (0.7, 0.16, 0.12)),
            usd.lambert("Yellow", (0.75, 0.6, 0.14)),
            usd.lambert("Green", (0.14, 0.5, 0.28)),
        ),
        usd.mesh("Wall", wall, [(0, 1, 2, 3)], material="Wall"),
        *bars,
        block('def Xform "Glass"', usd.placed((0.0, 0.0, 0.0), (20.0, 30.0, 6.0)), glass),
        usd.distances(1.6, ("10", "1e3", "1e5", "1e7")),
    ]
    return {
        "acne/glass_slab.usda": usd.stage(
            CARD, parts, requires=("transmission", "distant_light"), metadata=usd.selected(camera_distance="10")
        )
    }


def _bar(name: str, material: str, x: float) -> str:
    """An upright strip just before the wall; it leans, so that a shift shows in both directions."""
    half, lean, z = 0.16, 0.5, -2.48
    corners: list[usd.Row] = [
        (x - half - lean, -3.0, z),
        (x + half - lean, -3.0, z),
        (x + half + lean, 3.0, z),
        (x - half + lean, 3.0, z),
    ]
    return usd.mesh(name, corners, [(0, 1, 2, 3)], material=material)
