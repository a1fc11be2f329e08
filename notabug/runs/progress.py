"""What a run shows while it goes on and when it has ended: lines that fit, and a table where there is room for it."""

from __future__ import annotations

import os
import shlex
import textwrap
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from types import TracebackType
from typing import Literal

from rich.console import Console, RenderableType
from rich.live import Live
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table
from rich.text import Text

from notabug.metrics.verdict import GLYPH
from notabug.printable import SafeConsole
from notabug.results.alike import alike, kind
from notabug.results.document import GateSaid
from notabug.results.gate import NOT_CALIBRATED, OF_FILES
from notabug.results.record import Result
from notabug.results.wording import STYLE, area, finding_names, number, strongest

_PLAIN = "default not bold"
SHOWN = 5  # jobs named for each state
NARROWEST = 20  # columns that COLUMNS may say: below them no name has room
LOG_WIDTH = 160  # columns of a log, which has no width of its own
BAR = 36  # columns that the bar, its count and its clock take
WORD = 15  # columns of a glyph and the longest verdict
INDENT = 4  # columns before what is said below a result
SHORTEST = 12  # columns that a name is left with, whatever else there is
FOLDED = 24  # columns that variants and findings keep in a table at least
NUMBERS = 40  # columns of a table's verdict, area, jnd, seconds, and of the gaps between its columns

Detail = Literal["quiet", "normal", "verbose"]
Key = tuple[str, str, str]  # of a result: its scene, its variant as it is told, its renderer

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
    """Draws a run on ``console``; a ``Watcher`` and a context manager. ``done`` hears of each result too.

    In a log each result is a line. On a terminal a bar tells how far it is, and above it stands what is not well: the
    rest is told at the end.
    """

    def __init__(
        self,
        console: Console,
        done: Callable[[Result], object],
        detail: Detail = "normal",
        note: str = "",
        brief: frozenset[str] = frozenset(),
    ) -> None:
        """``note`` is told at the beginning; scenes of ``brief`` are named without their variants."""
        self._console = console
        self._heard = done
        self._detail = detail
        self._note = note
        self._brief = brief
        self._shown: set[Key] = set()
        self._told: set[tuple[str, str, str]] = set()
        self._bar = Progress(
            BarColumn(12),
            MofNCompleteColumn(),
            TimeElapsedColumn(),
            TextColumn("{task.description}", markup=False),
            console=console,
        )
        self._task = self._bar.add_task("", total=None)
        self._live: Live | None = None
        if console.is_terminal and detail != "quiet":
            self._live = Live(console=console, get_renderable=lambda: self._bar, refresh_per_second=8, transient=True)

    def __enter__(self) -> Board:
        if self._live is not None:
            self._live.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._live is not None:
            self._live.stop()

    @property
    def shown(self) -> frozenset[Key]:
        """The results of which all was printed: a line, and the message."""
        return frozenset(self._shown)

    def begin(self, jobs: int) -> None:
        self._bar.update(self._task, total=jobs)
        if self._note and self._detail != "quiet":
            self._console.print(Text(self._note, style="dim"), soft_wrap=True)

    def start(self, scene: str, variant: str, renderer: str, stage: str) -> None:
        room = max(12, self._console.width - BAR)
        self._bar.update(self._task, description=shortened(f"{scene} {renderer} {stage} {variant}".rstrip(), room))

    def done(self, result: Result, kept: bool) -> None:
        self._bar.advance(self._task)
        self._heard(result)
        word = result.verdict.word
        if self._detail == "quiet" or (self._detail == "normal" and not self._worth_a_line(result)):
            return
        if result.scene in self._brief:
            result = replace(result, variant="")
        blamed = "" if OF_FILES in result.verdict.triggers else result.renderer
        same = (blamed, word, kind(result.verdict.message, result.scene))
        known = same in self._told
        self._told.add(same)
        told = not known or self._detail == "verbose"
        if told or word in ("pass", "limitation"):  # whose line is all that is said of them
            self._shown.add(key_of(result))
        for text in lines(result, self._console.width, kept=kept, told=told):
            self._console.print(text, soft_wrap=True)

    def _worth_a_line(self, result: Result) -> bool:
        word = result.verdict.word
        if NOT_CALIBRATED in result.verdict.triggers:  # told once at the end: nothing of it was drawn
            return False
        return word != "unsupported" if self._live is None else word in ("bug", "error") or result.fails


def console(*, stderr: bool = False) -> Console:
    """A console; a log has the width that COLUMNS says, else lines are wide enough for the table."""
    made = SafeConsole(stderr=stderr, highlight=False)
    if made.is_terminal:
        return made
    said = os.environ.get("COLUMNS", "")
    width = int(said) if said.isascii() and said.isdecimal() and int(said) >= NARROWEST else LOG_WIDTH
    return SafeConsole(stderr=stderr, highlight=False, width=width)


def key_of(result: Result) -> Key:
    return (result.scene, result.variant, result.renderer)


def shortened(text: str, room: int) -> str:
    """``text`` in ``room`` columns, its middle left out where it is longer.

    >>> shortened("terminator/sphere tessellation=24x12", 20)
    'terminator…ion=24x12'
    """
    if len(text) <= room:
        return text
    if room < 3:
        return text[:room]
    head = room // 2
    return f"{text[:head]}…{text[len(text) - (room - head - 1) :]}"


def lines(result: Result, width: int, *, kept: bool = False, told: bool = True) -> list[Text]:
    """One result in ``width`` columns: a line that names it, and below it what was found or why not, where ``told``."""
    verdict = result.verdict
    name = " ".join(part for part in (result.scene, result.variant) if part)
    tail = ""
    if verdict.findings:
        tail = f"  {number(round(area(result), 1))} px, jnd {number(strongest(result), 2)}"
    tail += "  kept" if kept else ""
    other = f"expected {result.expected}" if result.surprising else ""
    head = verdict_text(result)
    head.append(" " * max(1, WORD - len(head.plain)) + f"{result.renderer}  ", style=_PLAIN)
    room = width - len(head.plain)
    here = bool(other) and len(name) + len(tail) + 2 + len(other) <= room  # else it has a line of its own
    tail += f"  {other}" if here else ""
    if len(name) + len(tail) > room:  # the name may be shortened, what is said of it may not
        name = shortened(name, max(SHORTEST, room - len(tail)))
    made = [head.append(name, style=_PLAIN).append(tail, style="bold" if result.surprising else _PLAIN)]
    below = [finding_names(result)]
    if told and verdict.message and verdict.word not in ("pass", "limitation"):
        below += verdict.message.splitlines()
    below += [other] if not here else []
    for line in below:
        folded = textwrap.wrap(line, max(SHORTEST, width - INDENT), break_long_words=False, break_on_hyphens=False)
        made += [Text(" " * INDENT + part) for part in folded]
    return made


def fits(results: Sequence[Result], width: int) -> bool:
    """Whether a table of ``results`` has room in ``width`` columns: names whole, findings in at least FOLDED."""
    widest = [0] * 4
    for result in results:
        parts = (result.scene, result.renderer, result.variant, finding_names(result))
        widest = [max(most, len(part)) for most, part in zip(widest, parts, strict=True)]
    scene, renderer, variant, found = widest
    expected = max((len(result.expected) for result in results if result.surprising), default=0)
    return scene + max(8, renderer) + min(variant, FOLDED) + min(found, FOLDED) + expected + NUMBERS <= width


def listing(results: Sequence[Result], console: Console, detail: Detail = "normal") -> list[RenderableType]:
    """The results as ``console`` has room for them; ``quiet``: only what fails. What is unsupported is only counted."""
    shown = [
        result
        for result in results
        if detail == "verbose" or (result.fails if detail == "quiet" else result.verdict.word != "unsupported")
    ]
    if not shown:
        return []
    if detail == "normal" and fits(shown, console.width):
        return [table(shown), Text("")]
    verbose = detail == "verbose"
    made: list[RenderableType] = []
    for result in shown:
        made += lines(result, console.width, told=verbose)
        if verbose:
            extra = (" ".join(result.renderer_command), result.command)
            made += [Text(" " * INDENT + each, style="dim") for each in extra if each]
    return [*made, Text("")]


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
    surprises = any(result.surprising for result in results)
    if surprises:
        drawn.add_column("expected", no_wrap=True)
    for result in results:
        cells = [
            Text(result.scene),
            Text(result.variant),
            Text(result.renderer),
            verdict_text(result),
            Text(finding_names(result)),
            Text(number(round(area(result), 1)) if result.verdict.findings else ""),
            Text(number(strongest(result), 2) if result.verdict.findings else ""),
            Text(f"{sum(result.seconds.get(key, 0.0) for key in ('render', 'judge')):.2f}"),
        ]
        if surprises:
            cells.append(Text(result.expected if result.surprising else "", style="bold"))
        drawn.add_row(*cells)
    return drawn


def causes(results: Sequence[Result], out: Path | None = None) -> tuple[list[Text], frozenset[Key]]:
    """The lines of ``messages`` that tell of several results at once, and these results."""
    found = _messages(results, out)
    several = [(line, same) for line, same in found if len(same) > 1]
    return [line for line, _ in several], frozenset(key_of(result) for _, same in several for result in same)


def messages(results: Sequence[Result], out: Path | None = None) -> list[Text]:
    """What is not well and why: of what one renderer makes alike one line, with a count.

    ``out`` is the run's folder, in which the logs lie.
    """
    return [line for line, _ in _messages(results, out)]


def _messages(results: Sequence[Result], out: Path | None) -> list[tuple[Text, Sequence[Result]]]:
    made: list[tuple[Text, Sequence[Result]]] = []
    bugs: dict[tuple[str, str], list[Result]] = {}
    others = []
    for result in results:
        if result.verdict.word in ("pass", "limitation") or not result.verdict.message:
            continue
        if result.verdict.word == "bug":
            bugs.setdefault((result.renderer, result.verdict.message), []).append(result)
        else:
            others.append(result)
    for (renderer, message), found in bugs.items():
        scenes = list(dict.fromkeys(result.scene for result in found))
        variant = found[0].variant if len(found) == 1 else f"({len(found)} variants)"
        where = " ".join(part for part in (scenes[0], variant, renderer) if part)
        if len(scenes) > 1:
            more = f" and {len(scenes) - SHOWN} more" if len(scenes) > SHOWN else ""
            where = f"{renderer}: {len(scenes)} scenes ({', '.join(scenes[:SHOWN])}{more})"
        under = f"; {found[0].under}" if found[0].under else ""
        made.append((verdict_text(found[0]).append(f"  {where}: {message}{under}", style=_PLAIN), found))
    for same in alike(others):
        count = len(same.results)
        one = " ".join(part for part in (same.first.scene, same.first.variant) if part)
        many = {"error": f"{count} jobs failed alike", "unsupported": f"{count} scenes"}
        what = one if count == 1 else many.get(same.first.verdict.word, f"{count} alike")
        who = same.renderers
        said = f"  {', '.join(who)}: {what}: {same.told}"
        if NOT_CALIBRATED in same.first.verdict.triggers:
            said += f"; until that is gone nothing of it is judged: see `notabug calibrate -r {shlex.quote(who[0])}`"
        if count > 1 and same.logs and out is not None and str(out / same.logs[0]) not in said:
            said += f"; log: {out / same.logs[0]}"
        made.append((verdict_text(same.first).append(said, style=_PLAIN), same.results))
    return made


def states(results: Sequence[Result], gate: GateSaid) -> list[Text]:
    """What became of what was accepted, a state a line, those that fail first; what to do where it is not plain."""
    lines = []
    for state, advice in ADVICE.items():
        if state == "new" and not gate["file"]:
            continue  # nobody has said what is known: that it is not expected is in the counts
        found = [result for result in results if result.state == state and (result.because or state == "new")]
        if found:
            style = "bold red" if any(each.fails for each in found) else "default"
            named = "; ".join(" ".join(x for x in (e.scene, e.variant, e.renderer) if x) for e in found[:SHOWN])
            more = f"; and {len(found) - SHOWN} more" if len(found) > SHOWN else ""
            name = f"not in {gate['file']}" if state == "new" else state
            lines.append(Text(f"{name}: {len(found)}", style=style).append(f"  {named}{more}{advice}", style=_PLAIN))
    if gate["unused"]:
        lines.append(Text(f"unused: {len(gate['unused'])} entries of {gate['file']} met no result of this run", "dim"))
    return lines


def verdict_text(result: Result) -> Text:
    word = result.verdict.word
    return Text(f"{GLYPH[word]} {word}", style=STYLE[word])
