"""The ``run`` command: from words to a plan, the board, the summary, the report and an exit code."""

from __future__ import annotations

import contextlib
import json
import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from rich.console import Console
from rich.text import Text

from notabug.adapters.base import Quality
from notabug.adapters.command import Command
from notabug.adapters.registry import adapter, adapters
from notabug.commands.summary import one_picture, one_place, summary
from notabug.ending import Stopped, exit_state
from notabug.exit_codes import ExitCode
from notabug.printable import escaped
from notabug.references.workarounds.workaround import Workaround
from notabug.report.drawing import Pictures
from notabug.report.page import draw
from notabug.results.gate import FailOn, Gate, code_of
from notabug.results.record import load
from notabug.results.wording import counted, duration
from notabug.runs import workarounds
from notabug.runs.folders import write_json
from notabug.runs.plan import Plan, find_renderers, left_out
from notabug.runs.progress import Board, Detail, Key, console
from notabug.runs.run import Run, run
from notabug.runs.selection import OWN_FOLDER, Choice, NothingSelectedError, choose, parse_variants, part, quick
from notabug.runs.workers import Alone, ClusterLostError, workers_for
from notabug.scenes_usd.errors import ManyFaultsError, NotabugError, SceneError, SelectionError
from notabug.scenes_usd.own import take_scene
from notabug.scenes_usd.view import AS_IT_IS, View

FIRST = 1.5  # seconds that a job takes the first time, on two cores: the 125 of the default run take 3 minutes
LONG = 20.0  # seconds: of a run that is shorter nobody need know how long it takes


@dataclass(frozen=True, slots=True, kw_only=True)
class Asked:
    """What the words of the command line ask for; ``remedies``: with and without the workarounds of the scenes."""

    scenes: Sequence[str]
    renderers: Sequence[str]
    variants: Sequence[str]
    view: View = AS_IT_IS
    every_variant: bool = False
    out: Path
    samples: int
    seeds: int
    timeout: float
    require: Sequence[str] = ()
    resume: bool = True
    as_json: bool = False
    remedies: bool = False
    expect: Path | None = None
    fail_on: FailOn = "any"
    jobs: int = 0
    executor: str = ""
    shard: str = ""
    baseline: Path | None = None
    detail: Detail = "normal"
    few: bool = False  # one scene of each class


def command(asked: Asked) -> ExitCode:
    """Run the selection and print what came of it."""
    quiet = console(stderr=True)
    if asked.baseline is not None:
        load(asked.baseline)  # before anything is drawn for a folder that holds no run
    gate = Gate.load(asked.expect, asked.fail_on)
    selected = workarounds.chosen(asked.scenes) if asked.remedies else []
    try:
        plan = _plan(asked, _choices(asked, selected, quiet), gate, quiet)
    except (KeyboardInterrupt, Stopped) as error:
        quiet.print("stopped before a result was finished; the same command begins again", markup=False, soft_wrap=True)
        raise SystemExit(exit_state(error)) from None
    pictures = Pictures(plan.out)
    state, shown = _done(plan, pictures, asked.detail, quiet)
    rows = workarounds.rows(selected, state.results)
    document: dict[str, object] = {**state.document()}
    if asked.remedies:
        document["workarounds"] = [row.as_dict() for row in rows]
        write_json(plan.out / "run.json", document)
    page = draw(plan.out, pictures=pictures, baseline=asked.baseline)
    if asked.as_json:
        print(escaped(json.dumps(document, ensure_ascii=False, allow_nan=False)))
    elif asked.remedies:
        console().print(workarounds.table(rows))
    else:
        summary(console(), state, page, asked.detail, shown if one_place() else frozenset())
    return workarounds.code_of(rows, state.results) if asked.remedies else code_of(state.results)


def _choices(asked: Asked, selected: Sequence[Workaround], quiet: Console) -> list[Choice]:
    """The scenes and variants to draw, those of a team's own read and told of."""
    if asked.remedies:
        if asked.variants or asked.every_variant or asked.view.words:
            left = "leave --variant, --variants, --camera, --time and --purpose out"
            raise SelectionError("workarounds choose their pictures themselves", do=left)
        choices = workarounds.choices(selected)
    else:
        given = parse_variants(asked.variants)
        choices = choose(asked.scenes, given, every_variant=asked.every_variant, view=asked.view)
    return _read_own(part(quick(choices) if asked.few else choices, asked.shard), quiet)


def _plan(asked: Asked, choices: Sequence[Choice], gate: Gate, quiet: Console) -> Plan:
    """The plan for ``choices``; raises where a renderer is required and missing, or where none is installed."""
    names = dict.fromkeys(asked.renderers)
    wanted = {name: adapter(name) for name in names} if names else adapters()
    required = {name: adapter(name) for name in asked.require}

    whys: dict[str, str] = {}
    found, missing = find_renderers(wanted, whys.__setitem__)
    for line in left_out(whys, asked=bool(names)):
        quiet.print(Text(line, style="yellow"), soft_wrap=True)
    for name, renderer in required.items():
        if name not in found:
            renderer.find()  # raises with the way to install it
    if not found:
        raise NothingSelectedError("no renderer is installed", do="see `notabug doctor`")
    # The settings of workarounds alter adapters by functions that exist in this process only.
    one_by_one = asked.remedies
    workers, threads = (
        (Alone(), 0) if one_by_one else workers_for(asked.executor, asked.jobs, len(choices) * len(found))
    )
    seeds = tuple(range(asked.seeds))
    return Plan(
        choices=choices,
        renderers=found,
        out=asked.out,
        quality=Quality(samples=asked.samples, seeds=seeds, timeout=asked.timeout, threads=threads),
        resume=asked.resume,
        missing=missing,
        command=["notabug", *sys.argv[1:]],
        gate=gate,
        workers=workers,
        shard=asked.shard,
    )


def _done(plan: Plan, pictures: Pictures, detail: Detail, quiet: Console) -> tuple[Run, frozenset[Key]]:
    """The run of ``plan``, and the results of which all was told meanwhile.

    Where it is stopped the page is drawn of what is finished, and the program ends.
    """
    try:
        with Board(quiet, pictures.begin, detail, _beginning(plan), one_picture(plan.choices)) as board:
            return run(plan, board), board.shown
    except (KeyboardInterrupt, Stopped, ClusterLostError) as error:
        with contextlib.suppress(NotabugError, OSError):  # the record is what counts, and it is there
            draw(plan.out, pictures=pictures)
        if isinstance(error, ClusterLostError):
            raise
        quiet.print(
            f"stopped; finished results stay in {plan.out} and the same command goes on from there",
            markup=False,
            soft_wrap=True,
        )
        raise SystemExit(exit_state(error)) from None


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
        if taken.told(choice.source):
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
    own = [name for name, (adapter, _) in plan.renderers.items() if isinstance(adapter, Command)]
    drawing = f", and what {' and '.join(own)} {'takes' if len(own) == 1 else 'take'} to draw" if own else ""
    known = (
        f"; the first run takes {duration(jobs * FIRST)} on two idle cores{drawing}; later ones keep what is finished"
    )
    takes = known if first and jobs * FIRST >= LONG else ""
    scenes = len({choice.source for choice in plan.choices})
    views = f" in {len(plan.choices)} variants" if len(plan.choices) > scenes else ""
    pictures = f", {counted(jobs, 'picture')}" if jobs != scenes else ""
    what = f"{counted(scenes, 'scene')}{views}{pictures}"
    return f"rendering and judging {what} with {names}; results go to {plan.out}{takes}"
