"""Step 8 of docs/judge.md, the name: which faults may be behind a bug, and how strong, as quick pictures tell.

Faults are ranked by how much their change of the reference looks like the picture's. Those that come in all strengths
are taken at the strength that fits.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
import numpy.typing as npt

from notabug.metrics.admissible import Admissible
from notabug.metrics.channels import largest
from notabug.metrics.explain import Explanation
from notabug.metrics.formulas import DEVIATION
from notabug.metrics.lattice import Lattice, lattice
from notabug.metrics.noise import Measured
from notabug.metrics.policy import POLICY
from notabug.metrics.quick import Predict, Preview, choices
from notabug.references.models.model import Model

Floats = npt.NDArray[np.floating]
Quick = Callable[[tuple[Model, ...]], Floats]
"""Quick pictures of sets of models on a lattice, (rows, columns, 3)."""


def likely(
    measured: Measured,
    found: Explanation,
    faults: Sequence[Model],
    predict: Predict,
    preview: Preview,
    habits: tuple[Model, ...] = (),
) -> list[Iterator[Model]]:
    """The faults whose change of the picture is most like the measured one, likeliest first, each at some strengths.

    The first strength of a fault is the one that fits best along one axis. A renderer may have the choices ``habits``
    beside its fault, which hides some of them. Pictures are looked at on a lattice.
    """
    numbers = POLICY.likely
    reference = predict(())
    look = lattice(*reference.edge.shape)
    quick = partial(look.preview, preview)
    steps = look.blocks(numbers.steps)
    # of edges only what is wrong counts: there quick pictures of the right scene differ from the mean as well
    at = look.of(~reference.edge | found.significance.pixels)[..., None]
    at = at if at.sum() > numbers.enough else np.ones_like(at)
    scale = look.of(worth(measured, reference))
    # what the picture changes on the reference, and on the choices of a renderer that explain most of it
    starts: list[tuple[tuple[Model, ...], Floats]] = [((), look.of(measured.mean - reference.value))]
    beside = choices(found.models)
    if found.models:
        starts.append((beside, look.of(measured.mean - found.target.value)))
    if habits:
        starts.append((habits, look.of(measured.mean - predict(habits).value)))

    def compared(change: Floats, other: Floats, local: bool, step: int) -> float:
        a, b = (coarse(np.clip(each / scale, -numbers.clip, numbers.clip) * at, step) for each in (change, other))
        if local:
            b = b * (largest(np.abs(a)) > 1.0)[..., None]
        product = float(np.linalg.norm(a) * np.linalg.norm(b))
        return abs(float((a * b).sum())) / product if product > 0 else 0.0

    def covered(change: Floats, other: Floats) -> float:
        a = (np.clip(change / scale, -numbers.clip, numbers.clip) * at) ** 2
        return float(a[other != 0].sum() / max(float(a.sum()), 1e-30))

    def equal(change: Floats, own: Floats) -> float:
        """The share of what is changed that ``own`` says right: of each value the share of its size."""
        size = np.minimum(np.abs(change) / scale, numbers.clip) * at
        off = np.minimum(np.abs(change - own) / np.maximum(np.abs(change), scale), 1.0)
        beside = np.minimum(np.abs(own) / scale, numbers.clip) * at * (np.abs(change) <= scale)
        return 1.0 - float((size * off + beside).sum()) / max(float(size.sum()), 1e-30)

    def scored(fault: Model, change: Floats, own: Floats) -> float:
        local = fault.local or fault.rule != "choice"
        score = max(compared(change, own, local, step) for step in steps)
        if fault.rule == "choice" and fault.at is None and equal(change, own) > numbers.equal:
            score += 1.0  # of one strength: what is not only alike but the same comes first
        # under "any" what it shows may be anything, where it acts
        return max(score, covered(change, own)) if fault.rule == "any" else score

    ranked: list[_Ranked] = []
    families: dict[object, list[list[tuple[_Ranked, Floats]]]] = {}
    placed = (fault if fault.placed is None else fault.placed(found.significance.pixels) for fault in faults)
    for index, fault in enumerate(each for each in placed if each is not None):
        tried: list[tuple[_Ranked, Floats]] = []
        for base, change in starts:
            own = quick((*base, fault)) - quick(base)
            tried.append((_Ranked(scored(fault, change, own), index, fault, base, change), own))
        if fault.jointly is None:
            ranked.append(max((each for each, _ in tried), key=lambda each: each.score))
        else:
            families.setdefault(fault.jointly, []).append(tried)
    for axes in families.values():  # several axes at once are one fault: the likeliest axis stands for all of them
        best = []
        for on_one_base in zip(*axes, strict=True):
            likeliest = max((each for each, _ in on_one_base), key=lambda each: each.score)
            together = _together([own for _, own in on_one_base], likeliest.change, at / scale)
            score = max(compared(likeliest.change, together, False, step) for step in steps)
            best.append(replace(likeliest, together=score))
        ranked.append(max(best, key=lambda each: each.together))
    ranked = sorted((each for each in ranked if each.most > numbers.least_alike), key=_Ranked.place)
    alike = sum(each.most > numbers.alike for each in ranked)
    tried_in_turn = sorted(ranked[: min(numbers.likely, max(alike, numbers.few))], key=_Ranked.turn)
    return [_strengths(each, at, scale, quick, look) for each in tried_in_turn]


@dataclass(frozen=True, slots=True, eq=False)
class _Ranked:
    """A fault, how much it looks like the picture on ``base``, and what the picture changes there."""

    score: float
    index: int
    fault: Model
    base: tuple[Model, ...]
    change: Floats
    together: float = 0.0
    """The score of all axes of a fault that has several, which may be off along each."""

    @property
    def most(self) -> float:
        """The score along one axis or along all, whichever is better."""
        return max(self.score, self.together)

    def place(self) -> tuple[float, bool, int]:
        """What is less is likelier."""
        return (-round(self.most, 2), *self.turn()[1:])

    def turn(self) -> tuple[float, bool, int]:
        """What is less is tried earlier: of the likely ones those that need one axis only."""
        return (-round(self.score, 2), self.fault.rare, self.index)


def _strengths(
    ranked: _Ranked, at: npt.NDArray[np.bool_], scale: Floats, quick: Quick, look: Lattice
) -> Iterator[Model]:
    """The fault at the strength that fits where it looks (h, w, 1), along several axes at once, and as it was."""
    fault, base, change = ranked.fault, ranked.base, ranked.change
    if fault.at is None:
        yield fault
        return
    best, strength = fault, fault.strength
    own = quick((*base, fault)) - quick(base)
    for step in (*look.blocks(POLICY.likely.steps), 1):
        size = fitting_size(change * at, own * at, scale, step)
        if size is None:
            break
        strength = _sane(fault.neutral + (strength - fault.neutral) * size, fault)
        best = replace(fault.at(strength), at=fault.at, strength=strength, neutral=fault.neutral)
        own = quick((*base, best)) - quick(base)
    farther = _farther(best, own, ranked, at / scale, quick)
    if farther is not None:
        yield farther
    yield best
    if fault.jointly is not None:
        joint = _jointly(
            fault, base, change, np.where(at, scale, np.inf), quick, look.blocks(POLICY.likely.joint_steps)
        )
        if joint.axes > 1:
            yield joint
    if best.strength != fault.strength:  # a limitation beside the fault can mislead the fit
        yield replace(fault, at=None)


def _farther(best: Model, own: Floats, ranked: _Ranked, weight: Floats, quick: Quick) -> Model | None:
    """``best`` at another strength, where quick pictures tell that it leaves less than the change ``own`` of ``best``.

    A change that does not grow with its strength, as that of a refraction, is fitted by its slope to one that is too
    small: what it shows elsewhere counts against it. So strengths farther off are looked at, and then those beside.
    """
    assert best.at is not None
    base, change = quick(ranked.base), ranked.change

    def left(moved: Floats) -> float:
        return float(np.minimum(np.abs(change - moved) * weight, POLICY.likely.clip).sum())

    def at(strength: float) -> tuple[float, float]:
        model = best.at(strength)  # type: ignore[misc]
        return left(quick((*ranked.base, model)) - base), strength

    least = here = left(own)
    if least <= POLICY.likely.well * left(np.zeros_like(own)):
        return None
    strength, off = best.strength, best.strength - best.neutral
    for factors in POLICY.likely.farther:
        tried = [at(_sane(best.neutral + factor * off, best)) for factor in factors]
        least, strength = min([(least, strength), *tried])
        off = strength - best.neutral
    if least > POLICY.likely.much_less * here:
        return None
    return replace(best.at(strength), at=best.at, strength=strength, neutral=best.neutral)


def _together(moves: Sequence[Floats], change: Floats, weight: Floats) -> Floats:
    """The sum of ``moves`` (h, w, 3), each times a factor, that is nearest to ``change``; pixels have a ``weight``."""
    weight = np.minimum(weight, POLICY.likely.clip / np.maximum(np.abs(change), 1e-30))
    columns = np.stack([(move * weight).ravel() for move in moves], axis=1)
    factors = np.linalg.lstsq(columns.T @ columns, columns.T @ (change * weight).ravel(), rcond=None)[0]
    return np.asarray(np.tensordot(factors, np.stack(moves), axes=1))


def _trust(off: Floats) -> Floats:
    """Huber's weights (n,) of deviations ``off`` (n,): 1.345 standard deviations, told by the median, count in full."""
    return np.minimum(1.0, POLICY.regression.huber * DEVIATION * float(np.median(off)) / np.maximum(off, 1e-12))


def _jointly(
    fault: Model, base: tuple[Model, ...], change: Floats, scale: Floats, quick: Quick, steps: tuple[int, ...]
) -> Model:
    """``fault`` along all of its axes at once, at the strengths whose quick picture is nearest to ``change``.

    A ``scale`` without end is that of pixels which do not count.

    Gauss and Newton's steps, on means over blocks of the sizes ``steps``, large ones first, which a large step does not
    leave; derivatives are taken once for each size of block.
    """
    assert fault.jointly is not None
    start, unit = quick(base), np.eye(fault.axes) * fault.strength
    strengths, here, most = np.zeros(fault.axes), np.zeros_like(change), POLICY.likely.most * fault.strength
    for step in steps:
        moves = [quick((*base, fault.jointly(strengths + each))) - start - here for each in unit]
        for _ in range(POLICY.likely.joint_turns):
            weight = 1.0 / np.maximum(scale, np.abs(change - here) / POLICY.likely.clip)
            columns = np.stack([coarse(move * weight, step).ravel() for move in moves], axis=1)
            left = coarse((change - here) * weight, step).ravel()
            further = np.clip(strengths + _regression(columns, left) * fault.strength, -most, most)
            there = quick((*base, fault.jointly(further))) - start
            if np.abs(left).sum() <= np.abs(coarse((change - there) * weight, step)).sum():
                break
            strengths, here = further, there
    rounded = np.array([float(f"{strength:.3g}") for strength in strengths])
    rounded[np.abs(rounded) < POLICY.likely.least * fault.strength] = 0.0
    axes = int(np.count_nonzero(rounded))
    return replace(fault.jointly(rounded), axes=axes, strengths=tuple(float(strength) for strength in rounded))


def _regression(columns: Floats, values: Floats) -> Floats:
    """The factors (k,) by which the ``columns`` (n, k) add up to ``values`` (n,), by Huber's regression."""
    acts = columns.any(axis=1)
    columns, values = columns[acts], values[acts]
    found: Floats = np.zeros(columns.shape[1])
    if len(values) < len(found):
        return found
    trust = np.ones_like(values)
    for _ in range(POLICY.likely.turns):
        root = np.sqrt(trust)
        found = np.linalg.lstsq(columns * root[:, None], values * root, rcond=None)[0]
        trust = _trust(np.abs(values - columns @ found))
        if not trust.any():  # most of it fits to the last bit
            break
    return found


def coarse(values: Floats, step: int) -> Floats:
    """Means of ``values`` (h, w, c) over blocks of ``step`` x ``step`` pixels; what fills no block is left out."""
    if step == 1:
        return values
    h, w, c = (each // step * step for each in (*values.shape[:2], step * values.shape[2]))
    return np.asarray(values[:h, :w].reshape(h // step, step, w // step, step, c // step).mean(axis=(1, 3)))


def changed_by(measured: Measured, reference: Admissible) -> Floats:
    """What the picture changes on the reference, off its edges (h, w, 3)."""
    return np.asarray((measured.mean - reference.value) * ~reference.edge[..., None])


def fitting_size(change: Floats, own: Floats, scale: Floats, step: int = 1) -> float | None:
    """The factor by which ``own`` fits ``change`` best, by Huber's regression in which large changes weigh less.

    What a limitation changes in a corner of the picture has no say in it.
    """
    weight = 1.0 / np.maximum(scale, np.abs(change) / POLICY.likely.clip)
    a, b = coarse(change * weight, step), coarse(own * weight, step)
    acts = b != 0
    a, b = a[acts], b[acts]
    if not b.size:
        return None
    trust, factor = np.ones_like(b), 1.0
    for _ in range(POLICY.likely.turns):
        factor = float((trust * a * b).sum() / (trust * b * b).sum())
        trust = _trust(np.abs(a - factor * b))
        if not trust.any():  # most of it fits to the last bit
            break
    return factor


def refined(fault: Model, change: Floats, predict: Predict, scale: Floats) -> Model:
    """``fault`` at the strength at which the full prediction has the size of ``change``, by one step of a secant."""
    assert fault.at is not None
    reference = predict(())
    own = (predict((fault,)).value - reference.value) * ~reference.edge[..., None]
    size = fitting_size(change, own, scale)
    if size is None:
        return fault
    off = (fault.strength - fault.neutral) * size
    strength = _sane(fault.neutral + off, fault)
    return replace(fault.at(strength), strength=fault.neutral + off, strengths=(strength,))


def _sane(strength: float, fault: Model) -> float:
    """``strength`` to three digits of its distance from neutral, and within what a fault can be."""
    off = strength - fault.neutral
    if fault.neutral:
        off = min(max(off, -POLICY.likely.least_factor), POLICY.likely.most_factor)
    size = POLICY.likely.most * abs(fault.strength - fault.neutral)
    off = min(max(off, -size), size)
    if off == 0.0:
        off = POLICY.likely.least * (fault.strength - fault.neutral)
    return fault.neutral + float(f"{off:.3g}")


def worth(measured: Measured, to: Admissible) -> Floats:
    """What a residual is worth (h, w, 3): a quarter of the tolerance, and the noise."""
    return np.sqrt(np.asarray((to.tau / POLICY.likely.worth) ** 2 + measured.variance))
