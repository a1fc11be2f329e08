"""Step 8 of docs/judge.md, the name: how well a fault fits, alone and beside limitations, at the strength that fits."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from notabug.metrics.admissible import Admissible, residual
from notabug.metrics.bug_leg import Bug
from notabug.metrics.channels import largest, total
from notabug.metrics.explain import Explanation, fit
from notabug.metrics.likely import changed_by, refined
from notabug.metrics.names import Name
from notabug.metrics.noise import Measured
from notabug.metrics.policy import POLICY
from notabug.metrics.quick import choices, nearer, nears
from notabug.metrics.rules import support
from notabug.metrics.significance import significance
from notabug.references.models.model import Edit, Model, excluded_by

Floats = npt.NDArray[np.floating]


def fitted(bug: Bug, fault: Model) -> Iterator[Name]:
    """How well ``fault`` fits: alone, beside limitations, closer to the strength that fits, and here and there."""
    measured, found, predict = bug.measured, bug.found, bug.predict
    if fault.darkened is not None and _is_there(bug, fault, fault.darkened):
        return
    if fault.local and fault.rule == "set" and not _touches(measured, found.target, predict((fault,))):
        return
    bare = nearest = fit(measured, (), predict, (fault,))
    yield named(bug, fault, bare)
    closer = fault
    # quick pictures gave a rough strength
    if fault.at is not None and POLICY.fitted.nearly < remains(bug, bare) < POLICY.bug_leg.hope:
        closer = refined(fault, changed_by(measured, predict(())), predict, bug.scale)
    if bare.significance.excess > 0:
        others = [
            (each,) for each in bug.limitations if _nearer(bug, bare, (fault, each)) and _useful(bug, bare, fault, each)
        ]
        for models in dict.fromkeys((found.models, bug.together, *others)):
            if models:
                beside = fit(measured, models, predict, (fault,))
                yield named(bug, fault, beside)
                nearest = min(nearest, beside, key=lambda each: each.significance.excess)
                if nearest.significance.excess == 0:
                    break
        if nearest.models and nearest.significance.excess > 0 and remains(bug, nearest) < POLICY.bug_leg.hope:
            yield from _grown(bug, fault, nearest)
    if fault.local and fault.rule == "choice" and _touches(measured, found.target, predict((fault,))):
        patched = patchwork(measured, found.target, predict((fault,)))
        left = significance(residual(measured.mean, patched), measured, patched)
        leaves = bug.remains(left, still=bool(left.triggers))
        misfit = bug.misfit(patched) * POLICY.fitted.free + POLICY.fitted.choice
        yield Name(fault.name, fault.claim, leaves, misfit, strengths=fault.made_of, rare=fault.rare)
    if closer.strength != fault.strength:
        yield from fitted(bug, replace(closer, at=None))
    # behind what is missing more may be
    if fault.placed is not None and POLICY.names.nothing < remains(bug, nearest) < POLICY.bug_leg.hope:
        more = fault.placed(nearest.significance.pixels)
        if more is not None:
            yield from fitted(bug, more)


def _grown(bug: Bug, fault: Model, nearest: Explanation) -> Iterator[Name]:
    """How well ``fault`` fits beside more limitations than one: each time the one that leaves the shortest bug leg.

    A renderer has all of its conventions and limitations at once, and a fault hides them from a search without it.
    """
    while remains(bug, nearest) > POLICY.names.nothing and len(nearest.models) < POLICY.explain.largest_grown:
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
        if best.significance.excess > POLICY.explain.shorter * nearest.significance.excess:
            return
        yield named(bug, fault, best)
        nearest = best


def remains(bug: Bug, found: Explanation) -> float:
    """The share of the bug leg that ``found`` leaves."""
    return bug.remains(found.significance, still=bool(found.triggers))


def named(bug: Bug, fault: Model, found: Explanation) -> Name:
    """``fault`` as a name for the bug, of which ``found`` is what it and the limitations beside it explain."""
    off = bug.misfit(found.target)
    claim = fault.claim + (fault.if_black if fault.if_black and _leaves_black(bug, found) else "")
    numbers = {fault.number: fault.strength} if fault.number else {}
    if fault.rule == "choice":
        axes = 1 if fault.jointly else fault.axes  # a model of one axis tells how many there are
        return Name(
            fault.name,
            claim,
            remains(bug, found),
            off,
            found,
            numbers=numbers,
            axes=axes,
            strengths=fault.made_of,
            moves=bool(fault.moves),
            rare=fault.rare,
        )
    return Name(
        fault.name,
        claim,
        remains(bug, found),
        off * POLICY.fitted.free + POLICY.fitted.choice,
        found,
        found.freedom,
        fault.rule == "any",
        strengths=fault.made_of,
        rare=fault.rare,
    )


def _leaves_black(bug: Bug, found: Explanation) -> bool:
    """Whether all that the fault takes away leaves black, as the very surfaces do where no light reaches them."""
    was, left = (largest(np.asarray(each.value, np.float64)) for each in (bug.predict(()), found.target))
    changed = np.abs(was - left) > POLICY.fitted.black * float(was.max(initial=0.0))
    return (
        bool(changed.any())
        and float((left[changed] <= POLICY.fitted.black * was[changed]).mean()) >= POLICY.fitted.all_black
    )


def _is_there(bug: Bug, fault: Model, darkened: Edit) -> bool:
    """Whether the picture shows rightly a part of the scene that ``fault`` says is gone, where it would change it.

    Edges may be right by chance. Of a part that has lost some faces more than a little is wrong.
    """
    reference, gone = bug.predict(()), bug.predict((fault,))
    dark = bug.predict((replace(fault, name=f"{fault.name} darkened", edit=darkened),))
    acts = support(reference, dark) & support(reference, gone) & ~reference.edge
    target = bug.found.target
    wrong = acts & (largest(np.abs(residual(bug.measured.mean, target)) - target.tau) > 0)
    return bool(acts.any()) and float(wrong.sum()) < POLICY.rules.least_touched * float(acts.sum())


def _touches(measured: Measured, base: Admissible, other: Admissible) -> bool:
    """Whether a local fault could be more than a few wrong pixels of what it acts on."""
    acts = support(base, other)
    wrong = acts & (largest(np.abs(residual(measured.mean, base)) - base.tau) > 0)
    return float(wrong.sum()) >= POLICY.rules.least_touched * float(acts.sum())


def _nearer(bug: Bug, start: Explanation, models: tuple[Model, ...]) -> bool:
    """Whether ``models``, of which all but the last are those of ``start``, may leave less, as quick pictures tell."""
    known = choices(models[:-1])
    return nearer(bug.measured, models, start, bug.predict, bug.preview, known)[0]


def _useful(bug: Bug, start: Explanation, fault: Model, each: Model) -> bool:
    """Whether ``each`` moves any pixel that ``start`` leaves wrong; most do not, as previews tell."""
    wrong = start.significance.pixels
    beside = (fault, *choices(start.models))
    return nears(start, each, bug.preview, beside) and bool(
        (support(bug.predict(choices(beside)), bug.predict((*choices(beside), each))) & wrong).any()
    )


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
