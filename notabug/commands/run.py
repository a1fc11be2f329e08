"""The ``run`` command: from words to a plan, the board, the summary, the report and an exit code."""

from __future__ import annotations

import contextlib
import json
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from rich.console import Console
from rich.text import Text

from notabug.adapters.base import Quality
from notabug.adapters.registry import adapter, adapters
from notabug.ending import Stopped, exit_state
from notabug.exit_codes import ExitCode
from notabug.printable import escaped
from notabug.report.drawing import Pictures
from notabug.report.page import draw
from notabug.results.gate import FailOn, Gate, code_of
from notabug.results.record import load
from notabug.results.wording import counted, duration, tally
from notabug.runs import workarounds
from notabug.runs.folders import write_json
from notabug.runs.plan import Plan, find_renderers
from notabug.runs.progress import Board, Detail, console, listing, messages, states
from notabug.runs.run import Run, run
from notabug.runs.selection import OWN_FOLDER, Choice, NothingSelectedError, choose, parse_variants, part, quick
from notabug.runs.workers import Alone, ClusterLostError, crew
from notabug.scenes_usd.errors import ManyFaultsError, NotabugError, SceneError, SelectionError
from notabug.scenes_usd.own import take_scene
from notabug.scenes_usd.view import AS_IT_IS, View

FIRST = 1.5  # seconds that a job takes the first time, on two cores: the 125 of the default run take 3 minutes
LONG = 20.0  # seconds: of a run that is shorter nobody need know how long it takes


def command(
    *,
    scenes: Sequence[str],
    renderers: Sequence[str],
    variants: Sequence[str],
    view: View = AS_IT_IS,
    every_variant: bool,
    out: Path,
    samples: int,
    seeds: int,
    timeout: float,
    require: Sequence[str],
    resume: bool,
    as_json: bool,
    remedies: bool = False,
    expect: Path | None = None,
    fail_on: FailOn = "any",
    jobs: int = 0,
    executor: str = "",
    shard: str = "",
    baseline: Path | None = None,
    detail: Detail = "normal",
    few: bool = False,
) -> ExitCode:
    """Run the selection and print what came of it; ``remedies``: with and without the workarounds of it."""
    quiet = console(stderr=True)
    if baseline is not None:
        load(baseline)  # before anything is drawn for a folder that holds no run
    gate = Gate.load(expect, fail_on)
    selected = workarounds.chosen(scenes) if remedies else []
    if remedies and (variants or every_variant or view.words):
        left = "leave --variant, --variants, --camera, --time and --purpose out"
        raise SelectionError("workarounds choose their pictures themselves", do=left)
    choices = (
        workarounds.choices(selected)
        if remedies
        else choose(scenes, parse_variants(variants), every_variant=every_variant, view=view)
    )
    choices = part(quick(choices) if few else choices, shard)
    choices = _read_own(choices, quiet)
    asked = {name: adapter(name) for name in dict.fromkeys(renderers)} if renderers else adapters()
    required = {name: adapter(name) for name in require}

    def note(name: str, why: str) -> None:
        quiet.print(Text(f"{name}: not installed, left out. {why}", style="yellow"), soft_wrap=True)

    found, missing = find_renderers(asked, note)
    for name, each in required.items():
        if name not in found:
            each.find()  # raises with the way to install it
    if not found:
        raise NothingSelectedError("no renderer is installed", do="see `notabug doctor`")
    # The settings of workarounds alter adapters by functions that exist in this process only.
    at_work, threads = (Alone(), 0) if remedies else crew(executor, jobs, len(choices) * len(found))
    plan = Plan(
        choices=choices,
        renderers=found,
        out=out,
        quality=Quality(samples=samples, seeds=tuple(range(seeds)), timeout=timeout, threads=threads),
        resume=resume,
        missing=missing,
        command=["notabug", *sys.argv[1:]],
        gate=gate,
        crew=at_work,
        shard=shard,
    )
    pictures = Pictures(out)
    try:
        with Board(quiet, pictures.begin, detail, _beginning(plan)) as board:
            state = run(plan, board)
    except (KeyboardInterrupt, Stopped, ClusterLostError) as error:
        with contextlib.suppress(NotabugError, OSError):  # the record is what counts, and it is there
            draw(out, pictures=pictures)
        if isinstance(error, ClusterLostError):
            raise
        quiet.print(
            f"stopped; finished results stay in {out} and the same command goes on from there",
            markup=False,
            soft_wrap=True,
        )
        raise SystemExit(exit_state(error)) from None
    found_rows = workarounds.rows(selected, state.results)
    document = state.document()
    if remedies:
        document["workarounds"] = [each.as_dict() for each in found_rows]
        write_json(out / "run.json", document)
    page = draw(out, pictures=pictures, baseline=baseline)
    if as_json:
        print(escaped(json.dumps(document, ensure_ascii=False, allow_nan=False)))
    elif remedies:
        console().print(workarounds.table(found_rows))
    else:
        _summary(console(), state, page, detail)
    return workarounds.code_of(found_rows, state.results) if remedies else code_of(state.results)


def _read_own(choices: Sequence[Choice], quiet: Console) -> list[Choice]:
    """The ``choices`` with the scenes of a team's own read, once for all renderers, before anything is drawn.

    Told is how each was adapted, and all that takes it out of the contract; that is raised where it leaves nothing to
    draw. A camera, a frame or a variant that a scene lacks is a SelectionError, which says what there is.
    """
    read: list[Choice] = []
    faults: list[SceneError] = []
    for choice in choices:
        own = choice.folder.startswith(OWN_FOLDER)
        if choice.refused or not (own or choice.view.words):
            read.append(choice)
            continue
        try:
            taken = take_scene(choice.source, choice.variants, choice.view)
        except SceneError as error:
            faults += error.errors if isinstance(error, ManyFaultsError) else (error,)
            read.append(replace(choice, refused=str(error)))
            continue
        if taken.says:
            quiet.print(Text(taken.told(choice.source)), soft_wrap=True)
        read.append(replace(choice, scene=taken.scene if own else None))
    if faults and all(choice.refused for choice in read):
        raise ManyFaultsError(tuple(faults)) if len(faults) > 1 else faults[0]
    for fault in faults:
        quiet.print(Text(f"notabug: {fault}", style="bold red"), soft_wrap=True)
    return read


def _beginning(plan: Plan) -> str:
    """What a run is about to do."""
    names = ", ".join(plan.renderers)
    jobs = sum(len(plan.wanted(choice)) for choice in plan.choices)
    first = not (plan.out / "run.json").is_file()
    known = f"; the first run takes {duration(jobs * FIRST)} on two idle cores, later ones keep what is finished"
    takes = known if first and jobs * FIRST >= LONG else ""
    what = f"{counted(len(plan.choices), 'scene')}, {counted(jobs, 'job')}"
    return f"rendering and judging {what} with {names}; results go to {plan.out}{takes}"


def _summary(out: Console, state: Run, page: Path, detail: Detail) -> None:
    for drawn in listing(state.results, out, detail):
        out.print(drawn, soft_wrap=isinstance(drawn, Text))
    told = [result for result in state.results if result.fails] if detail == "quiet" else state.results
    for line in messages(told, state.plan.out):
        out.print(line, soft_wrap=True)
    for line in [] if detail == "quiet" else states(state.results, state.plan.gate.document(state.results)):
        out.print(line, soft_wrap=True)
    out.print(Text(tally(result.verdict.word for result in state.results), style="bold"))
    if detail == "quiet":
        return
    surprises = sum(result.surprising for result in state.results)
    if surprises:
        out.print(f"{surprises} other than expected")
    seconds = state.document()["seconds"]
    share = seconds["outside"] / seconds["total"] if seconds["total"] else 0.0
    at_once = state.plan.crew.at_once
    out.print(
        f"{seconds['total']:.1f} s, of which {seconds['render']:.1f} s in renderers and {share:.0%} outside of them"
        f"{f', {at_once} jobs at once' if at_once > 1 else ''}"
    )
    out.print(f"{state.plan.out / 'run.json'}\n{page}", markup=False, soft_wrap=True)
