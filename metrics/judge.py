"""judge: from pictures and predictions to a Judgement. The procedure's steps live beside it, one a file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np
import numpy.typing as npt

from notabug.adapters.base import Declaration
from notabug.metrics import perceive as eye
from notabug.metrics.admissible import RELATIVE, Admissible, admissible
from notabug.metrics.causes import gain_message
from notabug.metrics.channels import largest, pixels, put
from notabug.metrics.explain import Explanation, Predict, admitted, beside_faults, explain, support
from notabug.metrics.naming import UNNAMED, Name, Others, name_bug
from notabug.metrics.neighbours import Bools, widened
from notabug.metrics.noise import TILE, Measured, measure
from notabug.metrics.nuisance import some
from notabug.metrics.valid import box, invalid
from notabug.metrics.verdict import Finding, Leg, Verdict, Word
from notabug.references.models.model import Model, models
from notabug.references.predict import predict, preview
from notabug.scenes_usd.scene import Scene

Floats = npt.NDArray[np.floating]
Key = tuple[tuple[str, ...], ...]

REGIONS = 12  # boxes a finding lists at most
UNTELLABLE = 0.25  # share of the lit pixels where no epsilon helps, beyond which acne is neither right nor wrong
BLIND = 3.0  # standard errors of a tile's mean that must fit into the tolerance, or the picture is too noisy to judge


@dataclass(frozen=True, slots=True, eq=False)
class Judgement:
    """A verdict with the pictures it was drawn from; every picture is (h, w, 3) linear, every map (h, w).

    ``mean`` is the mean of the seeds, ``reference`` what the intended model gives, ``nearest`` the nearest admissible
    picture P(I). ``limitation_map`` and ``bug_map`` are FLIP (0..1) of the two legs, or zeros where a leg is empty.
    ``models`` maps the name of each limitation that was considered to its picture.
    """

    verdict: Verdict
    mean: Floats
    reference: Floats
    nearest: Floats
    limitation_map: Floats
    bug_map: Floats
    models: dict[str, Floats] = field(default_factory=dict)


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
    pixel counts. ``naming`` looks for the fault behind a bug; without it every bug is ``unexplained``. ``others`` gives
    references of other scenes, to recognise a picture that belongs to one of them.
    """
    sets: dict[Key, Admissible] = {}
    quick: dict[Key, Floats] = {}

    def predicted(chosen: tuple[Model, ...]) -> Admissible:
        key = _key(chosen)
        if key not in sets:
            sets[key] = admissible(predict(scene, chosen), declaration, tolerance)
        return sets[key]

    def previewed(chosen: tuple[Model, ...]) -> Floats:
        key = _key(chosen)
        if key not in quick:
            quick[key] = preview(scene, chosen)
        return quick[key]

    reference = predicted(())
    wrong = invalid(pictures, scene.height, scene.width)
    if wrong is not None:
        return _refused(wrong, pictures, reference)
    measured = measure(pictures, reference.edge)
    known = list(models(scene))
    open_to = admitted(known, declaration)
    found = explain(measured, open_to, predicted, previewed)
    findings: tuple[Finding, ...] = ()
    word: Word
    hesitation = _hesitation(measured, found, declaration, len(pictures))
    hesitation = hesitation or _beyond_telling(found, open_to, predicted, declaration)
    considered = {key[0][0]: to.value for key, to in sets.items() if len(key) == 1}
    name = None
    if found.triggers and (not hesitation or not declaration.noisy):
        faults = [each.under(declaration) for each in known if each.kind == "fault" and each.open_to(declaration)]
        name = UNNAMED
        if naming:
            beside = beside_faults(open_to, found)
            name = name_bug(measured, found, faults, beside, predicted, previewed, others)
        if name.name == "unexplained":
            name = _global_name(found) or name
    if hesitation and (name is None or name.name == "unexplained"):  # what a fault explains is no noise
        word, message = "inconclusive", hesitation
        findings = (
            () if found.triggers else _limitations(found, declaration)
        )  # seen through the noise that may hide a bug
    elif name is not None:
        bug = _bug(name, found)
        # a large gain hides a limitation until it is taken out: the fault's own explanation holds what is beside it
        word, findings, message = "bug", (bug, *_limitations(name.fitted or found, declaration)), bug.message
    else:
        findings = _limitations(found, declaration)
        word = "limitation" if any(each.kind == "limitation" for each in findings) else "pass"
        message = "; ".join(each.message for each in findings)
    judgement = Judgement(
        Verdict(word, findings, triggers=found.triggers, message=message, numbers=_numbers(measured, found, reference)),
        measured.mean,
        reference.value,
        found.nearest,
        np.zeros(measured.mean.shape[:2]),
        np.zeros(measured.mean.shape[:2]),
        considered,
    )
    return _perceived(judgement, found, reference, perceive)


def _key(chosen: tuple[Model, ...]) -> Key:
    """What tells sets of models apart; the claim holds what those of one name differ in: an axis, a strength."""
    return tuple((each.name, each.claim, str(each.strength), repr(each.options)) for each in chosen)


def _refused(wrong: Finding, pictures: Sequence[Floats], reference: Admissible) -> Judgement:
    first = np.asarray(pictures[0], np.float64)
    shown = first if first.shape == reference.value.shape else np.zeros_like(reference.value)
    empty = np.zeros(reference.value.shape[:2])
    verdict = Verdict("bug", (wrong,), triggers=("invalid",), message=wrong.message)
    return Judgement(verdict, shown, reference.value, reference.value, empty, empty)


def _hesitation(measured: Measured, found: Explanation, declaration: Declaration, given: int) -> str:
    """Why no verdict is possible, or "": a single noisy picture, or noise that hides what the tolerance forbids."""
    if not measured.noisy:
        if given > 1:  # seeds that agree to the last bit, as where all is black
            return ""
        if declaration.noisy and found.triggers:
            return "one picture of a noisy renderer: render at least two seeds"
        if found.triggers and _looks_noisy(measured, found):
            return "the picture looks noisy and there is only one: give at least two independent seeds"
        return ""
    smooth = some(np.flatnonzero(~found.target.edge))
    variance, tau = (pixels(each, smooth) for each in (measured.variance, found.target.tau))
    ratio = float(np.median(np.sqrt(measured.kappa * variance) / TILE / tau)) if smooth.size else 0.0
    if not found.triggers and BLIND * ratio > 1.0:
        factor = (BLIND * ratio) ** 2
        return f"too noisy: {factor:.1f} times as many samples would decide"
    return ""


def _beyond_telling(found: Explanation, open_to: Sequence[Model], predicted: Predict, declaration: Declaration) -> str:
    """Why a picture that chance explains says nothing, or "": rounding may then do that to most of what is lit."""
    if found.triggers or not any(each.rule == "set" for each in found.models):
        return ""
    bare = predicted(())
    lit = largest(bare.value) > 0
    for each in open_to:
        if each.name == "acne":
            share = float((support(bare, predicted((each,))) & lit).sum()) / max(1.0, float(lit.sum()))
            if share > UNTELLABLE:
                return (
                    f"no picture can tell here: with a rounding of {declaration.hit_error:.1e} of the distance no"
                    f" reasonable epsilon prevents acne on {share:.0%} of what is lit; bring camera or scene nearer"
                )
    return ""


def _looks_noisy(measured: Measured, found: Explanation) -> bool:
    """A residual that changes sign from pixel to pixel all over the smooth parts is noise, not a fault."""
    off = measured.mean - found.target.value
    r = off[..., int(np.argmax((off**2).sum(axis=(0, 1))))]  # where red and blue are exchanged their sum says nothing
    smooth = ~widened(found.target.edge, 1)
    bright = smooth & (largest(found.target.value) > 0)
    wrong = r[found.significance.pixels & bright]
    if bright.sum() < 256 or wrong.size < 0.05 * bright.sum():
        return False
    if not 0.05 < float((wrong > 0).mean()) < 0.95:  # all too dark, or all too bright: acne, or holes
        return False
    centred = np.where(bright, r - r[bright].mean(), 0.0)
    power = float((centred**2).sum()) / float(bright.sum())
    both = bright[:, 1:] & bright[:, :-1]
    lag = float((centred[:, 1:] * centred[:, :-1])[both].mean()) if both.any() else power
    return lag < 0.3 * power and abs(float(r[bright].mean())) < 0.3 * float(np.sqrt(power))


def _global_name(found: Explanation) -> Name | None:
    """The name of a bug that is only a gain or a shift of the whole picture, fitted already."""
    if found.significance.triggers:
        return None
    if found.nuisance.gained:
        return Name("light_gain", gain_message(found.nuisance.gain), 0.0)
    if found.nuisance.warped and not found.nuisance.shifted:
        moved = f"edges move by up to {found.nuisance.warp:.2f} pixels against the middle"
        return Name("field_of_view", f"{moved}: the field of view, the aspect or the roll is wrong", 0.0)
    x, y = found.nuisance.shift
    return Name("pixel_shift", f"the picture is shifted by ({x:+.2f}, {y:+.2f}) pixels (right, down)", 0.0)


def _bug(name: Name, found: Explanation) -> Finding:
    wrong, tiles = found.significance.pixels, found.significance.tiles
    if not wrong.any():  # faint and wide: the tiles that deviate, or the whole picture
        h, w = wrong.shape
        wrong = np.kron(tiles, np.ones((TILE, TILE), bool))[:h, :w] if tiles.any() else np.ones((h, w), bool)
    z = float(found.significance.z[wrong].max())
    return Finding("bug", name.name, float(wrong.sum()), box(wrong), z=z, message=name.message, regions=regions(wrong))


def _limitations(found: Explanation, declaration: Declaration) -> tuple[Finding, ...]:
    made = []
    for each in found.models:
        alpha = found.alphas[each.name]
        mask = alpha > 0
        if mask.any():
            kind: Literal["limitation", "convention"] = "convention" if each.kind == "convention" else "limitation"
            area, strength = float(alpha.sum()), float(found.before[mask].max())
            message = each.claim + undeclared(each, declaration)
            made.append(Finding(kind, each.name, area, box(mask), z=strength, message=message, regions=regions(mask)))
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
    return tuple(each for _, each in sorted(found, reverse=True)[:REGIONS])


def _numbers(measured: Measured, found: Explanation, reference: Admissible) -> dict[str, float]:
    square = np.square(measured.mean - reference.value)
    return {
        "rmse": float(np.sqrt(square.mean())),
        "rel_mse": float((square / (reference.value**2 + 1e-2)).mean()),
        "max": float(np.sqrt(square.max())),
        "gain": found.nuisance.gain,
        "shift_x": found.nuisance.shift[0],
        "shift_y": found.nuisance.shift[1],
        "warp": found.nuisance.warp,
        "freedom": found.freedom,
        "kappa": measured.kappa,
        "seeds": float(measured.seeds),
        "severity": found.severity,
        "bug_pixels": float(found.significance.pixels.sum()),
    }


def _perceived(judgement: Judgement, found: Explanation, reference: Admissible, perceive: bool) -> Judgement:
    """Measure both legs, and the findings' jnd on the leg each belongs to."""
    limited = np.zeros(judgement.mean.shape[:2], np.bool_)
    for each in found.models:
        limited |= found.alphas[each.name] > 0
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
