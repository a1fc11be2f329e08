"""site: the gallery's pages, from exhibits and templates."""

from __future__ import annotations

import contextlib
import itertools
import json
from collections.abc import Iterator, Sequence
from importlib.resources import files
from pathlib import Path
from urllib.parse import urlencode

import numpy as np

from notabug.gallery.entries import Exhibit, Run, collect, document, own_models, read_run, scene_of
from notabug.gallery.remedies import remedies
from notabug.gallery.steps import Steps, silent
from notabug.gallery.store import Store
from notabug.gallery.taxonomy import Kind, taxonomy
from notabug.gallery.templating import environment
from notabug.gallery.terms import terms
from notabug.gallery.trend import trends
from notabug.references.models.model import Model, models
from notabug.references.predict import predict
from notabug.references.raster.picture import RasterOptions, raster_picture
from notabug.references.tracer.envelope import trace_picture
from notabug.references.tracer.options import Options
from notabug.results import conformance
from notabug.results.document import ResultSaid
from notabug.results.wording import STYLE, WORST_FIRST
from notabug.scenes_usd.catalogue import PREVIEW
from notabug.scenes_usd.errors import NotabugError
from notabug.scenes_usd.reader import read_scene

ASSETS = (
    "base.css",
    "gallery.css",
    "gallery.js",
    "flip.js",
    "shader.js",
    "theme.js",
    "viewer.js",
    "vendor/exr.js",
    "vendor/LICENSES.txt",
)

# Pages may load their own scripts, style and small pictures, and nothing else. Chromium takes 'self' on a page from
# disk for no origin at all, so the scheme is named as well.
POLICY = (
    "default-src 'none'; script-src 'self' file:; style-src 'self' file:; img-src 'self' file: data:; "
    "base-uri 'none'; form-action 'none'"
)

CALIBRATION = "calibration"  # the class of the card, which is no artifact


def build(
    folders: Sequence[Path],
    out: Path,
    *,
    every_variant: bool = False,
    with_models: bool = True,
    step: int = 4,
    bench: Path | None = None,
    white: float = 1.0,
    only: Sequence[str] = (),
    steps: Steps = silent,
) -> Path:
    """Write the gallery of the corpus and the runs in ``folders`` to ``out``; returns its first page.

    ``only`` are globs of the scenes that it shows, none: all; ``step`` is the grid of the terms in pixels, 0 for none;
    ``bench`` a folder of SVG plots; ``steps`` tells how far it is.
    """
    runs = [read_run(each) for each in folders]
    plots = _plots(bench)
    store = Store(out)
    try:
        exhibits = collect(
            runs, store, every_variant=every_variant, with_models=with_models, white=white, only=only, steps=steps
        )
        for each in steps(exhibits, "terms of pixels"):
            if with_models and step and each.artifact_class != "own":
                with contextlib.suppress(NotabugError):  # a variant that the corpus does not have
                    each.terms = store.record(terms(scene_of(each), step))
            each.record = store.record(document(each))
        site = {"scenes": [[each.scene, each.variant, each.record] for each in exhibits]}
        store.text("data/site.js", f"notabug.site({_json(site)});\n")
        _pages(store, exhibits, runs, plots, with_models=with_models, white=white)
        for name in ASSETS:
            asset = files("notabug.gallery").joinpath("static", name)
            store.text(f"assets/{name}", asset.read_text(encoding="utf-8"))
    except BaseException:
        store.stop()
        raise
    store.sweep()
    return out / "index.html"


def _pages(
    store: Store,
    exhibits: list[Exhibit],
    runs: list[Run],
    plots: list[tuple[str, str]],
    *,
    with_models: bool,
    white: float,
) -> None:
    jinja = environment()
    kinds = [each for each in taxonomy() if any(x.artifact_class == each.id for x in exhibits)]
    renderers = list(dict.fromkeys(each.renderer for run in runs for each in run.results))
    found = trends(exhibits, runs)
    features = _features(exhibits)
    names = sorted({f.name for x in exhibits for d in x.latest.values() for f in d.result.verdict.findings})
    by_class = {each.id: [x for x in exhibits if x.artifact_class == each.id] for each in kinds}
    shared = {
        "policy": POLICY,
        "kinds": kinds,
        "shown_kinds": [each for each in kinds if each.id != CALIBRATION],
        "all_kinds": sum(each.id != CALIBRATION for each in taxonomy()),
        "spelled": _spelled(sum(each.id != CALIBRATION for each in taxonomy())),
        "runs": runs,
        "renderers": renderers,
        "has_trend": bool(found),
        "has_features": bool(features),
        "has_bench": bool(plots),
        "viewer": viewer_address,
    }

    def page(template: str, name: str, **more: object) -> None:
        root = "../" if "/" in name else ""
        store.text(name, jinja.get_template(template).render(**shared, root=root, **more))

    emblems = {each.id: _emblem(each, by_class[each.id], store, white, with_models=with_models) for each in kinds}
    page("index.html", "index.html", emblems=emblems, by_class=by_class, tally=_tally)
    remedied = remedies(store, exhibits, white) if with_models else []
    for kind in kinds:
        own = by_class[kind.id]
        page(
            "class.html",
            f"class/{kind.id}.html",
            kind=kind,
            emblem=emblems[kind.id],
            exhibits=own,
            models=_models(kind, own),
            shown=_shown(own),
            remedies=[each for each in remedied if each.artifact_class == kind.id],
        )
    ranked = sorted(exhibits, key=_rank)
    page("matrix.html", "matrix.html", exhibits=ranked, names=names)
    page("viewer.html", "viewer.html", exhibits=exhibits)
    if features:
        page("features.html", "features.html", features=features)
    if found:
        page("trend.html", "trend.html", trends=found)
    for name, text in plots:
        store.text(f"bench/{name}", text)
    if plots:
        page("bench.html", "bench.html", plots=[name for name, _ in plots])


def viewer_address(scene: str, variant: str, **more: str) -> str:
    """Where the viewer shows a scene; what was said is encoded, so it stays text."""
    return "viewer.html#" + urlencode({"scene": scene, **({"variant": variant} if variant else {}), **more})


def _rank(exhibit: Exhibit) -> tuple[int, float, str]:
    """Worst first: the worst verdict, then the largest area."""
    latest = exhibit.latest.values()
    worst = min((WORST_FIRST.index(each.result.verdict.word) for each in latest), default=len(WORST_FIRST))
    return worst, -max((each.area for each in latest), default=0.0), exhibit.scene


def _features(exhibits: list[Exhibit]) -> list[tuple[Exhibit, conformance.Row]]:
    """Each scene of the preview surface's features, and its row of the conformance table."""
    found = {row.feature: row for row in conformance.rows(_latest(exhibits))}
    named = {each.scene.partition("/")[2]: each for each in exhibits if each.scene.startswith(f"{PREVIEW}/")}
    return [(named[name], row) for name, row in found.items()]


def _latest(exhibits: list[Exhibit]) -> Iterator[ResultSaid]:
    for exhibit in exhibits:
        for drawn in exhibit.latest.values():
            yield drawn.result.as_dict()


def _tally(exhibits: list[Exhibit]) -> list[tuple[str, int]]:
    words = [each.result.verdict.word for x in exhibits for each in x.latest.values()]
    return [(word, words.count(word)) for word in STYLE if word in words]


def _emblem(kind: Kind, exhibits: list[Exhibit], store: Store, white: float, *, with_models: bool) -> str:
    """The picture that stands for a class; without models that of its first scene."""
    chosen = kind.emblem
    first = next((each.thumb for each in exhibits if each.thumb), "")
    if not with_models:
        return first
    try:
        scene = read_scene(chosen["scene"], chosen.get("variants"))
        if "options" in chosen:
            drawn = trace_picture(scene, Options(shadows="facets", **chosen["options"]), samples=1, dtype=np.float32)
            return store.thumb(drawn, white=white)
        if "raster" in chosen:
            return store.thumb(raster_picture(scene, RasterOptions(**chosen["raster"]), dtype=np.float32), white=white)
        acting = next((each for each in models(scene) if each.name == chosen.get("model")), None)
        pixels = np.asarray(predict(scene, () if acting is None else (acting,)).mean)
        return store.thumb(pixels, white=white)
    except NotabugError:
        return first


def _models(kind: Kind, exhibits: list[Exhibit]) -> list[tuple[Model, list[Exhibit]]]:
    """The models that act on the scenes of a class, faults last, each with the scenes whose viewer shows it."""
    found: dict[str, tuple[Model, list[Exhibit]]] = {}
    for each in exhibits:
        try:
            acting = own_models(kind.id, scene_of(each))
        except NotabugError:
            continue
        for model in (*acting, *each.models):
            _, showing = found.setdefault(model.name, (model, []))
            if each not in showing and any(x.name == model.name for x in each.models):
                showing.append(each)
    order = {"limitation": 0, "convention": 1, "fault": 2}
    return sorted(found.values(), key=lambda each: order[each[0].kind])


def _shown(exhibits: list[Exhibit]) -> list[tuple[str, list[str]]]:
    """Renderer -> the limitations that it shows on these scenes, each once."""
    pairs = sorted(
        {
            (renderer, finding.name)
            for exhibit in exhibits
            for renderer, each in exhibit.latest.items()
            for finding in each.result.verdict.findings
            if finding.kind == "limitation"
        }
    )
    return [(name, [each for _, each in group]) for name, group in itertools.groupby(pairs, key=lambda each: each[0])]


def _plots(folder: Path | None) -> list[tuple[str, str]]:
    """The SVG files of ``folder``: pages show them as pictures, in which no script runs."""
    if folder is None:
        return []
    paths = sorted(folder.glob("*.svg"))
    if not paths:
        raise NotabugError("no plots", where=str(folder), expected="SVG files", do="give the folder that bench wrote")
    return [(f"{at:02}-{_plain(path.stem)}.svg", path.read_text(encoding="utf-8")) for at, path in enumerate(paths)]


def _plain(text: str) -> str:
    return "".join(each if each.isalnum() and each.isascii() else "_" for each in text)[:60]


def _json(value: object) -> str:
    return json.dumps(value, separators=(",", ":"))


def _spelled(count: int) -> str:
    """A small number as the first word of a sentence."""
    words = ("No", "One", "Two", "Three", "Four", "Five", "Six", "Seven", "Eight", "Nine", "Ten", "Eleven", "Twelve")
    return words[count] if count < len(words) else str(count)
