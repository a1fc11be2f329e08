"""The ``diff`` command: what changed from one run to a later one, worst first."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from pathlib import Path

from rich.table import Table
from rich.text import Text

from notabug.exit_codes import ExitCode
from notabug.printable import escaped
from notabug.results.record import Result, load
from notabug.results.wording import STYLE, area, finding_names, number, strongest
from notabug.runs.progress import console

RANK = {"pass": 0, "limitation": 1, "unsupported": 2, "inconclusive": 3, "error": 4, "bug": 5}
SAME = 1e-3  # relative: area and jnd that differ by less are the same, whatever the file's rounding


@dataclass(frozen=True, slots=True)
class Change:
    """One job of two runs; a side that lacks it has the verdict ""."""

    scene: str
    variant: str
    renderer: str
    before: str
    after: str
    names_before: str
    names_after: str
    area_px: tuple[float, float]
    jnd: tuple[float, float]

    @property
    def steps(self) -> int:
        """How many ranks worse; a job that is new or gone counts from a pass."""
        return RANK.get(self.after, 0) - RANK.get(self.before, 0)

    @property
    def worse(self) -> bool:
        """Another verdict of a worse kind, another name, or more of the same."""
        if not self.before or not self.after:
            return self.after in ("bug", "error")
        grown = any(_grown(*each) for each in (self.area_px, self.jnd)) or self.names_before != self.names_after
        return self.steps > 0 or (self.steps == 0 and self.after in ("limitation", "bug") and grown)


def compare(before: list[Result], after: list[Result]) -> list[Change]:
    """The jobs whose verdict, names, area or jnd changed, worst first."""
    sides = [{(each.scene, each.variant, each.renderer): each for each in results} for results in (before, after)]
    changes = [_change(key, sides[0].get(key), sides[1].get(key)) for key in sides[0] | sides[1]]
    changed = [each for each in changes if _changed(each)]
    return sorted(
        changed,
        key=lambda each: (
            *(not each.worse, -each.steps, each.area_px[0] - each.area_px[1]),
            *(each.scene, each.variant, each.renderer),
        ),
    )


def command(before: Path, after: Path, as_json: bool) -> ExitCode:
    """Print the changes from ``before`` to ``after``; BUG where one is for the worse."""
    runs = [[Result.from_dict(each) for each in load(folder)["results"]] for folder in (before, after)]
    changes = compare(*runs)
    if as_json:
        print(
            escaped(
                json.dumps({"changes": [asdict(each) | {"worse": each.worse} for each in changes]}, ensure_ascii=False)
            )
        )
    elif changes:
        console().print(_table(changes))
    worse = sum(each.worse for each in changes)
    if not as_json:
        same = len({(each.scene, each.variant, each.renderer) for run in runs for each in run}) - len(changes)
        console().print(f"{worse} worse, {len(changes) - worse} otherwise changed, {same} the same")
    return ExitCode.BUG if worse else ExitCode.OK


def _change(key: tuple[str, str, str], before: Result | None, after: Result | None) -> Change:
    scene, variant, renderer = key
    return Change(
        *(scene, variant, renderer),
        before.verdict.word if before else "",
        after.verdict.word if after else "",
        finding_names(before) if before else "",
        finding_names(after) if after else "",
        (area(before) if before else 0.0, area(after) if after else 0.0),
        (strongest(before) if before else 0.0, strongest(after) if after else 0.0),
    )


def _changed(each: Change) -> bool:
    other = (each.before, each.names_before) != (each.after, each.names_after)
    return other or any(_grown(a, b) or _grown(b, a) for a, b in (each.area_px, each.jnd))


def _grown(before: float, after: float) -> bool:
    return after - before > SAME * max(abs(before), abs(after))


def _table(changes: list[Change]) -> Table:
    drawn = Table(box=None, header_style="bold", pad_edge=False)
    for name in ("", "scene", "variant", "renderer", "verdict", "findings", "area px", "jnd"):
        drawn.add_column(name, overflow="fold")
    for each in changes:
        names = dict.fromkeys((each.names_before or "–", each.names_after or "–"))
        drawn.add_row(
            Text("worse" if each.worse else "", style="bold red"),
            *(Text(part) for part in (each.scene, each.variant, each.renderer)),
            Text(f"{each.before or 'none'} → {each.after or 'none'}", style=STYLE.get(each.after, "")),
            Text(" → ".join(names)),
            Text(" → ".join(number(round(part, 1)) for part in each.area_px)),
            Text(" → ".join(number(part, 2) for part in each.jnd)),
        )
    return drawn
