"""``notabug bench generality``: draw what is not there yet, judge it, print what is wrong, shrink each bug."""

from __future__ import annotations

import json
import tempfile
import time
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

from rich.console import Console
from rich.progress import Progress
from rich.table import Table

from notabug.bench.generality.examine import Record
from notabug.bench.generality.exports import able, table
from notabug.bench.generality.jobs import Job, Part, expose, folder, installed
from notabug.bench.generality.summary import WORDS, is_bad, sentence, summary
from notabug.bench.verdict.run import run
from notabug.exit_codes import ExitCode
from notabug.results.record import json_ready
from notabug.runs.folders import write_json
from notabug.runs.progress import console
from notabug.runs.provenance import tool
from notabug.scenes_usd.errors import SelectionError

SCENES, QUICK = 400, 20  # scenes that are drawn
FAULTS, LIMITED = 250, 150  # of them, with a fault, which shows in some 200, and with a limitation
QUICK_SIDE = 48
REDUCING = 600.0  # seconds that shrinking one bug may take


def command(
    *,
    parts: Sequence[Part],
    scenes: int,
    seed: int,
    renderers: Sequence[str],
    quick: bool,
    naming: bool,
    reducing: bool,
    resume: bool,
    as_json: bool,
    out: Path,
    side: int = 0,
    workers: int = 0,
) -> ExitCode:
    """Run the ``parts`` on ``scenes`` random scenes (0: as many as there should be) of ``seed``.

    Exit 1 where we are wrong: a false bug, a control that passed, a traceback. Interrupted it reports what there is.
    """
    begun = time.perf_counter()
    who = installed(tuple(renderers) or able(parts))
    if not who:
        raise SelectionError("no renderer is installed", do="notabug doctor says how to get one; or name one with -r")
    todo = jobs(parts, scenes, seed, who, quick=quick, naming=naming, side=side or (QUICK_SIDE if quick else 0))
    loud = console(stderr=True)
    with tempfile.TemporaryDirectory(prefix="notabug-") as scratch:
        records = _judged(todo, folder(who) if resume else Path(scratch), workers, loud)
    records.sort(key=lambda each: (each["part"], each["seed"], each["index"], each["renderer"]))
    found = summary(records)
    out.mkdir(parents=True, exist_ok=True)
    document = json_ready(
        {
            "schema": 1,
            "tool": tool(),
            "seed": seed,
            "quick": quick,
            "naming": naming,
            "renderers": list(who),
            "jobs": len(todo),
            "seconds": time.perf_counter() - begun,
            "summary": found,
            "records": records,
        }
    )
    write_json(out / "generality.json", document)
    if reducing:
        from notabug.bench.generality.reducing import write_bugs

        write_bugs(records, out / "generality", lambda text: loud.print(text, markup=False, soft_wrap=True), REDUCING)
    if as_json:
        print(json.dumps(document, ensure_ascii=False, allow_nan=False))
    else:
        _show(found)
        _show_exports([record for record in records if record["part"] == "exports"])
        console().print(str(out / "generality.json"), markup=False, soft_wrap=True)
    return ExitCode.BUG if any(is_bad(each) for each in found.values()) else ExitCode.OK


def _judged(todo: Sequence[Job], kept: Path, workers: int, loud: Console) -> list[Record]:
    """The records of every job, or of those that were done before an interruption; what is wrong is told at once."""
    records: list[Record] = []
    with suppress(KeyboardInterrupt), Progress(console=loud, transient=True) as progress:
        task = progress.add_task("generality", total=len(todo))
        for made in run(todo, expose, kept, workers):
            records += made
            for each in made:
                if is_bad(summary([each])[each["part"]]):
                    progress.console.print(sentence(each), markup=False, soft_wrap=True)
            progress.advance(task)
    return records


def jobs(
    parts: Sequence[Part], scenes: int, seed: int, who: tuple[str, ...], *, quick: bool, naming: bool, side: int
) -> list[Job]:
    """Every job of ``parts``, in an order that makes any beginning of it a fair sample."""
    count = scenes or (QUICK if quick else SCENES)
    found: list[Job] = []
    for part in ("scenes", "features"):
        if part in parts:
            found += [Job(part, seed, index, who, naming, side) for index in range(count)]
    if "meshes" in parts:
        from notabug.bench.generality.meshes import mesh_names

        names = mesh_names()
        found += [Job("meshes", seed, k, who, naming, side, name) for k, name in enumerate(names)]
    if "faults" in parts:
        from notabug.bench.generality.faults import fault_jobs

        found += fault_jobs(min(count, FAULTS), seed, who, naming=naming, side=side)
    if "limitations" in parts:
        from notabug.bench.generality.limitations import limitation_jobs

        found += limitation_jobs(min(count, LIMITED), seed, naming=naming, side=side)
    if "exports" in parts:
        from notabug.bench.generality.exports import export_jobs

        found += export_jobs(who, seed, naming=naming, side=side)
    return found


def _show_exports(records: Sequence[Record]) -> None:
    """What was said of each export and of each fault in it, if exports are among the ``records``."""
    if not records:
        return
    head, *lines = table(records)
    shown = Table(*head, title="generality, exports and faults in them")
    for line in lines:
        shown.add_row(*line)
    console().print(shown)


def _show(found: Record) -> None:
    out = console()
    for part, numbers in found.items():
        table = Table("pictures by", *WORDS, title=f"generality, {part}")
        for name, row in numbers["words"].items():
            table.add_row(name, *(str(each) if each else "" for each in row.values()))
        out.print(table)
        for key, title in (
            ("false_bugs", "called a bug, of a renderer that was given nothing wrong"),
            ("controls_passed", "black or noise that passed"),
            ("tracebacks", "tracebacks"),
            ("errors", "errors"),
            ("missed", "faults that were not called a bug"),
            ("misnamed", "faults with another name"),
        ):
            for each in numbers.get(key, []):
                out.print(f"{title}: {sentence(each)}", markup=False, soft_wrap=True)
                if each.get("trace"):
                    out.print(each["trace"], markup=False, soft_wrap=True)
        for key, title in (("called_bug", "called a bug"), ("named_right", "named right")):
            if key in numbers and numbers[key]["of"]:
                share = numbers[key]
                out.print(f"{part}, {title}: {share['hits']} of {share['of']}, {100 * share['share']:.1f} %")
        for kind, times in numbers.get("judging", {}).items():
            told = ", ".join(f"{name} {taken:.2f} s" for name, taken in times.items())
            out.print(f"{part}, to judge and name a bug, {kind}: {told}")
