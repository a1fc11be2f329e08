"""Step 6 of docs/judge.md, what explains it: which sets of models may help, as quick pictures tell beforehand.

A quick picture has one sample a pixel, at its centre. What it changes is what the mean changes, but for edges.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Protocol

import numpy as np
import numpy.typing as npt

from notabug.metrics.admissible import Admissible
from notabug.metrics.channels import largest, pixels
from notabug.metrics.image_filters import widened
from notabug.metrics.noise import Measured
from notabug.metrics.policy import POLICY
from notabug.references.models.model import Model
from notabug.references.tracer.envelope import AROUND

if TYPE_CHECKING:
    from notabug.metrics.explain import Explanation

Floats = npt.NDArray[np.floating]
Places = npt.NDArray[np.intp]
Predict = Callable[[tuple[Model, ...]], Admissible]
"""What a set of models admits, for one scene and one renderer's declaration."""


class Preview(Protocol):
    """Quick pictures of sets of models, for one scene."""

    def __call__(self, chosen: tuple[Model, ...], at: Places | None = None, /) -> Floats:
        """The picture (h, w, 3), by one sample a pixel; or its pixels numbered ``at`` (n,), (n, 3)."""


def choices(models: Sequence[Model]) -> tuple[Model, ...]:
    """Those of ``models`` that replace the reference."""
    return tuple(model for model in models if model.rule == "choice")


def guessed(models: tuple[Model, ...], predict: Predict, preview: Preview, beside: tuple[Model, ...] = ()) -> Floats:
    """The picture (h, w, 3) of ``models`` on top of ``beside``, without predicting it; good off edges.

    Quick pictures are of the centres of pixels: their difference is the mean's.
    """
    return np.asarray(predict(beside).value + (preview((*beside, *models)) - preview(beside)))


def nearer(
    measured: Measured,
    models: tuple[Model, ...],
    best: Explanation,
    predict: Predict,
    preview: Preview,
    known: tuple[Model, ...] = (),
) -> tuple[bool, float]:
    """Whether ``models`` may leave less than ``best``, as a quick picture tells off edges, and what it leaves there.

    What they change is added to the prediction of ``known``, choices among them. Quick pictures tell nothing where most
    wrong pixels lie at edges, unless the picture itself is one. Of models that are no choices, which may show anything
    between, nothing is left where they act.
    """
    start = predict(known)
    smooth = ~(predict(()).edge | start.edge) | start.share_is_point
    wrong = best.significance.pixels
    if not smooth.any() or float((wrong & smooth).sum()) < POLICY.quick.least_told * float(wrong.sum()):
        return True, 0.0
    spots = wrong & smooth if wrong.any() else smooth  # else it is a gain, a shift, or what is faint and wide
    told, around = (_spread(np.flatnonzero(each)) for each in (spots, smooth))
    at = np.concatenate([told, around])
    value, tau, mean, had = (pixels(each, at) for each in (start.value, start.tau, measured.mean, best.target.value))
    still = preview(known, at)

    def off(picture: Floats) -> Floats:
        return np.maximum(largest(np.abs(mean - picture) - tau), 0.0)

    def left_by(some: tuple[Model, ...]) -> Floats:
        chosen = (*known, *(choice for choice in choices(some) if choice not in known))
        quick = preview(chosen, at)
        left = off(value + (quick - still))
        for each in some:
            if each.rule != "choice":
                for other in each.values():
                    left[largest(np.abs(preview((*chosen, other), at) - quick) - POLICY.quick.acts * tau) > 0] = 0.0
        return left

    left, was = left_by(models), off(had)
    count, of_each = told.size, np.count_nonzero(smooth) / around.size
    before, after, rest = (float(each.sum()) for each in (was[:count], left[:count], left[count:] * of_each))
    if after >= (POLICY.quick.nearer if wrong.any() else 1.0) * before and before > 0.0:
        return False, rest
    most = POLICY.quick.farther * max(float(was[count:].sum()) * of_each, best.significance.excess)
    # between centres quick pictures are wrong, also of what explains most: it is measured alike
    return bool(
        rest <= most or rest <= POLICY.quick.farther * float(left_by(best.models)[count:].sum()) * of_each
    ), rest


def _spread(places: Places) -> Places:
    """At least `quick.told_by` of ``places`` (n,), at most twice as many, evenly spread; all if they are fewer."""
    return places[:: max(1, places.size // POLICY.quick.told_by)]


def nears(start: Explanation, model: Model, preview: Preview, fixed: tuple[Model, ...] = ()) -> bool:
    """Whether ``model`` changes, on top of ``fixed``, the centre of a pixel within AROUND of one to be explained."""
    near = np.flatnonzero(widened(start.significance.pixels, AROUND))
    base = pixels(preview(fixed), near)
    return not near.size or any(
        bool((pixels(preview((*fixed, value)), near) != base).any()) for value in model.values()
    )


def surely_helps(bare: Explanation, model: Model, preview: Preview) -> bool:
    """Whether ``model`` moves the centre of a pixel that needs explaining, off edges, by more than the tolerance."""
    at = np.flatnonzero(bare.significance.pixels & ~bare.target.edge)
    start, tau = pixels(preview(()), at), POLICY.quick.surely * pixels(bare.target.tau, at)
    return any(bool((np.abs(pixels(preview((value,)), at) - start) > tau).any()) for value in model.values())
