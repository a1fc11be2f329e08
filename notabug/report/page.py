"""report.html: one page that opens from disk, drawn only from ``run.json`` and the pictures next to it."""

from __future__ import annotations

import base64
import hashlib
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field
from importlib.resources import files
from pathlib import Path

from markupsafe import Markup

from notabug.folders import write_text
from notabug.gallery.templating import environment
from notabug.record import Result, load
from notabug.report.pictures import address, levels, tone_map
from notabug.scenes_usd.errors import NotabugError
from notabug.scenes_usd.picture import read_picture
from notabug.words import STYLE, area, number, readable, strongest, tally

LEGS = ("limitation", "bug")


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


class Pictures:
    """The pictures of the run in ``out`` as the page shows them, each drawn once, by threads.

    Those of a finished result may be begun while the run goes on, where a processor is idle: compressing pictures lets
    others run. ``white`` is the radiance that is shown as white.
    """

    def __init__(self, out: Path, white: float = 1.0) -> None:
        self._out = out
        self._white = white
        self._drawn: dict[str, Future[str]] = {}
        self._references: dict[tuple[str, str], str] = {}
        self._pool = ThreadPoolExecutor()

    def __enter__(self) -> Pictures:
        return self

    def __exit__(self, *_: object) -> None:
        self._pool.shutdown(cancel_futures=True)

    def begin(self, result: Result) -> None:
        """Draw what the page shows of ``result``, and of the first in a row the reference."""
        images, legs = result.images, result.verdict.legs
        if "reference" in images:
            self._references.setdefault((result.scene, result.variant), images["reference"])
        for name in (result.image, images.get("nearest", ""), self._reference(result)):
            self._draw(name, self._picture)
        for leg in LEGS:
            self._draw(images.get(f"{leg}_map", "") if legs[leg].pixels else "", self._heat)

    def shown(self, name: str, title: str) -> Shown:
        """The picture called ``name`` of a result that was begun, under ``title``."""
        if not name:
            return Shown(title, note="no picture")
        try:
            return Shown(title, self._drawn[name].result())
        except NotabugError as error:
            return Shown(title, note=str(error))

    def reference(self, result: Result) -> Shown:
        """The reference in the row of ``result``."""
        return self.shown(self._reference(result), "reference")

    def _reference(self, result: Result) -> str:
        return self._references.get((result.scene, result.variant), "")

    def _draw(self, name: str, how: Callable[[str], str]) -> None:
        if name and name not in self._drawn:
            self._drawn[name] = self._pool.submit(how, name)

    def _picture(self, name: str) -> str:
        return address(tone_map(read_picture(inside(self._out, name)).pixels, self._white))

    def _heat(self, name: str) -> str:
        return address(levels(read_picture(inside(self._out, name)).pixels[:, :, 0]))


def draw(out: Path, white: float = 1.0, pictures: Pictures | None = None) -> Path:
    """Write ``out/report.html`` from ``out/run.json``; ``white`` is the radiance that the pictures show as white.

    ``pictures`` are those that were begun during the run.
    """
    with pictures or Pictures(out, white) as drawn:
        return _page(out, white, drawn)


def _page(out: Path, white: float, pictures: Pictures) -> Path:
    from jinja2 import UndefinedError

    document = load(out)
    results = [Result.from_dict(each) for each in document["results"]]
    names = list(dict.fromkeys(each.renderer for each in results))
    rows: dict[tuple[str, str], Row] = {}
    for each in results:
        pictures.begin(each)
    for each in results:
        row = Row(each.scene, each.variant, each.claim, pictures.reference(each))
        rows.setdefault((each.scene, each.variant), row).cells[each.renderer] = _cell(each, pictures)
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
    except (UndefinedError, TypeError, ValueError, AttributeError) as error:
        raise NotabugError(
            "the record lacks what the page shows", where=str(out / "run.json"), got=str(error)
        ) from error
    target = out / "report.html"
    write_text(target, page)
    return target


def _cell(result: Result, pictures: Pictures) -> Cell:
    images, legs = result.images, result.verdict.legs
    strip = [pictures.shown(images.get("nearest", ""), "nearest")]
    for leg in LEGS:
        heat = images.get(f"{leg}_map", "") if legs[leg].pixels else ""
        strip.append(pictures.shown(heat, f"{leg} leg") if heat else Shown(f"{leg} leg", note="empty"))
    return Cell(result, pictures.shown(result.image, "picture"), tuple(strip), _facts(result))


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
