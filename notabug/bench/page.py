"""bench.html: one page that opens from disk, drawn only from the JSON files beside it; its plots lie in ``plots/``."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib.resources import files
from itertools import groupby
from pathlib import Path
from typing import Any

import jinja2
from markupsafe import Markup

from notabug.bench import efficiency, metamorphic, prose, stability
from notabug.bench.efficiency_error import MEASURES, Floor
from notabug.bench.plots import efficiency_plot, stability_plot
from notabug.bench.stability_sweeps import SWEEPS
from notabug.runs.folders import folder_name, write_text

KINDS = ("efficiency", "stability", "metamorphic")


@dataclass(frozen=True, slots=True)
class Part:
    """One heading with its plot, its words and its table."""

    title: str
    words: str
    plot: Markup | None = None
    head: tuple[str, ...] = ()
    rows: tuple[tuple[str, ...], ...] = ()


def draw(out: Path) -> Path:
    """Write ``out/bench.html`` and ``out/plots/*.svg`` from those of efficiency, stability and metamorphic .json that
    are there."""
    makers: dict[str, Callable[[Any, Path], list[Part]]] = {
        "efficiency": _efficiency,
        "stability": _stability,
        "metamorphic": _metamorphic,
    }
    sections = []
    for kind in KINDS:
        path = out / f"{kind}.json"
        if path.is_file():
            document = json.loads(path.read_text("utf-8"))
            sections.append((kind, document, makers[kind](document["results"], out / "plots")))
    environment = jinja2.Environment(autoescape=True, trim_blocks=True, lstrip_blocks=True)
    template = environment.from_string(files("notabug.bench").joinpath("bench.html").read_text("utf-8"))
    page = out / "bench.html"
    write_text(page, template.render(sections=sections))
    return page


Rows = Sequence[dict[str, Any]]


def _inline(path: Path) -> Markup:
    """A plot of ours as part of the page: without the XML head."""
    text = path.read_text("utf-8")
    return Markup(text[text.index("<svg") :])  # noqa: S704 - drawn by us; matplotlib escapes its labels


def _stability(rows: Rows, plots: Path) -> list[Part]:
    courses = [course_from(row) for row in rows]
    parts = []
    for name in SWEEPS:
        mine = [course for course in courses if course.sweep == name]
        if not mine:
            continue
        plot = stability_plot(mine, plots / f"stability-{folder_name(name)}.svg")
        table = tuple(
            (
                each.renderer,
                "-" if each.onset is None else f"{each.onset:.2g}",
                each.kind or "-",
                "-" if each.predicted is None else f"{each.predicted:.2g}",
                "-" if each.decades_off is None else f"{each.decades_off:+.1f}",
            )
            for each in mine
        )
        head = ("renderer", "onset", "kind of failure", "predicted", "decades apart")
        parts.append(Part(SWEEPS[name].title, prose.about_sweep(mine), _inline(plot), head, table))
    return parts


def course_from(data: dict[str, Any]) -> stability.Course:
    """A course as ``stability.json`` holds it."""
    fields = {key: value for key, value in data.items() if key != "decades_off"}
    return stability.Course(**{**fields, "points": tuple(stability.Point(**each) for each in data["points"])})


def result_from(data: dict[str, Any]) -> efficiency.Result:
    """A result as ``efficiency.json`` holds it."""
    places = tuple(
        efficiency.Place(**{**each, "spread": {k: tuple(v) for k, v in each["spread"].items()}})
        for each in data["places"]
    )
    found = None if data["floor"] is None else Floor(**data["floor"])
    return efficiency.Result(**{**data, "places": places, "floor": found, "front": tuple(data["front"])})


def _efficiency(rows: Rows, plots: Path) -> list[Part]:
    results = [result_from(row) for row in rows]
    parts = []
    for (scene, knob), group in groupby(results, key=lambda result: (result.scene, result.knob)):
        mine = list(group)
        plot = efficiency_plot(mine, plots / f"efficiency-{folder_name(f'{scene}-{knob}')}.svg")
        table = tuple(
            (
                each.renderer,
                f"{place.value:g}",
                f"{place.wall:.2f}",
                f"{place.wall_net:.2f}",
                f"{place.cpu:.2f}",
                f"{place.cpu_net:.2f}",
                f"{place.memory:.0f}",
                *(
                    f"{place.errors[name]:.2g} ({place.spread[name][0]:.2g}..{place.spread[name][1]:.2g})"
                    for name in MEASURES
                ),
                "-" if place.efficiency is None else f"{place.efficiency:.2g}",
            )
            for each in mine
            for place in each.places
        )
        head: tuple[str, ...] = ("renderer", knob, "wall s", "without start", "processor s", "without start", "MiB")
        head += ("relMSE", "FLIP", "FLIP p99", "CIEDE2000", "wrong pixels", "1/(var s)")
        parts.append(Part(f"{scene}: {knob}", prose.about_efficiency(mine), _inline(plot), head, table))
    return parts


def _check_from(data: dict[str, Any]) -> metamorphic.Check:
    fields: dict[str, Any] = {key: value for key, value in data.items() if key != "broken"}
    return metamorphic.Check(**{**fields, "place": tuple(data["place"])})


def _metamorphic(rows: Rows, _: Path) -> list[Part]:
    checks = [_check_from(row) for row in rows]
    parts = []
    for renderer, group in groupby(checks, key=lambda check: check.renderer):
        mine = list(group)
        table = tuple(
            (
                each.scene,
                each.relation,
                each.message or ("broken" if each.broken else "holds"),
                f"{each.largest:.1e}",
                str(each.pixels),
                f"{each.edge_pixels} of {each.edges}",
            )
            for each in mine
        )
        head = ("scene", "relation", "", "largest difference", "pixels", "at edges")
        parts.append(Part(renderer, prose.about_relations(mine), None, head, table))
    return parts
