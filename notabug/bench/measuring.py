"""The commands ``bench efficiency``, ``stability`` and ``metamorphic``: measure, write JSON, draw the page."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from rich.console import Console

from notabug.bench import page
from notabug.exit_codes import ExitCode
from notabug.results.record import json_ready
from notabug.runs.folders import write_json
from notabug.runs.progress import console
from notabug.runs.provenance import tool

REPEATS = 3
QUICK_SIDE = 48
Note = Callable[[str], None]
Rows = list[dict[str, Any]]


def command(what: str, *, quick: bool, out: Path, renderers: Sequence[str], resume: bool, as_json: bool) -> ExitCode:
    """Measure, write ``out/<what>.json`` and ``out/bench.html``; exit 1 where our own renderer broke a relation."""
    progress = console(stderr=True)
    begun = time.perf_counter()

    def note(text: str) -> None:
        progress.print(f"{time.perf_counter() - begun:5.0f} s  {text}", markup=False, soft_wrap=True)

    measure = {"efficiency": _efficiency, "stability": _stability, "metamorphic": _metamorphic}[what]
    out.mkdir(parents=True, exist_ok=True)
    about, rows = measure(out, note, quick, renderers, resume)
    document = json_ready(
        {
            "schema": 1,
            "tool": tool(),
            "what": what,
            "about": about,
            "quick": quick,
            "seconds": time.perf_counter() - begun,
            "results": rows,
        }
    )
    write_json(out / f"{what}.json", document)
    drawn = page.draw(out)
    if as_json:
        print(json.dumps(document, ensure_ascii=False, allow_nan=False))
    else:
        _show(console(), out / f"{what}.json", drawn)
    ours = (row for row in rows if str(row["renderer"]).startswith("inhouse float64"))
    return ExitCode.BUG if any(course.get("broken") for course in ours) else ExitCode.OK


def _show(to: Console, *paths: Path) -> None:
    for path in paths:
        to.print(str(path), markup=False, soft_wrap=True)


def _wanted(name: str, renderers: Sequence[str]) -> bool:
    """``inhouse`` stands for ``inhouse float32`` too."""
    return not renderers or any(name == renderer or name.startswith(f"{renderer} ") for renderer in renderers)


def _stability(out: Path, note: Note, quick: bool, renderers: Sequence[str], resume: bool) -> tuple[str, Rows]:
    from notabug.bench import stability
    from notabug.bench.stability_contestants import contestants
    from notabug.bench.stability_sweeps import SWEEPS
    from notabug.bench.stability_theory import SHARE

    entrants = [contestant for contestant in contestants() if _wanted(contestant.name, renderers)]
    bench = stability.Bench(out / "stability", resume=resume, side=QUICK_SIDE if quick else 0)
    courses = stability.measure(bench, list(SWEEPS.values()), entrants, note, quick=quick)
    about = (
        "Each number goes over decades on a small stage; clipping planes, lights and fall-off go with the scene. "
        f"A renderer breaks where more than {SHARE:.0%} of the pixels are wrong"
        + ("." if quick else f"; that place is bisected to a factor of {stability.FINE:g}.")
        + " Renderers without shadows get the stage lit from the eye. Triangles in the plots are predictions."
    )
    return about, [course.as_dict() for course in courses]


def _efficiency(out: Path, note: Note, quick: bool, renderers: Sequence[str], resume: bool) -> tuple[str, Rows]:
    from notabug.bench import efficiency
    from notabug.bench.efficiency_plan import plan
    from notabug.runs.provenance import fingerprint

    rows: Rows = []
    code = fingerprint("scenes_usd", "references", "adapters", "bench")
    repeats = 2 if quick else REPEATS
    for lines in plan(quick=quick, side=QUICK_SIDE if quick else 0):
        chosen = [line for line in lines if _wanted(line.renderer, renderers)]
        if not chosen:
            continue
        kept = out / "efficiency" / f"{chosen[0].scene.replace('/', '-')}-{chosen[0].knob}.json"
        key = json.dumps([code, repeats, [[each.renderer, [s.value for s in each.settings]] for each in chosen]])
        stored = json.loads(kept.read_text("utf-8")) if resume and kept.is_file() else {}
        if stored.get("key") != key:
            results = json_ready([each.as_dict() for each in efficiency.measure(chosen, repeats, note)])
            kept.parent.mkdir(parents=True, exist_ok=True)
            stored = {"key": key, "results": results}
            write_json(kept, stored)
        rows += stored["results"]
    about = (
        f"Each renderer on one thread, {repeats} repetitions in turn. Without start: less the cost of the same scene "
        "at a few pixels. Errors are medians, with the smallest and largest, against the reference; large marks lie "
        "on the Pareto front."
    )
    return about, rows


def _metamorphic(out: Path, note: Note, quick: bool, renderers: Sequence[str], resume: bool) -> tuple[str, Rows]:
    del resume
    from notabug.adapters.base import RendererMissingError
    from notabug.adapters.registry import adapters
    from notabug.bench import metamorphic
    from notabug.bench.metamorphic_reduced import write_reduced
    from notabug.bench.metamorphic_relations import RELATIONS
    from notabug.runs.folders import folder_name

    who: list[tuple[str, metamorphic.Draw, float]] = [
        ("inhouse float64", metamorphic.in_house("float64"), metamorphic.EXACT),
        ("inhouse float32", metamorphic.in_house("float32"), metamorphic.ROUNDED),
    ]
    for name, each in adapters().items():
        if name == "inhouse":
            continue
        try:
            each.find()
        except RendererMissingError:
            continue
        who.append((name, metamorphic.drawn_by(each), metamorphic.ROUNDED))
    scenes = metamorphic.stages(metamorphic.SCENES[:2] if quick else metamorphic.SCENES)
    checks = metamorphic.measure(scenes, [each for each in who if _wanted(each[0], renderers)], note)
    for made in (check for check in checks if check.broken):
        scene = next(each for each in scenes if each.id == made.scene)
        relation = next(each for each in RELATIONS if each.name == made.relation)
        draw = next(draw for name, draw, _ in who if name == made.renderer)
        folder = out / "metamorphic" / folder_name(f"{made.renderer}-{made.scene.replace('/', '-')}-{made.relation}")
        note(f"reduced: {write_reduced(made, scene, relation, draw, folder, note)}")
    about = (
        "Pairs of scenes that must give the same picture at pixel centres; no reference is needed. Pixels within one "
        "of an edge or a terminator are counted apart: there the last bit decides what is seen."
    )
    return about, [check.as_dict() for check in checks]
