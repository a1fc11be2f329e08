"""A known adapter whose table says what it cannot draw together, or that it gets spheres as meshes."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

from notabug.adapters.base import Adapter, Apart, Declaration, Found, Quality, Render
from notabug.adapters.requirements import check_supported, not_together
from notabug.adapters.spheres import as_given
from notabug.scenes_usd.scene import Scene


@dataclass(frozen=True, slots=True)
class Joined:
    """``base`` with ``apart`` beside its own, and with its spheres as ``spheres`` says."""

    base: Adapter
    spheres: Literal["exact", "mesh"]
    apart: tuple[Apart, ...]

    @property
    def name(self) -> str:
        return self.base.name

    @property
    def capabilities(self) -> frozenset[str]:
        return self.base.capabilities

    @property
    def not_together(self) -> tuple[Apart, ...]:
        return (*not_together(self.base), *self.apart)

    @property
    def install(self) -> str:
        return self.base.install

    def declaration(self, quality: Quality) -> Declaration:
        return replace(self.base.declaration(quality), spheres=self.spheres)

    def find(self) -> Found:
        found = self.base.find()
        return replace(found, key=f"{found.key} spheres={self.spheres}")

    def render(self, scene: Scene, out: Path, quality: Quality) -> tuple[Render, ...]:
        given = as_given(scene, self.declaration(quality))
        check_supported(self, given)
        return self.base.render(given, out, quality)
