"""What ``run`` prints at its end: causes that several results share, the results that none covers, and the counts."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path

from rich.console import Console
from rich.text import Text

from notabug.results import conformance
from notabug.results.record import Result
from notabug.results.wording import tally
from notabug.runs.progress import Detail, Key, causes, key_of, listing, messages, states
from notabug.runs.run import Run
from notabug.runs.selection import Choice


def summary(out: Console, state: Run, page: Path, detail: Detail, shown: frozenset[Key]) -> None:
    """Print what came of the run. ``shown`` are the results that stand above it already, each with its message."""
    results = named_briefly(state.results, state.plan.choices)
    told = [result for result in results if result.fails] if detail == "quiet" else results
    groups, covered = causes(told, state.plan.out)
    for line in groups:
        out.print(line, soft_wrap=True)
    again = detail == "verbose"
    single = [result for result in results if again or key_of(result) not in covered | shown]
    for drawn in listing(single, out, detail):
        out.print(drawn, soft_wrap=isinstance(drawn, Text))
    features = conformance.rows(result.as_dict() for result in state.results)
    if features and detail != "quiet":
        out.print(conformance.table(features))
    for line in messages([result for result in told if key_of(result) not in covered | shown], state.plan.out):
        out.print(line, soft_wrap=True)
    for line in [] if detail == "quiet" else states(results, state.plan.gate.document(state.results)):
        out.print(line, soft_wrap=True)
    out.print(Text(counts(state.results, detail), style="bold"), soft_wrap=True)
    if detail == "quiet":
        return
    seconds = state.document()["seconds"]
    share = seconds["outside"] / seconds["total"] if seconds["total"] else 0.0
    at_once = state.plan.workers.at_once
    together = f", {at_once} jobs at once" if at_once > 1 else ""
    out.print(
        f"{seconds['total']:.1f} s{together}: {1.0 - share:.0%} in renderers, {share:.0%} in judging and all else"
    )
    out.print(f"{state.plan.out / 'run.json'}\n{page}", markup=False, soft_wrap=True)


def counts(results: Sequence[Result], detail: Detail = "normal") -> str:
    """The verdicts in numbers, and how many of them nobody expected: no table of a scene, no entry of a team."""
    line = tally(result.verdict.word for result in results)
    surprises = [result for result in results if result.surprising or result.state == "new"]
    if not surprises or detail == "quiet":
        return line
    words = {result.verdict.word for result in surprises}
    if len(surprises) == sum(result.verdict.word in words for result in results):  # no number is told twice
        return ", ".join(f"{part} (not expected)" if part.split()[1] in words else part for part in line.split(", "))
    return f"{line}; {len(surprises)} not expected"


def one_picture(choices: Iterable[Choice]) -> frozenset[str]:
    """The scenes of which a run draws one picture, the default one: nothing is to be told apart by a variant's name."""
    found: dict[str, list[Choice]] = {}
    for choice in choices:
        found.setdefault(choice.id, []).append(choice)
    return frozenset(name for name, same in found.items() if len(same) == 1 and not same[0].variant)


def named_briefly(results: Sequence[Result], choices: Iterable[Choice]) -> list[Result]:
    """``results`` as people are told of them: without the variant where the scene has one picture, the default one."""
    plain = one_picture(choices)
    return [replace(result, variant="") if result.scene in plain else result for result in results]


def one_place() -> bool:
    """Whether standard output and standard error are read together: what the one says, the other need not."""
    try:
        out, err = (os.fstat(stream.fileno()) for stream in (sys.stdout, sys.stderr))
    except (OSError, ValueError, AttributeError):
        return False
    return (out.st_dev, out.st_ino) == (err.st_dev, err.st_ino)
