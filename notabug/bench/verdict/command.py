"""``notabug bench verdict``: expose the design, print the numbers, write JSON and plots."""

from __future__ import annotations

import json
import time
from contextlib import suppress
from pathlib import Path
from typing import Any

from rich.progress import Progress
from rich.table import Table

from notabug.bench.verdict.design import FULL, QUICK, groups
from notabug.bench.verdict.evaluate import expose
from notabug.bench.verdict.renderers import expose_renderer, renderer_groups
from notabug.bench.verdict.run import Record, folder, run
from notabug.bench.verdict.summary import OURS, summary
from notabug.exit_codes import ExitCode
from notabug.results.record import json_ready
from notabug.runs.folders import write_json
from notabug.runs.progress import console
from notabug.runs.provenance import tool


def command(*, quick: bool, as_json: bool, out: Path) -> ExitCode:
    """Run what is not there yet, and report each side of the split; exit 1 where a clean picture was called a bug.

    Interrupted it reports what there is: any beginning of the design is a fair sample of it.
    """
    size = QUICK if quick else FULL
    begun = time.perf_counter()
    records: list[Record] = []
    design = (("in-house", groups(size), expose), ("renderers", renderer_groups(size), expose_renderer))
    drawn = [0, sum(len(found) for _, found, _ in design)]
    with suppress(KeyboardInterrupt), Progress(console=console(stderr=True), transient=True) as progress:
        for title, found, work in design:
            task = progress.add_task(title, total=len(found))
            for made in run(found, work, folder()):
                records += made
                drawn[0] += 1
                progress.advance(task)
    document: dict[str, Any] = {
        "tool": tool(),
        "size": size.name,
        "pixels": size.side,
        "seconds": time.perf_counter() - begun,
        "pictures": len(records),
        "groups": drawn,
        "sides": {side: summary([r for r in records if r["side"] == side]) for side in size.sides},
    }
    out.mkdir(parents=True, exist_ok=True)
    write_json(out / "verdict.json", document)
    write_json(out / "records.json", {"records": json_ready(records)})
    if as_json:
        print(json.dumps(document, ensure_ascii=False, allow_nan=False))
    else:
        for side in size.sides:
            _show(side, document["sides"][side])
        line = f"{len(records)} pictures judged, {drawn[0]} of {drawn[1]} groups, {document['seconds']:.0f} s"
        console().print(line, markup=False)
    _plots(out, document)
    alarms = document["sides"]["evaluation"]["clean_called_bug"]["hits"]
    return ExitCode.BUG if alarms else ExitCode.OK


def _plots(out: Path, document: Record) -> None:
    try:
        from notabug.bench.verdict.plots import draw
    except ImportError:
        console(stderr=True).print("no plots: pip install 'notabug[bench]' for matplotlib", markup=False)
        return
    for path in draw(out, document):
        console(stderr=True).print(str(path), markup=False, soft_wrap=True)


def _show(side: str, found: Record) -> None:
    matrix = Table("label", *found["confusion"]["clean"], title=f"{side}: our word for each label")
    for label, row in found["confusion"].items():
        matrix.add_row(label, *(str(each) for each in row.values()))
    console().print(matrix)
    rates = Table("what", "share", "of", "95 %", "asked", title=f"{side}: rates")
    for key, title, asked in (
        ("bugs_missed", "bugs missed", "at most 0.5 %"),
        ("limitations_called_bug", "limitations called bug", "at most 1 %"),
        ("clean_called_bug", "clean pictures called bug", "none"),
        ("limitations_named", "limitations named right", "at least 97 %"),
        ("faults_named", "faults named right", "at least 85 %"),
    ):
        rates.add_row(title, *_cells(found[key]), asked)
    for name, each in found["must"].items():
        rates.add_row(f"found: {name}, 16 samples x 4", *_cells(each), "all")
    console().print(rates)
    gates = Table(
        "judge", "AUC", "AUC, clean", "best threshold", "missed", "limitations", "clean", title=f"{side}: judges"
    )
    first, *rest = found["judges"]
    for row in (first, *sorted(rest, key=lambda each: -(each["auc"] or 0.0))):
        cells = (
            row.get(key) for key in ("auc", "auc_clean", "best", "missed", "limitations_called_bug", "clean_called_bug")
        )
        style = "bold" if row["name"] == OURS else ""
        gates.add_row(row["name"], *("-" if cell is None else f"{cell:.3f}" for cell in cells), style=style)
    console().print(gates)
    alarms = Table("condition", "false alarms per 1,000", "of", title=f"{side}: clean pictures")
    for name, each in found["false_alarms"].items():
        alarms.add_row(name, f"{1000 * (each['share'] or 0.0):.1f}", str(each["of"]))
    console().print(alarms)
    steps = found["sequential"]
    if steps["pictures"]:
        console().print(
            f"sequential: median {steps['median_samples']:,.0f} samples a picture, fixed budget {steps['budget']:,}; "
            f"{100 * steps['right']['share']:.1f} % right of {steps['pictures']}",
            markup=False,
        )


def _cells(each: Record) -> tuple[str, str, str]:
    if each["share"] is None:
        return "-", "0", "-"
    low, high = each["interval"]
    return f"{100 * each['share']:.2f} %", str(each["of"]), f"{100 * low:.1f} to {100 * high:.1f} %"
