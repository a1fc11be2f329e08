"""Workarounds at work: their settings become choices of a run, and its results a table of before and after."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from pathlib import Path

from rich.table import Table
from rich.text import Text

from notabug.adapters.base import Adapter, Declaration, Found, Quality, Render
from notabug.exit_codes import ExitCode
from notabug.references.workarounds.workaround import Setting, Workaround, workarounds
from notabug.results.record import Result
from notabug.results.wording import finding_names, number, readable
from notabug.runs.progress import verdict_text
from notabug.runs.selection import Choice
from notabug.scenes_usd.catalogue import entry
from notabug.scenes_usd.errors import SelectionError
from notabug.scenes_usd.reader import read_scene
from notabug.scenes_usd.scene import Scene


@dataclass(frozen=True, slots=True)
class Altered:
    """An adapter that draws a scene as a setting has it."""

    base: Adapter
    setting: Setting
    name: str  # tells apart what is drawn otherwise: a kept picture is known by it

    @property
    def capabilities(self) -> frozenset[str]:
        return self.base.capabilities

    @property
    def install(self) -> str:
        return self.base.install

    def declaration(self, quality: Quality) -> Declaration:
        return replace(self.base.declaration(quality), **self.setting.declares)

    def find(self) -> Found:
        return self.base.find()

    def render(self, scene: Scene, out: Path, quality: Quality) -> tuple[Render, ...]:
        return self.base.render(self.setting.edit(scene), out, quality)


def chosen(words: Sequence[str]) -> list[Workaround]:
    """The workarounds that ``words`` name: themselves, their class, their scenes, globs of these; none: all."""
    known = list(workarounds())
    for word in words:
        if not any(_matches(each, word) for each in known):
            names = ", ".join(each.name for each in known)
            raise SelectionError(f"no workaround for {word!r}", expected=f"a scene, a class or one of {names}")
    return [each for each in known if not words or any(_matches(each, word) for word in words)]


def _matches(workaround: Workaround, word: str) -> bool:
    names = {workaround.name, workaround.artifact_class, *(setting.scene for setting in workaround.settings)}
    return any(fnmatchcase(name, word) for name in names)


def choices(selected: Iterable[Workaround]) -> list[Choice]:
    """What to render for ``selected``: each setting once, however many workarounds share it."""
    found: dict[tuple[str, str], Choice] = {}
    for workaround in selected:
        for setting in workaround.settings:
            found.setdefault(_place(setting), _choice(setting))
    return list(found.values())


def _place(setting: Setting) -> tuple[str, str]:
    """The scene and the variant as a result has them."""
    full = {**entry(setting.scene).defaults, **setting.variants}
    variant = ",".join(f"{key}={value}" for key, value in sorted(full.items()))
    return setting.scene, f"{variant} [{setting.label}]".lstrip() if setting.label else variant


def _choice(setting: Setting) -> Choice:
    def alter(adapter: Adapter, scene: Scene) -> Adapter:
        attributes = setting.adapters.get(adapter.name, {})
        base = replace(adapter, **attributes) if attributes else adapter  # type: ignore[type-var]
        return Altered(base, setting, f"{adapter.name} {setting.edit(scene).digest()} {base!r}")

    if not setting.label:
        return Choice(setting.scene, setting.scene, setting.variants)
    only = frozenset(setting.adapters)
    return Choice(setting.scene, setting.scene, setting.variants, label=setting.label, alter=alter, only=only)


@dataclass(frozen=True, slots=True)
class Effect:
    """What one renderer shows under one setting: artifacts of whatever name, conventions left out."""

    setting: Setting
    result: Result
    facets: int

    @property
    def area(self) -> float:
        """In pixels."""
        return sum(finding.area_px for finding in self.result.verdict.findings if finding.kind != "convention")

    @property
    def jnd(self) -> float:
        """Of the strongest artifact."""
        found = (finding.jnd for finding in self.result.verdict.findings if finding.kind != "convention")
        return max(found, default=0.0)

    @property
    def flip(self) -> float:
        """Mean FLIP over the picture, of both legs."""
        return sum(leg.flip for leg in self.result.verdict.legs.values())

    def as_dict(self) -> dict[str, object]:
        return {
            "scene": self.result.scene,
            "variant": self.result.variant,
            "verdict": self.result.verdict.word,
            "findings": list(dict.fromkeys(finding.name for finding in self.result.verdict.findings)),
            "area_px": self.area,
            "jnd": self.jnd,
            "flip": self.flip,
            "facets": self.facets,
        }


@dataclass(frozen=True, slots=True)
class Row:
    """A workaround on one renderer."""

    workaround: Workaround
    renderer: str
    before: Effect
    after: Effect
    limits: tuple[Effect, ...]

    @property
    def shown(self) -> bool:
        """Whether the artifact is there without the workaround, under the name that it has."""
        return any(finding.name in self.workaround.reduces for finding in self.before.result.verdict.findings)

    @property
    def reduced(self) -> bool:
        """Less of the picture is off, and it is off by less."""
        return self.after.area < self.before.area and self.after.flip < self.before.flip

    @property
    def word(self) -> str:
        return ("reduced" if self.reduced else "not reduced") if self.shown else "not shown"

    def as_dict(self) -> dict[str, object]:
        return {
            "workaround": self.workaround.name,
            "class": self.workaround.artifact_class,
            "renderer": self.renderer,
            "outcome": self.word,
            "before": self.before.as_dict(),
            "after": self.after.as_dict(),
            "limits": [limit.as_dict() for limit in self.limits],
        }


def rows(selected: Iterable[Workaround], results: Iterable[Result]) -> list[Row]:
    """A row for each workaround and renderer that has judged pictures of both settings."""
    judged = {"pass", "limitation", "bug"}
    found = {(x.scene, x.variant, x.renderer): x for x in results if x.verdict.word in judged}
    renderers = dict.fromkeys(name for _, _, name in found)
    made = []
    for workaround in selected:
        for renderer in renderers:
            effects = {
                setting: Effect(setting, found[key], _facets(setting))
                for setting in workaround.settings
                if (key := (*_place(setting), renderer)) in found
            }
            if workaround.before in effects and workaround.after in effects:
                limits = tuple(effects[limit] for limit in workaround.limits if limit in effects)
                made.append(Row(workaround, renderer, effects[workaround.before], effects[workaround.after], limits))
    return made


def code_of(found: Sequence[Row], results: Iterable[Result]) -> ExitCode:
    """BUG where a workaround leaves as much of its artifact as there was; RENDERER where a renderer failed."""
    if any(each.shown and not each.reduced for each in found):
        return ExitCode.BUG
    failed = any(result.verdict.word == "error" for result in results)
    return ExitCode.RENDERER if failed else ExitCode.OK


def _facets(setting: Setting) -> int:
    """Triangles of the meshes that are drawn."""
    scene = setting.edit(read_scene(setting.scene, setting.variants))
    return sum(int((mesh.counts - 2).sum()) for mesh in scene.meshes)


def table(found: Sequence[Row]) -> Table:
    """The rows, each setting on a line of its own."""
    drawn = Table(box=None, header_style="bold", pad_edge=False, expand=False)
    drawn.add_column("workaround", no_wrap=True)
    drawn.add_column("renderer", no_wrap=True)
    drawn.add_column("", no_wrap=True)
    drawn.add_column("scene and variant", overflow="fold")
    drawn.add_column("verdict", no_wrap=True)
    drawn.add_column("findings", overflow="fold")
    for name in ("area px", "jnd", "FLIP", "facets"):
        drawn.add_column(name, justify="right", no_wrap=True)
    for row in found:
        name, renderer = readable(row.workaround.name), row.renderer
        for when, effect in (("before", row.before), ("after", row.after), *(("limit", x) for x in row.limits)):
            drawn.add_row(
                Text(name),
                Text(renderer),
                Text(when),
                Text(f"{effect.result.scene} {effect.result.variant}"),
                verdict_text(effect.result),
                Text(finding_names(effect.result)),
                Text(number(round(effect.area, 1))),
                Text(number(effect.jnd, 2)),
                Text(number(effect.flip, 2)),
                Text(str(effect.facets)),
            )
            name = renderer = ""
        drawn.add_row("", "", Text(row.word, style="green" if row.reduced else "yellow"))
    return drawn
