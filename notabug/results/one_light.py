"""Bugs that a renderer shows under one type of light only: the results of a whole run tell, those of one scene cannot.

"A 1/pi is missing" is a mistake of the shading where every scene shows it, and of the point lights where only scenes
show it that point lights light. So the cause is told with the type of light, wherever the run can tell.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from notabug.results.record import Result
from notabug.results.wording import decisive

SCENES = 2  # scenes that show the bug, and scenes of other lights that do not: one of each may be chance
JUDGED = frozenset({"pass", "limitation", "bug"})


def told_by_lights(results: Sequence[Result]) -> list[Result]:
    """``results`` with ``under`` set where all of a run's results tell that a bug comes with one type of light.

    Scenes that lights of several types light are left aside, and so is a scene with another bug, which may hide this
    one.
    """
    made = [replace(result, under="") if result.under else result for result in results]
    places: dict[str, list[int]] = {}
    for place, result in enumerate(made):
        if result.verdict.word in JUDGED and len(set(result.lights)) == 1:
            places.setdefault(result.renderer, []).append(place)
    for own in places.values():
        for name in dict.fromkeys(name for place in own for name in _bugs(made[place])):
            showing = [place for place in own if name in _bugs(made[place])]
            said = _only([made[place] for place in own], [made[place] for place in showing])
            for place in showing if said else ():
                made[place] = replace(made[place], under=said)
    return made


def _bugs(result: Result) -> tuple[str, ...]:
    return tuple(finding.name for finding in decisive(result)) if result.verdict.word == "bug" else ()


def _only(judged: Sequence[Result], showing: Sequence[Result]) -> str:
    """``under point lights only (...)`` where exactly the scenes of one type of light are ``showing`` a bug, or ""."""
    kinds = {result.lights[0] for result in showing}
    if len(kinds) != 1:
        return ""
    (light,) = kinds
    spared = [result for result in judged if result.verdict.word != "bug"]
    others = [result for result in spared if result.lights[0] != light]
    scenes, without = ({result.scene for result in found} for found in (showing, others))
    if len(spared) > len(others) or min(len(scenes), len(without)) < SCENES:
        return ""
    rest = " and ".join(dict.fromkeys(result.lights[0] for result in others))
    return f"under {light} lights only: {len(scenes)} scenes show it, {len(without)} under {rest} lights do not"
