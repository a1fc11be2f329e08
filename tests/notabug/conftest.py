"""A front door with renderers and a judge that do as they are told."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import notabug.adapters.registry
import notabug.doctor
import notabug.listing
import notabug.outcome
import notabug.running
from notabug.adapters.base import Declaration, Found, Quality, Render, RendererMissingError
from notabug.cli import main
from notabug.metrics.judge import Judgement
from notabug.metrics.verdict import Verdict
from notabug.scenes_usd.picture import write_exr
from notabug.scenes_usd.scene import Scene


@dataclass
class FakeRenderer:
    """Draws every scene grey; ``mishaps`` maps a scene's id to what it raises there."""

    name: str = "grey"
    capabilities: frozenset[str] = frozenset()
    install: str = "apt install grey"
    version: str = "1.0"
    installed: bool = True
    mishaps: dict[str, BaseException] = field(default_factory=dict)
    drawn: list[str] = field(default_factory=list)

    def declaration(self, quality: Quality) -> Declaration:
        return Declaration("float32", "box", 0.5, 2.0**-24, relative_quantum=True, noisy=len(quality.seeds) > 1)

    def find(self) -> Found:
        if not self.installed:
            raise RendererMissingError("no executable", where=f"adapter {self.name!r}", do=self.install)
        return Found(self.version, "/nowhere")

    def render(self, scene: Scene, out: Path, quality: Quality) -> tuple[Render, ...]:
        self.drawn.append(f"{scene.id} {scene.variant}".rstrip())
        if scene.id in self.mishaps:
            raise self.mishaps[scene.id]
        renders = []
        for seed in quality.seeds:
            write_exr(out / f"{seed}.exr", np.full((scene.height, scene.width, 3), 0.25))
            renders.append(Render(out / f"{seed}.exr", seed, quality.samples or 4, 0.0, ("grey", scene.id)))
        return tuple(renders)


@dataclass
class FakeJudge:
    """Gives every scene the verdict in ``verdicts``, else a pass."""

    verdicts: dict[str, Verdict] = field(default_factory=dict)
    judged: list[str] = field(default_factory=list)

    def __call__(self, pictures: Any, scene: Scene, declaration: Declaration, **options: Any) -> Judgement:
        self.judged.append(scene.id)
        mean = np.mean(pictures, axis=0, dtype=np.float64)
        none = np.zeros(mean.shape[:2])
        return Judgement(self.verdicts.get(scene.id, Verdict("pass")), mean, mean, mean, none, none)


@dataclass
class Door:
    """The command line: call it with words; ``renderers`` are the only ones there are."""

    renderers: dict[str, FakeRenderer]
    judge: FakeJudge
    out: Path
    capture: pytest.CaptureFixture[str]
    patch: pytest.MonkeyPatch
    stdout: str = ""
    stderr: str = ""

    @property
    def grey(self) -> FakeRenderer:
        return self.renderers["grey"]

    def __call__(self, *words: str) -> int:
        self.patch.setattr(sys, "argv", ["notabug", *words])
        with pytest.raises(SystemExit) as stop:
            main()
        self.stdout, self.stderr = self.capture.readouterr()
        code = stop.value.code
        return code if isinstance(code, int) else int(code is not None)

    def run(self, *words: str) -> int:
        return self("run", "--out", str(self.out), *words)


@pytest.fixture
def door(monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> Door:
    renderers = {"grey": FakeRenderer()}
    judge = FakeJudge()
    there: Callable[[], dict[str, FakeRenderer]] = lambda: dict(sorted(renderers.items()))  # noqa: E731
    for module in (notabug.adapters.registry, notabug.running, notabug.doctor, notabug.listing):
        monkeypatch.setattr(module, "adapters", there)
    monkeypatch.setattr(notabug.outcome, "judge", judge)
    monkeypatch.delenv("NOTABUG_REQUIRE", raising=False)
    monkeypatch.setenv("NOTABUG_JOBS", "1")  # other processes would not know these renderers
    monkeypatch.chdir(tmp_path)
    return Door(renderers, judge, tmp_path / "out", capsys, monkeypatch)
