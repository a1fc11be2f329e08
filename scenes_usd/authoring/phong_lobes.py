"""phong/lobes: one ball, two reflection models, three exponents."""

from __future__ import annotations

from notabug.scenes_usd.authoring import stage as usd
from notabug.scenes_usd.authoring.reflection import Reflection, reflection
from notabug.scenes_usd.authoring.usda import number

CARD = {
    "class": "phong",
    "claim": (
        "Two reflection models share one name and one exponent: Phong's lobe about the mirrored light, R.V, and "
        "Blinn's about the half vector, N.H. Lit from 110 degrees off the view, Phong's highlight is 1.7 times as "
        "long as it is wide and Blinn's is round; no relation of exponents turns one into the other."
    ),
    "figure": "Phong versus Phong",
    "cites": "Phong 1975; Blinn 1977; Fisher and Woo 1994; Woo, Pearce and Ouellette 1996, Table 1",
}

EXPONENTS = ("8", "32", "128")
PLASTIC = Reflection(diffuse=(0.12, 0.2, 0.32), specular=(0.62, 0.62, 0.62), exponent=None, lobe=None)


def files() -> dict[str, bytes]:
    """The scene's files by their path below scenes_usd."""
    parts = [
        usd.camera((0.0, 0.0, 40.0), (), 0.0285, (1.0, 100.0)),
        usd.distant_light(usd.looking((-0.92, -0.2, 0.335)), 3.7),
        usd.materials(reflection("Plastic", PLASTIC)),
        usd.sphere("Ball", 1.0, "Plastic"),
        *lobe_sets(),
    ]
    metadata = usd.selected(lobe="phong", n="32")
    return {"phong/lobes.usda": usd.stage(CARD, parts, requires=("sphere", "distant_light"), metadata=metadata)}


def lobe_set() -> str:
    """The variant set ``lobe`` of the material Plastic."""
    lobes = {
        name: usd.over("Materials/Plastic/Reflection", f'token inputs:lobe = "{name}"') for name in ("phong", "blinn")
    }
    return usd.variant_set("lobe", lobes)


def lobe_sets() -> tuple[str, str]:
    """The variant sets ``lobe`` and ``n`` of the material Plastic."""
    exponents = {
        name: usd.over("Materials/Plastic/Reflection", f"float inputs:exponent = {number(float(name))}")
        for name in EXPONENTS
    }
    return lobe_set(), usd.variant_set("n", exponents)
