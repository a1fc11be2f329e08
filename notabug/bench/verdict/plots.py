"""The benchmark's plots, as SVG: ROC areas, and the smallest strength found."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import matplotlib as mpl
from matplotlib.figure import Figure

from notabug.bench.verdict.summary import OURS, Record


def draw(out: Path, document: Record) -> Iterator[Path]:
    """Write the plots of the evaluation side into ``out`` and return their paths."""
    mpl.rcParams["svg.hashsalt"] = "notabug"  # the same numbers give the same file
    side = document["sides"]["evaluation"]
    for name, figure in (("auc", _areas(side)), ("floors", _floors(side))):
        path = out / f"{name}.svg"
        figure.savefig(path, metadata={"Date": None}, bbox_inches="tight")
        yield path


def _areas(side: Record) -> Figure:
    rows = sorted((row for row in side["judges"] if row["auc"] is not None), key=lambda row: row["auc"])
    figure = Figure(figsize=(6, 0.28 * len(rows) + 1))
    axes = figure.subplots()
    colours = ["#0a7d5a" if row["name"] == OURS else "#9aa3ad" for row in rows]
    axes.barh([row["name"] for row in rows], [row["auc"] for row in rows], color=colours)
    for y, row in enumerate(rows):
        axes.text(row["auc"] + 0.005, y, f"{row['auc']:.3f}", va="center", fontsize=8)
    axes.set(xlim=(0, 1.08), xlabel="area under the ROC curve: a bug against a limitation")
    axes.axvline(0.5, color="black", linewidth=0.5, linestyle=":")
    axes.spines[["top", "right"]].set_visible(False)
    return figure


def _floors(side: Record) -> Figure:
    """For each judge the share of (fault, condition) pairs it finds at some strength without a false alarm."""
    names = [row["name"] for row in side["judges"]]
    rows = side["floors"]
    share = {name: sum(row["floor"][name] is not None for row in rows) / max(len(rows), 1) for name in names}
    order = sorted(names, key=lambda name: share[name])
    figure = Figure(figsize=(6, 0.28 * len(order) + 1))
    axes = figure.subplots()
    axes.barh(order, [share[name] for name in order], color=["#0a7d5a" if n == OURS else "#9aa3ad" for n in order])
    axes.set(xlim=(0, 1), xlabel="share of faults and conditions found at some strength at zero false alarms")
    axes.spines[["top", "right"]].set_visible(False)
    return figure
