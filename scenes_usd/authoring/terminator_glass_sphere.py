"""terminator/glass_sphere: a glass ball of facets in a room: refracted rays bent by the interpolated normal."""

from __future__ import annotations

from notabug.scenes_usd.authoring.reflection import Reflection, reflection
from notabug.scenes_usd.authoring.terminator_mirror_sphere import in_a_room

CARD = {
    "class": "terminator",
    "claim": (
        "A ray refracted about the interpolated normal enters and leaves the ball where its facets are, not where the "
        "smooth surface is: the upside-down room inside breaks at the facets' edges, and towards the outline rays "
        "meet a facet from the wrong side."
    ),
    "figure": "3",
    "cites": "Woo, Pearce and Ouellette 1996, figure 3 and the terminator section; Whitted 1980",
}


def files() -> dict[str, bytes]:
    """The scene's files by their path below scenes_usd."""
    glass = reflection("Ball", Reflection(transmission=0.9, ior=1.5))
    return {"terminator/glass_sphere.usda": in_a_room(CARD, glass, ("normals", "point_light", "transmission"))}
