"""One look at a scene: the file, the variants that are chosen and the picture of it that is meant."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from notabug.scenes_usd.view import View


@dataclass(frozen=True, slots=True)
class Look:
    """What is read of the scene at ``path``, which is resolved; ``variants`` are pairs in alphabetical order."""

    path: Path
    variants: tuple[tuple[str, str], ...] = ()
    view: View = field(default_factory=View)

    @classmethod
    def at(cls, path: Path, variants: Mapping[str, str] | None = None, view: View | None = None) -> Look:
        """A look at ``path`` under a choice of variants; sets left out keep their default."""
        return cls(path, tuple(sorted((variants or {}).items())), view or View())

    def __str__(self) -> str:
        """The file, and what is chosen where something is."""
        chosen = ",".join(f"{key}={name}" for key, name in self.variants)
        return f"{self.path} [{chosen}]" if chosen else str(self.path)

    def as_text(self) -> str:
        """All that ``from_text`` needs, in ASCII."""
        view = self.view
        return json.dumps([str(self.path), self.variants, view.camera, view.time, sorted(view.purposes), view.size])

    @classmethod
    def from_text(cls, text: str) -> Look:
        """The look that ``as_text`` wrote, read quickly: surfaces are refined once only."""
        path, variants, camera, time, purposes, size = json.loads(text)
        size = None if size is None else (int(size[0]), int(size[1]))
        view = View(camera=camera, time=time, purposes=frozenset(purposes), quick=True, size=size)
        return cls(Path(path), tuple((key, name) for key, name in variants), view)
