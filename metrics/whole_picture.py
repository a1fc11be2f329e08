"""Step 8 of docs/judge.md, the name: what may be wrong with the whole picture, and rays that pass beside its pixels."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from notabug.metrics.admissible import Admissible, residual
from notabug.metrics.bug_leg import Bug
from notabug.metrics.causes import (
    Cause,
    brought_in,
    causes,
    find_shifts,
    refined_shift,
    shift_numbers,
    shifted,
    without_border,
)
from notabug.metrics.channels import pixels
from notabug.metrics.explain import Explanation, explain
from notabug.metrics.fitted import fitted
from notabug.metrics.global_fit import global_fit
from notabug.metrics.lattice import Lattice
from notabug.metrics.names import Name
from notabug.metrics.policy import POLICY
from notabug.metrics.quick import Places
from notabug.metrics.significance import significance
from notabug.references.models.camera import pixel_shift
from notabug.references.models.model import Model

Floats = npt.NDArray[np.floating]


def whole_picture(bug: Bug) -> list[tuple[Name, Cause]]:
    """How well each cause in the whole picture fits."""
    measured, found = bug.measured, bug.found
    names = []
    for base in {id(each): each for each in (bug.predict(()), found.target)}.values():
        for cause in causes(measured, base):
            if bug.is_farther(base, cause):
                continue
            target = cause.under(base)
            left = significance(residual(measured.mean, target), measured, target)
            still = bool(left.triggers)
            if not still and not found.significance.triggers:  # nor may what was found in the whole picture be there
                still = bool(global_fit(measured, target, np.zeros(target.edge.shape, np.bool_)).triggers)
            names.append((_of_whole(bug, cause, target, bug.remains(left, still=still)), cause))
    return names


def _of_whole(bug: Bug, cause: Cause, target: Admissible, remains: float, beside: Explanation | None = None) -> Name:
    return Name(
        cause.name,
        cause.message,
        remains,
        bug.misfit(target),
        beside,
        whole=True,
        preview_misfit=bug.preview_misfit(target.value),
        numbers=cause.numbers,
        strengths=cause.strengths,
        moves=cause.moves,
    )


def beside_limitations(bug: Bug, cause: Cause) -> Iterator[Name]:
    """How well a ``cause`` fits beside limitations, which it has moved as well."""
    reference = bug.predict(())

    def quick(chosen: tuple[Model, ...], at: Places | None = None, /) -> Floats:
        if at is not None and cause.of_values is not None:
            return cause.of_values(bug.preview(chosen, at))
        value = bug.preview(chosen)
        picture = cause.under(replace(reference, value=value, lo=value, hi=value)).value
        return picture if at is None else pixels(picture, at)

    beside = explain(bug.measured, bug.limitations, lambda chosen: cause.under(bug.predict(chosen)), quick)
    if not beside.triggers:
        yield _of_whole(bug, cause, beside.target, 0.0, beside)


def moved_rays(bug: Bug) -> Iterator[Name]:
    """How well rays beside their pixels fit, where moving the reference brings it nearer to the picture.

    A moved picture only resembles that: at every edge it is a blend of two pixels, which leaves a bug leg of its own.
    """
    mean = bug.measured.mean
    height, width = mean.shape[:2]
    bases = {id(each): each for each in (bug.predict(()), bug.found.target)}.values()
    found = [each for base in bases for each in find_shifts(mean, base.value)]
    halves = [(x, y) for x in (0.0, -0.5, 0.5) for y in (0.0, -0.5, 0.5) if x or y]
    near = [
        each
        for each in halves
        if any(max(abs(each[0] - x), abs(each[1] - y)) < POLICY.whole_picture.roughly for x, y in found)
    ]
    other = [
        (x, y) for x, y in found if not any(max(abs(a - x), abs(b - y)) < POLICY.causes.same_shift for a, b in near)
    ]
    ranked = [(_left_by(bug, each), each) for each in dict.fromkeys((*near, *other))]
    vectors = [each for left, each in sorted(ranked) if left < POLICY.bug_leg.hope][: POLICY.whole_picture.sharpened]
    for place, vector in enumerate(vectors):
        model = pixel_shift(width, height, *vector)
        names = list(_ray_names(bug, model, vector))
        yield from names
        if min((each.remains for each in names), default=1.0) <= POLICY.names.nothing:
            return
        left = refined_shift(mean, bug.predict((model,)).value, (0.0, 0.0))
        # full pictures tell it better than blurred ones
        if place == 0 and max(map(abs, left)) > POLICY.causes.same_shift:
            vectors.insert(1, (vector[0] + left[0], vector[1] + left[1]))


def _left_by(bug: Bug, vector: tuple[float, float]) -> float:
    """The share of the picture's misfit that a shift leaves, by what tells it best.

    Quick pictures tell it of what is smooth, and of edges where one sample a pixel is taken; of blurred edges the moved
    reference does. A shift of what is flat is wrong in lines of one pixel, which may lie between those of the lattice:
    where it sees next to none of them, every pixel is looked at.
    """
    reference = bug.predict(())
    height, width = reference.edge.shape
    seen = np.count_nonzero(bug.look.of(bug.found.significance.pixels))
    look = bug.look if seen >= POLICY.bug_leg.few_told else Lattice(height, width, step=1)
    model = pixel_shift(width, height, *vector)
    start, picture, scale = (look.of(each) for each in (reference.value, bug.measured.mean, bug.scale))
    quick = start + (look.preview(bug.preview, (model,)) - look.preview(bug.preview, ()))
    shares = []
    for value in (quick, look.of(shifted(reference.value, *vector))):
        for part in (~reference.edge, ~brought_in(reference.edge.shape, *vector)):
            was, left = (
                float(np.minimum(np.abs(picture - each) / scale, POLICY.likely.clip)[look.of(part)].sum())
                for each in (start, value)
            )
            shares.append(left / was if was > 0 else math.inf)
    return min(shares)


def _ray_names(bug: Bug, model: Model, vector: tuple[float, float]) -> Iterator[Name]:
    mean = bug.measured.mean

    def bordered(chosen: tuple[Model, ...]) -> Admissible:
        return without_border(bug.predict(chosen), mean, *vector)

    likeness = bug.likeness(model)
    for each in fitted(replace(bug, predict=bordered), model):
        yield replace(each, preview_misfit=likeness, numbers=shift_numbers(*vector), strengths=vector)
