"""run: every task of a plan done by its workers; the record ``run.json`` follows closely."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import cast

from notabug.ending import saved_trace
from notabug.results.document import RendererSaid, RunDocument
from notabug.results.gate import NOT_CALIBRATED, OF_FILES, Gate
from notabug.results.one_light import told_by_lights
from notabug.results.record import Result, run_document
from notabug.runs.calibration import CARDS
from notabug.runs.first_card import calibrate
from notabug.runs.folders import folder_name, job_folder, sole_writer, write_json
from notabug.runs.job import as_asked, blank_result, no_judgement, perform
from notabug.runs.job_files import kept_result, keys_of
from notabug.runs.plan import Done, Plan, Silent, Task, Watcher, read_choice, reproduce
from notabug.runs.provenance import tool
from notabug.runs.workers import Alone
from notabug.scenes_usd.errors import FileError, NotabugError, is_of_files

SAVING = 0.02  # share of a run's time that its record may take while it goes on


@dataclass(slots=True)
class Run:
    """A run in progress and its record, ``run.json``, which follows it closely; each result is on disk at once."""

    plan: Plan
    watcher: Watcher
    results: list[Result] = field(default_factory=list)
    calibration: dict[str, Result] = field(default_factory=dict)
    refused: dict[str, str] = field(default_factory=dict)  # renderer: what its calibration card says against it
    rendering: float = 0.0  # seconds that renderers took in this run; kept results cost none
    begun: float = field(default_factory=time.perf_counter)
    finished: bool = False
    due: float = 0.0  # when ``run.json`` is next worth its while

    def document(self) -> RunDocument:
        """``run.json``."""
        total = time.perf_counter() - self.begun
        found: dict[str, RendererSaid] = {
            name: {"version": there.version, "where": there.where} for name, (_, there) in self.plan.renderers.items()
        }
        jobs = self.plan.workers.document()
        missing: dict[str, RendererSaid] = {name: {"missing": line} for name, line in self.plan.missing.items()}
        return run_document(
            tool=tool(),
            command=self.plan.command,
            finished=self.finished,
            seconds={
                "total": total,
                "render": self.rendering,
                "outside": max(0.0, total - self.rendering / self.plan.workers.at_once),
            },
            jobs={**jobs, "threads": self.plan.quality.threads, "shard": self.plan.shard},
            gate=self.plan.gate.document(self.results),
            renderers=found | missing,
            calibration=[self.calibration[name] for name in found if name in self.calibration],
            results=self.results,
        )

    def save(self, *, now: bool = True) -> None:
        """Write ``run.json``; unless ``now``, only where that is long enough ago to cost SAVING of the time or less.

        While jobs go on a full disk costs only the record: it may have room again at the end.
        """
        start = time.perf_counter()
        if now or start >= self.due:
            with contextlib.nullcontext() if now else contextlib.suppress(OSError):
                write_json(self.plan.out / "run.json", self.document())
            end = time.perf_counter()
            self.due = end + (end - start) / SAVING


def run(plan: Plan, watcher: Watcher) -> Run:
    """Do every job of ``plan``; a job that fails is a result of its own and the others go on.

    Raises FolderInUseError where another run, in any process, is writing into the folder.
    """
    with sole_writer(plan.out):
        return _run(plan, watcher)


def _run(plan: Plan, watcher: Watcher) -> Run:
    state = Run(plan, watcher)
    tasks = [Task(choice, name) for choice in plan.choices for name in plan.wanted(choice)]
    watcher.begin(len(tasks))
    state.save()
    results: dict[int, Result] = {}
    try:
        _do(plan, state, watcher, tasks, results)
    except BaseException:  # a signal, or the cluster is lost: what is finished stays on record
        _collect(state, tasks, results)
        with contextlib.suppress(OSError):
            state.save()
        raise
    state.results = told_by_lights(state.results)
    state.finished = True
    state.save()
    return state


def _do(plan: Plan, state: Run, watcher: Watcher, tasks: Sequence[Task], results: dict[int, Result]) -> None:
    """Do ``tasks``; ``results`` gets each one's by its place, as they end."""
    with plan.workers as workers:
        seen = watcher if workers.at_hand else Silent()
        lean = replace(plan, choices=(), workers=Alone(), gate=Gate())  # what a job needs, wherever it is done
        names = list(plan.renderers)
        for place, card in workers.each(partial(calibrate, lean, seen), names):
            name = names[place]
            if isinstance(card, Exception):
                state.refused[name] = f"the card's job was lost: {card}"
            else:
                state.refused[name] = card.refused
                state.rendering += card.rendering
                state.calibration |= {name: card.result} if card.result is not None else {}
        for index, task in enumerate(tasks):
            shown = state.calibration.get(task.renderer)
            if task.choice == CARDS[0] and shown is not None and shown.scene == task.choice.id:
                _finish(state, results, index, Done(shown, False, 0.0))
        rest = [index for index in range(len(tasks)) if index not in results]
        for place, done in workers.each(partial(perform, lean, state.refused, seen), [tasks[each] for each in rest]):
            index = rest[place]
            _finish(state, results, index, _lost(plan, tasks[index], done) if isinstance(done, Exception) else done)


def _collect(state: Run, tasks: Sequence[Task], results: dict[int, Result]) -> None:
    """Put on record what other processes have finished and this one has not heard of."""
    with contextlib.suppress(OSError, NotabugError):
        fresh = {path.parent for path in state.plan.out.glob("*/*/*/*/result.json")}
        for index, task in enumerate(tasks):
            named = folder_name(task.renderer)
            home = job_folder(state.plan.out, task.choice.folder or task.choice.id, "", task.renderer).parents[1]
            if index in results or not any(path.name == named and path.parents[1] == home for path in fresh):
                continue
            kept = _finished(state, task)
            if kept is not None:
                _finish(state, results, index, Done(kept, True, 0.0))


def _finished(state: Run, task: Task) -> Result | None:
    """The result of ``task`` where it is on disk and made from what is there now."""
    scene = read_choice(task.choice)
    if isinstance(scene, NotabugError):
        return None
    adapter, found = state.plan.renderers[task.renderer]
    adapter = task.choice.alter(adapter, scene)
    blank = blank_result(state.plan, task.choice, scene, task.renderer)
    folder = job_folder(state.plan.out, task.choice.folder or task.choice.id, blank.variant, task.renderer)
    kept = kept_result(folder, keys_of(scene, adapter, found, state.plan.quality)["result"], state.plan.out)
    return None if kept is None else as_asked(kept, blank)


def _finish(state: Run, results: dict[int, Result], index: int, done: Done) -> None:
    """Put a job's result in its place and save the record."""
    state.rendering += done.rendering
    results[index] = state.plan.gate.judged(not_to_blame(done.result, state.calibration.get(done.result.renderer)))
    state.results = [results[result] for result in sorted(results)]
    state.watcher.done(results[index], done.kept)
    state.save(now=False)


def not_to_blame(result: Result, card: Result | None) -> Result:
    """``result``, of a renderer that is refused for its ``card``; as the disk's where the disk failed that card."""
    if card is None or OF_FILES not in card.verdict.triggers or NOT_CALIBRATED not in result.verdict.triggers:
        return result
    return replace(result, verdict=replace(result.verdict, triggers=(OF_FILES,), message=card.verdict.message))


def _lost(plan: Plan, task: Task, error: Exception) -> Done:
    """The result of a job that never came back."""
    name, choice = task.renderer, task.choice
    if isinstance(error, NotabugError):
        what = str(error)
    elif is_of_files(error):
        what = str(FileError.of(cast(OSError, error)))
    else:
        what = f"internal error: {type(error).__name__}: {error}; please report it {saved_trace(error)}"
    return Done(
        Result(
            scene=choice.id,
            variant=choice.variant,
            renderer=name,
            renderer_version=plan.renderers[name][1].version,
            verdict=no_judgement("error", what),
            command=reproduce(choice, name, plan.quality, plan.out),
        ),
        False,
        0.0,
    )
