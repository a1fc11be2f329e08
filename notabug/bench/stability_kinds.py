"""Which pixels of a sweep's picture are wrong, and what went wrong there.

A second picture, lit from the eye, tells a hole from a shadow: there nothing is dark unless nothing is seen.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from notabug.adapters.base import Declaration
from notabug.bench.stability_scenes import headlit
from notabug.metrics.image_filters import widened
from notabug.references.tracer.envelope import Envelope, trace_envelope
from notabug.references.tracer.options import Options
from notabug.references.tracer.precision import ABSOLUTE, RELATIVE
from notabug.scenes_usd.scene import Scene

Floats = npt.NDArray[np.floating]
Bools = npt.NDArray[np.bool_]

WHOLE = 0.9  # of an object's or a shadow's pixels: so many, and it is lost, not damaged
NEAR_EDGE = 1 / 32  # of the picture's width from the edge of a shadow or an outline: there, it has moved

KINDS = (
    *("acne", "lost shadow", "displaced shadow", "lost object", "stripes", "hole", "displaced outline"),
    *("wrong shade", "non-finite", "refused"),
)


@dataclass(frozen=True, slots=True, eq=False)
class Truth:
    """What a sweep's picture must be, and what it would be without shadows, lit from the eye, or with an object less.

    ``without`` holds (h, w, 3) for each object: the scene lit from the eye, with that object left out.
    """

    lit: Envelope
    unshadowed: Floats
    headlit: Envelope
    without: tuple[Floats, ...]


def truth(scene: Scene) -> Truth:
    """The truth about ``scene``, which must be well conditioned."""
    bare = headlit(scene)
    return Truth(
        lit=_envelope(scene, Options()),
        unshadowed=_envelope(scene, Options(shadows="none")).point,
        headlit=_envelope(bare, Options(shadows="none")),
        without=tuple(
            _envelope(replace(bare, objects=(*bare.objects[:k], *bare.objects[k + 1 :])), Options(shadows="none")).point
            if len(bare.objects) > 1
            else np.zeros((bare.height, bare.width, 3))
            for k in range(len(bare.objects))
        ),
    )


def _envelope(scene: Scene, options: Options) -> Envelope:
    return trace_envelope(scene, options, grid=2, refine=4, threads=1)


def wrong(picture: Floats, of: Envelope, declaration: Declaration) -> Bools:
    """(h, w) the pixels of a picture of pixel centres that are off by more than the tolerance.

    Within a pixel of an edge whatever is seen nearby is right: a renderer may round a silhouette to either side.
    """
    quantum = 0.55 * declaration.quantum * (np.abs(of.point) if declaration.relative_quantum else 1.0)
    tolerance = RELATIVE * np.abs(of.point) + ABSOLUTE + quantum
    with np.errstate(invalid="ignore"):
        off = np.abs(picture - of.point) > tolerance
        near = widened(edges(of), 1)
        window = (3, 3, 1)
        low = ndimage.minimum_filter(of.lo, window) - tolerance
        high = ndimage.maximum_filter(of.hi, window) + tolerance
        outside = (picture < low) | (picture > high)
    return np.asarray(np.where(near[..., None], outside, off).any(axis=2) | ~np.isfinite(picture).all(axis=2))


def edges(of: Envelope) -> Bools:
    """(h, w) where what is seen, or which lights reach it, changes inside the pixel or towards a neighbour."""
    found = of.edge.copy()
    across, down = of.ids[:, 1:] != of.ids[:, :-1], of.ids[1:] != of.ids[:-1]
    found[:, 1:] |= across
    found[:, :-1] |= across
    found[1:] |= down
    found[:-1] |= down
    return found


def kinds(picture: Floats, seen: Floats, of: Truth, declaration: Declaration) -> dict[str, int]:
    """Wrong pixels by kind; ``seen`` is the same renderer's picture of ``headlit`` of the scene."""
    count: dict[str, int] = {}
    left = wrong(picture, of.lit, declaration)

    def book(kind: str, mask: Bools) -> None:
        nonlocal left
        number = int((mask & left).sum())
        if number:
            count[kind] = count.get(kind, 0) + number
        left &= ~mask

    book("non-finite", np.asarray(~np.isfinite(picture).all(axis=2)))
    amiss = wrong(seen, of.headlit, declaration) & left
    close = max(1, round(NEAR_EDGE * picture.shape[1]))
    outline = _within(edges(of.headlit), close)
    rim = _within(edges(of.headlit), 1)
    for rest in of.without:
        shown = _differ(of.headlit.point, rest)
        lost = amiss & shown & ~_differ(seen, rest)
        if _is_whole(lost, shown & ~rim):
            book("lost object", lost)
        elif rest.any():
            book("stripes", lost & (rest > 0.0).any(axis=2) & ~outline)
    dark = ~(seen > 0.25 * of.headlit.point).any(axis=2) & (of.headlit.point > 0.0).any(axis=2)
    book("hole", np.asarray(amiss & dark & ~outline))
    book("displaced outline", np.asarray(amiss & outline))
    book("wrong shade", amiss)
    shadow = (of.lit.point < 0.5 * of.unshadowed).all(axis=2) & (of.unshadowed > ABSOLUTE).any(axis=2)
    light = (of.lit.point > 0.5 * of.unshadowed).any(axis=2) & (of.unshadowed > ABSOLUTE).any(axis=2)
    bright = (picture > 0.5 * of.unshadowed).any(axis=2)
    cleared = shadow & bright & left
    border = _within(edges(of.lit), close)
    if _is_whole(cleared, shadow & ~_within(edges(of.lit), 1)):
        book("lost shadow", cleared)
    else:
        book("displaced shadow", np.asarray(cleared | (light & ~bright & border & bool(cleared.any()))))
    book("acne", np.asarray(light & ~bright))
    book("wrong shade", left.copy())
    return count


def _is_whole(lost: Bools, all_of_it: Bools) -> bool:
    """Whether so much is lost of what lies off the edges, where nothing can be called wrong."""
    return bool(all_of_it.any() and (lost & all_of_it).sum() >= WHOLE * all_of_it.sum())


def _differ(a: Floats, b: Floats) -> Bools:
    with np.errstate(invalid="ignore"):
        return np.asarray(~(np.abs(a - b) <= 0.02 * np.maximum(np.abs(a), np.abs(b)) + ABSOLUTE).all(axis=2))


def _within(mask: Bools, pixels: int) -> Bools:
    return np.asarray(ndimage.binary_dilation(mask, iterations=pixels)) if mask.any() else mask
