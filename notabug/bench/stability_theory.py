"""Where rounding must break a renderer: first-order error analysis of each sweep, in one place.

u is the unit roundoff. A computed hit point is off by at most gamma_3 = 3u/(1 - 3u) of what entered it (Higham 2002,
*Accuracy and Stability of Numerical Algorithms*, lemma 3.1; Pharr, Jakob and Humphreys 2023, *Physically Based
Rendering*, section 6.8). A pixel is wrong once that error changes its value by the tolerance, or takes it across a
surface, a shadow ray's start or a step of the depth buffer. Constants are geometry of the stages, not fitted.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from notabug.bench import stability_scenes as stages
from notabug.references.tracer.precision import RELATIVE

UNIT = {"float32": 2.0**-24, "float64": 2.0**-53}

LIGHT = 5.0  # from the lamp to what it lights
SHIFT = RELATIVE / 2.0 * LIGHT  # of a surface along the light: E falls with the square of the distance
SLOPE = 0.6  # |N.D| of the central ray on a floor
SHARE = 0.01  # of the pixels: so many wrong ones are an onset
STEEP = 0.4 * 2.0 * math.pi / 0.5  # of the texture: relative change of its value for each 1 of uv
CELL = 1.0  # edge of a facet of the low light's floor
STEEPNESS = 0.5  # |N.L| on the still life
BLOCKER = 0.5  # typical distance from a shadow to what throws it, and between an object and what it hides


@dataclass(frozen=True, slots=True)
class Arithmetic:
    """What error analysis must know of a renderer.

    Attributes
    ----------
    unit : unit roundoff of its intersections; storage : of the points it keeps.
    start, start_relative : shadow rays begin (or count blockers from) start + start_relative * |p| off the surface.
    lifted : they begin that far along the normal, where the surface's own rounding does not reach.
    depth_bits : of a depth buffer, 0 where there is none; it then casts no shadows.
    exact_highlight : the lobe is computed from 1 - cosine, without cancellation.
    barycentric : a hit's place comes from its barycentric coordinates, not from a plane.
    """

    unit: float
    storage: float
    start: float = 0.0
    start_relative: float = 0.0
    lifted: bool = False
    depth_bits: int = 0
    exact_highlight: bool = False
    barycentric: bool = True


def gamma(unit: float) -> float:
    """gamma_3: the error bound of three roundings."""
    return 3.0 * unit / (1.0 - 3.0 * unit)


def far_camera(a: Arithmetic) -> float:
    """t has the relative error gamma_3, so the hit slides gamma_3 d along the ray: its light changes, then its shadow.

    A depth buffer's planes go along with the camera, so its step grows with d until it hides objects.
    """
    if a.depth_bits:
        return BLOCKER * stages.DISTANCE / depth_step(a, stages.DISTANCE / 10.0, stages.DISTANCE * 10.0)
    return min(SHIFT, _covered(a)) / gamma(a.unit)


def _covered(a: Arithmetic) -> float:
    """The error of a hit that a fixed start along the shadow ray covers: start times N.L; beyond it there is acne."""
    return STEEPNESS * a.start if a.start and not a.lifted else math.inf


def offset(a: Arithmetic) -> float:
    """Points and hits are rounded to gamma_3 p, until a fixed start does not cover that; one that grows with |p| passes
    close blockers."""
    if a.depth_bits:
        return SHIFT / gamma(max(a.unit, a.storage))
    found = min(SHIFT / gamma(max(a.unit, a.storage)), _covered(a) / gamma(a.unit))
    return min(found, BLOCKER / a.start_relative) if a.start_relative else found


def shrunk(a: Arithmetic) -> float:
    """Blockers come closer than where shadow rays start; rounding is relative and does not matter."""
    return a.start / BLOCKER if a.start and not a.depth_bits else 0.0


def grown(a: Arithmetic) -> float:
    """Rounding grows with the scene, until a fixed start of shadow rays does not cover it; else nothing happens."""
    return math.inf if a.depth_bits else _covered(a) / (gamma(a.unit) * stages.DISTANCE)


def low_light(a: Arithmetic) -> float:
    """N.L is a small difference of products: off by gamma_3, it is off by gamma_3 / sin(elevation) of itself.

    And a point sunk by e sees its surface again e / sin(elevation) away: beyond a fixed start, or, where the facet
    itself is left out, on another one once that is SHARE of a facet. A start off the surface prevents it.
    """
    shade = gamma(max(a.unit, a.storage)) / RELATIVE
    sunk = gamma(a.unit) * stages.DISTANCE / 2.0
    acne = 0.0 if a.depth_bits or a.lifted else sunk / (a.start or SHARE * CELL)
    return math.degrees(math.asin(min(1.0, max(shade, acne))))


def gap(a: Arithmetic) -> float:
    """Two sheets are gap / |N.D| apart along a ray; a hit is off by gamma_3 of distance and size, a depth by its step.

    Points rounded when they are stored move a sheet by u / sqrt(3), the standard deviation of a rounding, where
    coordinates are about 1.
    """
    if a.depth_bits:
        return SLOPE * depth_step(a, stages.DISTANCE / 10.0, stages.DISTANCE * 10.0)
    return max(SLOPE * gamma(a.unit) * stages.DISTANCE, a.storage / math.sqrt(3.0))


def near_plane(a: Arithmetic) -> float:
    """The near plane whose depth step is the distance of the sheets: step = z^2 (1/n - 1/f) / 2^b."""
    if not a.depth_bits:
        return 0.0
    return stages.DISTANCE**2 / 2.0**a.depth_bits * SLOPE / stages.NEAR_GAP


def depth_step(a: Arithmetic, near: float, far: float) -> float:
    """The step of a depth buffer at the target, in units of length along the axis."""
    return stages.DISTANCE**2 * (1.0 / near - 1.0 / far) / 2.0**a.depth_bits


def sliver(a: Arithmetic) -> float:
    """An edge function's products, (L/2)^2, are rounded to u each and divided by the area L w: a barycentric coordinate
    is off by u L / (4 w), and a place between corners L apart by u L^2 / (4 w).

    From a plane, or after clipping, only the corners' own rounding counts, gamma_3 L.
    """
    if a.barycentric and not a.depth_bits:
        return math.sqrt(4.0 * stages.STRIP * SHIFT / max(a.unit, a.storage)) / stages.STRIP
    return SHIFT / gamma(max(a.unit, a.storage)) / stages.STRIP


def exponent(a: Arithmetic) -> float:
    """cos^n multiplies the cosine's relative error by n."""
    return math.inf if a.exact_highlight else RELATIVE / gamma(a.unit)


def uv_magnitude(a: Arithmetic) -> float:
    """uv is rounded to u |uv|, and the texture changes by STEEP for each 1 of uv."""
    return RELATIVE / (gamma(a.unit) * STEEP)


Prediction = Callable[[Arithmetic], float]
