"""Step 10 of docs/judge.md, the verdict: calls the other steps, which live beside it, and puts a Judgement together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
import numpy.typing as npt

from notabug.adapters.base import Declaration
from notabug.adapters.spheres import as_given
from notabug.metrics import perceive as eye
from notabug.metrics.admissible import Admissible, residual
from notabug.metrics.causes import gain_message
from notabug.metrics.channels import largest, pixels, put
from notabug.metrics.expected import expected
from notabug.metrics.explain import Explanation, beside_faults, explain, few_wrong, fit
from notabug.metrics.global_fit import untold_gain
from notabug.metrics.hesitation import hesitation
from notabug.metrics.image_checks import box, invalid
from notabug.metrics.image_filters import Bools, widened
from notabug.metrics.names import UNNAMED, Name
from notabug.metrics.naming import Others, name_bug, possible
from notabug.metrics.noise import Measured, in_tiles
from notabug.metrics.policy import POLICY
from notabug.metrics.predictions import Predictions
from notabug.metrics.second_look import doubtful, shared_out
from notabug.metrics.sets import admitted, stated_conventions
from notabug.metrics.telling import doing
from notabug.metrics.verdict import Finding, Leg, Verdict, Word
from notabug.references.models.camera import shift_message
from notabug.references.models.model import Model, models
from notabug.references.tracer.precision import RELATIVE
from notabug.scenes_usd.scene import Scene

Floats = npt.NDArray[np.floating]


@dataclass(frozen=True, slots=True, eq=False)
class Judgement:
    """A verdict with the pictures it was drawn from; every picture is (h, w, 3) linear, every map (h, w).

    ``mean`` is the mean of the seeds, ``reference`` what the intended model gives, ``nearest`` the nearest admissible
    picture P(I). ``limitation_map`` and ``bug_map`` are FLIP (0..1) of the two legs, or zeros where a leg is empty.
    """

    verdict: Verdict
    mean: Floats
    reference: Floats
    nearest: Floats
    limitation_map: Floats
    bug_map: Floats


def judge(
    pictures: Sequence[Floats],
    scene: Scene,
    declaration: Declaration,
    *,
    perceive: bool = True,
    tolerance: float = RELATIVE,
    others: Others = tuple,
    naming: bool = True,
) -> Judgement:
    """Judge ``pictures`` (independent seeds of one renderer, each (h, w, 3) linear) of ``scene``.

    ``perceive`` measures FLIP and colour differences on the legs that are not empty; without it the legs hold only
    pixel counts. ``naming`` looks for the fault behind a bug; without it every bug is ``unexplained``, and the
    verdict's word is the same. ``others`` gives references of other scenes, to recognise a picture that belongs to one
    of them.
    """
    scene = as_given(scene, declaration)
    doing("predicts the reference")
    against = expected(scene, declaration, tolerance)
    wrong = invalid(pictures, scene.height, scene.width)
    if wrong is not None:
        return _refused(wrong, pictures, against.admitted)
    measured, predicted = against.measure(pictures)
    reference = predicted(())
    known = list(models(scene))
    open_to = admitted(known, declaration)
    stated = stated_conventions(open_to, declaration)
    doing("looks for legitimate limitations that explain the picture")
    found = explain(measured, open_to, predicted, predicted.preview, predicted.closely, stated)
    if found.triggers and few_wrong(found):
        predicted, found = _looked_closer(measured, found, predicted)
    doubted = np.zeros(reference.edge.shape, np.bool_) if found.triggers else doubtful(measured, found, scene)
    if doubted.any():
        predicted = predicted.finely(doubted)
        measured = shared_out(measured, predicted(()), doubted)
        found = explain(measured, open_to, predicted, predicted.preview, predicted.closely, stated)
    findings: tuple[Finding, ...] = ()
    word: Word
    name: Name | None = None
    undecided = hesitation(measured, found, predicted, open_to, scene, declaration, len(pictures))
    undecided = undecided or ("" if found.triggers else untold_gain(found.global_fit))
    if undecided:
        word, message = "inconclusive", undecided
        findings = () if found.triggers else _limitations(found, declaration)  # seen through the noise
    elif found.triggers:
        name = UNNAMED
        if naming:
            doing("looks for the coding error behind the bug")
            faults = [each.under(declaration) for each in known if each.kind == "fault" and each.open_to(declaration)]
            beside = beside_faults(open_to, found)
            close = predicted.closely(found.significance.pixels) if few_wrong(found) else predicted
            name = name_bug(measured, found, possible(faults, declaration), beside, close, predicted.preview, others)
        if name is UNNAMED:
            name = _global_name(found) or name
        bug = _bug(name, found, measured, reference)
        # a large gain hides a limitation until it is taken out: the fault's own explanation holds what is beside it
        word, findings, message = "bug", (bug, *_limitations(name.fitted or found, declaration)), bug.message
    else:
        findings = _limitations(found, declaration)
        word = "limitation" if any(finding.kind == "limitation" for finding in findings) else "pass"
        message = "; ".join(finding.message for finding in findings)
    judgement = Judgement(
        Verdict(
            word,
            findings,
            triggers=found.triggers,
            message=message,
            numbers=_numbers(measured, found, reference) | dict(name.numbers if word == "bug" and name else {}),
        ),
        measured.mean,
        reference.value,
        found.nearest,
        np.zeros(measured.mean.shape[:2]),
        np.zeros(measured.mean.shape[:2]),
    )
    return _perceived(judgement, found, reference, perceive)


def _looked_closer(measured: Measured, found: Explanation, predicted: Predictions) -> tuple[Predictions, Explanation]:
    """What explains a picture of which little is wrong, where the prediction itself was what is wrong there.

    It is made as exact as references are at these pixels, and asked without models, then with those of ``found``.
    """
    closer = predicted.finely(found.significance.pixels)
    for some in dict.fromkeys(((), found.models)):
        again = fit(measured, some, closer)
        if not again.triggers:
            return closer, replace(again, before=found.before)
    return predicted, found


def _refused(wrong: Finding, pictures: Sequence[Floats], reference: Admissible) -> Judgement:
    first = np.asarray(pictures[0], np.float64)
    shown = first if first.shape == reference.value.shape else np.zeros_like(reference.value)
    empty = np.zeros(reference.value.shape[:2])
    verdict = Verdict("bug", (wrong,), triggers=("invalid",), message=wrong.message)
    return Judgement(verdict, shown, reference.value, reference.value, empty, empty)


def _global_name(found: Explanation) -> Name | None:
    """The name of a bug that is only a gain or a shift of the whole picture, fitted already."""
    if found.significance.triggers:
        return None
    if found.global_fit.gained:
        return Name("light_gain", gain_message(found.global_fit.gain), 0.0, strengths=(found.global_fit.gain,))
    if found.global_fit.warped and not found.global_fit.shifted:
        moved = f"edges move by up to {found.global_fit.warp:.2f} pixels against the middle"
        return Name("field_of_view", f"{moved}: the field of view, the aspect or the roll is wrong", 0.0)
    x, y = found.global_fit.shift
    return Name("pixel_shift", shift_message(x, y), 0.0, strengths=(x, y))


def _bug(name: Name, found: Explanation, measured: Measured, reference: Admissible) -> Finding:
    wrong, tiles = found.significance.pixels, found.significance.tiles
    if not wrong.any():  # faint and wide: the tiles that deviate, or the whole picture
        h, w = wrong.shape
        wrong = in_tiles(tiles, h, w) if tiles.any() else np.ones((h, w), bool)
    z = float(found.significance.z[wrong].max())
    # outside of what the reference admits, and of what the limitations beside it admit
    outside = [largest(np.abs(residual(measured.mean, to)) - to.tau) for to in (reference, found.target)]
    return Finding(
        "bug",
        name.name,
        float(wrong.sum()),
        box(wrong),
        z=z,
        message=name.message,
        regions=regions(wrong),
        worst=_worst(np.minimum(*outside), wrong),
        strengths=name.strengths,
    )


def _worst(off: Floats, among: Bools) -> tuple[int, int]:
    """The pixel (x, y) that is most ``off`` (h, w) of those ``among`` which it is looked for."""
    y, x = np.unravel_index(int(np.argmax(np.where(among, off, -np.inf))), off.shape)
    return int(x), int(y)


def _limitations(found: Explanation, declaration: Declaration) -> tuple[Finding, ...]:
    made = []
    for model in found.models:
        alpha = found.alphas[model.name]
        mask = alpha > 0
        if mask.any():
            kind: Literal["limitation", "convention"] = "convention" if model.kind == "convention" else "limitation"
            area, strength = float(alpha.sum()), float(found.before[mask].max())
            message = model.claim + undeclared(model, declaration)
            made.append(
                Finding(
                    kind,
                    model.name,
                    area,
                    box(mask),
                    z=strength,
                    message=message,
                    regions=regions(mask),
                    worst=_worst(found.before, mask),
                )
            )
    return tuple(made)


def undeclared(model: Model, declaration: Declaration) -> str:
    """Which declarations would decide whether the renderer may show ``model``, or "" where they are made."""
    missing = model.hangs_on(declaration)
    return f" (it may, as nothing is declared: {', '.join(missing)} would say so)" if missing else ""


def regions(mask: Bools) -> tuple[tuple[int, int, int, int], ...]:
    """The boxes of the parts of ``mask`` (h, w), parts closer than four pixels taken as one, largest first."""
    from scipy import ndimage

    labels, _ = ndimage.label(widened(mask, 2))
    labels = labels * mask
    found = []
    for number, place in enumerate(ndimage.find_objects(labels), 1):
        if place is not None:
            rows, columns = place
            size = int((labels[place] == number).sum())
            found.append((size, (columns.start, rows.start, columns.stop, rows.stop)))
    return tuple(each for _, each in sorted(found, reverse=True)[: POLICY.judge.regions])


def _numbers(measured: Measured, found: Explanation, reference: Admissible) -> dict[str, float]:
    value = reference.value.astype(np.float64)  # squares of bright pixels are beyond float32
    square = np.square(measured.mean - value)
    return {
        "rmse": float(np.sqrt(square.mean())),
        "rel_mse": float((square / (value**2 + POLICY.judge.rel_mse)).mean()),
        "max": float(np.sqrt(square.max())),
        "gain": found.global_fit.gain,
        "shift_x": found.global_fit.shift[0],
        "shift_y": found.global_fit.shift[1],
        "warp": found.global_fit.warp,
        "freedom": found.freedom,
        "kappa": measured.kappa,
        "seeds": float(measured.seeds),
        "severity": found.severity,
        "bug_pixels": float(found.significance.pixels.sum()),
    }


def _perceived(judgement: Judgement, found: Explanation, reference: Admissible, perceive: bool) -> Judgement:
    """Measure both legs, and the findings' jnd on the leg each belongs to."""
    limited = np.zeros(judgement.mean.shape[:2], np.bool_)
    for model in found.models:
        limited |= found.alphas[model.name] > 0
    wrong = found.significance.pixels | bool(found.triggers and not found.significance.pixels.any())
    at = np.flatnonzero(limited)
    halfway = put(reference.value, at, pixels(found.target.value, at))
    limitation_leg, limitation_map = _leg(reference.value, halfway, limited, perceive)
    admitted_picture = found.nearest if found.significance.pixels.any() else found.target.value
    tested = judgement.mean if found.triggers else admitted_picture
    bug_leg, bug_map = _leg(admitted_picture, tested, wrong & bool(found.triggers), perceive)
    findings = []
    for finding in judgement.verdict.findings:
        beside = finding.kind != "bug" and finding.name not in found.alphas  # seen only once the fault is taken out
        if not perceive or beside:
            findings.append(finding)
            continue
        if finding.kind == "bug":
            seen = bug_leg.itp
        else:
            seen = eye.jnd(reference.value, halfway, found.alphas[finding.name] > 0)
        findings.append(replace(finding, jnd=seen, visible=seen >= 1.0))
    legs = {
        "limitation": limitation_leg,
        "bug": replace(bug_leg, pixels=int(found.significance.pixels.sum())),
    }
    verdict = replace(judgement.verdict, findings=tuple(findings), legs=legs)
    return replace(judgement, verdict=verdict, limitation_map=limitation_map, bug_map=bug_map)


def _leg(start: Floats, end: Floats, mask: Bools, perceive: bool) -> tuple[Leg, Floats]:
    count = int(mask.sum())
    empty = np.zeros(mask.shape)
    if not count or not perceive:
        return Leg(pixels=count), empty
    error = eye.flip(start, end)
    return Leg(count, float(error.mean()), float(error.max()), eye.jnd(start, end, mask)), error
