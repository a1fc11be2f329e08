"""SVG plots with logarithmic axes and labels at the lines, in colours that colour-blind readers can tell apart."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from notabug.bench.efficiency import Result
from notabug.bench.stability import Course
from notabug.bench.stability_sweeps import SWEEPS
from notabug.bench.stability_theory import SHARE

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# Okabe and Ito 2008, "Color Universal Design"; yellow is left out, it is too faint on white.
PALETTE = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#E69F00", "#000000", "#7F7F7F", "#8C564B")
MARKS = "osD^vP*Xh"
STROKES = ("-", "--", ":")  # of the first lines as many as there are colours, of as many more, and so on
_LINE = 0.235  # inches that a label is high
_HEIGHT = 3.6  # inches that a plot is high, where its labels need no more
LEAST = 1e-4  # share of pixels that stands for none on a logarithmic axis


@dataclass(frozen=True, slots=True)
class Curve:
    """One line: ``marked`` points are drawn large, ``ticks`` are places on the line ``level`` (predictions)."""

    name: str
    x: tuple[float, ...]
    y: tuple[float, ...]
    marked: tuple[int, ...] = ()
    tick: float | None = None


def stability_plot(courses: Sequence[Course], path: Path) -> Path:
    """Share of wrong pixels over the swept number; a triangle on the dotted line is a predicted onset."""
    sweep = SWEEPS[courses[0].sweep]
    curves = [
        Curve(
            course.renderer,
            tuple(point.value for point in course.points if point.share is not None),
            tuple(max(point.share, LEAST) for point in course.points if point.share is not None),
            tick=course.predicted,
        )
        for course in courses
    ]
    label = f"{sweep.title} [{sweep.unit}]" if sweep.unit else sweep.title
    return draw(curves, path, label, "share of wrong pixels", level=SHARE, falling=not sweep.rising)


def efficiency_plot(results: Sequence[Result], path: Path) -> Path:
    """relMSE over processor time, or over the knob where that is not samples; large marks: the Pareto front."""
    timed = results[0].knob == "samples"
    curves = []
    for result in results:
        places = [place for place in result.places if not timed or place.cpu_net > 0.0]
        curves.append(
            Curve(
                result.renderer,
                tuple(place.cpu_net if timed else place.value for place in places),
                tuple(max(place.errors["relmse"], 1e-16) for place in places),
                marked=tuple(i for i, place in enumerate(places) if timed and place.value in result.front),
            )
        )
    return draw(curves, path, "processor seconds, start not counted" if timed else results[0].knob, "relMSE")


def draw(
    curves: Sequence[Curve],
    path: Path,
    x_label: str,
    y_label: str,
    *,
    level: float | None = None,
    falling: bool = False,
) -> Path:
    """Write the curves to ``path``; ``level`` is a dotted line, ``falling`` turns the x axis round."""
    import matplotlib as mpl

    mpl.use("svg")
    from matplotlib import pyplot

    settings: Any = {"svg.hashsalt": path.stem, "svg.fonttype": "none", "font.size": 9, "font.family": "sans-serif"}
    with mpl.rc_context(settings):
        height = max(_HEIGHT, _LINE * (len(curves) + 1))
        figure, axes = pyplot.subplots(figsize=(7.2, height), layout="constrained")
        axes.set_xscale("log")
        axes.set_yscale("log")
        axes.set_xlabel(x_label)
        axes.set_ylabel(y_label)
        axes.spines[["top", "right"]].set_visible(False)
        axes.grid(True, which="major", alpha=0.25, linewidth=0.5)
        ends = []
        for number, curve in enumerate(curves):
            if not curve.x:
                continue
            colour, mark, stroke = style(number)
            axes.plot(curve.x, curve.y, color=colour, marker=mark, linestyle=stroke, markersize=3.5, linewidth=1.2)
            for at in curve.marked:
                axes.plot(curve.x[at], curve.y[at], color=colour, marker=mark, markersize=8, fillstyle="none")
            if curve.tick is not None and level is not None:
                axes.plot(curve.tick, level, color=colour, marker="v", markersize=8, fillstyle="none")
            ends.append(End(curve.name, colour, mark, curve.x[-1], curve.y[-1]))
        if level is not None:
            axes.axhline(level, color="#7F7F7F", linestyle=":", linewidth=1.0)
        if falling:
            axes.invert_xaxis()
        _label(axes, ends, _LINE / height)
        path.parent.mkdir(parents=True, exist_ok=True)
        figure.savefig(path, format="svg", metadata={"Date": None, "Creator": "notabug"})
        pyplot.close(figure)
    return path


def style(number: int) -> tuple[str, str, str]:
    """Colour, mark and stroke of a line by its number: no two of the first 27 have the same."""
    round_, place = divmod(number, len(PALETTE))
    return PALETTE[place], MARKS[(place + round_) % len(MARKS)], STROKES[round_ % len(STROKES)]


@dataclass(frozen=True, slots=True)
class End:
    """Where a line ends, and how it looks."""

    name: str
    colour: str
    mark: str
    x: float
    y: float


def _label(axes: Axes, ends: Sequence[End], line: float) -> None:
    """Names in the margin, at the height of their line's end, moved apart by ``line`` where they would touch."""
    low, high = (math.log10(each) for each in axes.get_ylim())
    heights: list[float] = []
    ordered = sorted(ends, key=lambda end: end.y)
    for end in ordered:
        wanted = (math.log10(end.y) - low) / (high - low)
        heights.append(max(wanted, heights[-1] + line) if heights else wanted)
    for place in range(len(heights) - 1, -1, -1):  # down again from the top of the plot
        above = heights[place + 1] - line if place + 1 < len(heights) else 1.0
        heights[place] = min(heights[place], above)
    for end, height in zip(ordered, heights, strict=True):
        axes.plot(
            1.03, height, color=end.colour, marker=end.mark, markersize=3.5, transform=axes.transAxes, clip_on=False
        )
        axes.annotate(
            end.name,
            xy=(end.x, end.y),
            xycoords="data",
            xytext=(1.05, height),
            textcoords="axes fraction",
            color=end.colour,
            va="center",
            annotation_clip=False,
            arrowprops={"arrowstyle": "-", "color": end.colour, "alpha": 0.3, "linewidth": 0.6},
        )
