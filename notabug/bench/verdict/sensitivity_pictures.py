"""The pictures by which notabug.bench.verdict.sensitivity measures numbers, and what is said of one.

They are drawings of the quick design's tuning half, cards of adapters with and without a fault, and a few made for
numbers that decide only in rare pictures: values next to what is no picture, small pictures.
"""

from __future__ import annotations

import importlib
import math
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict, dataclass, replace
from functools import cached_property, partial
from typing import Literal

import numpy as np
import numpy.typing as npt

from notabug.bench.verdict.design import QUICK, Group, groups, number
from notabug.bench.verdict.evaluate import drawing, fault_of, filmed, scene_of, subsamples
from notabug.bench.verdict.image_formation import BY_NAME, shoot, written
from notabug.bench.verdict.scene_setup import resized
from notabug.metrics.causes import encoded, zoomed
from notabug.scenes_usd.reader import read_scene
from notabug.scenes_usd.scene import Scene

SIDE = 40  # pixels of a picture's side
PICTURES = {"clean": 20, "limitation": 20, "bug": 24}  # of each label
CARD_SIDE = 64  # pixels: of a smaller one no tone has enough pixels
TINY = 10  # pixels: fewer than a gain of the whole picture needs are smooth
Picture = npt.NDArray[np.float32]
Edit = Callable[[Picture], npt.NDArray[np.floating]]
Way = Literal["word", "eye", "name", "card"]
WAYS: tuple[Way, ...] = ("word", "eye", "name")
"""How a picture is judged, the quickest first: for its word, for what an eye sees too, for the name of a bug too."""


@dataclass(frozen=True, slots=True, eq=False)
class Sample:
    """One picture of the sample, before it is judged; ``declared`` holds the fields of its declaration.

    A ``card`` is read as `notabug calibrate` does.
    """

    label: str
    scene: Scene
    pictures: tuple[Picture, ...]
    declared: Mapping[str, object]
    card: bool = False


@dataclass(frozen=True, slots=True)
class Said:
    """What of a verdict is compared; ``details`` are all of its other numbers, boxes and words."""

    word: str
    bugs: tuple[str, ...]
    limitations: tuple[str, ...]
    severity: float
    details: str = ""


def chosen() -> list[tuple[Group, str]]:
    """The drawings of the sample, each under one of its conditions: of every label as many scenes as there are."""
    design = groups(replace(QUICK, sides=("tuning",), side=SIDE))
    result: list[tuple[Group, str]] = []
    for label, count in PICTURES.items():
        seen: Counter[str] = Counter()
        ranked: list[tuple[int, int, Group]] = []
        for group in (group for group in design if group.label == label):
            ranked.append((seen[group.scene], len(ranked), group))
            seen[group.scene] += 1
        for at, (_, _, group) in enumerate(sorted(ranked, key=lambda entry: entry[:2])[:count]):
            result.append((group, group.conditions[at % len(group.conditions)]))
    return result


def taken(group: Group, condition_name: str) -> Sample:
    """The picture of ``group`` under a condition."""
    scene = scene_of(group)
    condition = BY_NAME[condition_name]
    picture, _, declared = drawing(group, scene, subsamples(scene, ()))
    fault = fault_of(group)
    pictures = tuple(
        written(filmed(fault, shot, group.strength), condition)
        for shot in shoot((picture,), condition, number("sensitivity", group.key()))
    )
    return Sample(group.label, scene, pictures, {**asdict(condition.declaration()), **declared})


def _clean(name: str, side: int, condition_name: str) -> Sample:
    scene, condition = resized(read_scene(name), side), BY_NAME[condition_name]
    shots = shoot((subsamples(scene, ()),), condition, number("sensitivity", name, side))
    return Sample("clean", scene, tuple(written(shot, condition) for shot in shots), asdict(condition.declaration()))


Drawing = Callable[[], Sample]


@dataclass(frozen=True)
class Planned:
    """A picture of the sample that is drawn when it is first asked for: a bench that goes on draws few of them.

    ``name`` tells it from the others, also where another version of the design holds other pictures.
    """

    label: str
    draw: Drawing
    card: bool = False
    name: str = ""

    @cached_property
    def sample(self) -> Sample:
        return replace(self.draw(), label=self.label, card=self.card)

    @property
    def ways(self) -> tuple[Way, ...]:
        return ("card",) if self.card else WAYS


def _changed(base: Planned, edit: Edit, label: str = "bug", **declared: object) -> Planned:
    """``base`` with each of its pictures changed by ``edit``, and with further fields ``declared``."""

    def draw() -> Sample:
        drawn = base.sample
        pictures = tuple(np.ascontiguousarray(edit(picture), np.float32) for picture in drawn.pictures)
        return replace(drawn, pictures=pictures, declared={**drawn.declared, **declared})

    return Planned(label, draw, base.card)


def _right(name: str, side: int, condition: str, *, card: bool = False) -> Planned:
    return Planned("clean", partial(_clean, name, side, condition), card)


def _with_pixel(value: float) -> Edit:
    def edit(picture: Picture) -> Picture:
        spoilt = picture.copy()
        spoilt[0, 0] = value
        return spoilt

    return edit


def _times(gain: float) -> Edit:
    return lambda picture: picture * gain


def rare() -> Iterator[Planned]:
    """Pictures for numbers that decide only in such: values next to the limits, few pixels, more or less light."""
    ball = _right("terminator/sphere", SIDE, "box")
    for value in (-1.5e-6, -0.7e-6, 1.5e15, 0.7e15):
        yield _changed(ball, _with_pixel(value))
    yield from small_pictures()
    for gain in (math.pi, 1.006, 0.0):
        yield _changed(ball, _times(gain))


def small_pictures() -> Iterator[Planned]:
    """Pictures of few pixels, right and too bright."""
    for side in (TINY, 2 * TINY):
        for condition in ("box", "16 samples", "8-bit sRGB"):
            small = _right("terminator/sphere", side, condition)
            yield small
            for gain in (1.02, 1.2):
                yield _changed(small, _times(gain))


def cards() -> Iterator[Planned]:
    """The calibration card as right and as wrong adapters give it."""
    from scipy import ndimage

    yield _right("calibration/card", CARD_SIDE, "16 samples", card=True)
    card = _right("calibration/card", CARD_SIDE, "box", card=True)
    yield card
    for shift in (0.07, 0.15):
        yield _changed(card, partial(ndimage.shift, shift=(0, shift, 0), order=3, mode="nearest"))
    for gain in (1.003, 1.006, 2.0):
        yield _changed(card, _times(gain))
    for gamma in (1.007, 1.015):
        yield _changed(card, partial(_powered, gamma=gamma))
    for scale in (1.002, 1.005):
        yield _changed(card, partial(zoomed, scale=scale))
    for filter_name, width in (("point", 0.3), ("box", 0.3), ("box", 0.6), ("tent", 0.6), ("tent", 1.0)):
        blur = partial(ndimage.gaussian_filter, sigma=(width, width, 0))
        yield _changed(card, blur, filter=filter_name)
    yield _changed(card, encoded)
    yield _changed(card, np.flipud)
    yield _changed(card, np.zeros_like)
    yield Planned("bug", lambda: replace(_clean("terminator/sphere", CARD_SIDE, "box"), scene=card.sample.scene), True)


def _powered(picture: Picture, gamma: float) -> npt.NDArray[np.floating]:
    return np.asarray(np.maximum(picture, 0.0) ** gamma)


def _limited(name: str, scene: str, condition: str, **variants: str) -> Planned:
    """A picture with the limitation of that name, by a renderer that declares nothing of it."""
    said = tuple(sorted(variants.items()))
    group = Group("limitation", name, "", 1.0, scene, said, 0, "tuning", (condition,), SIDE)
    return Planned("limitation", partial(taken, group, condition))


def single() -> Iterator[Planned]:
    """Pictures for numbers that decide where there is one seed, one sample, or a light with a size."""
    for name in ("terminator/sphere", "area_shadows/penumbra"):
        noisy = _right(name, SIDE, "4 samples")
        yield Planned("noise", partial(_first_of, noisy))
        yield Planned("noise", partial(_first_of, _changed(noisy, _times(1.1))))
    centres = _right("area_shadows/penumbra", SIDE // 2, "point")
    yield centres
    yield _changed(centres, _times(1.006))
    yield _limited("shadow_map_acne", "shadow_map/slopes", "point")
    yield _limited("shadow_map_acne", "shadow_map/slopes", "4 samples")
    yield _limited("coincident_surfaces", "visibility/coincident_planes", "16 samples")
    yield _limited("acne", "acne/sphere", "gaussian", camera_distance="1e3")
    yield _changed(_right("texture/uneven_quad", TINY, "16 samples"), _times(0.98))


def _first_of(seeds: Planned) -> Sample:
    return replace(seeds.sample, pictures=seeds.sample.pictures[:1])


def every() -> list[Planned]:
    """All of them, in an order that is fixed."""
    planned = [
        Planned(group.label, partial(taken, group, condition), name=f"{group.key()} {condition}")
        for group, condition in chosen()
    ]
    for made in (rare, cards, single):
        planned += [replace(picture, name=f"{made.__name__} {number}") for number, picture in enumerate(made())]
    return planned


def judged(sample: Sample, way: Way) -> Said:
    """What the judge says that is imported now, in one of its ways."""
    declaration = importlib.import_module("notabug.adapters.base").Declaration(**sample.declared)
    if way == "card":
        return _read(sample, declaration)
    judge = importlib.import_module("notabug.metrics.judge").judge
    verdict = judge(sample.pictures, sample.scene, declaration, perceive=way == "eye", naming=way == "name").verdict
    names = {
        kind: tuple(sorted(finding.name for finding in verdict.findings if finding.kind == kind))
        for kind in ("bug", "limitation")
    }
    severity = verdict.numbers.get("severity", math.inf if verdict.word == "bug" else 0.0)
    return Said(verdict.word, names["bug"], names["limitation"], float(severity), repr(verdict.as_dict()))


def _read(sample: Sample, declaration: object) -> Said:
    """What is read off a card: "pass" where nothing is held against the adapter."""
    reader = importlib.import_module("notabug.metrics.calibration").read_card
    envelope = importlib.import_module("notabug.references.predict").predict(sample.scene)
    reading = reader(sample.pictures, envelope, declaration)
    return Said("bug" if reading.causes else "pass", reading.causes, (), 0.0, repr(reading))
