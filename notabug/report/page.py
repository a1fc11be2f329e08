"""report.html: one page that opens from disk, drawn only from ``run.json`` and the pictures next to it."""

from __future__ import annotations

import base64
import hashlib
import json
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from importlib.resources import files
from pathlib import Path
from typing import Any

import jinja2
from markupsafe import Markup

from notabug.folders import write_text
from notabug.gallery.templating import environment
from notabug.record import SCHEMA, Result
from notabug.report.pictures import address, levels, tone_map
from notabug.scenes_usd.errors import NotabugError
from notabug.scenes_usd.picture import read_picture
from notabug.words import STYLE, area, number, readable, strongest, tally


@dataclass(frozen=True, slots=True)
class Shown:
    """One picture of a cell: ``address`` is empty where there is nothing to see, and ``note`` says why."""

    title: str
    address: str = ""
    note: str = ""


@dataclass(frozen=True, slots=True)
class Cell:
    """One renderer's column of a row."""

    result: Result
    picture: Shown
    strip: tuple[Shown, ...]
    facts: tuple[tuple[str, str], ...]


@dataclass(slots=True)
class Row:
    """One scene and variant: its reference, and a cell for each renderer that has a result."""

    scene: str
    variant: str
    claim: str
    reference: Shown
    cells: dict[str, Cell] = field(default_factory=dict)

    @property
    def words(self) -> str:
        return " ".join(sorted({cell.result.verdict.word for cell in self.cells.values()}))


def draw(out: Path, white: float = 1.0) -> Path:
    """Write ``out/report.html`` from ``out/run.json``; ``white`` is the radiance that the pictures show as white."""
    document = load(out)
    results = [Result.from_dict(each) for each in _results(document, out)]
    names = list(dict.fromkeys(each.renderer for each in results))
    rows: dict[tuple[str, str], Row] = {}
    with ThreadPoolExecutor() as pool:  # compressing pictures lets other threads run
        cells = list(pool.map(lambda each: _cell(out, each, white), results))
    for each, cell in zip(results, cells, strict=True):
        row = rows.setdefault((each.scene, each.variant), Row(each.scene, each.variant, each.claim, Shown("reference")))
        row.cells[each.renderer] = cell
        if not row.reference.address:
            row.reference = _picture(out, each.images.get("reference", ""), "reference", white)
    try:
        page = (
            environment()
            .get_template("page.html")
            .render(
                css=Markup(_style()),  # noqa: S704 - our own file, not input
                viewer=Markup(_asset("viewer.html")),  # noqa: S704
                policy=_policy(),
                document=document,
                renderers=names,
                rows=list(rows.values()),
                counts=[(word, sum(each.verdict.word == word for each in results)) for word in STYLE],
                summary=tally(each.verdict.word for each in results),
                white=white,
            )
        )
    except (jinja2.UndefinedError, TypeError, ValueError, AttributeError) as error:
        raise NotabugError(
            "the record lacks what the page shows", where=str(out / "run.json"), got=str(error)
        ) from error
    target = out / "report.html"
    write_text(target, page)
    return target


def load(out: Path) -> dict[str, Any]:
    """``run.json`` of the folder ``out``."""
    path = out / "run.json"
    try:
        document = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise NotabugError("cannot read the run", where=str(path), got=error.strerror or "", do="notabug run") from None
    except ValueError as error:
        raise NotabugError("not a run's record", where=str(path), got=str(error)) from None
    if not isinstance(document, dict) or document.get("schema") != SCHEMA:
        got = str(document.get("schema")) if isinstance(document, dict) else type(document).__name__
        raise NotabugError("not a run's record", where=str(path), expected=f"schema {SCHEMA}", got=got)
    return document


def _results(document: dict[str, Any], out: Path) -> list[Any]:
    found = document.get("results")
    if not isinstance(found, list):
        raise NotabugError("not a run's record", where=str(out / "run.json"), expected="a list of results")
    return found


def _cell(out: Path, result: Result, white: float) -> Cell:
    legs = result.verdict.legs
    strip = (
        _picture(out, result.images.get("nearest", ""), "nearest", white),
        _heat(out, result.images.get("limitation_map", ""), "limitation leg", legs["limitation"].pixels),
        _heat(out, result.images.get("bug_map", ""), "bug leg", legs["bug"].pixels),
    )
    return Cell(result, _picture(out, result.image, "picture", white), strip, _facts(result))


def _facts(result: Result) -> tuple[tuple[str, str], ...]:
    """The numbers under a picture, as (name, value)."""
    verdict = result.verdict
    facts: dict[str, str] = {}
    if verdict.findings:
        facts["area"] = f"{number(round(area(result), 1))} px"
        facts["jnd"] = number(strongest(result), 2)
        if significance := max(each.z for each in verdict.findings):
            facts["z"] = number(significance)
    for name, leg in verdict.legs.items():
        if leg.pixels:
            facts[f"{readable(name)} leg"] = f"{leg.pixels} px, FLIP {number(leg.flip)}, max {number(leg.flip_max)}"
    if result.samples:
        facts["samples"] = f"{result.samples} x {result.seeds} seeds" if result.seeds > 1 else str(result.samples)
    if result.samples or result.seconds.get("render"):
        facts["seconds"] = f"{result.seconds['render']:.2f} render, {result.seconds['judge']:.2f} judge"
    facts |= {readable(name): number(value, 4) for name, value in verdict.numbers.items() if name != "seeds"}
    if verdict.triggers:
        facts["triggers"] = ", ".join(verdict.triggers)
    if result.renderer_version:
        facts["version"] = result.renderer_version
    return tuple(facts.items())


def _picture(out: Path, name: str, title: str, white: float) -> Shown:
    if not name:
        return Shown(title, note="no picture")
    try:
        return Shown(title, address(tone_map(read_picture(inside(out, name)).pixels, white)))
    except NotabugError as error:
        return Shown(title, note=str(error))


def _heat(out: Path, name: str, title: str, pixels: int) -> Shown:
    if not name or not pixels:
        return Shown(title, note="empty")
    try:
        return Shown(title, address(levels(read_picture(inside(out, name)).pixels[:, :, 0])))
    except NotabugError as error:
        return Shown(title, note=str(error))


def inside(out: Path, name: str) -> Path:
    """A file of the run by its relative name; a record cannot make the report read anything else."""
    path = (out / name).resolve()
    if not path.is_relative_to(out.resolve()):
        raise NotabugError("a picture outside of the run's folder is not shown", got=name)
    return path


def _asset(name: str) -> str:
    return files("notabug.report").joinpath(name).read_text(encoding="utf-8")


def _style() -> str:
    """What the gallery's pages and the report share, and the report's own."""
    return files("notabug.gallery").joinpath("static", "base.css").read_text(encoding="utf-8") + _asset("page.css")


def _policy() -> str:
    """The page's content security policy: its own script and style, embedded pictures, no network."""
    script = _asset("viewer.html").partition("<script>")[2].partition("</script>")[0]
    return (
        f"default-src 'none'; img-src data:; script-src '{_hashed(script)}'; "
        f"style-src '{_hashed(_style())}'; base-uri 'none'; form-action 'none'"
    )


def _hashed(text: str) -> str:
    return "sha256-" + base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()
