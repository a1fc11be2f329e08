"""Scenes of the corpus, the pictures that renderers make of them, and verdicts on pictures that were tampered with."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from notabug.adapters.base import Adapter, Declaration, Quality
from notabug.metrics.judge import judge
from notabug.metrics.verdict import Verdict
from notabug.references.models.model import Model, models
from notabug.references.predict import predict
from notabug.references.store import others
from notabug.references.tracer.envelope import Envelope
from notabug.scenes_usd.picture import read_picture
from notabug.scenes_usd.reader import read_scene
from notabug.scenes_usd.scene import Scene

Pictures = list[npt.NDArray[np.floating]]

POINT = Declaration("float64", "point", 0.0, 2.0**-24, relative_quantum=True, noisy=False)
BOX = Declaration("float64", "box", 0.5, 2.0**-24, relative_quantum=True, noisy=False)
DEFAULT = Quality()


@dataclass
class Studio:
    """What several tests need: each scene is read once, each picture drawn once, in each process."""

    folder: Path
    point: Declaration = POINT
    box: Declaration = BOX
    _scenes: dict[Any, Scene] = field(default_factory=dict)
    _pictures: dict[Any, Pictures] = field(default_factory=dict)

    def scene(self, name: str, **variants: str) -> Scene:
        key = (name, *sorted(variants.items()))
        if key not in self._scenes:
            self._scenes[key] = read_scene(name, variants)
        return self._scenes[key]

    def model(self, scene: Scene, name: str) -> Model:
        return next(each for each in models(scene) if each.name == name)

    def predicted(self, scene: Scene, *names: str) -> Envelope:
        return predict(scene, [self.model(scene, each) for each in names])

    def draw(self, adapter: Adapter, scene: Scene, quality: Quality = DEFAULT) -> Pictures:
        """The pictures by ``adapter``; do not write to them."""
        key = (adapter, scene.digest(), quality)
        if key not in self._pictures:
            out = self.folder / str(len(self._pictures))
            out.mkdir(parents=True)
            self._pictures[key] = [read_picture(each.image).pixels for each in adapter.render(scene, out, quality)]
        return self._pictures[key]

    def verdict(
        self, pictures: Sequence[npt.NDArray[np.floating]], scene: Scene, declaration: Declaration, **options: Any
    ) -> Verdict:
        options = {"perceive": False, "others": lambda: others(scene)} | options
        return judge(pictures, scene, declaration, **options).verdict


@pytest.fixture(scope="session")
def studio(tmp_path_factory: pytest.TempPathFactory) -> Studio:
    return Studio(tmp_path_factory.mktemp("studio"))
