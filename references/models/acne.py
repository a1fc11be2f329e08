"""Surface acne: light that a surface takes from itself because its own hit point is off by rounding."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from notabug.references.models.model import Model
from notabug.scenes_usd.scene import Mesh, Scene

_PAPER = "Woo, Pearce and Ouellette 1996, Surface acne and figures 1 and 2"
_EPSILON = "Haines 1989, in Glassner, An Introduction to Ray Tracing; Amanatides and Mitchell 1990"

# The hit point's error is at most C * u * (|O| + t + |x|), u the roundoff of the renderer's precision; 8 covers the
# terms of a float32 intersection (Pharr, Jakob and Humphreys 2023, section 6.8). Adapters state what was measured.
C = 8.0
ROUNDOFF = {"float32": 2.0**-24, "float64": 2.0**-53}
# A sphere's quadratic takes b^2 - c, both about |O - C|^2, for a discriminant of (r cos)^2: what it is off by moves the
# hit by that over 2 r. Of 2e5 float32 rays from 5 to 300 radii the worst was 3.9 u |O - C|^2 / r, by each of three ways
# to write the formula (Haines, Guenther and Akenine-Moeller 2019, Ray Tracing Gems 7, has the stable one).
SPHERE_C = 4.0
CONSTANT = 1e-3  # an epsilon for scenes of about the size one; a tenth of it is too small from an offset of 1000 on
# Epsilons of these shares of the picture's width detach contact shadows: by the first by 13 of 256 pixels, and by the
# second, of which a smaller epsilon lights a share that shows, by three.
LARGE = (0.05, 0.0125)
MASKS = 3  # lights that are lost each by itself; of more lights all or one


def models(scene: Scene) -> Iterator[Model]:
    """Models of a scene with lights and something to be hit."""
    if not scene.lights or not scene.objects:
        return
    lost = lost_lights(len(scene.lights))
    off = {"hit_error": C * ROUNDOFF["float32"], "sphere_error": SPHERE_C * ROUNDOFF["float32"]}
    yield Model(
        name="acne",
        kind="limitation",
        rule="set",
        claim="the surface shadows itself where no reasonable epsilon prevents it",
        cites=f"{_PAPER}; {_EPSILON}",
        options={"acne": lost[0], **off},
        others=tuple({"acne": each, **off} for each in lost[1:]),
        shows="dots",
        declared=("hit_error", "sphere_error"),
    )
    # a ray that is reflected or refracted at the wrong side of its own surface may see anything
    bends = any(material.sends_on for material in scene.materials)
    yield Model(
        name="no_epsilon",
        kind="fault",
        rule="any" if bends else "set",
        claim="rays meet the surface that they start on, since no epsilon keeps them off it",
        cites=f"{_PAPER}; {_EPSILON}",
        options={"acne": lost[0], "hit_error": np.inf},
        others=tuple({"acne": each, "hit_error": np.inf} for each in lost[1:]),
        shows="dots_everywhere",
        drawn={"start": "none"},
    )
    seen = width_of_view(scene)
    for share in LARGE:
        yield Model(
            name="epsilon_too_large",
            kind="fault",
            rule="set",
            claim="an epsilon is so large that shadows do not reach what throws them, or are lost: it is up to"
            f" {share:g} of the width of the view",
            cites=f"{_PAPER}; {_EPSILON}",
            options={"start": "absolute", "epsilon": share * seen},
        )
    # one that is a pixel wide or more is drawn too large, else too small
    drawn = CONSTANT if seen / scene.width < CONSTANT else CONSTANT / 10
    short = {"start": "absolute", "epsilon": CONSTANT / 10, **off}
    yield Model(
        name="epsilon_not_scaled",
        kind="fault",
        rule="set",
        claim="one constant epsilon serves scenes of every size, offset and distance",
        cites=f"{_PAPER}; {_EPSILON}; POV-Ray 3.7 passes over what a ray meets within .001",
        options={"start": "absolute", "epsilon": CONSTANT},
        others=tuple({**short, "acne": each} for each in lost),
        declared=("hit_error", "sphere_error"),
        drawn={"start": "absolute", "epsilon": drawn},
    )


def lost_lights(lights: int) -> list[int]:
    """Which lights a sample may lose, as bits: all of them, and then fewer."""
    if lights > MASKS:
        return [-1, *(1 << k for k in range(lights))]
    return [-1, *range(1, 2**lights - 1)]


def width_of_view(scene: Scene) -> float:
    """How wide a stretch the picture shows, at the mean distance of the objects."""
    centres: list[Any] = [
        (shape.points.min(axis=0) + shape.points.max(axis=0)) / 2 if isinstance(shape, Mesh) else shape.to_world[3, :3]
        for shape in scene.objects
    ]
    axis = -scene.camera.to_world[2, :3]
    distance = float(np.mean([(centre - scene.camera.to_world[3, :3]) @ axis for centre in centres]))
    return float(2.0 * scene.camera.tan_x * scene.camera.spans(abs(distance)))
