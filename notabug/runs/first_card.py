"""The first job of every renderer in a run: a calibration card, and what that says against its adapter."""

from __future__ import annotations

from dataclasses import dataclass, replace

from notabug.results.record import Result
from notabug.runs.calibration import CARDS, refusal, textured
from notabug.runs.job import Jobs, do_job
from notabug.runs.plan import Plan, Watcher, read_choice
from notabug.scenes_usd.scene import Scene


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
    jobs = Jobs(plan, watcher)
    first: Result | None = None
    kept = False
    for card in CARDS:
        scene = read_choice(card)
        if isinstance(scene, Scene):
            result, old = do_job(jobs, card, scene, name)
            kept = kept or old
            first = first or result
            if result.verdict.word != "unsupported":
                first = result
                break
    if first is None:
        return Calibrated(None, "", jobs.rendering, kept)
    shown = first

    def plain() -> Result | None:
        nonlocal kept
        for card in CARDS[1:] if textured(shown.scene) else ():
            scene = read_choice(card)
            if isinstance(scene, Scene):
                result, old = do_job(jobs, card, scene, name)
                kept = kept or old
                if result.verdict.word != "unsupported":
                    return result
        return None

    refused = refusal(shown, plan.renderers[name][0], plan.quality, plan.out, plain)
    return Calibrated(shown, refused, jobs.rendering, kept)
