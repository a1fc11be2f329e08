"""Step 8 of docs/judge.md, the name: the cause or fault that leaves the shortest bug leg, else ``unexplained``.

Faults are first ranked by quick pictures: how much the fault's change of the reference looks like the picture's. The
likeliest are then fitted in full, those that come in all strengths at the strength that fits.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from notabug.adapters.base import Declaration
from notabug.metrics.admissible import Admissible, residual
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
from notabug.metrics.channels import largest, pixels, total
from notabug.metrics.explain import Explanation, explain, fit
from notabug.metrics.global_fit import global_fit
from notabug.metrics.likely import changed_by, likely, refined, worth
from notabug.metrics.names import UNNAMED, Name, best_of
from notabug.metrics.noise import Measured
from notabug.metrics.policy import POLICY
from notabug.metrics.quick import Places, Predict, Preview, choices, guessed, nearer, nears
from notabug.metrics.rules import support
from notabug.metrics.sets import habits
from notabug.metrics.significance import Significance, significance
from notabug.references.models.camera import pixel_shift
from notabug.references.models.model import Model, excluded_by

Floats = npt.NDArray[np.floating]

SAME = POLICY.naming.same
OTHER = POLICY.naming.other
CHOICE = POLICY.naming.choice
FREE = POLICY.naming.free
NEARLY = POLICY.naming.nearly
SHORTER = POLICY.explain.shorter
HOPE = POLICY.naming.hope
SHARPENED = POLICY.naming.sharpened
ROUGHLY = POLICY.naming.roughly
EXACT = POLICY.names.exact
NOTHING = POLICY.names.nothing
CLIP = POLICY.likely.clip
SAME_SHIFT = POLICY.causes.same_shift
LARGEST_GROWN = POLICY.explain.largest_grown
LEAST_TOUCHED = POLICY.rules.least_touched

GONE = frozenset({"face_missing", "object_missing"})
OR_BLACK = ", or drawn black, as where their normals point away from the light"
BLACK = POLICY.naming.black
ALL_BLACK = POLICY.naming.all_black

OF_RAYS = frozenset({"acne", "start", "epsilon", "shadow_rays", "retroreflection", "unreversed", "lost_reflection"})
"""Switches of faults that only a renderer can have that follows rays from one surface to the next."""

Others = Callable[[], Iterable[tuple[str, Floats]]]
"""References of other scenes of the same size: (name, (h, w, 3))."""


def name_bug(
    measured: Measured,
    found: Explanation,
    faults: Sequence[Model],
    limitations: Sequence[Model],
    predict: Predict,
    preview: Preview,
    others: Others = tuple,
) -> Name:
    """Name the bug in ``measured``, of which ``found`` is the best explanation by ``limitations`` alone."""
    reference = predict(())
    bug = _Bug(measured, found, limitations, predict, preview, worth(measured, reference))
    exact = EXACT * min(1.0, bug.misfit(found.target))  # what leaves less leaves nothing for another to explain
    best = best_of(None, _whole(bug), exact, noisy=measured.noisy)
    if best is None or not best.is_exact(exact):
        best = best_of(best, _moved_rays(bug), exact, noisy=measured.noisy)
    for fault in (
        () if best and best.is_exact(exact) else likely(measured, found, faults, predict, preview, bug.together)
    ):
        preview_misfit = bug.likeness(fault)
        if best is None or preview_misfit < best.prune_bound(exact):
            names = (replace(each, preview_misfit=preview_misfit) for each in _fitted(bug, fault))
            best = best_of(best, names, exact, noisy=measured.noisy)
    if best is not None:
        return _of_two(bug, best, faults)
    if _alike(measured.mean, reference.value) < OTHER:
        likeness, name = max(((_alike(measured.mean, each), name) for name, each in others()), default=(0.0, ""))
        if likeness > SAME:
            return Name("wrong_scene", f"this is a picture of {name}", 0.0)
    return UNNAMED


def possible(faults: Iterable[Model], declaration: Declaration) -> list[Model]:
    """Those of ``faults`` that a renderer can have: without rays that start on surfaces none of theirs is told."""
    rays = declaration.hit_error > 0.0 and declaration.depth in ("", "unknown")
    return [each for each in faults if rays or OF_RAYS.isdisjoint(each.options)]


def _of_two(bug: _Bug, best: Name, faults: Sequence[Model]) -> Name:
    """``best``, or the fault of the texture that gives the very same picture where the whole one is upside down."""
    for fault in faults if best.name == "upside_down" else ():
        if fault.name == "flipped_v" and bug.preview_misfit(
            guessed((fault,), bug.predict, bug.preview)
        ) < HOPE * bug.preview_misfit(bug.predict(()).value):
            fitted = fit(bug.measured, (), bug.predict, (fault,))
            if _remains(bug, fitted) <= NOTHING:
                claim = f"{fault.claim}, or the picture is upside down: in this scene the two look alike"
                return replace(_named(bug, fault, fitted), message=claim)
    return best


@dataclass(frozen=True, slots=True, eq=False)
class _Bug:
    """A bug to be named: the picture, what is found in it without faults, and what a residual is worth (h, w, 3)."""

    measured: Measured
    found: Explanation
    limitations: Sequence[Model]
    predict: Predict
    preview: Preview
    scale: Floats

    @property
    def together(self) -> tuple[Model, ...]:
        """All choices that a renderer has at once, where a fault has hidden some of them but not all; else none."""
        some, every = set(choices(self.found.models)), habits(self.limitations)
        return every if some and some < set(every) else ()

    def misfit(self, to: Admissible) -> float:
        """Mean |residual| in units of tolerance and noise."""
        return float((np.abs(residual(self.measured.mean, to)) / self.scale).mean())

    def remains(self, left: Significance, *, still: bool) -> float:
        """The share of the bug leg that ``left`` is; of one without pixels whether it is ``still`` there, 0 or 1."""
        if not self.found.significance.triggers:  # only a gain or a shift: no pixel, so no leg, to be explained
            return float(still)
        return left.excess / max(self.found.significance.excess, 1e-30)

    def preview_misfit(self, value: Floats) -> float:
        """Mean |deviation| from ``value`` off the edges, in units of tolerance and noise, large ones cut off."""
        off = np.minimum(np.abs(self.measured.mean - value) / self.scale, CLIP)
        smooth = ~self.predict(()).edge
        return float(off[smooth].mean() if smooth.any() else off.mean())

    def likeness(self, fault: Model) -> float:
        """``preview_misfit`` of what the quick pictures say that ``fault`` makes of the reference or of ``found``."""
        places = dict.fromkeys(((), choices(self.found.models)))
        return min(self.preview_misfit(guessed((fault,), self.predict, self.preview, beside)) for beside in places)


def _whole(bug: _Bug) -> Iterator[Name]:
    """How well each cause in the whole picture fits, and the likeliest one beside limitations."""
    measured, found, predict = bug.measured, bug.found, bug.predict
    reference = predict(())
    nearest: tuple[float, Cause | None] = (HOPE, None)
    for base in {id(each): each for each in (reference, found.target)}.values():
        for cause in causes(measured, base):
            target = cause.under(base)
            left = significance(residual(measured.mean, target), measured, target)
            still = bool(left.triggers)
            if not still and not found.significance.triggers:  # nor may what was found in the whole picture be there
                still = bool(global_fit(measured, target, np.zeros(target.edge.shape, np.bool_)).triggers)
            remains = bug.remains(left, still=still)
            preview_misfit = bug.preview_misfit(target.value)
            yield Name(
                cause.name,
                cause.message,
                remains,
                bug.misfit(target),
                whole=True,
                preview_misfit=preview_misfit,
                numbers=cause.numbers,
            )
            if remains < nearest[0]:
                nearest = (remains, cause)
    if nearest[1] is not None and nearest[0] > 0.0:  # what it leaves may be a limitation, which it has moved as well
        cause = nearest[1]

        def quick(chosen: tuple[Model, ...], at: Places | None = None, /) -> Floats:
            value = bug.preview(chosen)
            picture = cause.under(replace(reference, value=value, lo=value, hi=value)).value
            return picture if at is None else pixels(picture, at)

        beside = explain(measured, bug.limitations, lambda chosen: cause.under(predict(chosen)), quick)
        if not beside.triggers:
            misfit, preview_misfit = bug.misfit(beside.target), bug.preview_misfit(beside.target.value)
            yield Name(
                cause.name,
                cause.message,
                0.0,
                misfit,
                beside,
                whole=True,
                preview_misfit=preview_misfit,
                numbers=cause.numbers,
            )


def _moved_rays(bug: _Bug) -> Iterator[Name]:
    """How well rays beside their pixels fit, where moving the reference brings it nearer to the picture.

    A moved picture only resembles that: at every edge it is a blend of two pixels, which leaves a bug leg of its own.
    """
    mean = bug.measured.mean
    height, width = mean.shape[:2]
    bases = {id(each): each for each in (bug.predict(()), bug.found.target)}.values()
    found = [each for base in bases for each in find_shifts(mean, base.value)]
    halves = [(x, y) for x in (0.0, -0.5, 0.5) for y in (0.0, -0.5, 0.5) if x or y]
    near = [each for each in halves if any(max(abs(each[0] - x), abs(each[1] - y)) < ROUGHLY for x, y in found)]
    other = [(x, y) for x, y in found if not any(max(abs(a - x), abs(b - y)) < SAME_SHIFT for a, b in near)]
    ranked = [(_left_by(bug, each), each) for each in dict.fromkeys((*near, *other))]
    vectors = [each for left, each in sorted(ranked) if left < HOPE][:SHARPENED]
    for place, vector in enumerate(vectors):
        model = pixel_shift(width, height, *vector)
        names = list(_ray_names(bug, model, vector))
        yield from names
        if min((each.remains for each in names), default=1.0) <= NOTHING:
            return
        left = refined_shift(mean, bug.predict((model,)).value, (0.0, 0.0))
        if place == 0 and max(map(abs, left)) > SAME_SHIFT:  # full pictures tell it better than blurred ones
            vectors.insert(1, (vector[0] + left[0], vector[1] + left[1]))


def _left_by(bug: _Bug, vector: tuple[float, float]) -> float:
    """The share of the picture's misfit that a shift leaves, by what tells it best.

    Quick pictures tell it of what is smooth, and of edges where one sample a pixel is taken; of blurred edges the moved
    reference does.
    """
    reference = bug.predict(())
    height, width = reference.edge.shape
    quick = guessed((pixel_shift(width, height, *vector),), bug.predict, bug.preview)
    shares = []
    for value in (quick, shifted(reference.value, *vector)):
        for part in (~reference.edge, ~brought_in(reference.edge.shape, *vector)):
            was, left = (
                float(np.minimum(np.abs(bug.measured.mean - each) / bug.scale, CLIP)[part].sum())
                for each in (reference.value, value)
            )
            shares.append(left / was if was > 0 else math.inf)
    return min(shares)


def _ray_names(bug: _Bug, model: Model, vector: tuple[float, float]) -> Iterator[Name]:
    mean = bug.measured.mean

    def bordered(chosen: tuple[Model, ...]) -> Admissible:
        return without_border(bug.predict(chosen), mean, *vector)

    for each in _fitted(replace(bug, predict=bordered), model):
        yield replace(each, preview_misfit=bug.likeness(model), numbers=shift_numbers(*vector))


def _fitted(bug: _Bug, fault: Model) -> Iterator[Name]:
    """How well ``fault`` fits: alone, beside limitations, closer to the strength that fits, and here and there."""
    measured, found, predict = bug.measured, bug.found, bug.predict
    if fault.local and fault.rule == "set" and not _touches(measured, found.target, predict((fault,))):
        return
    bare = nearest = fit(measured, (), predict, (fault,))
    yield _named(bug, fault, bare)
    closer = fault
    if fault.at is not None and NEARLY < _remains(bug, bare) < HOPE:  # quick pictures gave a rough strength
        closer = refined(fault, changed_by(measured, predict(())), predict, bug.scale)
    if bare.significance.excess > 0:
        beside = [
            (each,) for each in bug.limitations if _nearer(bug, bare, (fault, each)) and _useful(bug, bare, fault, each)
        ]
        for models in dict.fromkeys((found.models, bug.together, *beside)):
            if models:
                fitted = fit(measured, models, predict, (fault,))
                yield _named(bug, fault, fitted)
                nearest = min(nearest, fitted, key=lambda each: each.significance.excess)
                if nearest.significance.excess == 0:
                    break
        if nearest.models and nearest.significance.excess > 0 and _remains(bug, nearest) < HOPE:
            yield from _grown(bug, fault, nearest)
    if fault.local and fault.rule == "choice" and _touches(measured, found.target, predict((fault,))):
        patched = patchwork(measured, found.target, predict((fault,)))
        left = significance(residual(measured.mean, patched), measured, patched)
        remains = bug.remains(left, still=bool(left.triggers))
        yield Name(fault.name, fault.claim, remains, bug.misfit(patched) * FREE + CHOICE)
    if closer.strength != fault.strength:
        yield from _fitted(bug, replace(closer, at=None))
    if fault.placed is not None and NOTHING < _remains(bug, nearest) < HOPE:  # behind what is missing more may be
        more = fault.placed(nearest.significance.pixels)
        if more is not None:
            yield from _fitted(bug, more)


def _grown(bug: _Bug, fault: Model, nearest: Explanation) -> Iterator[Name]:
    """How well ``fault`` fits beside more limitations than one: each time the one that leaves the shortest bug leg.

    A renderer has all of its conventions and limitations at once, and a fault hides them from a search without it.
    """
    while nearest.significance.excess > 0 and len(nearest.models) < LARGEST_GROWN:
        others = [
            (*nearest.models, each)
            for each in bug.limitations
            if each not in nearest.models
            and not excluded_by(each, nearest.models)
            and _nearer(bug, nearest, (fault, *nearest.models, each))
            and _useful(bug, nearest, fault, each)
        ]
        fits = [fit(bug.measured, models, bug.predict, (fault,)) for models in others]
        best = min(fits, key=lambda each: each.significance.excess, default=nearest)
        if best.significance.excess > SHORTER * nearest.significance.excess:
            return
        yield _named(bug, fault, best)
        nearest = best


def _remains(bug: _Bug, fitted: Explanation) -> float:
    return bug.remains(fitted.significance, still=bool(fitted.triggers))


def _named(bug: _Bug, fault: Model, fitted: Explanation) -> Name:
    off = bug.misfit(fitted.target)
    claim = fault.claim + (OR_BLACK if fault.name in GONE and _leaves_black(bug, fitted) else "")
    numbers = {"gain": fault.strength} if fault.name == "light_gain" else {}
    if fault.rule == "choice":
        axes = 1 if fault.jointly else fault.axes  # a model of one axis tells how many there are
        return Name(fault.name, claim, _remains(bug, fitted), off, fitted, numbers=numbers, axes=axes)
    free = (fitted.freedom, fault.rule == "any")
    return Name(fault.name, claim, _remains(bug, fitted), off * FREE + CHOICE, fitted, *free)


def _leaves_black(bug: _Bug, fitted: Explanation) -> bool:
    """Whether all that the fault takes away leaves black, as the very surfaces do where no light reaches them."""
    was, left = (largest(np.asarray(each.value, np.float64)) for each in (bug.predict(()), fitted.target))
    changed = np.abs(was - left) > BLACK * float(was.max(initial=0.0))
    return bool(changed.any()) and float((left[changed] <= BLACK * was[changed]).mean()) >= ALL_BLACK


def _touches(measured: Measured, base: Admissible, other: Admissible) -> bool:
    """Whether a local fault could be more than a few wrong pixels of what it acts on."""
    acts = support(base, other)
    wrong = acts & (largest(np.abs(residual(measured.mean, base)) - base.tau) > 0)
    return float(wrong.sum()) >= LEAST_TOUCHED * float(acts.sum())


def _nearer(bug: _Bug, start: Explanation, models: tuple[Model, ...]) -> bool:
    """Whether ``models``, of which all but the last are those of ``start``, may leave less, as quick pictures tell."""
    known = choices(models[:-1])
    return nearer(bug.measured, models, start, bug.predict, bug.preview, known)[0]


def _useful(bug: _Bug, start: Explanation, fault: Model, each: Model) -> bool:
    """Whether ``each`` moves any pixel that ``start`` leaves wrong; most do not, as previews tell."""
    wrong = start.significance.pixels
    beside = (fault, *choices(start.models))
    return nears(start, each, bug.preview, beside) and bool(
        (support(bug.predict(choices(beside)), bug.predict((*choices(beside), each))) & wrong).any()
    )


def _alike(a: Floats, b: Floats) -> float:
    """The correlation of two pictures, 0 where sizes differ or one is constant."""
    if a.shape != b.shape or np.ptp(a) == 0 or np.ptp(b) == 0:
        return 0.0
    return float(np.corrcoef(a.ravel(), b.ravel())[0, 1])


def patchwork(measured: Measured, base: Admissible, other: Admissible) -> Admissible:
    """At each pixel what ``base`` or what ``other`` admits, whichever is nearer to the picture: a local fault."""
    nearer = total(np.abs(residual(measured.mean, other))) < total(np.abs(residual(measured.mean, base)))
    at = nearer[..., None]
    return Admissible(
        value=np.where(at, other.value, base.value),
        lo=np.where(at, other.lo, base.lo),
        hi=np.where(at, other.hi, base.hi),
        tau=np.maximum(base.tau, other.tau),
        edge=base.edge | other.edge,
        share=base.share,
        share_is_point=base.share_is_point,
    )
