"""Step 8: the name of a bug: the cause or fault that leaves the shortest bug leg, else ``unexplained``.

Faults are first ranked by quick pictures: how much the fault's change of the reference looks like the picture's. The
likeliest are then fitted in full, those that come in all strengths at the strength that fits.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import numpy.typing as npt

from notabug.adapters.base import Declaration
from notabug.metrics.admissible import Admissible, residual
from notabug.metrics.causes import (
    SAME_SHIFT,
    Cause,
    brought_in,
    causes,
    find_shifts,
    refined_shift,
    shift_numbers,
    shifted,
    without_border,
)
from notabug.metrics.channels import largest, total
from notabug.metrics.explain import (
    LARGEST_GROWN,
    LEAST_TOUCHED,
    Explanation,
    Predict,
    Preview,
    choices,
    explain,
    fit,
    guessed,
    nears,
    support,
)
from notabug.metrics.noise import Measured
from notabug.metrics.nuisance import nuisance
from notabug.metrics.significance import Significance, significance
from notabug.references.models.camera import pixel_shift
from notabug.references.models.model import Model

Floats = npt.NDArray[np.floating]

STEPS = (4, 1)  # pixels a block: a texture that has moved by more than a texel is found only where it is blurred
REMAINS = 0.15  # a name may leave this much of the bug leg: right ones leave .08, a gamma in the place of an albedo .18
SAME = 0.97  # correlation from which two pictures show the same scene
NOTHING = 0.02  # what a name leaves where two renderers see different surfaces at an edge
OTHER = 0.7  # and below which they do not
LIKELY = 8  # faults that are fitted in full, where their quick pictures look alike
ALIKE = 0.3  # correlation of the changes below which a fault is not tried
LEAST_ALIKE, FEW = 0.1, 2  # and below which it is not even where fewer faults than FEW are more alike
CLIP = 30.0  # tolerances: a larger change counts no more, or one highlight would decide
CHOICE, FREE = 0.05, 1.1  # what a local fault's misfit is raised by, for it may choose at each pixel, in noise too
NEARLY = 0.03  # a strength that leaves this is good enough
SHORTER = 0.9  # of the bug leg that a further limitation may leave, or it is not one more
HOPE = 0.7  # a fault that leaves more than this of the bug leg is not tried beside limitations
EXACT = 0.01  # misfit, and share of it, that a cause in the whole picture may leave which no fault need be tried after
WORSE = 1.5  # a fault whose quick picture deviates so much more than that of one that leaves nothing is not fitted
NOISE = 1.0  # misfit of a picture that a fault explains: .8 where all of it is Gaussian noise
LADEN = 1.1  # of two names that leave nothing, by how much a limitation more must lower the misfit
SHARPENED = 3  # vectors of a shift that are predicted in full, and one more
ROUGHLY = 0.55  # pixels by which a shift may be mistaken where edges are aliased
BETTER = 0.97  # of two names the one tried first stays unless the other's misfit is smaller by this factor

RARE = frozenset({"geometry_mirrored"})
"""Faults that are tried after others that look alike: a mirrored floor shows what a flipped texture shows."""
OF_RAYS = frozenset({"acne", "start", "epsilon", "shadow_rays", "retroreflection", "unreversed", "lost_reflection"})
"""Switches of faults that only a renderer can have that follows rays from one surface to the next."""

Others = Callable[[], Iterable[tuple[str, Floats]]]
"""References of other scenes of the same size: (name, (h, w, 3))."""


@dataclass(frozen=True, slots=True, eq=False)
class Name:
    """What a bug is called, why, and the share of the bug leg that the name leaves (0: it explains everything).

    ``fitted`` is the explanation by that fault and the limitations beside it, None where nothing is beside it. A name
    for what is wrong with the ``whole`` picture is no model of a fault. ``glance`` is the misfit of quick pictures.
    ``numbers`` are those of the verdict that the name knows better than a fit of the whole picture: a shift, a gain.
    ``misfit`` is the mean |residual| in units of tolerance and noise: it tells names apart that leave no bug leg. A
    fault that may take one of several values at each pixel has ``freedom``, and of two such the less free one is told.
    One that may show ``anything`` is told where no other is left.
    """

    name: str
    message: str
    remains: float
    misfit: float = math.inf
    fitted: Explanation | None = None
    freedom: float = 0.0
    anything: bool = False
    whole: bool = False
    glance: float = math.inf
    numbers: Mapping[str, float] = field(default_factory=dict)

    @property
    def laden(self) -> int:
        """How many limitations and conventions are needed beside the name."""
        return 0 if self.fitted is None else sum(bool(each.any()) for each in self.fitted.alphas.values())

    def over(self, exact: float) -> bool:
        """Whether it leaves no bug leg, and no more misfit than ``exact``."""
        return self.remains == 0.0 and self.misfit < exact

    def hope(self, exact: float) -> float:
        """From which ``glance`` on no other fault need be fitted after this one."""
        if self.remains > NOTHING or self.anything:
            return math.inf
        if self.laden:  # another one that looks alike may need no limitation
            return self.glance * WORSE + EXACT
        return self.glance * (1.0 if self.over(exact) else WORSE)


UNNAMED = Name("unexplained", "no model of a fault leaves this picture", 1.0)


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
    bug = _Bug(measured, found, limitations, predict, preview, _scale(measured, reference))
    exact = EXACT * min(1.0, bug.misfit(found.target))  # what leaves less leaves nothing for another to explain
    best = _best(None, _whole(bug), exact, noisy=measured.noisy)
    if best is None or not best.over(exact):
        best = _best(best, _moved_rays(bug), exact, noisy=measured.noisy)
    for fault in () if best and best.over(exact) else likely(measured, found, faults, predict, preview):
        glance = bug.likeness(fault)
        if best is None or glance < best.hope(exact):
            names = (replace(each, glance=glance) for each in _fitted(bug, fault))
            best = _best(best, names, exact, noisy=measured.noisy)
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
        if fault.name == "flipped_v" and bug.glance(guessed((fault,), bug.predict, bug.preview)) < HOPE * bug.glance(
            bug.predict(()).value
        ):
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

    def misfit(self, to: Admissible) -> float:
        """Mean |residual| in units of tolerance and noise."""
        return float((np.abs(residual(self.measured.mean, to)) / self.scale).mean())

    def remains(self, left: Significance, *, still: bool) -> float:
        """The share of the bug leg that ``left`` is; of one without pixels whether it is ``still`` there, 0 or 1."""
        if not self.found.significance.triggers:  # only a gain or a shift: no pixel, so no leg, to be explained
            return float(still)
        return left.excess / max(self.found.significance.excess, 1e-30)

    def glance(self, value: Floats) -> float:
        """Mean |deviation| from ``value`` off the edges, in units of tolerance and noise, large ones cut off."""
        off = np.minimum(np.abs(self.measured.mean - value) / self.scale, CLIP)
        smooth = ~self.predict(()).edge
        return float(off[smooth].mean() if smooth.any() else off.mean())

    def likeness(self, fault: Model) -> float:
        """``glance`` of what the quick pictures say that ``fault`` makes of the reference or of ``found``."""
        places = dict.fromkeys(((), choices(self.found.models)))
        return min(self.glance(guessed((fault,), self.predict, self.preview, beside)) for beside in places)


def _best(best: Name | None, names: Iterable[Name], exact: float, *, noisy: bool) -> Name | None:
    """The best of ``names`` and the ``best`` so far; those after one that leaves ``exact``ly nothing are not tried."""
    for each in names:
        if each.remains < REMAINS and (best is None or _better(each, best, noisy=noisy)):
            best = each
            if best.over(exact):
                break
    return best


def _better(each: Name, best: Name, *, noisy: bool) -> bool:
    if each.anything != best.anything:  # what may show anything always fits: whatever else leaves nothing says more
        fixed = best if each.anything else each
        return (fixed is each) == (fixed.remains <= NOTHING)
    if "pixel_shift" in (each.name, best.name) and (each.freedom or best.freedom):
        # two numbers for the whole picture excuse less than a choice at every pixel
        shift, free = (each, best) if best.freedom else (best, each)
        return (shift is each) == (shift.remains <= max(free.remains, NOTHING))
    if noisy and bool(each.freedom) != bool(best.freedom):  # nor is there anything to choose where only noise is left
        fixed = best if each.freedom else each
        if fixed.remains <= NOTHING and fixed.misfit < NOISE:
            return fixed is each
    if each.freedom and best.freedom:
        return (max(each.remains, NOTHING), each.freedom) < (max(best.remains, NOTHING), best.freedom)
    if each.laden != best.laden and max(each.remains, best.remains) <= NOTHING:
        # a misfit below EXACT leaves nothing to be explained: there the fewest limitations decide
        burden = LADEN ** (each.laden - best.laden)
        return max(each.misfit, EXACT) * burden < BETTER * max(best.misfit, EXACT)
    return each.misfit < BETTER * best.misfit


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
                still = bool(nuisance(measured, target, np.zeros(target.edge.shape, np.bool_)).triggers)
            remains = bug.remains(left, still=still)
            glance = bug.glance(target.value)
            yield Name(
                cause.name, cause.message, remains, bug.misfit(target), whole=True, glance=glance, numbers=cause.numbers
            )
            if remains < nearest[0]:
                nearest = (remains, cause)
    if nearest[1] is not None and nearest[0] > 0.0:  # what it leaves may be a limitation, which it has moved as well
        cause = nearest[1]
        beside = explain(measured, bug.limitations, lambda chosen: cause.under(predict(chosen)))
        if not beside.triggers:
            misfit, glance = bug.misfit(beside.target), bug.glance(beside.target.value)
            yield Name(cause.name, cause.message, 0.0, misfit, beside, whole=True, glance=glance, numbers=cause.numbers)


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
    ranked = [(_left_by(bug, each), each) for each in dict.fromkeys((*near, *found))]
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
        yield replace(each, glance=bug.likeness(model), numbers=shift_numbers(*vector))


def _fitted(bug: _Bug, fault: Model) -> Iterator[Name]:
    """How well ``fault`` fits: alone, beside limitations, closer to the strength that fits, and here and there."""
    measured, found, predict = bug.measured, bug.found, bug.predict
    if fault.local and fault.rule == "set" and not _touches(measured, found.target, predict((fault,))):
        return
    bare = nearest = fit(measured, (), predict, (fault,))
    yield _named(bug, fault, bare)
    closer = fault
    if fault.at is not None and NEARLY < _remains(bug, bare) < HOPE:  # quick pictures gave a rough strength
        closer = _refined(fault, changed_by(measured, predict(())), predict, bug.scale)
    if bare.significance.excess > 0:
        beside = [(each,) for each in bug.limitations if _useful(bug, bare, fault, each)]
        for models in dict.fromkeys((found.models, *beside)):
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


def _grown(bug: _Bug, fault: Model, nearest: Explanation) -> Iterator[Name]:
    """How well ``fault`` fits beside more limitations than one: each time the one that leaves the shortest bug leg.

    A renderer has all of its conventions and limitations at once, and a fault hides them from a search without it.
    """
    while nearest.significance.excess > 0 and len(nearest.models) < LARGEST_GROWN:
        features = {each.when[0] for each in nearest.models if each.when}
        others = [
            (*nearest.models, each)
            for each in bug.limitations
            if each not in nearest.models
            and not (each.when and each.when[0] in features)
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
    numbers = {"gain": fault.strength} if fault.name == "light_gain" else {}
    if fault.rule == "choice":
        return Name(fault.name, fault.claim, _remains(bug, fitted), off, fitted, numbers=numbers)
    free = (fitted.freedom, fault.rule == "any")
    return Name(fault.name, fault.claim, _remains(bug, fitted), off * FREE + CHOICE, fitted, *free)


def _touches(measured: Measured, base: Admissible, other: Admissible) -> bool:
    """Whether a local fault could be more than a few wrong pixels of what it acts on."""
    acts = support(base, other)
    wrong = acts & (largest(np.abs(residual(measured.mean, base)) - base.tau) > 0)
    return float(wrong.sum()) >= LEAST_TOUCHED * float(acts.sum())


def _useful(bug: _Bug, start: Explanation, fault: Model, each: Model) -> bool:
    """Whether ``each`` moves any pixel that ``start`` leaves wrong; most do not, as previews tell."""
    wrong = start.significance.pixels
    beside = (fault, *choices(start.models))
    return nears(start, each, bug.preview, beside) and bool(
        (support(bug.predict(choices(beside)), bug.predict((*choices(beside), each))) & wrong).any()
    )


def likely(
    measured: Measured, found: Explanation, faults: Sequence[Model], predict: Predict, preview: Preview
) -> Iterator[Model]:
    """The faults whose change of the picture is most like the measured one, likeliest first, at fitting strengths."""
    reference = predict(())
    at = ~reference.edge[..., None] if (~reference.edge).sum() > 256 else np.ones((*reference.edge.shape, 1), bool)
    scale = _scale(measured, reference)
    # what the picture changes on the reference, and on the choices of a renderer that explain most of it
    starts: list[tuple[tuple[Model, ...], Floats]] = [((), measured.mean - reference.value)]
    beside = choices(found.models)
    if found.models:
        starts.append((beside, measured.mean - found.target.value))

    def compared(change: Floats, other: Floats, local: bool, step: int) -> float:
        a, b = (coarse(np.clip(each / scale, -CLIP, CLIP) * at, step) for each in (change, other))
        if local:
            b = b * (largest(np.abs(a)) > 1.0)[..., None]
        product = float(np.linalg.norm(a) * np.linalg.norm(b))
        return abs(float((a * b).sum())) / product if product > 0 else 0.0

    def covered(change: Floats, other: Floats) -> float:
        a = (np.clip(change / scale, -CLIP, CLIP) * at) ** 2
        return float(a[other != 0].sum() / max(float(a.sum()), 1e-30))

    def scored(fault: Model, change: Floats, own: Floats) -> float:
        local = fault.local or fault.rule != "choice"
        score = max(compared(change, own, local, step) for step in STEPS)
        # under "any" what it shows may be anything, where it acts
        return max(score, covered(change, own)) if fault.rule == "any" else score

    ranked = []
    wrong = found.significance.pixels
    placed = (each if each.placed is None else each.placed(wrong) for each in faults)
    for index, fault in enumerate(each for each in placed if each is not None):
        tried = [
            (scored(fault, change, preview((*base, fault)) - preview(base)), -place, base, change)
            for place, (base, change) in enumerate(starts)
        ]
        score, _, base, change = max(tried, key=lambda each: each[:2])
        if score > LEAST_ALIKE:
            ranked.append((-score, fault.name in RARE, index, fault, base, change))
    ranked.sort(key=lambda each: (round(each[0], 2), *each[1:3]))
    alike = sum(-each[0] > ALIKE for each in ranked)
    for _, _, _, fault, base, change in ranked[: min(LIKELY, max(alike, FEW))]:
        if fault.at is None:
            yield fault
            continue
        best, strength = fault, fault.strength
        own = preview((*base, fault)) - preview(base)
        for step in (*STEPS, 1):
            size = _size(change * at, own * at, scale, step)
            if size is None:
                break
            strength = _sane(fault.neutral + (strength - fault.neutral) * size, fault)
            best = replace(fault.at(strength), at=fault.at, strength=strength, neutral=fault.neutral)
            own = preview((*base, best)) - preview(base)
        yield best
        if best.strength != fault.strength:  # a limitation beside the fault can mislead the fit
            yield replace(fault, at=None)


def coarse(values: Floats, step: int) -> Floats:
    """Means of ``values`` (h, w, c) over blocks of ``step`` x ``step`` pixels; what fills no block is left out."""
    if step == 1:
        return values
    h, w, c = (each // step * step for each in (*values.shape[:2], step * values.shape[2]))
    return np.asarray(values[:h, :w].reshape(h // step, step, w // step, step, c // step).mean(axis=(1, 3)))


def changed_by(measured: Measured, reference: Admissible) -> Floats:
    """What the picture changes on the reference, off its edges (h, w, 3)."""
    return np.asarray((measured.mean - reference.value) * ~reference.edge[..., None])


def _size(change: Floats, own: Floats, scale: Floats, step: int = 1) -> float | None:
    """The factor by which ``own`` fits ``change`` best, by Huber's regression in which large changes weigh less.

    What a limitation changes in a corner of the picture has no say in it.
    """
    weight = 1.0 / np.maximum(scale, np.abs(change) / CLIP)
    a, b = coarse(change * weight, step), coarse(own * weight, step)
    acts = b != 0
    a, b = a[acts], b[acts]
    if not b.size:
        return None
    trust, factor = np.ones_like(b), 1.0
    for _ in range(4):
        factor = float((trust * a * b).sum() / (trust * b * b).sum())
        off = np.abs(a - factor * b)
        trust = np.minimum(1.0, 1.345 * 1.4826 * float(np.median(off)) / np.maximum(off, 1e-12))
        if not trust.any():  # most of it fits to the last bit
            break
    return factor


def _refined(fault: Model, change: Floats, predict: Predict, scale: Floats) -> Model:
    """``fault`` at the strength at which the full prediction has the size of ``change``, by one step of a secant."""
    assert fault.at is not None
    reference = predict(())
    own = (predict((fault,)).value - reference.value) * ~reference.edge[..., None]
    size = _size(change, own, scale)
    if size is None:
        return fault
    off = (fault.strength - fault.neutral) * size
    return replace(fault.at(_sane(fault.neutral + off, fault)), strength=fault.neutral + off)


def _sane(strength: float, fault: Model) -> float:
    """``strength`` to three digits of its distance from neutral, and within what a fault can be."""
    off = strength - fault.neutral
    if fault.neutral:
        off = min(max(off, -0.9), 9.0)
    size = 20 * abs(fault.strength - fault.neutral)
    off = min(max(off, -size), size)
    if off == 0.0:
        off = 0.01 * (fault.strength - fault.neutral)
    return fault.neutral + float(f"{off:.3g}")


def _scale(measured: Measured, to: Admissible) -> Floats:
    """What a residual is worth (h, w, 3): a quarter of the tolerance, and the noise."""
    return np.sqrt(np.asarray((to.tau / 4.0) ** 2 + measured.variance))


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
