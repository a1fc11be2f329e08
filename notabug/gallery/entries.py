"""Exhibits: each scene and variant with its reference, its models' pictures and what every run's renderers drew."""

from __future__ import annotations

import importlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from notabug.gallery.steps import Steps, silent
from notabug.gallery.store import Store
from notabug.metrics.noise import measure
from notabug.references import store as references
from notabug.references.models.model import Model, models
from notabug.references.predict import predict
from notabug.references.tracer.precision import ABSOLUTE, RELATIVE
from notabug.report.loading import inside
from notabug.results.document import RunDocument
from notabug.results.record import Result, json_ready, load
from notabug.results.wording import area, finding_names, strongest
from notabug.scenes_usd.catalogue import Entry, scenes
from notabug.scenes_usd.errors import NotabugError
from notabug.scenes_usd.picture import read_picture
from notabug.scenes_usd.reader import read_scene
from notabug.scenes_usd.scene import Scene
from notabug.scenes_usd.view import from_text

Floats = npt.NDArray[np.floating]


@dataclass(frozen=True, slots=True)
class Run:
    """One run's record and the folder that it lies in."""

    name: str
    folder: Path
    document: RunDocument
    results: tuple[Result, ...]


@dataclass(frozen=True, slots=True)
class Drawn:
    """One renderer's result in one run, and its small picture."""

    run: Run
    result: Result
    thumb: str = ""
    note: str = ""

    @property
    def names(self) -> str:
        return finding_names(self.result)

    @property
    def area(self) -> float:
        return area(self.result)

    @property
    def jnd(self) -> float:
        return strongest(self.result)


@dataclass(slots=True)
class Exhibit:
    """One scene and variant; ``pictures`` and ``renders`` are what the viewer loads."""

    scene: str
    variant: str
    artifact_class: str
    claim: str
    figure: str = ""
    cites: str = ""
    thumb: str = ""
    pictures: list[dict[str, Any]] = field(default_factory=list)
    renders: list[dict[str, Any]] = field(default_factory=list)
    drawn: list[Drawn] = field(default_factory=list)
    models: list[Model] = field(default_factory=list)
    record: str = ""
    terms: str = ""

    @property
    def latest(self) -> dict[str, Drawn]:
        """Each renderer's result in the last run that has one."""
        return {each.result.renderer: each for each in self.drawn}


def read_run(folder: Path) -> Run:
    """The run in ``folder``; raises NotabugError where there is none."""
    document = load(folder)
    try:
        results = tuple(Result.from_dict(each) for each in document["results"])
    except (KeyError, TypeError, ValueError, IndexError) as error:
        raise NotabugError("not a run's record", where=str(folder / "run.json"), got=repr(error)) from None
    return Run(folder.resolve().name, folder, document, results)


def collect(
    runs: Sequence[Run],
    store: Store,
    *,
    every_variant: bool,
    with_models: bool,
    white: float,
    only: Sequence[str] = (),
    steps: Steps = silent,
) -> list[Exhibit]:
    """Every exhibit of the corpus (default variants, or all that are stored) and of ``runs``, with its pictures."""
    found: dict[tuple[str, str], Exhibit] = {}
    for entry, variant in _corpus(every_variant):
        found[entry.id, variant] = _exhibit(entry.id, variant)
    for run in runs:
        for result in run.results:
            found.setdefault((result.scene, result.variant), _exhibit(result.scene, result.variant, result.claim))
    if only:
        found = {key: each for key, each in found.items() if any(fnmatchcase(each.scene, glob) for glob in only)}
    for exhibit in steps(list(found.values()), "pictures"):
        _fill(exhibit, runs, store, with_models=with_models, white=white)
    return [each for each in found.values() if each.pictures or each.drawn]


def _corpus(every_variant: bool) -> Iterator[tuple[Entry, str]]:
    for scene in scenes():
        default = ",".join(f"{key}={name}" for key, name in sorted(scene.defaults.items()))
        yield scene, default
        folder = references.place(scene.id, default).parent
        for path in sorted(folder.glob("*.exr")) if every_variant else ():
            if path.stem not in (default, "default"):
                yield scene, path.stem


def _exhibit(scene: str, variant: str, claim: str = "") -> Exhibit:
    for each in scenes():
        if each.id == scene:
            return Exhibit(scene, variant, each.artifact_class, each.claim, each.card.figure, each.card.cites)
    return Exhibit(scene, variant, "own", claim)


def _fill(exhibit: Exhibit, runs: Sequence[Run], store: Store, *, with_models: bool, white: float) -> None:
    own = [(run, each) for run in runs for each in run.results if (each.scene, each.variant) == _key(exhibit)]
    reference = _reference(exhibit, own)
    if reference is not None:
        exhibit.thumb = store.thumb(reference, white=white)
        exhibit.pictures.append(_entry("reference", "reference", "reference", store.picture(reference), reference))
        if with_models and exhibit.artifact_class != "own":
            _add_models(exhibit, store, reference, {f.name for _, each in own for f in each.verdict.findings})
    for run, result in own:
        _add_render(exhibit, store, run, result, reference, white)


def _key(exhibit: Exhibit) -> tuple[str, str]:
    return exhibit.scene, exhibit.variant


def _reference(exhibit: Exhibit, own: list[tuple[Run, Result]]) -> Floats | None:
    """From the corpus; else the one that a run wrote."""
    if exhibit.artifact_class != "own":
        try:
            return references.read(exhibit.scene, exhibit.variant).pixels
        except NotabugError:
            pass
    for run, result in own:
        pixels, _ = _read(run, result.images.get("reference", ""))
        if pixels is not None:
            return pixels
    return None


def scene_of(exhibit: Exhibit) -> Scene:
    """The scene as USD has it; raises NotabugError where the corpus has no such variant."""
    return read_scene(exhibit.scene, *from_text(exhibit.variant))


ALSO = {"texture_space": ("opacity_map",)}
"""Files of models that a class has beside the one that bears its name."""


def own_models(artifact_class: str, scene: Scene) -> list[Model]:
    """The models of ``scene`` that belong to a class: those of the file that bears its name, and of those in ALSO."""
    found: list[Model] = []
    for name in (artifact_class, *ALSO.get(artifact_class, ())):
        try:
            module = importlib.import_module(f"notabug.references.models.{name}")
        except ModuleNotFoundError:
            continue
        found += module.models(scene)
    return found


def _add_models(exhibit: Exhibit, store: Store, reference: Floats, found: set[str]) -> None:
    """The limitations and conventions of the scene's own class, and those that a renderer showed."""
    try:
        scene = scene_of(exhibit)
    except NotabugError:  # a variant that the corpus does not have
        return
    names = {each.name for each in own_models(exhibit.artifact_class, scene)} | found
    seen: set[str] = set()
    for model in models(scene):
        if model.kind == "fault" or model.name not in names:
            continue
        if any(each.name == model.name for each in exhibit.models):
            continue  # one picture a name: the models of one name differ in which surface they act on
        pixels = np.asarray(predict(scene, (model,)).mean)
        if pixels.shape != reference.shape:
            continue
        off = np.abs(pixels - reference) > RELATIVE * np.abs(reference) + ABSOLUTE * float(reference.max())
        name = store.picture(pixels)
        if not off.any() or name in seen:
            continue
        seen.add(name)
        exhibit.models.append(model)
        exhibit.pictures.append(
            _entry(f"model:{model.name}", model.name.replace("_", " "), model.kind, name, pixels)
            | {"claim": model.claim, "cites": model.cites, "rule": model.rule, "model": model.name}
        )


def _add_render(
    exhibit: Exhibit, store: Store, run: Run, result: Result, reference: Floats | None, white: float
) -> None:
    pixels, note = _read(run, result.image)
    thumb = "" if pixels is None else store.thumb(pixels, white=white)
    exhibit.drawn.append(Drawn(run, result, thumb, note))
    same = sum(each.result.renderer == result.renderer for each in exhibit.drawn)
    label = result.renderer if same == 1 else f"{result.renderer} ({run.name}, {same})"
    maps: dict[str, str] = {}
    if pixels is not None:
        extra = {"renderer": label, "render": len(exhibit.renders)}
        exhibit.pictures.append(_entry(label, label, "render", store.picture(pixels), pixels) | extra)
        nearest, _ = _read(run, result.images.get("nearest", ""))
        if nearest is not None and nearest.shape == pixels.shape:
            name = f"nearest:{label}"
            title = f"nearest admissible to {label}"
            exhibit.pictures.append(_entry(name, title, "nearest", store.picture(nearest), nearest) | extra)
        for leg in ("limitation", "bug"):
            values, _ = _read(run, result.images.get(f"{leg}_map", ""))
            if values is not None and result.verdict.legs[leg].pixels:
                maps[leg] = store.picture(values[:, :, :1])
        if reference is not None and reference.shape == pixels.shape:
            error, maps["unit"] = _error(run, result, reference)
            maps["error"] = store.picture(error)
    document = result.as_dict()
    keep = ("renderer_version", "verdict", "findings", "message", "seconds", "expected", "command", "samples", "seeds")
    exhibit.renders.append(
        {
            "renderer": label,
            "run": run.name,
            "note": note,
            "maps": maps,
            **{key: value for key, value in document.items() if key in keep},
        }
    )


def _error(run: Run, result: Result, reference: Floats) -> tuple[Floats, str]:
    """What one step of z is: the standard error of the seeds' mean where they differ, else the verdict's tolerance."""
    tolerance = (RELATIVE * np.abs(reference) + ABSOLUTE * float(reference.max(initial=0.0))).max(axis=2, keepdims=True)
    folder = Path(result.image).parent
    folder = folder if folder.name == "renders" else folder / "renders"
    if result.seeds < 2:
        return tolerance, "tolerances"
    try:
        paths = sorted(inside(run.folder, str(folder)).glob("*.exr"))[: result.seeds]
        seeds = [read_picture(path).pixels for path in paths]
        measured = measure(seeds, np.zeros(reference.shape[:2], np.bool_)) if len(seeds) > 1 else None
    except (NotabugError, ValueError, OSError):
        return tolerance, "tolerances"
    if measured is None or not measured.noisy:
        return tolerance, "tolerances"
    error = np.sqrt(measured.variance.max(axis=2, keepdims=True))
    rounding = 2.0**-11 * np.abs(reference).max(axis=2, keepdims=True)  # of the half floats that are shown
    return np.maximum.reduce([error, 0.02 * tolerance, rounding]), "standard errors"


def _entry(name: str, title: str, kind: str, file: str, pixels: Floats) -> dict[str, object]:
    height, width = pixels.shape[:2]
    return {"name": name, "title": title, "kind": kind, "file": file, "size": [width, height]}


def _read(run: Run, name: str) -> tuple[Floats | None, str]:
    if not name:
        return None, "no picture"
    try:
        return read_picture(inside(run.folder, name)).pixels, ""
    except NotabugError as error:
        return None, str(error)


def document(exhibit: Exhibit) -> dict[str, object]:
    """What the viewer loads of an exhibit."""
    plain = {
        "scene": exhibit.scene,
        "variant": exhibit.variant,
        "claim": exhibit.claim,
        "pictures": exhibit.pictures,
        "renders": exhibit.renders,
        "terms": exhibit.terms,
    }
    return {str(name): json_ready(part) for name, part in plain.items()}
