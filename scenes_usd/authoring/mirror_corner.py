"""mirror/corner: a ball with a highlight between two mirrors that meet in a corner."""

from __future__ import annotations

from notabug.scenes_usd.authoring import stage as usd
from notabug.scenes_usd.authoring.reflection import Reflection, reflection

CARD = {
    "class": "mirror",
    "claim": (
        "A mirror repeats the ball but not its highlight: a highlight depends on who looks, and in each wall the "
        "reflected ray looks from its own side, so shape, size and place of the highlight differ on the ball and in "
        "every reflection of it."
    ),
    "figure": "8",
    "cites": "Woo, Pearce and Ouellette 1996, Table 1 and figure 8; Whitted 1980",
}

EXPONENT = 10.0
EYE, TARGET = (4.7, 2.5, 5.0), (-0.75, -0.15, -0.55)
LIGHT = (2.2, 2.6, 1.3)


def files() -> dict[str, bytes]:
    """The scene's files by their path below scenes_usd."""
    one = [(0, 1, 2, 3)]
    lacquer = Reflection(diffuse=(0.42, 0.1, 0.08), specular=(0.55, 0.55, 0.55), exponent=EXPONENT)
    floor = [(-1.8, -1.0, 3.5), (3.5, -1.0, 3.5), (3.5, -1.0, -1.8), (-1.8, -1.0, -1.8)]
    left = [(-1.8, -1.0, 3.0), (-1.8, -1.0, -1.8), (-1.8, 3.4, -1.8), (-1.8, 3.4, 3.0)]
    back = [(-1.8, -1.0, -1.8), (3.0, -1.0, -1.8), (3.0, 3.4, -1.8), (-1.8, 3.4, -1.8)]
    parts = [
        usd.camera(EYE, usd.looking(tuple(b - a for a, b in zip(EYE, TARGET, strict=True))), 0.37, (0.1, 100.0)),
        usd.point_light(LIGHT, 108.0),
        usd.materials(
            reflection("Mirror", Reflection(diffuse=(0.02, 0.03, 0.04), mirror=0.85)),
            reflection("Lacquer", lacquer),
            usd.lambert("Grey", (0.34, 0.35, 0.37)),
        ),
        usd.mesh("Floor", floor, one, material="Grey"),
        usd.mesh("Left", left, one, material="Mirror"),
        usd.mesh("Back", back, one, material="Mirror"),
        usd.sphere("Ball", 0.8, "Lacquer", usd.placed((0.0, -0.2, 0.0))),
    ]
    return {
        "mirror/corner.usda": usd.stage(CARD, parts, requires=("sphere", "mirror", "phong", "point_light"), metadata="")
    }
