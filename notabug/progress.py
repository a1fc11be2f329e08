"""What a run shows while it goes on: a table that fills on a terminal, else one plain line a result."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from types import TracebackType
from typing import Any

from rich.console import Console, Group, RenderableType
from rich.live import Live
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table
from rich.text import Text

from notabug.metrics.verdict import GLYPH
from notabug.printable import SafeConsole
from notabug.record import Result
from notabug.words import STYLE, area, finding_names, number, strongest

_PLAIN = "default not bold"
SHOWN = 5  # jobs named for each state

# What to do about a state, worst first.
ADVICE = {
    "new": "",
    "grew": "",
    "expired": ": look again, then correct it or accept it anew",
    "models changed": ": accepted under other scenes or models of notabug, whose results differ; look at the report, "
    "then `notabug accept` them again or correct the renderer",
    "improved": ": accept the smaller band",
    "fixed": ": delete the entry",
    "as expected": "",
}


class Board:
    """Draws a run on ``console``; a ``Watcher`` and a context manager. ``done`` hears of each result too."""

    def __init__(self, console: Console, done: Callable[[Result], object]) -> None:
        self._console = console
        self._heard = done
        self._results: list[tuple[Result, bool]] = []
        self._bar = Progress(
            BarColumn(24),
            MofNCompleteColumn(),
            TimeElapsedColumn(),
            TextColumn("{task.description}", markup=False),
            console=console,
        )
        self._task = self._bar.add_task("", total=None)
        self._live: Live | None = None
        if console.is_terminal:
            self._live = Live(console=console, get_renderable=self._draw, refresh_per_second=8, transient=True)

    def __enter__(self) -> Board:
        if self._live is not None:
            self._live.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._live is not None:
            self._live.stop()

    def begin(self, jobs: int) -> None:
        self._bar.update(self._task, total=jobs)

    def start(self, scene: str, variant: str, renderer: str, stage: str) -> None:
        self._bar.update(self._task, description=f"{scene} {variant}  {renderer} {stage}")

    def done(self, result: Result, kept: bool) -> None:
        self._results.append((result, kept))
        self._bar.advance(self._task)
        self._heard(result)
        if self._live is None:
            self._console.print(_line(result, kept), soft_wrap=True)

    def _draw(self) -> RenderableType:
        room = max(3, self._console.height - 6)
        return Group(table([each for each, _ in self._results[-room:]]), self._bar)


def console(*, stderr: bool = False) -> Console:
    """A console; in a log, which has no width, lines are wide enough for the table."""
    made = SafeConsole(stderr=stderr, highlight=False)
    return made if made.is_terminal else SafeConsole(stderr=stderr, highlight=False, width=160)


def table(results: Sequence[Result]) -> Table:
    """The results as a table."""
    drawn = Table(box=None, header_style="bold", pad_edge=False, expand=False)
    drawn.add_column("scene", no_wrap=True)
    drawn.add_column("variant", overflow="fold")
    drawn.add_column("renderer", no_wrap=True)
    drawn.add_column("verdict", no_wrap=True)
    drawn.add_column("findings", overflow="fold")
    drawn.add_column("area px", justify="right", no_wrap=True)
    drawn.add_column("jnd", justify="right", no_wrap=True)
    drawn.add_column("s", justify="right", no_wrap=True)
    surprises = any(each.surprising for each in results)
    if surprises:
        drawn.add_column("expected", no_wrap=True)
    for each in results:
        cells = [
            Text(each.scene),
            Text(each.variant),
            Text(each.renderer),
            verdict_text(each),
            Text(finding_names(each)),
            Text(number(round(area(each), 1)) if each.verdict.findings else ""),
            Text(number(strongest(each), 2) if each.verdict.findings else ""),
            Text(f"{sum(each.seconds.get(key, 0.0) for key in ('render', 'judge')):.2f}"),
        ]
        if surprises:
            cells.append(Text(each.expected if each.surprising else "", style="bold"))
        drawn.add_row(*cells)
    return drawn


def messages(results: Sequence[Result]) -> list[Text]:
    """What is not well and why: a line for each result, one for all variants of which the same is to be said."""
    same: dict[tuple[str, str, str], list[Result]] = {}
    for each in results:
        if each.verdict.message and each.verdict.word not in ("pass", "limitation"):
            same.setdefault((each.scene, each.renderer, each.verdict.message), []).append(each)
    return [
        verdict_text(found[0])
        .append(
            f"  {scene} {found[0].variant if len(found) == 1 else f'({len(found)} variants)'}".rstrip(), style=_PLAIN
        )
        .append(f" {renderer}: {message}", style=_PLAIN)
        for (scene, renderer, message), found in same.items()
    ]


def states(results: Sequence[Result], gate: Mapping[str, Any]) -> list[Text]:
    """What became of what was accepted, a state a line, those that fail first; what to do where it is not plain."""
    lines = []
    for state, advice in ADVICE.items():
        found = [each for each in results if each.state == state and (each.because or state == "new")]
        if found:
            style = "bold red" if any(each.fails for each in found) else "default"
            named = "; ".join(" ".join(x for x in (e.scene, e.variant, e.renderer) if x) for e in found[:SHOWN])
            more = f"; and {len(found) - SHOWN} more" if len(found) > SHOWN else ""
            lines.append(Text(f"{state}: {len(found)}", style=style).append(f"  {named}{more}{advice}", style=_PLAIN))
    if gate["unused"]:
        lines.append(Text(f"unused: {len(gate['unused'])} entries of {gate['file']} met no result of this run", "dim"))
    return lines


def verdict_text(result: Result) -> Text:
    word = result.verdict.word
    return Text(f"{GLYPH[word]} {word}", style=STYLE[word])


def _line(result: Result, kept: bool) -> Text:
    """One result as one line, for logs."""
    parts = [result.scene, result.variant, result.renderer]
    line = Text(" ".join(part for part in parts if part) + "  ").append_text(verdict_text(result))
    if result.verdict.findings:
        line.append(f"  {finding_names(result)} (area {number(round(area(result), 1))} px)")
    if result.verdict.message and result.verdict.word not in ("pass", "limitation"):
        line.append(f"  {result.verdict.message}")
    if result.surprising:
        line.append(f"  expected {result.expected}", style="bold")
    if kept:
        line.append("  kept", style="dim")
    return line
