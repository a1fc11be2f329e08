"""Step 6: the smallest set of limitations that explains a picture; what remains is the bug leg.

A set's ``choice`` models (and conventions) replace the reference. Its ``partial`` models then open, at each pixel of
their support, the segment from there to their own picture: V = B - R, alpha = clip(<I - R, V> / |V|^2, 0, 1).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import combinations

import numpy as np
import numpy.typing as npt

from notabug.adapters.base import Declaration
from notabug.metrics.admissible import MISSED, Admissible, residual
from notabug.metrics.channels import largest, pixels, put, total
from notabug.metrics.neighbours import Bools
from notabug.metrics.noise import Measured
from notabug.metrics.nuisance import Nuisance, nuisance
from notabug.metrics.quick import Predict, Preview, choices, nearer, nears, surely_helps
from notabug.metrics.significance import Significance, significance
from notabug.references.models.model import Model

Floats = npt.NDArray[np.floating]
Explained = tuple[Admissible, Floats, Bools, float]
"""An admissible set, the share alpha (h, w) of a model in it, its support (h, w), and its freedom."""
Closely = Callable[[Bools], Predict]
"""What sets of models admit, with whatever falls between the centres of given pixels (h, w)."""


MEAN_ALPHA = 0.25  # a partial limitation that fits its pixels by less than this on average is not that limitation
# The same of surfaces that coincide, where that share of what is off lies on the straight way to the other surface: by
# the order of its triangles Mitsuba shows another one than the nearest in a tenth of a pixel's samples.
MEAN_FOUGHT, MOST_BETWEEN = 0.05, 0.9
LEAST_MIXED, MOST_MIXED = 0.0003, 0.97  # mean share of the other values in a mixture
LARGEST_SET = 3
LARGEST_GROWN = 6  # of sets that are not searched but grown, one by one
SHORTER = 0.9  # of what a smaller set leaves: a larger one that leaves more is no better
VALUES = {2: 4, 3: 2}  # of a feature that are tried in a set of so many models: those that explain most by themselves
# Of the picture: what is wrong in less of it is predicted in full, as a change between the centres of pixels may
# explain it: half a texel at the borders of a card's patches, which no centre shows, is 5 % of 64 x 64 pixels.
FEW = 0.1
LEAST_TOUCHED = 0.1  # a fault that may do anything, or anywhere, is none that touches less than this of its support
LEAST_FOUGHT = 0.02  # of what surfaces share to the last bits: renderers show another one at a sixth of it or more
NOISE = 3.0  # standard errors beyond which a pixel is off
LEAST_GRAIN = 0.01  # root mean square by which shares differ from those around them, where there are dots
MOST_ALIKE, WIDENED = 0.3, 0.15  # correlation of neighbours' differences; a blot's is above .5, a Gaussian filter's .37


@dataclass(frozen=True, slots=True, eq=False)
class Explanation:
    """How far a set of models explains a picture.

    ``target`` is the admissible set, with the segments' alphas put in; ``nearest`` the admissible picture nearest to
    the measured one, equal to it where it is admissible within tolerance and noise. ``alphas`` maps each limitation
    to its share (h, w). ``freedom`` is the sum over the supports of the segments' lengths, per pixel of the picture.
    """

    models: tuple[Model, ...]
    target: Admissible
    nearest: Floats
    alphas: dict[str, Floats]
    freedom: float
    significance: Significance
    nuisance: Nuisance  # fitted only where nothing else is wrong
    before: Floats  # (h, w) z of the picture against the reference alone

    @property
    def triggers(self) -> tuple[str, ...]:
        return self.significance.triggers + self.nuisance.triggers

    @property
    def severity(self) -> float:
        """How near the picture is to being called a bug: from 1 on it is one. It only ranks pictures."""
        return max(self.significance.severity, *self.nuisance.severity)


def fit(measured: Measured, models: tuple[Model, ...], predict: Predict, fixed: tuple[Model, ...] = ()) -> Explanation:
    """Explain ``measured`` by all of ``models`` on top of ``fixed`` (a fault under test)."""
    applied = fixed + models
    chosen = choices(applied)
    target = predict(chosen)
    alphas: dict[str, Floats] = {}
    fault = choices(fixed)
    for each in choices(models):
        acts = support(predict(fault), predict((*fault, each)))
        if not acts.any():  # alone; beside the others it may
            acts = support(predict(tuple(other for other in chosen if other is not each)), target)
        alphas[each.name] = acts.astype(np.float64)
    freedom = 0.0
    excluded = np.zeros(measured.mean.shape[:2], np.bool_)
    for each in applied:
        if each.rule != "choice":
            values = [predict((*chosen, value)) for value in each.values()]
            explained: Callable[..., Explained] = _RULES[each.rule]
            if each.kind == "limitation" and each.sure is not None:
                # where a choice has another surface win, the first may win as well
                first = predict(tuple(other for other in chosen if other.options.keys().isdisjoint(each.sure)))
                values += [first] if first is not predict(chosen) else []
                another = predict((*chosen, replace(each, options=each.sure, others=())))
                explained = partial(_fought, explained, first, another)
            elif each.kind == "limitation" and each.rule == "set":
                explained = partial(_mixed, explained, 0.0 if each.grain else MEAN_ALPHA)
            if each.grain:
                explained = partial(_grained, explained, each.rule == "set")
            # means over samples show dots everywhere, or it is none: at pixel centres there may be few
            if each.kind == "fault" and (each.rule == "any" or (each.grain and not target.share_is_point)):
                explained = partial(_widespread, explained)
            target, alpha, within, length = explained(measured, target, *values)
            alphas[each.name] = alpha
            excluded |= within
            freedom += length
    r = residual(measured.mean, target)
    found = significance(r, measured, target)
    wrong = np.flatnonzero(found.pixels)
    nearest = put(measured.mean, wrong, pixels(measured.mean, wrong) - pixels(r, wrong))
    global_fit = Nuisance() if found.triggers else nuisance(measured, target, excluded)
    return Explanation(models, target, nearest, alphas, freedom, found, global_fit, found.z)


def support(bare: Admissible, other: Admissible) -> Bools:
    """Where (h, w) two admissible sets differ by more than the tolerance."""
    off = np.abs(other.value - bare.value)
    off -= np.maximum(bare.tau, other.tau)
    return np.asarray(largest(off) > 0)


def _segment(measured: Measured, base: Admissible, limited: Admissible) -> Explained:
    """The admissible set between ``base`` and ``limited``: (set, alpha (h, w), support (h, w), freedom)."""
    within = support(base, limited)
    # a picture that is off by as much as the limited one, or a little more, is beyond the tolerance before the support
    # begins: it lies on the segment wherever there is one
    at = np.flatnonzero((limited.value != base.value).any(axis=2))
    start, v, off = (pixels(each, at) for each in (base.value, limited.value, measured.mean))
    v, off = v - start, off - start
    share = _share(off, v)
    significant = (largest(np.abs(off) - pixels(base.tau, at)) > 0) & within.ravel()[at]
    if significant.any() and float(share[significant].mean()) < MEAN_ALPHA:
        return _nothing(base)
    value = put(base.value, at, start + share[:, None] * v)
    edge = base.edge | limited.edge
    ends = np.flatnonzero(edge)
    target = replace(
        base,
        value=value,
        lo=put(value, ends, np.minimum(pixels(base.lo, ends), pixels(limited.lo, ends))),
        hi=put(value, ends, np.maximum(pixels(base.hi, ends), pixels(limited.hi, ends))),
        tau=put(base.tau, at, np.maximum(pixels(base.tau, at), pixels(limited.tau, at))),
        edge=edge,
    )
    # a pixel's alpha counts by the share of its footprint that the artifact can take, so no filter moves the area
    area = np.zeros(within.shape)
    area.ravel()[at] = share * base.share.ravel()[at]
    length = np.sqrt(total(v * v))[within.ravel()[at]]
    return target, np.where(within, area, 0.0), within, float(length.sum() / within.size)


def _share(off: Floats, v: Floats) -> Floats:
    """How far (n,) along ``v`` (n, 3) the deviations ``off`` (n, 3) lie, 0 .. 1."""
    return np.asarray(np.clip(total(off * v) / np.maximum(total(v * v), 1e-30), 0.0, 1.0))


def _nothing(base: Admissible) -> Explained:
    """What a model explains that does not fit."""
    return base, np.zeros(base.edge.shape), np.zeros(base.edge.shape, np.bool_), 0.0


def _mixture(measured: Measured, base: Admissible, *values: Admissible) -> Explained:
    """The admissible set where each sample takes the value of ``base`` or one of ``values``: as in ``_segment``.

    At pixel centres the picture must take one of the values, and so must every seed's that has one sample a pixel;
    where samples are averaged, anything between them.
    """
    within = support(base, values[0])
    for each in values[1:]:
        within |= support(base, each)
    everything = (base, *values)
    value, alpha, never = base.value, np.zeros(within.shape), base.never
    if not base.share_is_point:
        lo = np.minimum.reduce([each.lo for each in everything])
        hi = np.maximum.reduce([each.hi for each in everything])
        taken = np.clip(measured.mean, lo, hi)
        if measured.singles is not None:
            taken, missed = _taken(measured.singles, everything)
            never = within & (missed > np.maximum.reduce([largest(each.tau) for each in everything]))
        value = np.where(within[..., None], taken, base.value)
        off = largest(np.abs(value - base.value))
        reach = largest(np.maximum(hi - base.value, base.value - lo))
        alpha = np.where(within, np.clip(off / np.maximum(reach, 1e-30), 0.0, 1.0), 0.0)
    else:
        distance = total(np.abs(measured.mean - base.value))
        for each in values:
            nearer = total(np.abs(measured.mean - each.value))
            better = within & (nearer < distance)
            value = np.where(better[..., None], each.value, value)
            alpha = np.where(better, 1.0, alpha)
            distance = np.where(better, nearer, distance)
    edge = base.edge | np.logical_or.reduce([each.edge & within for each in values])
    at = (edge & within & (measured.singles is None))[..., None]
    # where one shows the darker half of a pixel's samples and the other the brighter one, all may be bright
    reaches = [each.samples or (each.lo, each.hi) for each in everything]
    lo = np.where(at, np.minimum.reduce([each for each, _ in reaches]), np.where(within[..., None], value, base.lo))
    hi = np.where(at, np.maximum.reduce([each for _, each in reaches]), np.where(within[..., None], value, base.hi))
    tau = np.where(within[..., None], np.maximum.reduce([each.tau for each in everything]), base.tau)
    target = replace(base, value=value, lo=lo, hi=hi, tau=tau, edge=edge, never=never)
    length = np.sqrt(total((values[0].value - base.value) ** 2))
    return target, alpha, within, float(length[within].sum() / within.size)


def _taken(singles: Floats, values: Sequence[Admissible]) -> tuple[Floats, Floats]:
    """The mean (h, w, 3) of the seeds' ``singles`` (n, h, w, 3), each moved to what one sample of the nearest of
    ``values`` may show, and by how much (h, w) the farthest of them is moved."""
    moved, farthest = np.zeros(singles.shape[1:]), np.zeros(singles.shape[1:3])
    for each in singles:
        least = np.full(farthest.shape, np.inf)
        nearest = np.zeros(each.shape)
        for value in values:
            assert value.sampled is not None
            low, high, _ = value.sampled
            missed = MISSED * (high - low)
            inside = np.clip(each, low - missed, high + missed)
            distance = largest(np.abs(each - inside))
            nearest = np.where((distance < least)[..., None], inside, nearest)
            least = np.minimum(distance, least)
        moved += nearest
        farthest = np.maximum(farthest, least)
    return np.asarray(moved / len(singles)), farthest


def _anything(measured: Measured, base: Admissible, *values: Admissible) -> Explained:
    """The admissible set where a picture may show anything in the support of ``values``: as in ``_segment``."""
    within = np.logical_or.reduce([support(base, each) for each in values])
    at = within[..., None]
    value = np.where(at, measured.mean, base.value)
    lo, hi = np.where(at, value, base.lo), np.where(at, value, base.hi)
    alpha = (within & (largest(np.abs(measured.mean - base.value) - base.tau) > 0)).astype(np.float64)
    length = float(within.sum())  # more than any list of values has: theirs is a mean over the picture
    return replace(base, value=value, lo=lo, hi=hi), alpha, within, length


def _mixed(
    explained: Callable[..., Explained], least: float, measured: Measured, base: Admissible, *values: Admissible
) -> Explained:
    """What ``explained`` admits, if it is a mixture: one value nearly everywhere is a choice, not chance.

    Where it deviates it must do so by a mean share of ``least`` or more.
    """
    found = explained(measured, base, *values)
    _, alpha, within, _ = found
    off = _off(measured, base, within)
    mixed = not within.any() or LEAST_MIXED <= float(alpha[within].mean()) <= MOST_MIXED
    if not mixed or (off.any() and float(alpha[off].mean()) < least):
        return _nothing(base)
    return found


def _fought(
    explained: Callable[..., Explained],
    first: Admissible,
    another: Admissible,
    measured: Measured,
    base: Admissible,
    *values: Admissible,
) -> Explained:
    """What ``explained`` admits, if it touches enough of what surfaces share to the last bits.

    There one sees the ``first`` or ``another``; what lies on the straight way between them may be rare in each pixel.
    """
    surely = support(first, another)
    off = _off(measured, base, surely)
    if surely.any() and np.count_nonzero(off) < LEAST_FOUGHT * np.count_nonzero(surely):
        return _nothing(base)
    between = _between(measured, base, (another, first), off) > MOST_BETWEEN
    return _mixed(explained, MEAN_FOUGHT if between else MEAN_ALPHA, measured, base, *values)


def _off(measured: Measured, base: Admissible, within: Bools) -> Bools:
    """Where, ``within`` (h, w), a picture is off by more than the tolerance and its noise."""
    beyond = np.abs(measured.mean - base.value) - base.tau - NOISE * np.sqrt(measured.variance)
    return within & (largest(beyond) > 0)


def _between(measured: Measured, base: Admissible, values: Sequence[Admissible], off: Bools) -> float:
    """The share of the pixels ``off`` (h, w) that lie on the straight way from ``base`` to one of ``values``."""
    at = np.flatnonzero(off)
    if not at.size:
        return 0.0
    start, slack = pixels(base.value, at), pixels(base.tau, at) + NOISE * np.sqrt(pixels(measured.variance, at))
    away = pixels(measured.mean, at) - start
    found = np.zeros(at.size, np.bool_)
    for each in values:
        v = pixels(each.value, at) - start
        found |= largest(np.abs(away - _share(away, v)[:, None] * v) - slack) <= 0
    return float(found.mean())


def _grained(
    explained: Callable[..., Explained], shares: bool, measured: Measured, base: Admissible, *values: Admissible
) -> Explained:
    """What ``explained`` admits, if it is dots: shares alpha that differ from those around them, each by itself.

    A half-dark band, a black blot and another light are no acne. In a mean over many samples dots are small deviations,
    but still deviations; in blots neighbours deviate alike, and under another light half of all pixels do as those
    around them. Where alpha holds no ``shares``, only 0 and 1, the relative deviation is the share.
    """
    from scipy import ndimage

    found = explained(measured, base, *values)
    _, alpha, within, _ = found
    if not shares:
        bright = np.maximum(largest(np.abs(base.value)), largest(base.tau))
        alpha = np.where(within, np.minimum(largest(np.abs(measured.mean - base.value)) / bright, 1.0), 0.0)
    count = np.maximum(ndimage.uniform_filter(within.astype(np.float64), 5, mode="constant"), 1e-9)
    off = np.where(within, alpha - ndimage.uniform_filter(alpha * within, 5, mode="constant") / count, 0.0)
    power = float((off**2).sum())
    dots = np.abs(off[_off(measured, base, within)])
    rough = not dots.size or float(np.median(dots)) > LEAST_GRAIN
    if not rough or power <= LEAST_GRAIN**2 * float((within & (alpha > 0)).sum()):
        return _nothing(base)
    alike = 0.5 * float((off[:, 1:] * off[:, :-1]).sum() + (off[1:] * off[:-1]).sum())
    if alike > (MOST_ALIKE + (WIDENED if base.widened else 0.0)) * power:
        return _nothing(base)
    return found


def _widespread(
    explained: Callable[..., Explained], measured: Measured, base: Admissible, *values: Admissible
) -> Explained:
    """What ``explained`` admits, if it touches LEAST_TOUCHED of its support: few wrong pixels are no wrong rule."""
    found = explained(measured, base, *values)
    _, _, within, _ = found
    if within.any() and float(_off(measured, base, within).sum()) < LEAST_TOUCHED * float(within.sum()):
        return _nothing(base)
    return found


def _hull(measured: Measured, base: Admissible, *values: Admissible) -> Explained:
    """The admissible set of anything between the least and the most of ``base`` and ``values``: as in ``_segment``."""
    target, alpha, within, length = _mixture(measured, replace(base, share_is_point=False), *values)
    return replace(target, share_is_point=base.share_is_point), alpha, within, length


_RULES: dict[str, Callable[..., Explained]] = {
    "set": _mixture,
    "partial": _segment,
    "hull": _hull,
    "any": _anything,
}


def habits(models: Sequence[Model]) -> tuple[Model, ...]:
    """Those of ``models`` that are choices whose feature has one value: a renderer has all of them at once."""
    features = [each.when[0] for each in models if each.when]
    return tuple(each for each in choices(models) if each.when and features.count(each.when[0]) == 1)


def candidates(
    models: Sequence[Model], together: tuple[Model, ...] = (), sizes: Sequence[int] = range(LARGEST_SET + 1)
) -> Iterator[tuple[Model, ...]]:
    """Sets of ``models``, small ones first; two values of one feature (a quad's diagonals) exclude each other.

    The models ``together`` count as one, which beside others is the likeliest.
    """
    single: list[tuple[Model, ...]] = [(each,) for each in models]
    block = [together] if len(together) > 1 else []
    for size in (each for each in sizes if each <= len(models)):
        for some in combinations(single + block if size < 2 else block + single, size):
            chosen = tuple(each for unit in some for each in unit)
            features = [each.when[0] for each in chosen if each.when]
            if len(set(features)) == len(features):
                yield chosen


def admitted(models: Sequence[Model], declaration: Declaration) -> tuple[Model, ...]:
    """The limitations and conventions that ``declaration`` leaves open; ``unknown`` features leave all open."""
    return tuple(each.under(declaration) for each in models if each.kind != "fault" and each.open_to(declaration))


def explain(
    measured: Measured,
    models: Sequence[Model],
    predict: Predict,
    preview: Preview | None = None,
    closely: Closely | None = None,
) -> Explanation:
    """The smallest set without a trigger, of single models that with the least freedom; else that with the shortest
    bug leg.

    ``preview`` spares most of the predictions: of models that move nothing near what needs explaining, and of larger
    sets whose quick picture is no nearer than that of the best one. With it, sets of three grow from pairs whose quick
    picture is nearer, or from the best set. Before a picture is a bug, models that move nothing
    are predicted all the same. Where little is wrong it is predicted ``closely``.
    """
    bare = best = fit(measured, (), predict)
    if not bare.triggers:
        return bare
    close = closely is not None and few_wrong(bare)
    if closely is not None and close:
        predict = closely(bare.significance.pixels)
    together = habits(models)
    useful = _useful(bare, models, together, predict, preview)
    enough: list[Explanation] = []
    left: dict[Model, float] = {}
    pairs: list[frozenset[Model]] = []
    for size in range(1, LARGEST_SET + 1):
        for chosen in candidates(_leading(useful, left, VALUES.get(size, len(useful))), together, (size,)):
            if enough and len(chosen) > 1:
                break
            if size > 2 and preview is not None and not _grows((*pairs, frozenset(best.models)), chosen):
                continue
            if preview is not None and (len(chosen) > 1 or chosen[0].rule == "choice"):
                may, rest = nearer(measured, chosen, best, predict, preview)
                if not may:
                    left.setdefault(chosen[0], rest)
                    continue
            found = fit(measured, chosen, predict)
            left.setdefault(chosen[0], found.significance.excess)
            pairs += [frozenset(chosen)] if size == 2 else []
            if not found.triggers:
                enough.append(found)
            elif found.significance.excess < SHORTER * best.significance.excess:
                best = found
    if enough:  # dots may fill a facet as well: the models that could explain the least else
        return replace(min(enough, key=_taken_for_granted), before=bare.significance.z)
    if closely is not None and not close and best.models and few_wrong(best):
        predict, close = closely(best.significance.pixels), True
        best = fit(measured, best.models, predict)
        if not best.triggers:
            return replace(best, before=bare.significance.z)
    told = None if close else preview
    enlarged = _beside(measured, best, predict, [each for each in models if each not in useful], told)
    starts = [best, fit(measured, together, predict)] if together else [best]  # habits alone may leave more than none
    for start in starts:
        enlarged = enlarged or _grown(measured, start, models, predict, told)
    return replace(enlarged or best, before=bare.significance.z)


def _grows(from_some: Iterable[frozenset[Model]], chosen: tuple[Model, ...]) -> bool:
    """Whether ``chosen`` holds all models of a set, one that is not empty, of those that it may grow from."""
    return any(each and each.issubset(chosen) for each in from_some)


def few_wrong(found: Explanation) -> bool:
    """Whether what is left to be explained is so little that a model may do it between the centres of pixels."""
    return bool(0.0 < found.significance.pixels.mean() < FEW)


def _beside(
    measured: Measured, start: Explanation, predict: Predict, some: Sequence[Model], preview: Preview | None
) -> Explanation | None:
    """The models of ``start`` and one of ``some`` that leave nothing to be explained, or None.

    Some act only beside others: the folds of a mesh that stands for a smooth one, facets that shadow a silhouette.
    Where there is a ``preview`` it tells which move nothing there, and which leave as much.
    """
    for each in some:
        if each in start.models or len(start.models) >= LARGEST_SET:
            continue
        if preview is not None and not _promises(measured, start, each, predict, preview):
            continue
        if _helps(start, each, predict):
            found = fit(measured, (*start.models, each), predict)
            if not found.triggers:
                return found
    return None


def _promises(measured: Measured, start: Explanation, model: Model, predict: Predict, preview: Preview) -> bool:
    """Whether quick pictures say that ``model`` beside those of ``start`` changes what is wrong, and for the better."""
    beside = choices(start.models)
    return nears(start, model, preview, beside) and nearer(measured, (*start.models, model), start, predict, preview)[0]


def _taken_for_granted(found: Explanation) -> tuple[float, int]:
    """How much else a set could explain, and how much it supposes of a renderer: of two the least says most."""
    return found.freedom, sum(len(each.conditions) for each in found.models)


def _grown(
    measured: Measured, start: Explanation, models: Sequence[Model], predict: Predict, preview: Preview | None
) -> Explanation | None:
    """The models of ``start`` and more that leave nothing to be explained, or None.

    One is added at a time, the one that leaves least: a renderer has all of its conventions and limitations at once, so
    what mirrors, facets and quads do together takes more than LARGEST_SET of them.
    """
    while len(start.models) < LARGEST_GROWN:
        fits = [
            fit(measured, (*start.models, each), predict)
            for each in models
            if each not in start.models
            and not _excluded(each, start.models)
            and (preview is None or _promises(measured, start, each, predict, preview))
            and _helps(start, each, predict)
        ]
        enough = [each for each in fits if not each.triggers]
        if enough:
            return min(enough, key=_taken_for_granted)
        best = min(fits, key=lambda each: each.significance.excess, default=start)
        if best.significance.excess >= SHORTER * start.significance.excess:
            return None
        start = best
    return None


def _useful(
    bare: Explanation, models: Sequence[Model], together: tuple[Model, ...], predict: Predict, preview: Preview | None
) -> list[Model]:
    """Those of ``models`` that move what needs explaining: alone, beside conventions that do, or ``together``'s.

    A shadow ray that passes over a pane changes nothing where a pane blocks it, and much where it keeps a share.
    """

    alone = [
        each
        for each in models
        if preview is None
        or (nears(bare, each, preview) and (surely_helps(bare, each, preview) or _helps(bare, each, predict)))
    ]
    if preview is None:
        alone = [each for each in alone if _helps(bare, each, predict)]
        return alone
    besides: list[tuple[Model, ...]] = [(each,) for each in alone if each.kind == "convention"]
    besides += [together] if len(together) > 1 else []
    return [
        each
        for each in models
        if each in alone
        or any(
            nears(bare, each, preview, other) for other in besides if each not in other and not _excluded(each, other)
        )
    ]


def _leading(models: Sequence[Model], left: dict[Model, float], most: int) -> list[Model]:
    """``models`` without all but ``most`` values of a feature: those by which the least is ``left``."""
    ranked = sorted(models, key=lambda each: left.get(each, 0.0))
    counts: dict[str, int] = {}
    kept = []
    for each in ranked:
        feature = each.when[0] if each.when else ""
        counts[feature] = counts.get(feature, 0) + 1
        if not feature or counts[feature] <= most:
            kept.append(each)
    return [each for each in models if each in kept]


def beside_faults(models: Sequence[Model], found: Explanation) -> tuple[Model, ...]:
    """Those of ``models`` to be tried beside a fault: of a feature of many values only what ``found`` has of it."""
    features = [each.when[0] if each.when else "" for each in models]
    return tuple(
        each
        for each, feature in zip(models, features, strict=True)
        if not feature or features.count(feature) <= VALUES[2] or each in found.models
    )


def _excluded(model: Model, beside: tuple[Model, ...]) -> bool:
    """Whether ``model`` is another value of a feature that one of ``beside`` has."""
    return model.when is not None and any(each.when is not None and each.when[0] == model.when[0] for each in beside)


def _helps(start: Explanation, model: Model, predict: Predict) -> bool:
    """Whether ``model``, beside those of ``start``, moves any pixel that needs explaining."""
    wrong = start.significance.pixels
    beside = choices(start.models)
    base = predict(beside)
    moved = (support(base, predict((*beside, value))) for value in model.values())
    return not wrong.any() or any(bool((each & wrong).any()) for each in moved)
