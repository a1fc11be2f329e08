"""Step 6 of docs/judge.md, what explains it: which pictures no set of limitations can explain, told beforehand.

A renderer with several limitations changes a pixel by about the sum of what each changes. What a picture is off by far
beyond that sum, on much of what is wrong, no set explains: the search for one would cost minutes and find nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from notabug.metrics.admissible import Admissible, residual
from notabug.metrics.channels import largest, pixels
from notabug.metrics.image_filters import extreme, widened
from notabug.metrics.noise import Measured
from notabug.metrics.policy import POLICY
from notabug.metrics.quick import Predict, Preview, choices
from notabug.metrics.significance import Significance
from notabug.references.models.model import Model, excluded_by

Floats = npt.NDArray[np.floating]
Places = npt.NDArray[np.intp]


@dataclass(frozen=True, slots=True, eq=False)
class Reach:
    """How far models move the wrong pixels of a picture towards it, as far as each by itself tells.

    ``at`` (n,) are some of them, of which one stands for ``each``. ``off`` (n, 3) is how far they are from the
    reference, beyond tolerance and noise, and ``towards`` the sign. ``moves`` is how far each model brings them nearer
    (n, 3), and ``joint`` all conventions at once. A picture is out of reach where ``least`` pixels are.
    """

    at: Places
    each: float
    off: Floats
    towards: Floats
    moves: dict[Model, Floats]
    joint: Floats
    least: float

    def leaves(self, chosen: Sequence[Model], preview: Preview) -> float:
        """What the models ``chosen`` leave of the picture's deviation at the least, each having been looked at."""
        alone = np.asarray(sum((self.moves[model] for model in chosen), np.zeros_like(self.off)))
        beside = (preview(choices(chosen), self.at) - preview((), self.at)) * self.towards
        left = np.maximum(self.off - POLICY.reach.room * np.maximum(alone, beside), 0.0)
        return float(largest(left).sum()) * self.each

    def beyond_all(self) -> bool:
        """Whether no set of `explain.largest_grown` models, one of each feature, reaches the picture."""
        features: dict[str, Floats] = {"": self.joint}
        for model, moved in self.moves.items():
            feature = model.when[0] if model.when else model.name
            features[feature] = np.maximum(features.get(feature, 0.0), moved)
        moved = np.sort(np.array(list(features.values())), axis=0)[-POLICY.explain.largest_grown :].sum(axis=0)
        return bool(np.count_nonzero(largest(self.off - POLICY.reach.beyond * moved) > 0) * self.each >= self.least)


def reach(
    measured: Measured,
    bare: Significance,
    models: Sequence[Model],
    together: tuple[Model, ...],
    predict: Predict,
    preview: Preview,
    *,
    fully: bool = False,
) -> Reach | None:
    """How far ``models`` reach what is wrong with a picture, ``bare``; None where too few pixels tell.

    Each model is looked at alone, on top of ``together``, the conventions that a renderer has all at once, and on top
    of each choice that multiplies what is there. Of quick pictures only pixels off edges tell; by how much their
    neighbours differ, a pixel may change as well. ``fully`` predicts what each model alone admits: all pixels tell.
    """
    reference = predict(())
    at = np.flatnonzero(bare.pixels if fully else bare.pixels & ~widened(reference.edge, 1))
    counted = at.size
    least = float(
        max(
            POLICY.reach.fewest if fully else POLICY.reach.least_pixels,
            POLICY.reach.least_share * np.count_nonzero(bare.pixels),
        )
    )
    if counted < least:
        return None
    at = at[:: max(1, counted // POLICY.reach.told_by)]
    away = pixels(residual(measured.mean, reference), at)
    towards = np.sign(away)
    off = np.abs(away) - pixels(reference.tau, at) - POLICY.reach.noise * np.sqrt(pixels(measured.variance, at))
    if not fully:  # what the centre of a pixel does not show, those of its neighbours do
        off -= pixels(extreme(reference.value, np.maximum) - extreme(reference.value, np.minimum), at)
    start = preview((), at)
    bases = [(), *([together] if len(together) > 1 else []), *_factors(models, start, at, preview)]
    moves = {}
    for model in models:
        beside = [base for base in bases if model not in base and not excluded_by(model, base)]
        most = _reach(model, beside, at, towards, preview)
        if fully:
            admitted = [predict((value,)) for value in model.values()]
            most = np.maximum.reduce([most, *(_admits(reference, other, at, towards) for other in admitted)])
        moves[model] = most
    joint = np.maximum((preview(together, at) - start) * towards, 0.0) if together else np.zeros_like(off)
    return Reach(at, counted / at.size, off, towards, moves, joint, least)


def _admits(reference: Admissible, other: Admissible, at: Places, towards: Floats) -> Floats:
    """By how much (n, 3) ``other`` admits more than ``reference`` at the pixels ``at`` (n,), ``towards`` a picture."""
    more = pixels(other.hi + other.tau - reference.hi - reference.tau, at)
    less = pixels(reference.lo - reference.tau - other.lo + other.tau, at)
    return np.maximum(np.where(towards > 0, more, less), 0.0)


def _factors(models: Sequence[Model], start: Floats, at: Places, preview: Preview) -> list[tuple[Model, ...]]:
    """Those choices among ``models`` that more than double the pixels ``at`` (n,): what others change there grows too.

    Lobes are normalised by factors up to half their exponent, and interpolated colours spread what is multiplied.
    """
    growth = [(float(np.max(preview((model,), at) - 2.0 * start)), model) for model in choices(models)]
    growth.sort(key=lambda grown: -grown[0])
    return [(model,) for most, model in growth[: POLICY.reach.most_factors] if most > 0]


def _reach(model: Model, bases: Sequence[tuple[Model, ...]], at: Places, towards: Floats, preview: Preview) -> Floats:
    """By how much (n, 3) ``model`` moves the pixels ``at`` (n,), at most, ``towards`` a picture (n, 3: the sign)."""
    moved = [(preview((*base, value), at) - preview(base, at)) * towards for base in bases for value in model.values()]
    if model.rule == "any":
        return np.where(np.any(moved, axis=0), np.inf, 0.0)
    return np.asarray(np.maximum(np.maximum.reduce(moved), 0.0))
