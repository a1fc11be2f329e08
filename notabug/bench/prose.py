"""Plain words about measured numbers: the paragraph under each plot is computed, never written by hand."""

from __future__ import annotations

from collections.abc import Sequence

from notabug.bench import efficiency, metamorphic
from notabug.bench.stability import Course
from notabug.bench.stability_sweeps import SWEEPS


def about_sweep(courses: Sequence[Course]) -> str:
    """One paragraph on one sweep."""
    sweep = SWEEPS[courses[0].sweep]
    unit = f" {sweep.unit}" if sweep.unit else ""
    parts = []
    broken = sorted((course for course in courses if course.onset is not None), key=_order, reverse=not sweep.rising)
    for each in broken:
        assert each.onset is not None
        said = f"{each.renderer} breaks at {_number(each.onset)}{unit} ({each.kind})"
        off = each.decades_off
        if off is None:
            said += ", where error analysis expects nothing"
        elif abs(off) <= 1.0:
            said += f", {_factor(off)} predicted {_number(each.predicted or 0.0)}"
        else:
            said += f", {abs(off):.1f} decades {'after' if (off > 0) == sweep.rising else 'before'} the prediction"
        parts.append(said + ".")
    drawn = [course for course in courses if course.onset is None and all(p.share is not None for p in course.points)]
    if drawn:
        names = _listed([each.renderer for each in drawn])
        parts.append(f"{names} {'is' if len(drawn) == 1 else 'are'} right all the way.")
    refused = [course.renderer for course in courses if any(point.share is None for point in course.points)]
    if refused:
        parts.append(f"{_listed(refused)} cannot draw it.")
    return " ".join(parts)


def _order(each: Course) -> float:
    return each.onset or 0.0


def _factor(decades: float) -> str:
    factor = 10.0 ** abs(decades)
    return "at the" if factor < 1.5 else f"a factor of {factor:.1f} from the"


def about_efficiency(results: Sequence[efficiency.Result]) -> str:
    """One paragraph on one scene and knob."""
    parts = []
    timed = sorted(
        (result for result in results if result.time_to_target), key=lambda result: result.time_to_target or 0.0
    )
    if results[0].knob == "samples":
        if timed:
            best = timed[0]
            parts.append(
                f"relMSE {efficiency.TARGET:g} takes {best.renderer} {_seconds(best.time_to_target)} of processor time "
                "after its start"
                + "".join(f", {each.renderer} {_seconds(each.time_to_target)}" for each in timed[1:])
                + "."
            )
        never = [result.renderer for result in results if result.places and result.time_to_target is None]
        if never:
            parts.append(f"{_listed(never)} {'does' if len(never) == 1 else 'do'} not get there.")
        if results[0].bias > 0.0:
            least = f"{results[0].bias:.1g}"
            parts.append(f"No number of samples goes below relMSE {least}, which is facet self-shadow.")
    for result in results:
        if result.message:
            parts.append(f"{result.renderer}: {result.message}.")
            continue
        if result.slope is not None and result.theory is not None:
            parts.append(
                f"{result.renderer}: rms error falls as {result.knob}^{result.slope:.2f}, theory {result.theory:g}."
            )
        if result.knob == "epsilon" and result.places:
            low = min(result.places, key=lambda place: place.errors["relmse"])
            enough = 2.0 * low.errors["relmse"]
            good = [place.value for place in result.places if place.errors["relmse"] <= enough]
            parts.append(f"{result.renderer}: least error for epsilons from {min(good):g} to {max(good):g}.")
        gains = [place.efficiency for place in result.places if place.efficiency]
        if gains:
            parts.append(f"Its efficiency 1/(variance x time) is {max(gains):.1g} at best.")
        if result.floor is not None:
            parts.append(f"Its floor is a median relative error of {result.floor.median:.1g}: {result.floor.cause}.")
    return " ".join(parts)


def about_relations(checks: Sequence[metamorphic.Check]) -> str:
    """One paragraph on one renderer."""
    done = [check for check in checks if not check.message]
    broken = [each for each in done if each.broken]
    if not done:
        return "Nothing could be checked."
    largest = max((each.largest for each in done if not each.broken), default=0.0)
    parts = [
        f"{len(done) - len(broken)} of {len(done)} checks hold, to {largest:.1g} of the brightest pixel at most; "
        f"{done[0].allowed:g} is allowed."
    ]
    for each in broken:
        x, y = each.place
        parts.append(
            f"Broken: the picture of {each.scene} is not the same when {each.claim}; {each.pixels} pixels differ by up "
            f"to {each.largest:.1g}, most at {x}, {y}."
        )
    return " ".join(parts)


def _number(value: float) -> str:
    return f"{value:.2g}".replace("e+0", "e").replace("e-0", "e-").replace("e+", "e")


def _seconds(value: float | None) -> str:
    return f"{value or 0.0:.2g} s"


def _listed(names: Sequence[str]) -> str:
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"
