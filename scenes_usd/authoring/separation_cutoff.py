"""separation/cutoff: a dull highlight that reaches the dark side and is cut off there."""

from __future__ import annotations

from notabug.scenes_usd.authoring import stage as usd
from notabug.scenes_usd.authoring.phong_lobes import lobe_set
from notabug.scenes_usd.authoring.reflection import Reflection, reflection

CARD = {
    "class": "separation",
    "claim": (
        "With a low exponent and the light behind the ball, the highlight is still bright where N.L = 0 and the "
        "diffuse light ends: beyond that line no light counts, and the highlight stops as if cut with a knife. It "
        "does with either lobe."
    ),
    "figure": "7",
    "cites": "Woo, Pearce and Ouellette 1996, Table 1 and figure 7; Phong 1975; Blinn 1977",
}

EXPONENT = 3.0
EYE = (0.0, 2.2, 7.6)


def files() -> dict[str, bytes]:
    """The scene's files by their path below scenes_usd."""
    wax = Reflection(diffuse=(0.3, 0.12, 0.08), specular=(0.55, 0.55, 0.55), exponent=EXPONENT, lobe=None)
    floor = [(-9.0, -1.02, 5.0), (9.0, -1.02, 5.0), (9.0, -1.02, -14.0), (-9.0, -1.02, -14.0)]
    parts = [
        usd.camera(EYE, usd.looking((0.0, -2.3, -7.6)), 0.18, (0.1, 100.0)),
        usd.distant_light(usd.looking((-0.55, -0.42, 0.7)), 3.9),
        usd.materials(reflection("Plastic", wax), usd.lambert("Grey", (0.3, 0.31, 0.33))),
        usd.mesh("Floor", floor, [(0, 1, 2, 3)], material="Grey"),
        usd.sphere("Ball", 1.0, "Plastic"),
        lobe_set(),
    ]
    metadata = usd.selected(lobe="phong")
    return {"separation/cutoff.usda": usd.stage(CARD, parts, requires=("sphere", "distant_light"), metadata=metadata)}
