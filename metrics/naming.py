"""Step 8 of docs/judge.md, the name: the cause or fault that leaves the shortest bug leg, else ``unexplained``.

Faults are first ranked by quick pictures: how much the fault's change of the reference looks like the picture's. The
likeliest are then fitted in full, those that come in all strengths at the strength that fits.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from itertools import chain
from operator import itemgetter

import numpy as np
import numpy.typing as npt

from notabug.adapters.base import Declaration
from notabug.metrics.bug_leg import Bug
from notabug.metrics.explain import Explanation, fit
from notabug.metrics.fitted import fitted, named, remains
from notabug.metrics.lattice import lattice
from notabug.metrics.likely import likely, worth
from notabug.metrics.names import UNNAMED, Name, best_of
from notabug.metrics.noise import Measured
from notabug.metrics.policy import POLICY
from notabug.metrics.quick import Predict, Preview, guessed
from notabug.metrics.whole_picture import beside_limitations, moved_rays, whole_picture
from notabug.references.models.model import Model

Floats = npt.NDArray[np.floating]


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
    look = lattice(*reference.edge.shape)
    bug = Bug(measured, found, limitations, predict, preview, worth(measured, reference), look)
    # what leaves less leaves nothing for another to explain
    exact = POLICY.names.exact * min(1.0, bug.misfit(found.target))
    wholes = whole_picture(bug)
    # a ball of another shading is nearly that ball upside down: a turn, which blends nothing, must leave nothing
    said = (name for name, cause in wholes if not cause.turn or name.remains <= POLICY.names.nothing)
    best = best_of(None, said, exact, noisy=measured.noisy)
    near, cause = min(wholes, key=lambda whole: whole[0].remains, default=(UNNAMED, None))
    soon = near.remains < POLICY.names.remains  # a search beside what explains less is long, and mostly in vain

    def tried(best: Name | None, names: Callable[[], Iterable[Name]]) -> Name | None:
        return best if best and best.is_exact(exact) else best_of(best, names(), exact, noisy=measured.noisy)

    if cause is not None and soon and near.remains > 0.0:
        best = tried(best, lambda: beside_limitations(bug, cause))
    best = tried(best, lambda: moved_rays(bug))
    if best is None or not best.is_exact(exact):
        best = _best_fault(bug, best, faults, exact)
    if (
        cause is not None
        and not soon
        and near.remains < POLICY.bug_leg.hope
        and (best is None or best.remains > POLICY.names.nothing)
    ):
        best = tried(best, lambda: beside_limitations(bug, cause))
    if best is not None:
        return _of_two(bug, best, faults)
    if _alike(measured.mean, reference.value) < POLICY.naming.other:
        likeness, name = max(((_alike(measured.mean, each), name) for name, each in others()), default=(0.0, ""))
        if likeness > POLICY.naming.same:
            return Name("wrong_scene", f"this is a picture of {name}", 0.0)
    return UNNAMED


def possible(faults: Iterable[Model], declaration: Declaration) -> list[Model]:
    """Those of ``faults`` that a renderer can have: without rays that start on surfaces none of theirs is told."""
    rays = declaration.hit_error > 0.0 and declaration.depth in ("", "unknown")
    return [fault for fault in faults if rays or not fault.of_rays]


def _best_fault(bug: Bug, best: Name | None, faults: Sequence[Model], exact: float) -> Name | None:
    """The best of ``faults`` and the ``best`` so far; they are fitted in the order of what quick pictures leave."""
    found = likely(bug.measured, bug.found, faults, bug.predict, bug.preview, bug.together)
    told = bug.told()
    ranked: list[tuple[tuple[bool, int, int], float, Model, Iterator[Model]]] = []
    for turn, strengths in enumerate(found):
        first = next(strengths)
        likeness = bug.likeness(first)
        # a misfit is 0 where all that is wrong lies on edges, which misfits leave out
        level = round(math.log(max(likeness, exact, sys.float_info.min), POLICY.naming.level))
        ranked.append(((first.rule == "any", level, turn), likeness, first, strengths))
    for _, first_likeness, first, others in sorted(ranked, key=itemgetter(0)):
        if best is not None and best.is_exact(exact) and first_likeness >= best.prune_bound(exact):
            continue  # nor will another strength be better than what is exact
        for fault in chain((first,), others):
            likeness = first_likeness if fault is first else bug.likeness(fault)
            if best is not None and (likeness >= best.prune_bound(exact) or (fault.rule == "any" and best.fits)):
                continue
            if not bug.is_hopeless(fault, told):
                names = (replace(name, preview_misfit=likeness) for name in fitted(bug, fault))
                best = best_of(best, names, exact, noisy=bug.measured.noisy)
    return best


def _of_two(bug: Bug, best: Name, faults: Sequence[Model]) -> Name:
    """``best``, or a fault that shows the very same here as a cause in the whole picture: then both are told."""
    for fault in faults if best.whole else ():
        if fault.looks_like == best.name and bug.preview_misfit(
            guessed((fault,), bug.predict, bug.preview)
        ) < POLICY.bug_leg.hope * bug.preview_misfit(bug.predict(()).value):
            found = fit(bug.measured, (), bug.predict, (fault,))
            if remains(bug, found) <= POLICY.names.nothing:
                claim = f"{fault.claim}, or {best.message}: in this scene the two look alike"
                return replace(named(bug, fault, found), message=claim)
    return best


def _alike(a: Floats, b: Floats) -> float:
    """The correlation of two pictures, 0 where sizes differ or one is constant."""
    if a.shape != b.shape or np.ptp(a) == 0 or np.ptp(b) == 0:
        return 0.0
    return float(np.corrcoef(a.ravel(), b.ravel())[0, 1])
