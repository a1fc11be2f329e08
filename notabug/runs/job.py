"""One job: one scene drawn by one renderer and judged, or its result kept from an earlier run; never an exception."""

from __future__ import annotations

import traceback
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import cast

from notabug.adapters.base import Adapter, UnsupportedError
from notabug.adapters.trees import empty, replaced, states
from notabug.exit_codes import ExitCode, exit_code
from notabug.metrics.verdict import Verdict, Word
from notabug.results.gate import NO_REFERENCE, NO_SCENE, NOT_CALIBRATED, OF_FILES
from notabug.results.record import Result
from notabug.runs.folders import job_folder, job_lock, write_json
from notabug.runs.job_files import OF_RENDERS, draw_fresh, keep_log, kept_renders, kept_result, keys_of, relative
from notabug.runs.plan import Done, Plan, Task, Watcher, read_choice, reproduce
from notabug.runs.selection import Choice
from notabug.scenes_usd.catalogue import expected
from notabug.scenes_usd.errors import FileError, NotabugError, is_of_files
from notabug.scenes_usd.scene import Scene


@dataclass(slots=True)
class Jobs:
    """What jobs are done with, in whichever process, and the seconds that renderers took for them."""

    plan: Plan
    watcher: Watcher
    refused: Mapping[str, str] = field(default_factory=dict)  # renderer: what its calibration card says against it
    rendering: float = 0.0


def perform(plan: Plan, refused: Mapping[str, str], watcher: Watcher, task: Task) -> Done:
    """Do ``task``, in this process or another one. Two that do the same job do it one after the other."""
    jobs = Jobs(plan, watcher, refused)
    result, kept = do_job(jobs, task.choice, read_choice(task.choice), task.renderer)
    return Done(result, kept, jobs.rendering)


def do_job(jobs: Jobs, choice: Choice, scene: Scene | NotabugError, name: str) -> tuple[Result, bool]:
    """One result, and whether it was kept from an earlier run."""
    adapter, found = jobs.plan.renderers[name]
    blank = blank_result(jobs.plan, choice, scene, name)
    if isinstance(scene, NotabugError):
        return replace(blank, verdict=replace(no_judgement("error", str(scene)), triggers=(NO_SCENE,))), False
    blamed = jobs.refused.get(name, "")
    if blamed:
        refused = no_judgement("error", f"calibration: {blamed}")
        return replace(blank, verdict=replace(refused, triggers=(NOT_CALIBRATED,))), False
    adapter = choice.alter(adapter, scene)
    folder = job_folder(jobs.plan.out, choice.folder or choice.id, blank.variant, name)
    keys = keys_of(scene, adapter, found, jobs.plan.quality)
    try:
        with job_lock(folder, jobs.plan.out):
            kept = kept_result(folder, keys["result"], jobs.plan.out) if jobs.plan.resume else None
            if kept is not None:
                return as_asked(kept, blank), True
            return _fresh(jobs, blank, scene, adapter, folder, keys), False
    except OSError as error:  # the folder cannot be made or locked: the other jobs have folders of their own
        return replace(blank, verdict=no_judgement("error", str(FileError.of(error)))), False


def blank_result(plan: Plan, choice: Choice, scene: Scene | NotabugError, name: str) -> Result:
    """The result of a job of which nothing is known yet but what was asked for."""
    variant = choice.variant if isinstance(scene, NotabugError) else scene.variant
    blank = Result(
        scene=choice.id,
        variant=f"{variant} [{choice.label}]".lstrip() if choice.label else variant,
        renderer=name,
        renderer_version=plan.renderers[name][1].version,
        verdict=Verdict("error"),
        command=reproduce(choice, name, plan.quality, plan.out, variant),
    )
    if isinstance(scene, NotabugError):
        return blank
    stated = "" if choice.label else _expected(scene, name)
    lights = tuple(sorted({light.kind for light in scene.lights}))
    return replace(blank, claim=scene.card.claim, size=(scene.width, scene.height), expected=stated, lights=lights)


def as_asked(kept: Result, blank: Result) -> Result:
    """The result ``kept`` of an earlier run under this one's words."""
    return replace(kept, command=blank.command, expected=blank.expected, claim=blank.claim, lights=blank.lights)


def _fresh(jobs: Jobs, blank: Result, scene: Scene, adapter: Adapter, folder: Path, keys: dict[str, str]) -> Result:
    from notabug.runs.judge_files import judge_pictures  # of no use to a run whose jobs are done elsewhere

    plan, before = jobs.plan, states(folder)
    try:
        renders = kept_renders(folder, keys["render"]) if plan.resume else ()
        if renders:
            empty(folder, OF_RENDERS)
        else:
            jobs.watcher.start(blank.scene, blank.variant, blank.renderer, "renders")
            renders = draw_fresh(scene, adapter, folder, keys["render"], plan.quality)
            jobs.rendering += sum(render.seconds for render in renders)
        blank = replace(
            blank,
            samples=renders[0].samples,
            seeds=len(renders),
            image=relative(renders[0].image, plan.out),
            renderer_command=renders[0].command,
            seconds={"render": sum(render.seconds for render in renders), "judge": 0.0},
        )
        jobs.watcher.start(blank.scene, blank.variant, blank.renderer, "is judged")
        outcome = judge_pictures([render.image for render in renders], scene, adapter.declaration(plan.quality), folder)
        result = replace(
            blank,
            verdict=outcome.verdict,
            image=relative(outcome.image, plan.out),
            images={key: relative(path, plan.out) for key, path in outcome.images.items()},
            size=outcome.size,
            channels=outcome.channels,
            notes=(*outcome.notes, *scene.notes),
            seconds=blank.seconds | {"judge": outcome.seconds},
        )
        write_json(folder / "result.json", {"key": keys["result"], "result": result.as_dict()})
    except UnsupportedError as error:  # what a table states of "*" is for those who can draw the scene
        stated = expected(scene).get(blank.renderer, "") if blank.expected else ""
        return replace(blank, verdict=no_judgement("unsupported", str(error)), expected=stated)
    except NotabugError as error:
        # a log must not go where a link now leads
        kept = None if replaced(before) else keep_log(folder, getattr(error, "log", ""))
        why = (NO_REFERENCE,) if exit_code(error) is ExitCode.REFERENCE else ()
        head, newline, quoted = str(error).partition("\n")  # what follows is quoted from the log
        said = f"{head}{f'; log: {kept}' if kept else ''}{newline}{quoted}"
        verdict = replace(no_judgement("error", said), triggers=why)
        return replace(blank, verdict=verdict, log=relative(kept, plan.out) if kept else "")
    except Exception as error:  # a defect in one adapter or model must not cost the other results
        if is_of_files(error):
            verdict = no_judgement("error", str(FileError.of(cast(OSError, error))))
            return replace(blank, verdict=replace(verdict, triggers=(OF_FILES,)))
        kept = None if replaced(before) else keep_log(folder, traceback.format_exc())
        what = f"internal error: {type(error).__name__}: {error}" + (f"; the trace is in {kept}" if kept else "")
        return replace(blank, verdict=no_judgement("error", what), log=relative(kept, plan.out) if kept else "")
    return result


def _expected(scene: Scene, renderer: str) -> str:
    table = expected(scene)
    return table.get(renderer, table.get("*", ""))


def no_judgement(word: Word, message: str) -> Verdict:
    return Verdict(word, message=message)
