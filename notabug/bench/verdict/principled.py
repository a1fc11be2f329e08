"""An experiment: the verdict by description length and misfit alone, beside that of the rules of docs/judge.md.

``python -m notabug.bench.verdict.principled OUT.json [PICTURES]`` judges pictures of the tuning half both ways and
prints both tables; docs/decisions/0016-description-length.md has the outcome. A stopped bench goes on where it was.

A hypothesis is a set of limitations, a fault beside it, or nothing at all. It costs

    sum over pixels of rho(max(distance from what it admits - tolerance, 0) / sigma)  +  lambda x bits to describe it

both in bits. Bits are: for each choice the logarithm of how many there are; for a partial limitation besides a share
at each pixel where it acts; for a mixture the entropy of which value each sample takes; for a hull or a fault that may
show anything a value at each pixel. A bug that nobody knows describes the pixels that it spoils one by one. The
cheapest hypothesis is the verdict, and ``inconclusive`` where one with a bug and one without cost nearly the same.
"""

from __future__ import annotations

import json
import math
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from itertools import product
from pathlib import Path
from unittest import mock

import numpy as np
import numpy.typing as npt

from notabug.adapters.base import Declaration
from notabug.bench.verdict.design import QUICK, Group, Label, groups
from notabug.bench.verdict.sensitivity_pictures import SIDE, Sample, judged, taken
from notabug.metrics import rules
from notabug.metrics.admissible import Admissible, residual
from notabug.metrics.channels import largest
from notabug.metrics.expected import expected
from notabug.metrics.explain import Explanation, explain
from notabug.metrics.likely import likely
from notabug.metrics.naming import possible
from notabug.metrics.noise import Measured
from notabug.metrics.policy import POLICY, with_value
from notabug.metrics.predictions import Predictions
from notabug.metrics.quick import choices
from notabug.metrics.rules import RULES, Trial
from notabug.metrics.sets import admitted
from notabug.references.models.model import Model, excluded_by, models
from notabug.runs.folders import write_json

Floats = npt.NDArray[np.floating]

LAMBDAS = (0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0)
MARGINS = (
    0.0,
    0.5,
    1.0,
    2.0,
    4.0,
)  # bits, times lambda: a bug and no bug that cost so nearly the same are not told apart
SHARE_BITS = 3.0  # of a share from 0 to 1 at one pixel, as exact as a tolerance mostly is
LARGEST = 4  # models in a hypothesis
FAULTS = 3  # likeliest ones that are tried
BITS = 1.0 / math.log(2.0)  # a nat
CONDITIONS = {"clean": 3, "limitation": 2, "bug": 2}  # of each group
NO_TEST = with_value(POLICY, "rules.mean_alpha", 0.0)  # a segment without today's structural test


@dataclass(frozen=True, slots=True, eq=False)
class Hypothesis:
    """What a set of models costs: ``bits`` of its description, and the ``misfit`` (n,) of each pixel, in bits."""

    chosen: tuple[Model, ...]
    fault: bool
    limited: bool  # a limitation, not only conventions, acts
    bits: float
    misfit: Floats

    def cost(self, factor: float) -> float:
        """Where the hypothesis says all."""
        return float(self.misfit.sum()) + factor * self.bits

    def spoilt(self, factor: float, free: float) -> float:
        """Where an unknown bug besides describes some pixels one by one, each by ``free`` bits, the cheapest way."""
        return float(np.minimum(self.misfit, factor * free).sum()) + factor * self.bits


@dataclass(frozen=True, slots=True, eq=False)
class Case:
    """One picture, and what models predict of its scene."""

    measured: Measured
    predicted: Predictions
    open_to: tuple[Model, ...]
    faults: tuple[Model, ...]

    @property
    def free(self) -> float:
        """Bits that tell where a pixel is and what it shows: three values below the peak, as exact as the tolerance."""
        reference = self.predicted(())
        steps = float(reference.value.max(initial=0.0)) / float(np.median(reference.tau))
        return math.log2(reference.edge.size) + 3.0 * math.log2(max(2.0, steps))


def prepared(sample: Sample) -> Case:
    """The case of ``sample``, as judge.py makes it up to step 6."""
    scene, declaration = sample.scene, Declaration(**sample.declared)  # type: ignore[arg-type]
    measured, predicted = expected(scene, declaration).measure(sample.pictures)
    known = list(models(scene))
    faults = [model.under(declaration) for model in known if model.kind == "fault" and model.open_to(declaration)]
    return Case(measured, predicted, admitted(known, declaration), tuple(possible(faults, declaration)))


def rho(z: Floats) -> Floats:
    """Huber's function of ``z``, in bits: what normal noise of that size costs, and far out what a Laplacian's does."""
    huber = POLICY.regression.huber
    return np.where(z < huber, 0.5 * z**2, huber * (z - 0.5 * huber)) * BITS


def misfit(measured: Measured, to: Admissible) -> Floats:
    """What each pixel (n,) costs under ``to``; without noise a tolerance stands for its standard deviation."""
    beyond = np.maximum(np.abs(residual(measured.mean, to)) - to.tau, 0.0)
    sigma = np.maximum(np.sqrt(measured.variance), POLICY.significance.floor * to.tau) if measured.noisy else to.tau
    return np.asarray(rho(largest(beyond / sigma)) / measured.kappa).ravel()


def entropy(share: float) -> float:
    """Bits of one answer, yes with that ``share``.

    >>> entropy(0.5), entropy(0.0)
    (1.0, 0.0)
    """
    return -sum(part * math.log2(part) for part in (share, 1.0 - share) if part > 0.0)


def described(model: Model, alpha: Floats, within: npt.NDArray[np.bool_], free: float) -> float:
    """Bits that tell what ``model`` does at each pixel where it acts: where it shows nothing it says nothing."""
    count = float(within.sum())
    if not count or not alpha[within].any():
        return 0.0
    acting = float(np.count_nonzero(alpha[within]))
    if model.rule == "any":
        return acting * free
    if model.rule == "set":  # as many samples as pixels: that of a mean of many is the entropy of their mean
        return count * entropy(float(alpha[within].mean())) + acting * math.log2(len(model.values()))
    return count * entropy(acting / count) + acting * SHARE_BITS


def hypothesis(case: Case, chosen: tuple[Model, ...], fault: Model | None = None) -> Hypothesis:
    """What ``chosen``, and a ``fault`` that all of them act on, cost."""
    every = (*((fault,) if fault is not None else ()), *chosen)
    fixed = choices(every)
    target = case.predicted(fixed)
    bits = sum(math.log2(1 + len(case.open_to)) for _ in chosen)
    if fault is not None:  # which one, and how strong
        bits += math.log2(1 + len(case.faults)) + (SHARE_BITS if fault.at is not None else 0.0)
    hulls = tuple(model for model in every if model.rule == "hull")
    limited = any(model.kind == "limitation" for model in choices(chosen))
    with mock.patch.object(rules, "POLICY", NO_TEST):
        for model in (*hulls, *(model for model in every if model.rule not in ("hull", "choice"))):
            moved = () if model in hulls else hulls
            trial = Trial(case.measured, target, model, fixed, moved, case.predicted)
            target, alpha, within, _ = RULES[model.rule](trial.measured, trial.base, *trial.values())
            bits += described(model, alpha, within, case.free)
            limited |= model.kind == "limitation" and bool(alpha.any())
    return Hypothesis(chosen, fault is not None, limited, bits, misfit(case.measured, target))


def explored(case: Case, factor: float, known: dict[tuple[str, ...], Hypothesis]) -> list[Hypothesis]:
    """Sets of limitations and conventions, each the cheapest that the one before grows to, and faults beside the last.

    ``known`` keeps what was computed for other factors.
    """

    def of(chosen: tuple[Model, ...], fault: Model | None = None) -> Hypothesis:
        key = tuple(f"{model.name} {model.when} {model.claim}" for model in (*chosen, *((fault,) if fault else ())))
        if key not in known:
            known[key] = hypothesis(case, chosen, fault)
        return known[key]

    found = [of(())]
    best = found[0]
    while len(best.chosen) < LARGEST and best.misfit.any():
        more = [
            of((*best.chosen, model))
            for model in case.open_to
            if model not in best.chosen and not excluded_by(model, best.chosen)
        ]
        if not more:
            break
        found += more
        nearest = min(more, key=lambda each: each.cost(factor))
        if nearest.cost(factor) >= best.cost(factor):
            break
        best = nearest
    if best.cost(factor) > factor * math.log2(1 + len(case.faults)):  # else no fault can be cheaper
        for fault in likeliest(case):
            found.append(of((), fault))
            found += [of(best.chosen, fault)] if best.chosen else []
    return found


def likeliest(case: Case) -> Iterator[Model]:
    """Some faults whose quick pictures look like the picture, at the strength that fits."""
    start: Explanation = explain(case.measured, (), case.predicted)
    names: set[str] = set()
    for strengths in likely(case.measured, start, case.faults, case.predicted, case.predicted.preview):
        fault = next(strengths)
        if fault.name not in names:
            names.add(fault.name)
            yield fault
        if len(names) == FAULTS:
            return


@dataclass(frozen=True, slots=True)
class Costs:
    """What the cheapest hypothesis without a bug costs, and the cheapest with one, in bits.

    ``limited`` says whether the one without a bug has a limitation, ``exact`` whether it leaves no misfit at all.
    """

    clean: float
    wrong: float
    limited: bool
    exact: bool

    def word(self, margin: float) -> str:
        """The verdict's word."""
        if abs(self.clean - self.wrong) < margin and not self.exact:
            return "inconclusive"
        if self.wrong < self.clean:
            return "bug"
        return "limitation" if self.limited else "pass"


def costs(case: Case, factor: float, known: dict[tuple[str, ...], Hypothesis]) -> Costs:
    """The costs where description bits weigh ``factor`` times as much as misfit."""
    found = explored(case, factor, known)
    right = [each for each in found if not each.fault]
    clean = min(right, key=lambda each: each.cost(factor))
    unknown = factor * math.log2(1 + len(case.faults))
    named = [each.cost(factor) for each in found if each.fault]
    spoilt = [each.spoilt(factor, case.free) + unknown for each in right]
    return Costs(clean.cost(factor), min(*named, *spoilt, math.inf), clean.limited, not clean.misfit.any())


def drawn(most: int) -> list[tuple[Group, str]]:
    """Pictures of the tuning half, at most so many, evenly spread over the design."""
    design = groups(replace(QUICK, sides=("tuning",), side=SIDE))
    every = [
        (group, group.conditions[(at + turn) % len(group.conditions)])
        for at, group in enumerate(design)
        for turn in range(min(CONDITIONS[group.label], len(group.conditions)))
    ]
    return every[:: max(1, math.ceil(len(every) / most))]


@dataclass(frozen=True, slots=True)
class Row:
    """What was said of one picture: the word of the rules, the costs by factor, the processor time of both."""

    label: Label
    name: str
    condition: str
    rules: str
    costs: dict[str, Costs]
    seconds: dict[str, float]


def compared(group: Group, condition: str) -> Row:
    """One picture judged both ways."""
    sample = taken(group, condition)
    begun = time.process_time()
    said = judged(sample, "word").word
    between = time.process_time()
    case = prepared(sample)
    known: dict[tuple[str, ...], Hypothesis] = {}
    by_factor = {f"{factor:g}": costs(case, factor, known) for factor in LAMBDAS}
    seconds = {"rules": between - begun, "principled": time.process_time() - between}
    return Row(group.label, group.name, condition, said, by_factor, seconds)


Table = Mapping[Label, Mapping[str, int]]


def table(rows: Sequence[Row], said: Callable[[Row], str]) -> Table:
    """How often each word was said of the pictures of each label."""
    words = ("pass", "limitation", "inconclusive", "bug")
    labels: tuple[Label, ...] = ("clean", "limitation", "bug")
    return {
        label: {each: sum(row.label == label and said(row) == each for row in rows) for each in words}
        for label in labels
    }


def errors(counts: Table) -> tuple[int, int, int]:
    """False alarms, bugs that pass or are called a limitation, and pictures of which nothing is said."""
    open_ones = sum(words["inconclusive"] for words in counts.values())
    return (
        counts["clean"]["bug"] + counts["limitation"]["bug"],
        counts["bug"]["pass"] + counts["bug"]["limitation"],
        open_ones,
    )


def printed(rows: Sequence[Row]) -> str:
    """The tables of the rules and of the factor and margin with the fewest errors, and the errors of the others."""

    def said(factor: float, margin: float, row: Row) -> str:
        return row.costs[f"{factor:g}"].word(factor * margin)

    pairs = list(product(LAMBDAS, MARGINS))
    each = {pair: table(rows, partial(said, *pair)) for pair in pairs}
    best = min(each, key=lambda pair: (sum(errors(each[pair])), pair))
    lines = [f"{len(rows)} pictures of the tuning half, {SIDE} x {SIDE}"]
    titled = (
        ("rules", table(rows, lambda row: row.rules)),
        ("description length, lambda {:g}, margin {:g}".format(*best), each[best]),
    )
    for title, counts in titled:
        lines.append(f"\n{title}\n{'':12}{'pass':>8}{'limitation':>12}{'inconclusive':>14}{'bug':>6}")
        for label, words in counts.items():
            lines.append(
                f"{label:12}{words['pass']:8}{words['limitation']:12}{words['inconclusive']:14}{words['bug']:6}"
            )
        lines.append("false alarms {}, missed {}, inconclusive {}".format(*errors(counts)))
    lines.append("\nfalse alarms, missed, inconclusive by lambda (down) and margin (across)")
    lines.append(f"{'':8}" + "".join(f"{margin:>16g}" for margin in MARGINS))
    for factor in LAMBDAS:
        cells = (", ".join(map(str, errors(each[factor, margin]))) for margin in MARGINS)
        lines.append(f"{factor:<8g}" + "".join(f"{cell:>16}" for cell in cells))
    lines.append(
        ", ".join(
            f"seconds of {kind}: {sum(row.seconds[kind] for row in rows):.0f}" for kind in ("rules", "principled")
        )
    )
    return "\n".join(lines)


def read(path: Path) -> dict[str, Row]:
    """The rows that a bench has written."""
    known = json.loads(path.read_text("utf-8")) if path.exists() else {}
    return {
        key: Row(**{**row, "costs": {factor: Costs(**costs) for factor, costs in row["costs"].items()}})
        for key, row in known.items()
    }


def main(out: Path, most: int) -> None:
    """Judge what OUT.json does not hold yet, and print the tables."""
    known = read(out)
    for group, condition in drawn(most):
        key = f"{group.key()} {condition}"
        if key not in known:
            known[key] = compared(group, condition)
            write_json(out, {key: asdict(row) for key, row in known.items()})
    print(printed(list(known.values())))


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 300)
