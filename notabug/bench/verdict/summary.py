"""From records to the numbers: confusion, names, ROC, false alarms, detection floors, each with its interval."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy import stats

Record = dict[str, Any]
LABELS = ("clean", "limitation", "bug")
WORDS = ("pass", "limitation", "bug", "inconclusive")
OURS = "notabug"
BUDGET = 2_000_000  # samples a picture of Mitsuba's test
RESAMPLES = 1000


def shown(records: Iterable[Record]) -> list[Record]:
    """The records whose picture shows what it is labelled with; clean ones always do."""
    return [record for record in records if record["label"] == "clean" or record["shows"]]


def rate(records: Sequence[Record], good: Callable[[Record], bool]) -> Record:
    """The share of ``records`` that are ``good``, with a 95 % interval by a bootstrap over scenes.

    Where none, or all, are good a bootstrap says nothing: there the interval is Clopper and Pearson's.
    """
    by_scene: dict[str, list[bool]] = defaultdict(list)
    for record in records:
        by_scene[record["scene"]].append(good(record))
    hits, n = sum(sum(each) for each in by_scene.values()), len(records)
    if not n:
        return {"share": None, "hits": 0, "of": 0, "interval": [0.0, 1.0]}
    if hits in (0, n):
        found = stats.binomtest(hits, n).proportion_ci(0.95)
        return {"share": hits / n, "hits": hits, "of": n, "interval": [float(found.low), float(found.high)]}
    rng = np.random.default_rng(0)
    sums = np.array([[sum(each), len(each)] for each in by_scene.values()])
    drawn = sums[rng.integers(0, len(sums), (RESAMPLES, len(sums)))].sum(axis=1)
    low, high = np.percentile(drawn[:, 0] / drawn[:, 1], [2.5, 97.5])
    return {"share": hits / n, "hits": hits, "of": n, "interval": [float(low), float(high)]}


def area(bad: npt.ArrayLike, good: npt.ArrayLike) -> float | None:
    """The area under the ROC curve: the chance that a bug scores higher than a limitation, ties by half."""
    a, b = np.asarray(bad, float), np.asarray(good, float)
    if not a.size or not b.size:
        return None
    ranks = stats.rankdata(np.concatenate([a, b]))[: a.size]
    return float((ranks.sum() - a.size * (a.size + 1) / 2) / (a.size * b.size))


def best_threshold(bad: Sequence[float], good: Sequence[float]) -> tuple[float, float]:
    """The threshold with the highest balanced accuracy, and that accuracy: an upper bound, read off the labels."""
    best = (math.inf, 0.5)
    a, b = np.sort(np.asarray(bad, float)), np.sort(np.asarray(good, float))
    for threshold in np.unique(np.concatenate([a, b])):
        caught = 1.0 - np.searchsorted(a, threshold, "right") / a.size
        quiet = np.searchsorted(b, threshold, "right") / b.size
        if (caught + quiet) / 2 > best[1]:
            best = (float(threshold), float((caught + quiet) / 2))
    return best


def confusion(records: Sequence[Record]) -> dict[str, dict[str, int]]:
    """Pictures by label and by our word."""
    return {
        label: {word: sum(r["label"] == label and r["word"] == word for r in records) for word in WORDS}
        for label in LABELS
    }


def scores(records: Sequence[Record], judge: str) -> list[float]:
    """What ``judge`` says of each picture; a gate that has no number for one, an infinite picture say, rejects it."""
    found = [r["severity"] if judge == OURS else r["gates"][judge] for r in records]
    return [1e9 if math.isnan(each) else min(each, 1e9) for each in found]


def judges(records: Sequence[Record]) -> list[Record]:
    """Each gate, and ours: areas under the curve, accuracy at its own and at its best threshold, false alarms."""
    from notabug.bench.verdict.gates import gates

    seen = [each for each in shown(records) if each["gates"]]
    bugs, limited, clean = ([r for r in seen if r["label"] == label] for label in ("bug", "limitation", "clean"))
    rows = []
    for name, own in ((OURS, True), *((gate.name, gate.own) for gate in gates())):
        bad, good, quiet = (scores(each, name) for each in (bugs, limited, clean))
        row: dict[str, Any] = {
            "name": name,
            "auc": area(bad, good),
            "auc_clean": area(bad, quiet),
            "best": best_threshold(bad, good)[1] if bad and good else None,
        }
        if own:
            row["missed"] = _above(bad, below=True)
            row["limitations_called_bug"] = _above(good)
            row["clean_called_bug"] = _above(quiet)
        rows.append(row)
    return rows


def _above(values: Sequence[float], *, below: bool = False) -> float | None:
    if not values:
        return None
    return float(np.mean([(value <= 1.0) if below else (value > 1.0) for value in values]))


def floors(records: Sequence[Record]) -> list[Record]:
    """Per fault with several strengths and per condition: the smallest strength that ours, and each gate, finds.

    A judge finds a picture that scores above all clean and limited pictures of that condition (no false alarm), and a
    strength if it finds every picture of it.
    """
    from notabug.bench.verdict.gates import gates

    rows = []
    names = (OURS, *(gate.name for gate in gates()))
    scored = [record for record in records if record["gates"]]
    quiet: dict[str, list[Record]] = defaultdict(list)
    for each in scored:
        if each["label"] != "bug":
            quiet[each["condition"]].append(each)
    by: dict[tuple[str, str], list[Record]] = defaultdict(list)
    for each in scored:
        if each["label"] == "bug" and each["shows"]:
            by[each["name"], each["condition"]].append(each)
    for (fault, condition), found in sorted(by.items()):
        strengths = sorted({each["strength"] for each in found}, key=lambda s: abs(s - 1.0) if s > 0.5 else s)
        row: dict[str, Any] = {"fault": fault, "condition": condition, "pictures": len(found), "floor": {}}
        for name in names:
            limit = max([1.0 if name == OURS else 0.0, *scores(quiet[condition], name)])
            caught = [
                strength
                for strength in strengths
                if all(s > limit for s in scores([r for r in found if r["strength"] == strength], name))
            ]
            row["floor"][name] = caught[0] if caught else None
        rows.append(row)
    return rows


def sequential(records: Sequence[Record]) -> Record:
    """What the sequential test decided, and the samples it took."""
    found = [r for r in shown(records) if r.get("sequential")]
    used = [r["sequential"]["samples"] for r in found]
    right = {"clean": ("pass",), "limitation": ("limitation",), "bug": ("bug",)}
    return {
        "pictures": len(found),
        "median_samples": float(np.median(used)) if used else None,
        "mean_samples": float(np.mean(used)) if used else None,
        "budget": BUDGET,
        "right": rate(found, lambda r: r["sequential"]["word"] in right[r["label"]]),
        "undecided": rate(found, lambda r: r["sequential"]["word"] == "inconclusive"),
    }


def rightly_named(record: Record) -> bool:
    """Whether a bug has the name of its fault, or of one that was proven to give the same picture."""
    return record["bugs"][0] in record["right"] or bool(record["twin"])


def summary(records: Sequence[Record]) -> Record:
    """Every number of one side of the split."""
    seen = shown(records)
    clean, limited, bugs = ([r for r in seen if r["label"] == label] for label in LABELS)
    named = [r for r in bugs if r["named"] and r["word"] == "bug"]
    must = [r for r in bugs if r["condition"] == "16 samples"]
    return {
        "pictures": len(records),
        "shown": len(seen),
        "faults": len({r["name"] for r in bugs}),
        "confusion": confusion(seen),
        "bugs_missed": rate(bugs, lambda r: r["word"] in ("pass", "limitation")),
        "limitations_called_bug": rate(limited, lambda r: r["word"] == "bug"),
        "clean_called_bug": rate(clean, lambda r: r["word"] == "bug"),
        "limitations_named": rate(limited, lambda r: r["word"] != "bug" and r["limitations"] == r["right"]),
        "faults_named": rate(named, rightly_named),
        "false_alarms": {
            condition: rate([r for r in clean if r["condition"] == condition], lambda r: r["word"] == "bug")
            for condition in dict.fromkeys(r["condition"] for r in clean)
        },
        "must": {
            f"{name} {strength:g}": rate(
                [r for r in must if r["name"] == name and r["strength"] == strength], lambda r: r["word"] == "bug"
            )
            for name, strength in (
                ("light_gain", 1.01),
                ("exponent", 1.1),
                ("pixel_shift", 0.25),
                ("wrong_pixels", 50.0),
            )
        },
        "judges": judges(records),
        "floors": floors(records),
        "sequential": sequential(records),
        "twins": sorted({(r["name"], r["bugs"][0]) for r in named if r["twin"]}),
        "mistakes": [
            {
                key: r[key]
                for key in (
                    "label",
                    "name",
                    "strength",
                    "scene",
                    "seed",
                    "condition",
                    "word",
                    "bugs",
                    "limitations",
                    "triggers",
                    "renderer",
                )
            }
            for r in seen
            if (r["label"] == "clean" and r["word"] not in ("pass", "inconclusive"))
            or (r["label"] == "limitation" and (r["word"] != "limitation" or r["limitations"] != r["right"]))
            or (r["label"] == "bug" and (r["word"] != "bug" or (r["named"] and not rightly_named(r))))
        ],
    }
