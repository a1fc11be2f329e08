"""terminator/spacing: the same number of facets, evenly spaced or crowded where they do not help."""

from __future__ import annotations

import math

from notabug.scenes_usd.authoring import stage as usd
from notabug.scenes_usd.authoring.shapes import lat_long
from notabug.scenes_usd.authoring.usda import block

CARD = {
    "class": "terminator",
    "claim": (
        "How many facets a ball has does not say how deep their shadows reach: with its lines of longitude crowded on "
        "one side and wide apart where light and shade meet, as many facets darken a larger area than evenly spaced "
        "ones do."
    ),
    "figure": "3",
    "cites": "Woo, Pearce and Ouellette 1996, figure 3; Snyder and Barr 1987",
}

N, M = 24, 12
CROWDING = 0.75
TURN = (0.0, 30.0, 0.0)  # the sparse side faces the terminator that the viewer sees


def files() -> dict[str, bytes]:
    """The scene's files by their path below scenes_usd."""
    spacings = {"even": _ball(0.0), "uneven": _ball(CROWDING)}
    floor = usd.mesh(
        "Floor",
        [(-16.0, 0.0, 8.0), (12.0, 0.0, 8.0), (12.0, 0.0, -20.0), (-16.0, 0.0, -20.0)],
        [(0, 1, 2, 3)],
        material="Grey",
    )
    parts = [
        usd.camera((0.0, 4.2, 8.2), (-23.0, 3.5, 0.0), 0.22, (0.1, 100.0)),
        usd.point_light((14.0, 12.0, -2.0), 4000.0),
        usd.materials(usd.lambert("Clay", (0.6, 0.52, 0.5)), usd.lambert("Grey", (0.5, 0.5, 0.5))),
        floor,
        block('def Xform "Ball"', usd.placed((0.0, 1.05, 0.0), TURN)),
        usd.variant_set("spacing", {name: usd.over("Ball", text) for name, text in spacings.items()}),
    ]
    metadata = usd.selected(spacing="even")
    return {"terminator/spacing.usda": usd.stage(CARD, parts, requires=("normals", "point_light"), metadata=metadata)}


def _ball(crowding: float) -> str:
    """2 N (M - 1) facets; the gap between lines of longitude varies as 1 + crowding * cos of the longitude."""

    def around(share: float) -> float:
        return share + crowding * math.sin(2 * math.pi * share) / (2 * math.pi)

    points, faces = lat_long(N, M, around)
    return usd.mesh("Mesh", points, faces, normals=points, material="Clay")
