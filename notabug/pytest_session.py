"""What the pytest plug-in does once a scene is asked for: the plan, one job at a time, and the record at the end."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal, cast

import numpy as np
import numpy.typing as npt

from notabug.adapters.base import Adapter, Declaration, Found, Quality, RendererMissingError
from notabug.adapters.registry import adapter, adapters
from notabug.commands.judge import declare
from notabug.metrics.verdict import Verdict
from notabug.report.page import draw
from notabug.report.sentence import sentence
from notabug.results.document import ResultSaid
from notabug.results.expectation import BETTER
from notabug.results.gate import FailOn, Gate
from notabug.results.record import Result
from notabug.runs.first_card import Calibrated, calibrate
from notabug.runs.folders import sole_writer
from notabug.runs.job import perform
from notabug.runs.judge_files import judge_read
from notabug.runs.own_folder import claim
from notabug.runs.plan import Plan, Silent, Task
from notabug.runs.run import Run
from notabug.runs.selection import choose, parse_variants
from notabug.scenes_usd.errors import NotabugError, SelectionError
from notabug.scenes_usd.own import take_scene
from notabug.scenes_usd.picture import Picture, read_picture
from notabug.scenes_usd.view import AS_IT_IS, View, view_of

Image = str | Path | npt.NDArray[np.floating] | Picture
Kind = Literal["pass", "fail", "xfail", "skip"]


@dataclass(slots=True)
class Bench:
    """The jobs of a session by name, and the calibration of each renderer, drawn when it is first needed."""

    plan: Plan
    tasks: dict[str, Task]
    absent: dict[str, str]  # renderer: why it is not there
    required: frozenset[str]
    strict: bool
    cards: dict[str, Calibrated] = field(default_factory=dict)
    begun: float = field(default_factory=time.perf_counter)

    @classmethod
    def prepare(cls, settings: Mapping[str, str]) -> Bench:
        """The session that the plug-in's ``settings`` ask for; starts no renderer but to find it."""
        named = _words(settings["renderers"])
        required = _words(settings["require"])
        asked = {name: adapter(name) for name in (*named, *required)} if named else adapters()
        variants = _words(settings["variants"])
        wanted = parse_variants([variant for variant in variants if variant != "all"])
        time = float(settings["time"]) if settings["time"] else None
        view = view_of(settings["camera"], time, _words(settings["purposes"]))
        choices = choose(_words(settings["scenes"]), wanted, every_variant="all" in variants, view=view)
        found: dict[str, tuple[Adapter, Found]] = {}
        absent: dict[str, str] = {}
        for name, each in asked.items():
            try:
                found[name] = (each, each.find())
            except RendererMissingError as error:
                absent[name] = str(error)
        seeds = tuple(range(int(settings["seeds"])))
        # One thread: with xdist each worker has a core, and a picture must not depend on whether there are workers.
        quality = Quality(int(settings["samples"]), seeds, threads=1, timeout=float(settings["timeout"]))
        if settings["fail_on"] not in ("any", "visible"):
            raise SelectionError("not a choice", where="notabug_fail_on", expected="any or visible")
        gate = Gate.load(Path(settings["expect"]) if settings["expect"] else None, cast(FailOn, settings["fail_on"]))
        missing = {name: asked[name].install for name in absent}
        out = Path(settings["out"]).resolve()
        plan = Plan(choices, found, out, quality, missing=missing, command=["pytest"], gate=gate)
        tasks = {
            f"{choice.id}[{','.join(filter(None, (choice.variant, name)))}]": Task(choice, name)
            for choice in choices
            for name in asked
        }
        return cls(plan, tasks, absent, frozenset(required), settings["strict"].lower() in ("true", "1", "yes", "on"))

    def names(self) -> list[str]:
        """The jobs, in the order of a run."""
        return list(self.tasks)

    def missing(self, name: str) -> str:
        """Why the job's renderer is not there, or ""; raises where it is required."""
        renderer = self.tasks[name].renderer
        if renderer in self.absent and renderer in self.required:
            raise NotabugError("required and not installed", where=renderer, do=self.absent[renderer])
        return self.absent.get(renderer, "")

    def do(self, name: str) -> Result:
        """The result of the job; one that is finished in the folder, by whatever process, is kept."""
        task = self.tasks[name]
        claim(self.plan.out, "run")
        if task.renderer not in self.cards:
            self.cards[task.renderer] = calibrate(self.plan, Silent(), task.renderer)
        refused = {task.renderer: self.cards[task.renderer].refused}
        return self.plan.gate.judged(perform(self.plan, refused, Silent(), task).result)

    def outcome(self, result: Result) -> tuple[Kind, str]:
        """What the result is to pytest, and why."""
        said, word = sentence(result), result.verdict.word
        if result.fails:
            return "fail", f"{said}\n{result.command}"
        if result.state in BETTER and result.because:
            return ("fail" if self.strict else "pass"), f"[XPASS(strict)] {said}; update the entry"
        if word in ("limitation", "bug", "error"):
            names = " + ".join(
                dict.fromkeys(finding.name for finding in result.verdict.findings if finding.kind == word)
            )
            return "xfail", "; ".join(filter(None, (names or word, result.because)))
        return ("skip", said) if word in ("unsupported", "inconclusive") else ("pass", "")

    def write(self, records: Sequence[ResultSaid]) -> None:
        """``run.json`` and the page, of the results that came in."""
        results = [Result.from_dict(record) for record in records]
        order = {(task.choice.id, task.renderer): place for place, task in enumerate(self.tasks.values())}
        results.sort(key=lambda each: order.get((each.scene, each.renderer), len(order)))
        with sole_writer(self.plan.out):
            state = Run(self.plan, Silent(), results, finished=True, begun=self.begun)
            state.rendering = sum(result.seconds["render"] for result in results)
            state.save()
        draw(self.plan.out)


def judged(
    images: Sequence[Image],
    source: str,
    variants: Mapping[str, str],
    declared: Mapping[str, object],
    view: View = AS_IT_IS,
) -> Verdict:
    """The verdict on ``images``, paths or arrays, as seeds of one renderer; ``declared`` overrides what is unknown."""
    pictures = [image if isinstance(image, Picture) else _picture(image) for image in images]
    height, width = pictures[0].pixels.shape[:2]
    scene = take_scene(source, dict(variants), replace(view, size=(width, height)), "picture").scene
    words: dict[str, Any] = dict(declared)
    base = declare(
        pictures,
        words.pop("filter", "unknown"),
        words.pop("radius", None),
        words.pop("precision", "float32"),
        srgb=False,
        noisy=words.pop("noisy", None),
    )
    unknown = sorted(set(words) - set(Declaration.__slots__))
    if unknown:
        known = ", ".join(Declaration.__slots__)
        raise SelectionError("not part of a declaration", where="judge", expected=known, got=", ".join(unknown))
    declaration = replace(base, **words)
    return judge_read(pictures, scene, declaration).verdict


def _picture(image: str | Path | npt.NDArray[np.floating]) -> Picture:
    if isinstance(image, np.ndarray):
        return Picture(np.asarray(image, np.float32), image.shape[-1], 2.0**-24, relative_quantum=True, metadata={})
    return read_picture(Path(image))


def _words(text: str) -> list[str]:
    """The words of a setting, one a line or all in one."""
    return list(dict.fromkeys(text.split()))
