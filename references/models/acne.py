"""Surface acne: light that a surface takes from itself because its own hit point is off by rounding."""

from __future__ import annotations

from collections.abc import Iterator

from notabug.references.models.model import Model
from notabug.scenes_usd.scene import Scene

# The hit point's error is at most C * u * (|O| + t + |x|) in the renderer's precision; 8 covers a float32 intersection
# (Haines 1989; Pharr, Jakob and Humphreys 2023, section 6.8).
C = 8.0
ROUNDOFF = {"float32": 2.0**-24, "float64": 2.0**-53}


def models(scene: Scene) -> Iterator[Model]:
    """Models of a scene with lights and something to be hit."""
    if not scene.lights or not scene.objects:
        return
    for precision, u in ROUNDOFF.items():
        yield Model(
            name="acne",
            kind="limitation",
            rule="set",
            claim="the surface shadows itself where no reasonable epsilon prevents it",
            cites="Woo, Pearce and Ouellette 1996, figures 1 and 2; Amanatides and Mitchell 1990",
            options={"acne": True, "hit_error": C * u},
            when=("precision", precision),
        )
