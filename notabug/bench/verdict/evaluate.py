"""One group of the design: drawn once, taken under its conditions, judged by us and by every gate."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from itertools import islice
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from notabug.adapters.base import Declaration
from notabug.bench.verdict.catalogue import FAULTS, Fault, staged
from notabug.bench.verdict.design import NAMED, Group, number, seeds_of
from notabug.bench.verdict.gates import Pair, gates
from notabug.bench.verdict.image_formation import (
    BY_NAME,
    SEEDS,
    SUBSAMPLES,
    Condition,
    filtered,
    shoot,
    variance,
    written,
)
from notabug.bench.verdict.scene_setup import jittered, resized
from notabug.metrics.judge import judge
from notabug.metrics.verdict import Verdict
from notabug.references.models.camera import pixel_shift
from notabug.references.models.model import Model, models
from notabug.references.predict import configured
from notabug.references.tracer.emitters import DRAWN_DIRECTIONS
from notabug.references.tracer.envelope import trace_picture
from notabug.references.tracer.precision import ABSOLUTE, RELATIVE
from notabug.scenes_usd.reader import read_scene
from notabug.scenes_usd.scene import Scene

Floats = npt.NDArray[np.float64]

SHARE = 0.0025  # of the pixels must be off by more than twice the tolerance, or the picture does not show its fault
CERTAIN = 225.0  # and who knew the fault would find what no tolerance allows at fifteen standard errors, squared
KEPT = 4  # pictures without a label that a process holds
_UNLABELLED: dict[str, Floats] = {}
LOOKS = (2, 3, 4, 6, 8, 12, 16)  # seeds at which the sequential test looks


def expose(group: Group) -> list[dict[str, object]]:
    """One record for each picture of ``group``."""
    scene = scene_of(group)
    clean = _unlabelled(scene, ())
    picture, bare, declared = drawing(group, scene, clean)
    fault = fault_of(group)
    records = []
    for name in group.conditions:
        condition = BY_NAME[name]
        declaration = _declaring(condition, declared)
        reference, noise = filtered(clean, condition), variance(picture, condition)
        true = filtered(picture, condition)
        if fault and fault.film:
            true = fault.film(true, group.strength).astype(np.float64)
        # a fault that undoes the limitation beside it leaves the right picture: both must be told from it
        visible = group.label != "clean" and all(
            shows(true, filtered(each, condition), noise, moved(each, condition))
            for each in ((clean,) if bare is clean else (clean, bare))
        )
        for repeat in range(group.repeats if condition.samples else 1):
            subs = _rotated(scene) if group.label == "clean" and condition.samples else (picture,)
            pictures = list(_taken(group, subs, condition, f"noise {repeat}"))
            want = visible and group.label == "bug" and name == NAMED[group.draw("named") % len(NAMED)]
            start = time.perf_counter()
            verdict = judge(pictures, scene, declaration, perceive=False, naming=want).verdict
            seconds = time.perf_counter() - start
            mean = np.mean(pictures, axis=0)
            records.append(
                {
                    **group.as_dict(),
                    "condition": name,
                    "renderer": "inhouse",
                    "repeat": repeat,
                    "shows": visible,
                    "right": sorted(fault.right) if fault else [group.name],
                    "named": want,
                    **said(verdict),
                    "twin": want and _twin(group, scene, verdict),
                    "seconds": seconds,
                    "samples": (condition.samples or 1) * condition.seeds * scene.width * scene.height,
                    "gates": _gates(Pair(mean, reference, noise)) if visible or _gated(group, repeat) else {},
                    "sequential": None if repeat or name != NAMED[1] else _sequential(group, scene, picture, declared),
                }
            )
    return records


def _taken(
    group: Group, subs: Sequence[Floats], condition: Condition, draw: str, count: int = 0
) -> Iterator[npt.NDArray[np.float32]]:
    """The pictures of every seed as they come back from their files, with the fault of the film in them."""
    fault = fault_of(group)
    for each in shoot(subs, condition, group.draw(draw), count):
        yield written(filmed(fault, each, group.strength), condition)


def _gated(group: Group, repeat: int) -> bool:
    """Whether the gates see a clean picture: those of each scene's first seed, of noise the first."""
    return group.label == "clean" and not repeat and group.seed == seeds_of(group.scene, group.side)[0]


def _gates(pair: Pair) -> dict[str, float]:
    return {gate.name: gate.score(pair) for gate in gates()}


def said(verdict: Verdict) -> dict[str, object]:
    """What a record keeps of a verdict."""
    return {
        "word": verdict.word,
        "triggers": list(verdict.triggers),
        "bugs": [finding.name for finding in verdict.findings if finding.kind == "bug"],
        "limitations": [finding.name for finding in verdict.findings if finding.kind == "limitation"],
        "severity": verdict.numbers.get("severity", float("inf") if verdict.word == "bug" else 0.0),
        "gain": verdict.numbers.get("gain", 1.0),
        "bug_pixels": verdict.numbers.get("bug_pixels", 0.0),
        "message": verdict.message,
    }


def scene_of(group: Group) -> Scene:
    """The scene that ``group`` is judged as."""
    scene = jittered(resized(read_scene(group.scene, dict(group.variants)), group.pixels), group.seed)
    fault = fault_of(group)
    return staged(scene, fault.stage if fault else "")


def fault_of(group: Group) -> Fault | None:
    return next((fault for fault in FAULTS if group.label == "bug" and fault.name == group.name), None)


def filmed(fault: Fault | None, picture: Floats, strength: float) -> Floats:
    """``picture`` with what ``fault`` does to it after it was drawn."""
    return picture if fault is None or fault.film is None else fault.film(picture, strength).astype(np.float64)


def _declaring(condition: Condition, declared: Mapping[str, object]) -> Declaration:
    fields: dict[str, Any] = dict(declared)
    return replace(condition.declaration(), **fields)


def subsamples(scene: Scene, chosen: tuple[Model, ...]) -> Floats:
    """The picture at SUBSAMPLES times the resolution: regular subsamples (h s, w s, 3).

    Of pixels' centres, which stand alone, lights with a size are known as a renderer's picture knows them.
    """
    drawn, options = configured(scene, chosen)
    finer = replace(drawn, width=scene.width * SUBSAMPLES, height=scene.height * SUBSAMPLES)
    made = trace_picture(finer, options, threads=1)
    if any(light.emitter is not None for light in drawn.lights):
        centres = slice(SUBSAMPLES // 2, None, SUBSAMPLES)
        at = np.arange(finer.width * finer.height).reshape(finer.height, finer.width)[centres, centres].ravel()
        exact = trace_picture(finer, options, threads=1, at=at, directions=DRAWN_DIRECTIONS)
        made[centres, centres] = exact[centres, centres]
    return made


def _unlabelled(scene: Scene, beside: tuple[Model, ...]) -> Floats:
    """``subsamples`` without a label, which groups of the same setting share."""
    key = f"{scene.digest()} {[each.name for each in beside]}"
    if key not in _UNLABELLED:
        if len(_UNLABELLED) == KEPT:
            del _UNLABELLED[next(iter(_UNLABELLED))]
        _UNLABELLED[key] = subsamples(scene, beside)
        _UNLABELLED[key].flags.writeable = False
    return _UNLABELLED[key]


@lru_cache(maxsize=1)
def _rotated(scene: Scene) -> tuple[Floats, ...]:
    """``subsamples`` without a label for each seed, at places of its own: the lattice moved by up to half its step.

    The samples of one lattice misplace an edge by a tenth of a pixel, in each seed alike. A renderer's random samples
    do not, and of a right picture nothing else may be wrong.
    """
    rng = np.random.default_rng(number("rotated", scene.digest()))
    moves = rng.uniform(-0.5 / SUBSAMPLES, 0.5 / SUBSAMPLES, (SEEDS, 2))
    return tuple(subsamples(scene, (pixel_shift(scene.width, scene.height, *move),)) for move in moves)


def drawing(group: Group, scene: Scene, clean: Floats) -> tuple[Floats, Floats, dict[str, object]]:
    """Subsamples of the labelled picture and of the same without its label, and what its renderer declares beyond the
    conditions."""
    if group.label == "clean":
        return clean, clean, {}
    if group.label == "limitation":
        limited, declared = _limited(group, scene, clean)
        return limited, clean, declared
    fault = fault_of(group)
    assert fault is not None
    facets = [each for each in models(scene) if each.name == "facet_self_shadow" and not each.when]
    beside = tuple(facets) if group.draw("beside") % 2 else ()  # half of the buggy renderers have facets too
    model = fault.model(scene, group.strength, group.draw("which"))
    bare = _unlabelled(scene, beside)
    picture = subsamples(scene, (*beside, model)) if model else bare
    seen = fault.lens(picture, group.strength).astype(np.float64) if fault.lens else picture
    return seen, bare, {}


def _of_a_pixel(model: Model) -> Model:
    """``model`` for subsamples: acne begins where a hit's error exceeds half a pixel, not half a subsample."""
    errors = {each: model.options[each] / SUBSAMPLES for each in ("hit_error", "sphere_error") if each in model.options}
    return replace(model, options={**model.options, **errors}) if errors else model


def _declared(model: Model) -> dict[str, object]:
    """What a renderer declares that has the limitation ``model``."""
    if model.declared or model.when == ("resolves", "ray_float32"):
        return {"precision": "float32", "hit_error": -1.0}  # as large as float32 implies
    return {name: int(value) if name == "bounces" else value for name, value in model.conditions}


def _limited(group: Group, scene: Scene, clean: Floats) -> tuple[Floats, dict[str, object]]:
    found = [each for each in models(scene) if each.name == group.name and each.kind == "limitation"]
    model = next((each for each in found if each.when == ("resolves", "ray_float32")), found[0])
    declared = _declared(model)
    values = [subsamples(scene, (_of_a_pixel(each),)) for each in model.values()]
    if model.rule == "set":  # each sample takes one of the values
        rng = np.random.default_rng(group.draw("mixture"))
        which = rng.integers(0, len(values) + 1, clean.shape[:2])
        return np.choose(which[..., None], [clean, *values]), declared
    return clean + group.strength * (values[0] - clean), declared


def moved(sub: Floats, condition: Condition) -> tuple[Floats, Floats]:
    """The least and the most (h, w, 3) that the picture of ``sub`` shows, moved by up to a subsample: the tolerance."""
    wide = np.pad(sub, ((1, 1), (1, 1), (0, 0)), mode="edge")
    h, w = sub.shape[:2]
    pictures = [filtered(wide[y : y + h, x : x + w], condition) for y in range(3) for x in range(3)]
    return np.minimum.reduce(pictures), np.maximum.reduce(pictures)


def around(reference: Floats) -> tuple[Floats, Floats]:
    """The same, nearly, of a picture (h, w, 3) whose subsamples are not known: by the range of nearby pixels."""
    least, most = ndimage.minimum_filter(reference, (3, 3, 1)), ndimage.maximum_filter(reference, (3, 3, 1))
    reach = (most - least) / SUBSAMPLES
    return reference - reach, reference + reach


def shows(picture: Floats, reference: Floats, noise: Floats, within: tuple[Floats, Floats]) -> bool:
    """Whether anything can be seen: enough pixels beyond twice the tolerance, or all of them together, and above noise.

    This takes nothing from the judge but its stated tolerances: of values, and of the place, a fifth of a pixel, which
    puts the pixels of the reference ``within`` (lo, hi).
    """
    off = np.abs(picture - np.clip(picture, *within))
    tau = RELATIVE * np.abs(reference) + ABSOLUTE * float(reference.max())
    share = float((off > 2.0 * tau).any(axis=2).mean())
    whole = float(off.sum() / max(float(reference.sum()), 1e-30))
    if share < SHARE and whole < 2.0 * RELATIVE:
        return False
    if not noise.any():
        return True
    return float((np.maximum(off - tau, 0.0) ** 2 / np.maximum(noise, 1e-30))[noise > 0].sum()) > CERTAIN


def _twin(group: Group, scene: Scene, verdict: Verdict) -> bool:
    """Whether the fault that the verdict names, where it is another one, gives the very picture of the drawn one."""
    named = next((finding.name for finding in verdict.findings if finding.kind == "bug"), "")
    fault = fault_of(group)
    if not fault or not named or named in fault.right or named == "unexplained":
        return False
    clean = trace_picture(*configured(scene, ()), threads=1)
    model = fault.model(scene, group.strength, group.draw("which"))
    drawn = clean if model is None else trace_picture(*configured(scene, (model,)), threads=1)
    drawn = filmed(fault, drawn, group.strength)
    if named == "black":
        return not drawn.any()
    others = [each.film(clean, group.strength) for each in FAULTS if each.name == named and each.film]
    for each in models(scene):
        if each.kind == "fault" and each.name == named:
            other = each.at(group.strength) if each.at else each
            others.append(trace_picture(*configured(scene, (other,)), threads=1))
    return any(bool(np.allclose(each, drawn, rtol=1e-9, atol=1e-12)) for each in others)


def _sequential(group: Group, scene: Scene, sub: Floats, declared: dict[str, object]) -> dict[str, object] | None:
    """Seeds of 4 samples are added until two looks in a row say the same; for one group in four."""
    if group.draw("sequential") % 4:
        return None
    condition = Condition("sequence", samples=4)
    declaration = _declaring(condition, declared)
    taken = _taken(group, (sub,), condition, "sequence", LOOKS[-1])
    pictures: list[npt.NDArray[np.float32]] = []
    before, used = "", LOOKS[-1]
    for seeds in LOOKS:
        pictures += islice(taken, seeds - len(pictures))
        word = judge(pictures, scene, declaration, perceive=False, naming=False).verdict.word
        used = seeds
        if word == before and word != "inconclusive":
            break
        before = word
    return {"word": before if used == LOOKS[-1] else word, "samples": used * 4 * scene.width * scene.height}
