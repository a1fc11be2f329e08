"""Step 6 of docs/judge.md, what explains it: the smallest set of limitations; what remains is the bug leg.

A set's ``choice`` models (and conventions) replace the reference. Its ``partial`` models then open, at each pixel of
their support, the segment from there to their own picture: V = B - R, alpha = clip(<I - R, V> / |V|^2, 0, 1).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from operator import itemgetter
from types import MappingProxyType

import numpy as np
import numpy.typing as npt

from notabug.metrics.admissible import Admissible, residual
from notabug.metrics.channels import pixels, put
from notabug.metrics.global_fit import GlobalFit, global_fit
from notabug.metrics.image_filters import Bools
from notabug.metrics.noise import Measured
from notabug.metrics.policy import POLICY
from notabug.metrics.quick import Predict, Preview, choices, nearer, nears, surely_helps
from notabug.metrics.reach import Reach, reach
from notabug.metrics.rules import RULES, Explained, Trial, nothing, support
from notabug.metrics.sets import candidates, habits
from notabug.metrics.significance import Significance, significance
from notabug.metrics.structure import STRUCTURES
from notabug.references.models.model import Model, excluded_by

Floats = npt.NDArray[np.floating]
Closely = Callable[[Bools], Predict]
"""What sets of models admit, with whatever falls between the centres of given pixels (h, w)."""


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
    global_fit: GlobalFit  # fitted only where nothing else is wrong
    before: Floats  # (h, w) z of the picture against the reference alone

    @property
    def triggers(self) -> tuple[str, ...]:
        return self.significance.triggers + self.global_fit.triggers

    @property
    def severity(self) -> float:
        """How near the picture is to being called a bug: from 1 on it is one. It only ranks pictures."""
        return max(self.significance.severity, *self.global_fit.severity)


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
    hulls = tuple(each for each in applied if each.rule == "hull")
    for each in (*hulls, *(other for other in applied if other.rule not in ("hull", "choice"))):
        moved = () if each in hulls else hulls
        target, alpha, within, length = _applied(Trial(measured, target, each, chosen, moved, predict))
        alphas[each.name] = alpha
        excluded |= within
        freedom += length
    r = residual(measured.mean, target)
    found = significance(r, measured, target)
    wrong = np.flatnonzero(found.pixels)
    nearest = put(measured.mean, wrong, pixels(measured.mean, wrong) - pixels(r, wrong))
    whole = GlobalFit() if found.triggers else global_fit(measured, target, excluded)
    return Explanation(models, target, nearest, alphas, freedom, found, whole, found.z)


def _applied(trial: Trial) -> Explained:
    """What a model admits by its rule, where the picture shows what it must; else what there was without it."""
    structure = STRUCTURES[trial.model.shows]
    values = (*trial.values(), *structure.beside(trial))
    found = RULES[trial.model.rule](trial.measured, trial.base, *values)
    return found if structure.shown(trial, found) else nothing(trial.base)


def explain(
    measured: Measured,
    models: Sequence[Model],
    predict: Predict,
    preview: Preview | None = None,
    closely: Closely | None = None,
    stated: Sequence[Model] = (),
) -> Explanation:
    """The smallest set without a trigger, of single models that with the least freedom; else that with the shortest
    bug leg.

    ``preview`` spares most of the predictions: of models that move nothing near what needs explaining, and of larger
    sets whose quick picture is no nearer than that of the best one. With it, sets of three grow from the pairs that
    leave least, or from the best set. Before a picture is a bug, models that move nothing are predicted all the same.
    Where little is wrong it is predicted ``closely``. Conventions that a declaration has ``stated`` are tried first.
    """
    bare = best = fit(measured, (), predict)
    if not bare.triggers:
        return bare
    close = closely is not None and few_wrong(bare)
    looked = bare.significance.pixels & close
    if closely is not None and close:
        predict = closely(looked)
        if predict(()) is not bare.target:
            bare = best = fit(measured, (), predict)
            if not bare.triggers:
                return bare
    for found in _by_stated(measured, bare, stated, predict, preview):
        if not found.triggers:
            return replace(found, before=bare.significance.z)
    together = habits(models)
    wide = None if preview is None else reach(measured, bare.significance, models, together, predict, preview)
    if preview is not None and wide is not None and wide.beyond_all():
        return replace(_nearest(measured, bare, models, predict, preview), before=bare.significance.z)
    useful = _useful(bare, models, together, predict, preview)
    enough: list[Explanation] = []
    left: dict[Model, float] = {}
    pairs: list[tuple[float, frozenset[Model]]] = []
    near: Reach | None = None
    for size in range(1, POLICY.explain.largest_set + 1):
        if size == 2 and not enough and preview is not None:
            some = tuple(dict.fromkeys((*useful, *together)))
            near = reach(measured, bare.significance, some, together, predict, preview, fully=True)
            if near is not None and near.beyond_all():
                return replace(_nearest(measured, best, useful, predict, preview, left), before=bare.significance.z)
        grown_from = [pair for _, pair in sorted(pairs, key=itemgetter(0))[: POLICY.explain.pairs]]
        most = (len(useful), POLICY.explain.values_in_pairs, POLICY.explain.values_in_threes)[min(size, 3) - 1]
        for chosen in candidates(_leading(useful, left, most), together, size):
            if enough and len(chosen) > 1:
                break
            if size > 2 and preview is not None and not _grows((*grown_from, frozenset(best.models)), chosen):
                continue
            least = near.leaves(chosen, preview) if near is not None and preview is not None else 0.0
            if size > 1 and least >= POLICY.explain.shorter * best.significance.excess:
                continue
            if preview is not None and (len(chosen) > 1 or chosen[0].rule == "choice"):
                may, rest = nearer(measured, chosen, best, predict, preview)
                if not may:
                    left.setdefault(chosen[0], rest)
                    continue
            found = fit(measured, chosen, predict)
            left.setdefault(chosen[0], found.significance.excess)
            pairs += [(found.significance.excess, frozenset(chosen))] if size == 2 else []
            if not found.triggers:
                enough.append(found)
            elif found.significance.excess < POLICY.explain.shorter * best.significance.excess:
                best = found
    if enough:  # dots may fill a facet as well: the models that could explain the least else
        return replace(min(enough, key=_taken_for_granted), before=bare.significance.z)
    # what is wrong only beside these models was not looked at closely
    beside = best.significance.pixels & ~looked
    if closely is not None and best.models and few_wrong(best) and beside.any():
        predict = closely(beside)
        close = True
        best = fit(measured, best.models, predict)
        if not best.triggers:
            return replace(best, before=bare.significance.z)
    told = None if close else preview
    enlarged = _enlarged(measured, best, useful, models, together, predict, told)
    return replace(enlarged or best, before=bare.significance.z)


def _enlarged(
    measured: Measured,
    best: Explanation,
    useful: Sequence[Model],
    models: Sequence[Model],
    together: tuple[Model, ...],
    predict: Predict,
    preview: Preview | None,
) -> Explanation | None:
    """The models of ``best``, or a renderer's habits alone, and more of ``models`` that leave nothing, or None."""
    enlarged = _beside(measured, best, predict, [each for each in models if each not in useful], preview)
    starts = [best, fit(measured, together, predict)] if together else [best]  # habits alone may leave more than none
    for start in starts:
        enlarged = enlarged or _grown(measured, start, models, predict, preview)
    return enlarged


def _by_stated(
    measured: Measured, bare: Explanation, stated: Sequence[Model], predict: Predict, preview: Preview | None
) -> Iterator[Explanation]:
    """What the conventions that are ``stated`` leave: each alone, then all of those that move what is wrong."""
    near = tuple(model for model in stated if preview is None or nears(bare, model, preview))
    for some in (*((model,) for model in near), *([near] if len(near) > 1 else [])):
        yield fit(measured, some, predict)


def _nearest(
    measured: Measured,
    best: Explanation,
    models: Sequence[Model],
    predict: Predict,
    preview: Preview,
    left: Mapping[Model, float] = MappingProxyType({}),
) -> Explanation:
    """The set of ``models``, grown one by one from ``best``, that leaves least of a picture that none explains.

    Those are tried that by themselves leave least: as told by ``left``, else by their quick pictures.
    """
    while len(best.models) < POLICY.explain.largest_grown:
        ranked: list[tuple[float, int, Model]] = []
        for model in models:
            if model not in best.models and not excluded_by(model, best.models):
                may, rest = nearer(measured, (*best.models, model), best, predict, preview)
                ranked += [(left.get(model, rest), len(ranked), model)] if may else []
        fits = [
            fit(measured, (*best.models, model), predict) for _, _, model in sorted(ranked)[: POLICY.explain.likeliest]
        ]
        nearest = min(fits, key=lambda found: found.significance.excess, default=best)
        if nearest.significance.excess >= POLICY.explain.shorter * best.significance.excess:
            break
        best = nearest
    return best


def _grows(from_some: Iterable[frozenset[Model]], chosen: tuple[Model, ...]) -> bool:
    """Whether ``chosen`` holds all models of a set, one that is not empty, of those that it may grow from."""
    return any(each and each.issubset(chosen) for each in from_some)


def few_wrong(found: Explanation) -> bool:
    """Whether what is left to be explained is so little that a model may do it between the centres of pixels."""
    return bool(0.0 < found.significance.pixels.mean() < POLICY.explain.few)


def _beside(
    measured: Measured, start: Explanation, predict: Predict, some: Sequence[Model], preview: Preview | None
) -> Explanation | None:
    """The models of ``start`` and one of ``some`` that leave nothing to be explained, or None.

    Some act only beside others: the folds of a mesh that stands for a smooth one, facets that shadow a silhouette.
    Where there is a ``preview`` it tells which move nothing there, and which leave as much.
    """
    for each in some:
        if each in start.models or len(start.models) >= POLICY.explain.largest_set:
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
    what mirrors, facets and quads do together takes more than ``largest_set`` of them.
    """
    while len(start.models) < POLICY.explain.largest_grown:
        fits = [
            fit(measured, (*start.models, each), predict)
            for each in models
            if each not in start.models
            and not excluded_by(each, start.models)
            and (preview is None or _promises(measured, start, each, predict, preview))
            and _helps(start, each, predict)
        ]
        enough = [each for each in fits if not each.triggers]
        if enough:
            return min(enough, key=_taken_for_granted)
        best = min(fits, key=lambda each: each.significance.excess, default=start)
        if best.significance.excess >= POLICY.explain.shorter * start.significance.excess:
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
            nears(bare, each, preview, other) for other in besides if each not in other and not excluded_by(each, other)
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
        if not feature or features.count(feature) <= POLICY.explain.values_in_pairs or each in found.models
    )


def _helps(start: Explanation, model: Model, predict: Predict) -> bool:
    """Whether ``model``, beside those of ``start``, moves any pixel that needs explaining."""
    wrong = start.significance.pixels
    beside = choices(start.models)
    base = predict(beside)
    moved = (support(base, predict((*beside, value))) for value in model.values())
    return not wrong.any() or any(bool((each & wrong).any()) for each in moved)
