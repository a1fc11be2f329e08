"""Step 6 of docs/judge.md, what explains it: which pictures no set of limitations can explain, told beforehand.

A renderer with several limitations changes a pixel by about the sum of what each changes. What a picture is off by far
beyond that sum, on much of what is wrong, no set explains: the search for one would cost minutes and find nothing.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from notabug.metrics.admissible import Admissible, residual
from notabug.metrics.channels import largest, pixels
from notabug.metrics.neighbours import extreme, widened
from notabug.metrics.noise import Measured
from notabug.metrics.quick import Predict, Preview, choices
from notabug.metrics.significance import Significance
from notabug.references.models.model import Model, excluded_by

Floats = npt.NDArray[np.floating]
Places = npt.NDArray[np.intp]

TOGETHER = 6  # models whose changes are added up: as many as a set may grow to
BEYOND = 3.0  # times that sum: what two limitations do together may be more than what each does alone
MOST_FACTORS = 4  # choices, those that make the most of a pixel, on top of which all others are looked at
NOISE = 4.0  # standard errors that a pixel may be off by chance
LEAST_SHARE = 0.05  # of the wrong pixels that must be out of reach
LEAST_PIXELS = 16  # and their number: fewer may be edges that no quick picture shows
FEWEST = 2  # where what each model admits is predicted
TOLD_BY = 512  # pixels, evenly spread, that tell of all


def out_of_reach(
    measured: Measured,
    bare: Significance,
    models: Sequence[Model],
    together: tuple[Model, ...],
    predict: Predict,
    preview: Preview,
    *,
    fully: bool = False,
) -> bool:
    """Whether some of what is wrong with a picture, ``bare``, is farther from the reference than ``models`` reach.

    Each of ``models`` is looked at alone, on top of ``together``, the conventions that a renderer has all at once, and
    on top of each choice that multiplies what is there. Of quick pictures only pixels off edges tell; by how much their
    neighbours differ, a pixel may change as well. ``fully`` predicts what each model alone admits: all pixels tell.
    """
    reference = predict(())
    at = np.flatnonzero(bare.pixels if fully else bare.pixels & ~widened(reference.edge, 1))
    counted, least = at.size, LEAST_SHARE * np.count_nonzero(bare.pixels)
    least = max(FEWEST if fully else LEAST_PIXELS, least)
    if counted < least:
        return False
    at = at[:: max(1, counted // TOLD_BY)]
    away = pixels(residual(measured.mean, reference), at)
    towards = np.sign(away)
    off = np.abs(away) - pixels(reference.tau, at) - NOISE * np.sqrt(pixels(measured.variance, at))
    if not fully:  # what the centre of a pixel does not show, those of its neighbours do
        off -= pixels(extreme(reference.value, np.maximum) - extreme(reference.value, np.minimum), at)
    start = preview((), at)
    bases = [(), *([together] if len(together) > 1 else []), *_factors(models, start, at, preview)]
    reached: dict[str, Floats] = {}  # of the values of a feature a renderer has one
    for model in models:
        feature = model.when[0] if model.when else model.name
        beside = [base for base in bases if model not in base and not excluded_by(model, base)]
        most = _reach(model, beside, at, towards, preview)
        if fully:
            admitted = [predict((value,)) for value in model.values()]
            most = np.maximum.reduce([most, *(_admits(reference, each, at, towards) for each in admitted)])
        reached[feature] = np.maximum(reached.get(feature, 0.0), most)
    if together:
        reached[""] = np.maximum((preview(together, at) - start) * towards, 0.0)
    most = np.sort(np.array([*reached.values(), np.zeros_like(off)]), axis=0)[-TOGETHER:].sum(axis=0)
    return bool(np.count_nonzero(largest(off - BEYOND * most) > 0) / at.size * counted >= least)


def _admits(reference: Admissible, other: Admissible, at: Places, towards: Floats) -> Floats:
    """By how much (n, 3) ``other`` admits more than ``reference`` at the pixels ``at`` (n,), ``towards`` a picture."""
    more = pixels(other.hi + other.tau - reference.hi - reference.tau, at)
    less = pixels(reference.lo - reference.tau - other.lo + other.tau, at)
    return np.maximum(np.where(towards > 0, more, less), 0.0)


def _factors(models: Sequence[Model], start: Floats, at: Places, preview: Preview) -> list[tuple[Model, ...]]:
    """Those choices among ``models`` that more than double the pixels ``at`` (n,): what others change there grows too.

    Lobes are normalised by factors up to half their exponent, and interpolated colours spread what is multiplied.
    """
    growth = {(model,): float(np.max(preview((model,), at) - 2.0 * start)) for model in choices(models)}
    return sorted((base for base, most in growth.items() if most > 0), key=lambda base: -growth[base])[:MOST_FACTORS]


def _reach(model: Model, bases: Sequence[tuple[Model, ...]], at: Places, towards: Floats, preview: Preview) -> Floats:
    """By how much (n, 3) ``model`` moves the pixels ``at`` (n,), at most, ``towards`` a picture (n, 3: the sign)."""
    moved = [(preview((*base, value), at) - preview(base, at)) * towards for base in bases for value in model.values()]
    if model.rule == "any":
        return np.where(np.any(moved, axis=0), np.inf, 0.0)
    return np.maximum(np.maximum.reduce(moved), 0.0)
