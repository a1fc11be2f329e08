"""report.html: one page that opens from disk, drawn only from ``run.json`` and the pictures next to it."""

from __future__ import annotations

import base64
import hashlib
import json
import tempfile
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from importlib.resources import files
from pathlib import Path

from markupsafe import Markup

from notabug.gallery.templating import environment
from notabug.report.comparison import CHANGES
from notabug.report.drawing import FOLDER, Pictures
from notabug.report.legend import LEGEND
from notabug.report.loading import results_of
from notabug.report.rows import Group, Key, Row, Summary, changes_against, groups, key, make_row, summarise
from notabug.results.document import RunDocument
from notabug.results.record import Result, load
from notabug.results.wording import WORST_FIRST, area, strongest
from notabug.runs.folders import write_text
from notabug.scenes_usd.errors import NotabugError

POLICY = "default-src 'none'; img-src data: 'self' file:; base-uri 'none'; form-action 'none'"


def draw(
    out: Path,
    white: float = 1.0,
    pictures: Pictures | None = None,
    *,
    baseline: Path | None = None,
    single_file: bool = False,
) -> Path:
    """Write ``out/report.html`` from ``out/run.json``; ``white`` is the radiance that the pictures show as white.

    ``pictures`` are those that were begun during the run. They lie in ``report_files`` beside the page, unless it is to
    be a ``single_file``. ``baseline`` is the folder of an earlier run that this one is compared with.
    """
    document = load(out)
    results = results_of(document)
    before = None
    if baseline is not None:
        before = {key(result): result for result in results_of(load(baseline))}
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="notabug-"))) if single_file else None
        if pictures is None or single_file:
            drawn = stack.enter_context(Pictures(out, white, folder))
        else:
            drawn = stack.enter_context(pictures)
        for result in results:
            drawn.begin(result)
        rows = _rows(document, results, out, drawn, changes_against(results, before), files=not single_file)
        versions = {name: str(found.get("version", "")) for name, found in document["renderers"].items()}
        names = sorted({shown.name for row in rows for shown in (*row.main, *row.more) if shown.name})
        page = _page(
            document,
            groups(rows, out),
            summarise(rows, versions, before),
            white,
            out,
            before=str(baseline) if baseline is not None else "",
            embedded=_embedded(drawn.folder, names) if single_file else None,
        )
        if not single_file:
            _tidy(drawn.folder, set(names))
    target = out / "report.html"
    write_text(target, page)
    return target


def _rows(
    document: RunDocument,
    results: Sequence[Result],
    out: Path,
    pictures: Pictures,
    against: Mapping[Key, str],
    *,
    files: bool,
) -> list[Row]:
    models = str(document["tool"].get("models", "") if isinstance(document.get("tool"), dict) else "")
    return [
        make_row(
            result,
            out,
            pictures.of(result),
            pictures.peak(result),
            models,
            against.get(key(result), ""),
            files=files,
        )
        for result in results
    ]


def _page(
    document: RunDocument,
    found: Sequence[Group],
    summary: Summary,
    white: float,
    out: Path,
    *,
    before: str,
    embedded: Mapping[str, str] | None,
) -> str:
    from jinja2 import UndefinedError

    css, script = _style(), _script()
    data = json.dumps(embedded or {}).replace("<", "\\u003c")
    policy = f"{POLICY}; script-src '{_hashed(script)}'; style-src '{_hashed(css)}'"
    try:
        return environment().get_template("page.html").render(
            css=Markup(css),  # noqa: S704 - our own file, not input
            script=Markup(script),  # noqa: S704
            embedded=Markup(data) if embedded is not None else "",  # noqa: S704 - names and base64, made here
            policy=policy,
            document=document,
            groups=found,
            area=area,
            strongest=strongest,
            summary=summary,
            changes=CHANGES,
            baseline=before,
            pictures=FOLDER,
            legend=LEGEND,
            tips={each.word: each.text for each in LEGEND},
            verdicts=list(WORST_FIRST),
            white=white,
            out=out.as_posix(),
        )  # fmt: skip
    except (UndefinedError, TypeError, ValueError, AttributeError) as error:
        raise NotabugError(
            "the record lacks what the page shows", where=str(out / "run.json"), got=str(error)
        ) from error


def _embedded(folder: Path, names: Sequence[str]) -> dict[str, str]:
    """The PNGs called ``names`` as data addresses."""
    return {
        name: "data:image/png;base64," + base64.b64encode((folder / name).read_bytes()).decode("ascii")
        for name in names
    }


def _tidy(folder: Path, wanted: set[str]) -> None:
    """Remove the PNGs of an earlier page that this one does not show."""
    for path in folder.glob("*.png"):
        if path.name not in wanted:
            path.unlink(missing_ok=True)


def _asset(name: str) -> str:
    return files("notabug.report").joinpath(name).read_text(encoding="utf-8")


def _style() -> str:
    """What the gallery's pages and the report share, and the report's own."""
    return files("notabug.gallery").joinpath("static", "base.css").read_text(encoding="utf-8") + _asset("page.css")


def _script() -> str:
    """The switch of light and dark, which the gallery has too, and the report's own."""
    return files("notabug.gallery").joinpath("static", "theme.js").read_text(encoding="utf-8") + _asset("page.js")


def _hashed(text: str) -> str:
    return "sha256-" + base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()
