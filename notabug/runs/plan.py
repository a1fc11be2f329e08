"""What a run is to do: the plan, one task of it, what came of one, and who watches.

``find_renderers`` says which renderers are there to be planned with, ``left_out`` tells of the others.
"""

from __future__ import annotations

import shlex
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Protocol

from notabug.adapters.base import Adapter, Found, Quality, RendererMissingError
from notabug.adapters.environment import RECIPES
from notabug.results.gate import Gate
from notabug.results.record import Result
from notabug.runs.selection import Choice
from notabug.runs.workers import Alone, Workers
from notabug.scenes_usd.errors import NotabugError, SceneError
from notabug.scenes_usd.own import take_scene
from notabug.scenes_usd.scene import Scene
from notabug.scenes_usd.view import options_for


class Watcher(Protocol):
    """Sees a run go by: ``notabug.runs.progress`` draws it, tests count it."""

    def begin(self, jobs: int) -> None: ...
    def start(self, scene: str, variant: str, renderer: str, stage: str) -> None: ...
    def done(self, result: Result, kept: bool) -> None: ...


class Silent:
    """Sees nothing: the watcher of a job in another process."""

    def begin(self, jobs: int) -> None:
        del jobs

    def start(self, scene: str, variant: str, renderer: str, stage: str) -> None:
        del scene, variant, renderer, stage

    def done(self, result: Result, kept: bool) -> None:
        del result, kept


@dataclass(frozen=True, slots=True)
class Plan:
    """What to run: the cells of ``choices`` x ``renderers`` (adapters that were found), how well, and where to."""

    choices: Sequence[Choice]
    renderers: Mapping[str, tuple[Adapter, Found]]
    out: Path
    quality: Quality = field(default_factory=Quality)
    resume: bool = True
    missing: Mapping[str, str] = field(default_factory=dict)  # renderer: how to install it
    command: Sequence[str] = ()
    gate: Gate = field(default_factory=Gate)
    workers: Workers = field(default_factory=Alone)
    shard: str = ""

    def wanted(self, choice: Choice) -> list[str]:
        """The renderers that ``choice`` is for."""
        return [name for name in self.renderers if not choice.only or name in choice.only]


@dataclass(frozen=True, slots=True)
class Task:
    """One job: a choice for one renderer."""

    choice: Choice
    renderer: str


@dataclass(frozen=True, slots=True)
class Done:
    """What came of a job: ``kept`` from an earlier run, else ``rendering`` seconds were spent in the renderer."""

    result: Result
    kept: bool
    rendering: float


def read_choice(choice: Choice) -> Scene | NotabugError:
    """The scene that ``choice`` means, or why it cannot be read."""
    if choice.refused:
        return SceneError(choice.refused)
    if choice.scene is not None:
        return choice.scene
    try:
        return take_scene(choice.source, choice.variants, choice.view).scene
    except NotabugError as error:
        return error


def reproduce(choice: Choice, renderer: str, quality: Quality, out: Path, variant: str = "") -> str:
    """The command line that makes this one result again, in a folder beside ``out``, whose run stays as it is.

    ``variant`` is the whole choice of the scene, defaults included, where that is known.
    """
    if choice.label:
        words = ["notabug", "run", "--workarounds", choice.source, "-r", renderer]
        return shlex.join([*words, "--out", out.with_name(f"{out.name}-again").as_posix()] if out.name else words)
    words = ["notabug", "run", choice.source, "-r", renderer]
    words += options_for(variant or choice.variant)
    if quality.samples:
        words += ["--samples", str(quality.samples)]
    if len(quality.seeds) != len(Quality().seeds):
        words += ["--seeds", str(len(quality.seeds))]
    words += ["--out", out.with_name(f"{out.name}-again").as_posix()] if out.name else []
    return shlex.join(words)


def left_out(whys: Mapping[str, str], *, asked: bool) -> list[str]:
    """The lines that tell of renderers that are not installed, ``whys`` by name.

    Those that nobody needs to have, since notabug installs them where somebody wants them, are one line unless they are
    ``asked`` for.
    """
    optional = [name for name in whys if name in RECIPES and not asked]
    lines = [f"{name}: not installed, left out. {why}" for name, why in whys.items() if name not in optional]
    if len(optional) > 1:
        how = "`notabug install NAME` gets one, `notabug install` says how large they are"
        return [*lines, f"not installed, left out: {', '.join(optional)}; {how}"]
    return lines + [f"{name}: not installed, left out. {whys[name]}" for name in optional]


def find_renderers(
    adapters: Mapping[str, Adapter], note: Callable[[str, str], None]
) -> tuple[dict[str, tuple[Adapter, Found]], dict[str, str]]:
    """The installed ones of ``adapters``, and how to install the rest; ``note`` hears of each missing one once."""
    found: dict[str, tuple[Adapter, Found]] = {}
    missing: dict[str, str] = {}
    for name, adapter in adapters.items():
        try:
            found[name] = (adapter, adapter.find())
        except RendererMissingError as error:
            missing[name] = adapter.install
            note(name, str(error))
    return found, missing
