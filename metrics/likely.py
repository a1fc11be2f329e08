"""Step 8 of docs/judge.md, the name: which faults may be behind a bug, and how strong, as quick pictures tell.

Faults are ranked by how much their change of the reference looks like the picture's. Those that come in all strengths
are taken at the strength that fits.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from notabug.metrics.admissible import Admissible
from notabug.metrics.channels import largest
from notabug.metrics.explain import Explanation
from notabug.metrics.noise import Measured
from notabug.metrics.quick import Predict, Preview, choices
from notabug.references.models.model import Model

Floats = npt.NDArray[np.floating]

STEPS = (4, 1)  # pixels a block: a texture that has moved by more than a texel is found only where it is blurred
LIKELY = 8  # faults that are fitted in full, where their quick pictures look alike
ALIKE = 0.3  # correlation of the changes below which a fault is not tried
LEAST_ALIKE, FEW = 0.1, 2  # and below which it is not even where fewer faults than FEW are more alike
EQUAL = 0.9  # of the changes: two quick pictures that share so much are of one fault
CLIP = 30.0  # tolerances: a larger change counts no more, or one highlight would decide

JOINT_STEPS = (4, 4, 1, 1, 1)  # pixels a block, at each step towards the strengths along several axes
JOINT_LEAST, JOINT_MOST = 0.01, 20.0  # times the fault's own strength: what counts along an axis, and what is possible

RARE = frozenset({"geometry_mirrored", "cracks"})
"""Faults that are told after others that look alike: a mirrored floor shows what a flipped texture shows, and cracks
of a fine mesh show dots nearly everywhere."""


def likely(
    measured: Measured, found: Explanation, faults: Sequence[Model], predict: Predict, preview: Preview
) -> Iterator[Model]:
    """The faults whose change of the picture is most like the measured one, likeliest first, at fitting strengths."""
    reference = predict(())
    # of edges only what is wrong counts: there quick pictures of the right scene differ from the mean as well
    at = (~reference.edge | found.significance.pixels)[..., None]
    at = at if at.sum() > 256 else np.ones_like(at)
    scale = worth(measured, reference)
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

    def equal(change: Floats, own: Floats) -> float:
        a, b = (np.clip(each / scale, -CLIP, CLIP) * at for each in (change, own))
        return 1.0 - float(np.abs(a - b).sum()) / max(float(np.abs(a).sum()), 1e-30)

    def scored(fault: Model, change: Floats, own: Floats) -> float:
        local = fault.local or fault.rule != "choice"
        score = max(compared(change, own, local, step) for step in STEPS)
        if not local and fault.at is None and equal(change, own) > EQUAL:
            score += 1.0  # of one strength: what is not only alike but the same comes first
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
    joined: list[object] = []
    alike = sum(-each[0] > ALIKE for each in ranked)
    for _, _, _, fault, base, change in ranked[: min(LIKELY, max(alike, FEW))]:
        if fault.at is None:
            yield fault
            continue
        best, strength = fault, fault.strength
        own = preview((*base, fault)) - preview(base)
        for step in (*STEPS, 1):
            size = fitting_size(change * at, own * at, scale, step)
            if size is None:
                break
            strength = _sane(fault.neutral + (strength - fault.neutral) * size, fault)
            best = replace(fault.at(strength), at=fault.at, strength=strength, neutral=fault.neutral)
            own = preview((*base, best)) - preview(base)
        yield best
        if fault.jointly is not None and fault.jointly not in joined:
            joined.append(fault.jointly)
            yield _jointly(fault, base, change * at, scale, preview)
        if best.strength != fault.strength:  # a limitation beside the fault can mislead the fit
            yield replace(fault, at=None)


def _trust(off: Floats) -> Floats:
    """Huber's weights (n,) of deviations ``off`` (n,): 1.345 standard deviations, told by the median, count in full."""
    return np.minimum(1.0, 1.345 * 1.4826 * float(np.median(off)) / np.maximum(off, 1e-12))


def _jointly(fault: Model, base: tuple[Model, ...], change: Floats, scale: Floats, preview: Preview) -> Model:
    """``fault`` along all of its axes at once, at the strengths whose quick picture is nearest to ``change``.

    Gauss and Newton's steps, on means over blocks first, which a large step does not leave.
    """
    assert fault.jointly is not None
    start, unit = preview(base), np.eye(fault.axes) * fault.strength
    strengths = np.zeros(fault.axes)
    for step in JOINT_STEPS:
        here = preview((*base, fault.jointly(strengths))) - start
        moves = [preview((*base, fault.jointly(strengths + each))) - start - here for each in unit]
        weight = 1.0 / np.maximum(scale, np.abs(change - here) / CLIP)
        columns = np.stack([coarse(move * weight, step).ravel() for move in moves], axis=1)
        found = _regression(columns, coarse((change - here) * weight, step).ravel())
        most = JOINT_MOST * fault.strength
        strengths = np.clip(strengths + found * fault.strength, -most, most)
    rounded = np.array([float(f"{strength:.3g}") for strength in strengths])
    return fault.jointly(np.where(np.abs(rounded) < JOINT_LEAST * fault.strength, 0.0, rounded))


def _regression(columns: Floats, values: Floats) -> Floats:
    """The factors (k,) by which the ``columns`` (n, k) add up to ``values`` (n,), by Huber's regression."""
    acts = columns.any(axis=1)
    columns, values = columns[acts], values[acts]
    found: Floats = np.zeros(columns.shape[1])
    if len(values) < len(found):
        return found
    trust = np.ones_like(values)
    for _ in range(4):
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
    weight = 1.0 / np.maximum(scale, np.abs(change) / CLIP)
    a, b = coarse(change * weight, step), coarse(own * weight, step)
    acts = b != 0
    a, b = a[acts], b[acts]
    if not b.size:
        return None
    trust, factor = np.ones_like(b), 1.0
    for _ in range(4):
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


def worth(measured: Measured, to: Admissible) -> Floats:
    """What a residual is worth (h, w, 3): a quarter of the tolerance, and the noise."""
    return np.sqrt(np.asarray((to.tau / 4.0) ** 2 + measured.variance))
