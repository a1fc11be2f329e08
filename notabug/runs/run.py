"""run: every scene, variant and renderer of a selection, one job after the other, each result on disk at once."""

from __future__ import annotations

import contextlib
import json
import shlex
import time
import traceback
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any, Protocol, cast

from notabug.adapters.base import Adapter, Found, Quality, Render, RendererMissingError, UnsupportedError
from notabug.adapters.trees import empty, replaced, states
from notabug.ending import saved_trace
from notabug.exit_codes import ExitCode, exit_code
from notabug.metrics.verdict import Verdict, Word
from notabug.results.gate import NO_REFERENCE, NO_SCENE, Gate
from notabug.results.record import SCHEMA, RecordError, Result
from notabug.results.shape import FILE, NUMBER, TEXT, WHOLE, Fields, Many, Shape, check
from notabug.runs.calibration import CARDS, refusal, textured
from notabug.runs.folders import LOCK, folder_name, job_folder, job_lock, sole_writer, write_json, write_text
from notabug.runs.provenance import fingerprint, tool
from notabug.runs.selection import Choice
from notabug.runs.workers import Alone, Crew, rendering
from notabug.scenes_usd.catalogue import expected
from notabug.scenes_usd.errors import FileError, NotabugError, SceneError, is_of_files
from notabug.scenes_usd.own import take_scene
from notabug.scenes_usd.scene import Scene
from notabug.scenes_usd.view import options_for

SAVING = 0.02  # share of a run's time that its record may take while it goes on


class Watcher(Protocol):
    """Sees a run go by: ``notabug.runs.progress`` draws it, tests count it."""

    def begin(self, jobs: int) -> None: ...
    def start(self, scene: str, variant: str, renderer: str, stage: str) -> None: ...
    def done(self, result: Result, kept: bool) -> None: ...


class Silent:
    """Sees nothing: the watcher of a job in another process."""

    def begin(self, jobs: int) -> None:
        del jobs

    def start(self, scene: str, variant: str, renderer: str, stage: str) -> None:
        del scene, variant, renderer, stage

    def done(self, result: Result, kept: bool) -> None:
        del result, kept


@dataclass(frozen=True, slots=True)
class Plan:
    """What to run: the cells of ``choices`` x ``renderers`` (adapters that were found), how well, and where to."""

    choices: Sequence[Choice]
    renderers: Mapping[str, tuple[Adapter, Found]]
    out: Path
    quality: Quality = field(default_factory=Quality)
    resume: bool = True
    missing: Mapping[str, str] = field(default_factory=dict)  # renderer: how to install it
    command: Sequence[str] = ()
    gate: Gate = field(default_factory=Gate)
    crew: Crew = field(default_factory=Alone)
    shard: str = ""

    def wanted(self, choice: Choice) -> list[str]:
        """The renderers that ``choice`` is for."""
        return [name for name in self.renderers if not choice.only or name in choice.only]


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

    def document(self) -> dict[str, Any]:
        """``run.json``."""
        total = time.perf_counter() - self.begun
        found = {
            name: {"version": each.version, "where": each.where} for name, (_, each) in self.plan.renderers.items()
        }
        return {
            "schema": SCHEMA,
            "tool": tool(),
            "command": list(self.plan.command),
            "finished": self.finished,
            "seconds": {
                "total": total,
                "render": self.rendering,
                "outside": max(0.0, total - self.rendering / self.plan.crew.at_once),
            },
            "jobs": self.plan.crew.document() | {"threads": self.plan.quality.threads, "shard": self.plan.shard},
            "gate": self.plan.gate.document(self.results),
            "renderers": found | {name: {"missing": line} for name, line in self.plan.missing.items()},
            "calibration": [self.calibration[name].as_dict() for name in found if name in self.calibration],
            "results": [each.as_dict() for each in self.results],
        }

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
    except BaseException:  # a signal, or the crew is lost: what is finished stays on record
        _collect(state, tasks, results)
        with contextlib.suppress(OSError):
            state.save()
        raise
    state.finished = True
    state.save()
    return state


def _do(plan: Plan, state: Run, watcher: Watcher, tasks: Sequence[Task], results: dict[int, Result]) -> None:
    """Do ``tasks``; ``results`` gets each one's by its place, as they end."""
    with plan.crew as crew:
        seen = watcher if crew.at_hand else Silent()
        lean = replace(plan, choices=(), crew=Alone(), gate=Gate())  # what a job needs, wherever it is done
        names = list(plan.renderers)
        for place, card in crew.each(partial(calibrate, lean, seen), names):
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
        for place, done in crew.each(partial(perform, lean, state.refused, seen), [tasks[each] for each in rest]):
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
    scene = _read(task.choice)
    if isinstance(scene, NotabugError):
        return None
    adapter, found = state.plan.renderers[task.renderer]
    adapter = task.choice.alter(adapter, scene)
    blank = _blank(state, task.choice, scene, task.renderer)
    folder = job_folder(state.plan.out, task.choice.folder or task.choice.id, blank.variant, task.renderer)
    kept = _kept(folder, _keys(scene, adapter, found, state.plan.quality)["result"], state.plan.out)
    return None if kept is None else _as_asked(kept, blank)


@dataclass(frozen=True, slots=True)
class Task:
    """One job: a choice for one renderer."""

    choice: Choice
    renderer: str


@dataclass(frozen=True, slots=True)
class Done:
    """What came of a job: ``kept`` from an earlier run, else ``rendering`` seconds were spent in the renderer."""

    result: Result
    kept: bool
    rendering: float


def perform(plan: Plan, refused: Mapping[str, str], watcher: Watcher, task: Task) -> Done:
    """Do ``task``, in this process or another one. Two that do the same job do it one after the other."""
    state = Run(plan, watcher, refused=dict(refused))
    result, kept = _job(state, task.choice, _read(task.choice), task.renderer)
    return Done(result, kept, state.rendering)


def _finish(state: Run, results: dict[int, Result], index: int, done: Done) -> None:
    """Put a job's result in its place and save the record."""
    state.rendering += done.rendering
    results[index] = state.plan.gate.judged(done.result)
    state.results = [results[each] for each in sorted(results)]
    state.watcher.done(results[index], done.kept)
    state.save(now=False)


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
            verdict=_no_judgement("error", what),
            command=reproduce(choice, name, plan.quality),
        ),
        False,
        0.0,
    )


def _read(choice: Choice) -> Scene | NotabugError:
    if choice.refused:
        return SceneError(choice.refused)
    if choice.scene is not None:
        return choice.scene
    try:
        return take_scene(choice.source, choice.variants, choice.view).scene
    except NotabugError as error:
        return error


@dataclass(frozen=True, slots=True)
class Calibrated:
    """A renderer's result on the first card that it can draw, and what that says against its adapter, or ""."""

    result: Result | None
    refused: str
    rendering: float
    kept: bool  # whether it, or what else it was held against, is from an earlier run


def calibrate(plan: Plan, watcher: Watcher, name: str) -> Calibrated:
    """Draw the first card that the renderer called ``name`` can draw.

    A card that was kept from an earlier run and speaks against its adapter is drawn again: the adapter may have been
    mended in a place that no key covers, such as a machine's own settings.
    """
    found = _calibrate(plan, watcher, name)
    if found.refused and found.kept:
        return _calibrate(replace(plan, resume=False), watcher, name)
    return found


def _calibrate(plan: Plan, watcher: Watcher, name: str) -> Calibrated:
    state = Run(plan, watcher)
    first: Result | None = None
    kept = False
    for card in CARDS:
        scene = _read(card)
        if isinstance(scene, Scene):
            result, old = _job(state, card, scene, name)
            kept = kept or old
            first = first or result
            if result.verdict.word != "unsupported":
                first = result
                break
    if first is None:
        return Calibrated(None, "", state.rendering, kept)
    shown = first

    def plain() -> Result | None:
        nonlocal kept
        for card in CARDS[1:] if textured(shown.scene) else ():
            scene = _read(card)
            if isinstance(scene, Scene):
                result, old = _job(state, card, scene, name)
                kept = kept or old
                if result.verdict.word != "unsupported":
                    return result
        return None

    refused = refusal(shown, plan.renderers[name][0], plan.quality, plan.out, plain)
    return Calibrated(shown, refused, state.rendering, kept)


def _expected(scene: Scene, renderer: str) -> str:
    table = expected(scene)
    return table.get(renderer, table.get("*", ""))


def _job(state: Run, choice: Choice, scene: Scene | NotabugError, name: str) -> tuple[Result, bool]:
    """One result, and whether it was kept from an earlier run."""
    adapter, found = state.plan.renderers[name]
    blank = _blank(state, choice, scene, name)
    if isinstance(scene, NotabugError):
        return replace(blank, verdict=replace(_no_judgement("error", str(scene)), triggers=(NO_SCENE,))), False
    blamed = state.refused.get(name, "")
    if blamed:
        return replace(blank, verdict=_no_judgement("error", f"calibration: {blamed}")), False
    adapter = choice.alter(adapter, scene)
    folder = job_folder(state.plan.out, choice.folder or choice.id, blank.variant, name)
    keys = _keys(scene, adapter, found, state.plan.quality)
    try:
        with job_lock(folder, state.plan.out):
            kept = _kept(folder, keys["result"], state.plan.out) if state.plan.resume else None
            if kept is not None:
                return _as_asked(kept, blank), True
            return _fresh(state, blank, scene, adapter, folder, keys), False
    except OSError as error:  # the folder cannot be made or locked: the other jobs have folders of their own
        return replace(blank, verdict=_no_judgement("error", str(FileError.of(error)))), False


def _blank(state: Run, choice: Choice, scene: Scene | NotabugError, name: str) -> Result:
    """The result of a job of which nothing is known yet but what was asked for."""
    variant = choice.variant if isinstance(scene, NotabugError) else scene.variant
    blank = Result(
        scene=choice.id,
        variant=f"{variant} [{choice.label}]".lstrip() if choice.label else variant,
        renderer=name,
        renderer_version=state.plan.renderers[name][1].version,
        verdict=Verdict("error"),
        command=reproduce(choice, name, state.plan.quality),
    )
    if isinstance(scene, NotabugError):
        return blank
    stated = "" if choice.label else _expected(scene, name)
    return replace(blank, claim=scene.card.claim, size=(scene.width, scene.height), expected=stated)


def _as_asked(kept: Result, blank: Result) -> Result:
    """The result ``kept`` of an earlier run under this one's words."""
    return replace(kept, command=blank.command, expected=blank.expected, claim=blank.claim)


def _fresh(state: Run, blank: Result, scene: Scene, adapter: Adapter, folder: Path, keys: dict[str, str]) -> Result:
    from notabug.runs.judge_files import judge_pictures  # of no use to a run whose jobs are done elsewhere

    plan, before = state.plan, states(folder)
    try:
        renders = _renders(folder, keys["render"]) if plan.resume else ()
        if renders:
            empty(folder, _OF_RENDERS)
        else:
            state.watcher.start(blank.scene, blank.variant, blank.renderer, "renders")
            renders = _render(scene, adapter, folder, keys["render"], plan.quality)
            state.rendering += sum(each.seconds for each in renders)
        blank = replace(
            blank,
            samples=renders[0].samples,
            seeds=len(renders),
            image=_relative(renders[0].image, plan.out),
            renderer_command=renders[0].command,
            seconds={"render": sum(each.seconds for each in renders), "judge": 0.0},
        )
        state.watcher.start(blank.scene, blank.variant, blank.renderer, "is judged")
        outcome = judge_pictures([each.image for each in renders], scene, adapter.declaration(plan.quality), folder)
        result = replace(
            blank,
            verdict=outcome.verdict,
            image=_relative(outcome.image, plan.out),
            images={key: _relative(path, plan.out) for key, path in outcome.images.items()},
            size=outcome.size,
            channels=outcome.channels,
            notes=(*outcome.notes, *scene.notes),
            seconds=blank.seconds | {"judge": outcome.seconds},
        )
        write_json(folder / "result.json", {"key": keys["result"], "result": result.as_dict()})
    except UnsupportedError as error:  # what a table states of "*" is for those who can draw the scene
        stated = expected(scene).get(blank.renderer, "") if blank.expected else ""
        return replace(blank, verdict=_no_judgement("unsupported", str(error)), expected=stated)
    except NotabugError as error:
        # a log must not go where a link now leads
        kept = None if replaced(before) else _keep_log(folder, getattr(error, "log", ""))
        why = (NO_REFERENCE,) if exit_code(error) is ExitCode.REFERENCE else ()
        head, newline, quoted = str(error).partition("\n")  # what follows is quoted from the log
        said = f"{head}{f'; log: {kept}' if kept else ''}{newline}{quoted}"
        verdict = replace(_no_judgement("error", said), triggers=why)
        return replace(blank, verdict=verdict, log=_relative(kept, plan.out) if kept else "")
    except Exception as error:  # a defect in one adapter or model must not cost the other results
        if is_of_files(error):
            return replace(blank, verdict=_no_judgement("error", str(FileError.of(cast(OSError, error)))))
        kept = None if replaced(before) else _keep_log(folder, traceback.format_exc())
        what = f"internal error: {type(error).__name__}: {error}" + (f"; the trace is in {kept}" if kept else "")
        return replace(blank, verdict=_no_judgement("error", what), log=_relative(kept, plan.out) if kept else "")
    return result


_PICTURE: dict[str, Shape] = {"image": FILE, "seed": WHOLE, "samples": WHOLE, "seconds": NUMBER, "command": Many(TEXT)}
_RENDERS = Fields({"key": TEXT, "renders": Many(Fields(_PICTURE))})  # of renders.json
_OF_RENDERS = frozenset({LOCK, "renders", "renders.json", "log.txt"})  # what another judge's result is made from


def _render(scene: Scene, adapter: Adapter, folder: Path, key: str, quality: Quality) -> tuple[Render, ...]:
    """Fresh pictures in ``folder/renders``. ``folder`` is emptied first, so that no old file can pass for a new one.

    Whatever the renderer leaves beside the pictures, where our own files will be, is removed.
    """
    empty(folder, frozenset({LOCK}))
    pictures = folder / "renders"
    pictures.mkdir()
    before = states(pictures)
    with rendering():
        renders = adapter.render(scene, pictures, quality)
    if gone := replaced(before):
        raise NotabugError("the renderer replaced a folder of the run", where=str(gone), do="correct the renderer")
    empty(folder, frozenset({LOCK, "renders"}))
    if not renders:
        raise NotabugError(
            "the adapter returned no picture", where=f"adapter {adapter.name!r}", do="correct the adapter"
        )
    listed = [
        {
            "image": _relative(each.image, folder),
            "seed": each.seed,
            "samples": each.samples,
            "seconds": each.seconds,
            "command": list(each.command),
        }
        for each in renders
    ]
    _keep_log(folder, "\n".join(each.log for each in renders if each.log))
    write_json(folder / "renders.json", {"key": key, "renders": listed})
    return renders


def _renders(folder: Path, key: str) -> tuple[Render, ...]:
    """The pictures of an earlier run, when they are all there and were made the same way; else nothing."""
    stored = _load(folder / "renders.json")
    if stored.get("key") != key:
        return ()
    try:
        check(stored, _RENDERS, str(folder))
    except RecordError:
        return ()
    renders = tuple(
        Render(folder / each["image"], each["seed"], each["samples"], each["seconds"], tuple(each["command"]))
        for each in stored["renders"]
    )
    there = all(each.image.is_file() and each.image.resolve().is_relative_to(folder.resolve()) for each in renders)
    return renders if there and not (folder / "renders").is_symlink() else ()


def _kept(folder: Path, key: str, out: Path) -> Result | None:
    """The finished result of an earlier run, when nothing that enters it has changed and its pictures are there."""
    stored = _load(folder / "result.json")
    if stored.get("key") != key:
        return None
    try:
        result = Result.from_dict(stored["result"])
    except (RecordError, KeyError):
        return None
    return result if all((out / each).is_file() for each in (result.image, *result.images.values())) else None


def _keys(scene: Scene, adapter: Adapter, found: Found, quality: Quality) -> dict[str, str]:
    """What a picture and what a result depend on, as text."""
    made = [scene.digest(), adapter.name, found.version, found.key, quality.samples, list(quality.seeds)]
    return {name: json.dumps([*made, code]) for name, code in made_by().items()}


def made_by() -> dict[str, str]:
    """The fingerprints of the code that makes a picture, and of that which makes a result of it."""
    floors = {"render": ("scenes_usd", "adapters"), "result": ("scenes_usd", "references", "adapters", "metrics")}
    return {name: fingerprint(*each) for name, each in floors.items()}


def _load(path: Path) -> dict[str, Any]:
    try:
        document = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        return {}
    return document if isinstance(document, dict) else {}


def _relative(path: Path, base: Path) -> str:
    """``path`` seen from ``base``; a picture elsewhere is a defect of the adapter."""
    try:
        return path.resolve().relative_to(base.resolve()).as_posix()
    except ValueError:
        raise NotabugError("a picture lies outside of its folder", where=str(path), expected=f"below {base}") from None


def _keep_log(folder: Path, log: str) -> Path | None:
    """Where ``log`` was written beside the result; None where it is empty or cannot be written."""
    if log:
        with contextlib.suppress(OSError):
            folder.mkdir(parents=True, exist_ok=True)
            write_text(folder / "log.txt", log)
            return folder / "log.txt"
    return None


def _no_judgement(word: Word, message: str) -> Verdict:
    return Verdict(word, message=message)


def reproduce(choice: Choice, renderer: str, quality: Quality) -> str:
    """The command line that makes this one result again."""
    if choice.label:
        return shlex.join(["notabug", "run", "--workarounds", choice.source, "-r", renderer])
    words = ["notabug", "run", choice.source, "-r", renderer]
    words += options_for(choice.variant)
    if quality.samples:
        words += ["--samples", str(quality.samples)]
    if len(quality.seeds) != len(Quality().seeds):
        words += ["--seeds", str(len(quality.seeds))]
    return shlex.join(words)


def find_renderers(
    adapters: Mapping[str, Adapter], note: Callable[[str, str], None]
) -> tuple[dict[str, tuple[Adapter, Found]], dict[str, str]]:
    """The installed ones of ``adapters``, and how to install the rest; ``note`` hears of each missing one once."""
    found: dict[str, tuple[Adapter, Found]] = {}
    missing: dict[str, str] = {}
    for name, adapter in adapters.items():
        try:
            found[name] = (adapter, adapter.find())
        except RendererMissingError as error:
            missing[name] = adapter.install
            note(name, str(error))
    return found, missing
