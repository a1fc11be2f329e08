"""remedies: the workarounds of each class with before and after, from runs that hold both or from the models."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from notabug.gallery.entries import Drawn, Exhibit
from notabug.gallery.store import Store
from notabug.references.models.model import models
from notabug.references.predict import predict
from notabug.references.workarounds.workaround import Setting, Workaround, workarounds
from notabug.results.wording import area, number
from notabug.scenes_usd.catalogue import entry
from notabug.scenes_usd.errors import NotabugError
from notabug.scenes_usd.reader import read_scene


@dataclass(frozen=True, slots=True)
class Side:
    """A scene with or without a workaround: its picture and what was measured, where a run has it."""

    scene: str
    variant: str
    thumb: str = ""
    note: str = ""


@dataclass(frozen=True, slots=True)
class Remedy:
    """One workaround as a class page shows it."""

    name: str
    artifact_class: str
    claim: str
    cites: str
    caveat: str
    before: Side
    after: Side


def remedies(store: Store, exhibits: Sequence[Exhibit], white: float) -> list[Remedy]:
    """Every workaround that ``references.workarounds`` describes."""
    return [
        Remedy(
            workaround.name,
            workaround.artifact_class,
            workaround.claim,
            workaround.cites,
            workaround.caveat,
            *_sides(workaround, store, exhibits, white),
        )
        for workaround in workarounds()
    ]


def _sides(workaround: Workaround, store: Store, exhibits: Sequence[Exhibit], white: float) -> tuple[Side, Side]:
    """Both sides by one renderer that a run drew both with, else by the model that draws the artifact."""
    settings = (workaround.before, workaround.after)
    places = [_place(each) for each in settings]
    drawn = [_drawn(exhibits, *place) for place in places]
    both = [name for name in drawn[0] if name in drawn[1]]
    if both:
        name = "inhouse" if "inhouse" in both else both[0]
        sides = [
            Side(*place, found[name].thumb, f"{name}: {number(round(area(found[name].result)))} px of the artifact")
            for place, found in zip(places, drawn, strict=True)
        ]
        return sides[0], sides[1]
    made = [
        Side(*place, _predicted(setting, workaround.reduces, store, white))
        for place, setting in zip(places, settings, strict=True)
    ]
    return made[0], made[1]


def _place(setting: Setting) -> tuple[str, str]:
    full = {**entry(setting.scene).defaults, **setting.variants}
    variant = ",".join(f"{key}={value}" for key, value in sorted(full.items()))
    return setting.scene, f"{variant} [{setting.label}]".lstrip() if setting.label else variant


def _drawn(exhibits: Sequence[Exhibit], scene: str, variant: str) -> dict[str, Drawn]:
    for exhibit in exhibits:
        if (exhibit.scene, exhibit.variant) == (scene, variant):
            return {name: drawn for name, drawn in exhibit.latest.items() if drawn.thumb}
    return {}


def _predicted(setting: Setting, reduces: Sequence[str], store: Store, white: float) -> str:
    """The picture with the artifact; only where nothing but a variant is altered, else a run must show it."""
    if setting.label:
        return ""
    try:
        scene = read_scene(setting.scene, setting.variants)
        acting = tuple(model for model in models(scene) if model.name in reduces)[:1]
        return store.thumb(np.asarray(predict(scene, acting).mean), white=white)
    except NotabugError:
        return ""
