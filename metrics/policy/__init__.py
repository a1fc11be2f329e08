"""For docs/judge.md: every number that decides a verdict, by step, with its unit, meaning and source.

``POLICY.admissible.edge`` is the number ``edge`` that metrics/admissible.py reads: a group is named after its file, and
``regression`` is what several files share. ``entries`` lists them all, also those that stand in references/.
"""

from __future__ import annotations

import importlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, fields, replace
from typing import cast

from notabug.metrics.policy.admitted import Admissible, Leeway
from notabug.metrics.policy.calibration import Calibration
from notabug.metrics.policy.deviating import Excused, Significance
from notabug.metrics.policy.elsewhere import ELSEWHERE
from notabug.metrics.policy.ending import Judge, Perceive
from notabug.metrics.policy.explaining import Explain, Quick, Reach, Rules
from notabug.metrics.policy.hesitating import Hesitation
from notabug.metrics.policy.naming import BugLeg, Causes, Fitted, Lattice, Likely, Names, Naming, WholePicture
from notabug.metrics.policy.number import Said
from notabug.metrics.policy.pictures import ImageChecks, Noise
from notabug.metrics.policy.whole_picture import FewPixels, GlobalFit, Regression

Value = int | float | tuple[object, ...]


@dataclass(frozen=True, slots=True)
class Policy:
    """The groups of numbers, in the order of the steps of docs/judge.md."""

    calibration: Calibration = field(default=Calibration(), metadata={"step": "Calibration of an adapter"})
    image_checks: ImageChecks = field(default=ImageChecks(), metadata={"step": "Step 1: is it a picture?"})
    noise: Noise = field(default=Noise(), metadata={"step": "Step 2: the mean and its noise"})
    admissible: Admissible = field(default=Admissible(), metadata={"step": "Step 3: what is admitted"})
    leeway: Leeway = field(default=Leeway(), metadata={"step": "Step 3: what is admitted"})
    significance: Significance = field(default=Significance(), metadata={"step": "Step 4: what deviates"})
    excused: Excused = field(default=Excused(), metadata={"step": "Step 4: what deviates"})
    global_fit: GlobalFit = field(default=GlobalFit(), metadata={"step": "Step 5: the whole picture"})
    few_pixels: FewPixels = field(default=FewPixels(), metadata={"step": "Step 5: the whole picture"})
    regression: Regression = field(default=Regression(), metadata={"step": "Step 5: the whole picture"})
    rules: Rules = field(default=Rules(), metadata={"step": "Step 6: the search for an explanation"})
    explain: Explain = field(default=Explain(), metadata={"step": "Step 6: the search for an explanation"})
    quick: Quick = field(default=Quick(), metadata={"step": "Step 6: the search for an explanation"})
    reach: Reach = field(default=Reach(), metadata={"step": "Step 6: the search for an explanation"})
    hesitation: Hesitation = field(default=Hesitation(), metadata={"step": "Step 7: no verdict"})
    names: Names = field(default=Names(), metadata={"step": "Step 8: the name of a bug"})
    naming: Naming = field(default=Naming(), metadata={"step": "Step 8: the name of a bug"})
    whole_picture: WholePicture = field(default=WholePicture(), metadata={"step": "Step 8: the name of a bug"})
    lattice: Lattice = field(default=Lattice(), metadata={"step": "Step 8: the name of a bug"})
    likely: Likely = field(default=Likely(), metadata={"step": "Step 8: the name of a bug"})
    bug_leg: BugLeg = field(default=BugLeg(), metadata={"step": "Step 8: the name of a bug"})
    fitted: Fitted = field(default=Fitted(), metadata={"step": "Step 8: the name of a bug"})
    causes: Causes = field(default=Causes(), metadata={"step": "Step 8: the name of a bug"})
    perceive: Perceive = field(default=Perceive(), metadata={"step": "Step 9: what an eye sees"})
    judge: Judge = field(default=Judge(), metadata={"step": "Step 10: the verdict"})


POLICY = Policy()


@dataclass(frozen=True, slots=True)
class Entry:
    """One number of a policy: ``name`` is its group and field, or its module and constant in references/."""

    name: str
    value: Value | Mapping[str, Value]
    step: str
    said: Said


def entries(policy: Policy = POLICY) -> tuple[Entry, ...]:
    """Every number that decides, in the order of the steps; those of references/ stand after the others of a step."""
    elsewhere = [
        Entry(
            there.name, _constant(there.name), there.step, Said(there.unit, there.meaning, there.source, there.decides)
        )
        for there in ELSEWHERE
    ]
    own = list(_own(policy))
    steps = dict.fromkeys(entry.step for entry in (*own, *elsewhere))
    return tuple(entry for step in steps for entry in (*own, *elsewhere) if entry.step == step)


def _own(policy: Policy) -> Iterator[Entry]:
    for group in fields(policy):
        numbers = getattr(policy, group.name)
        for entry in fields(numbers):
            name = f"{group.name}.{entry.name}"
            yield Entry(name, getattr(numbers, entry.name), group.metadata["step"], entry.metadata["said"])


def _constant(name: str) -> Value | Mapping[str, Value]:
    """The value of a constant of references/."""
    path, _, constant = name.rpartition(".")
    return cast(Value | Mapping[str, Value], getattr(importlib.import_module(f"notabug.{path}"), constant))


def plain(value: Value | Mapping[str, Value]) -> object:
    """``value`` in JSON's own types: lists for tuples, objects for tables."""
    if isinstance(value, Mapping):
        return {key: plain(part) for key, part in value.items()}
    return [plain(cast(Value, part)) for part in value] if isinstance(value, tuple) else value


def flat(policy: Policy = POLICY) -> dict[str, float]:
    """Every number that decides, each by itself: those of a tuple or a table have their place in its name.

    >>> flat()["admissible.edge"], flat()["likely.steps.0"]
    (0.19, 4)
    """
    return {name: value for entry in entries(policy) for name, value in _flat(entry.name, plain(entry.value))}


def _flat(name: str, value: object) -> Iterator[tuple[str, float]]:
    if isinstance(value, dict | list):
        for key, part in value.items() if isinstance(value, dict) else enumerate(value):
            yield from _flat(f"{name}.{key}", part)
    else:
        yield name, cast(float, value)


def value_of(policy: Policy, name: str) -> Value:
    """The number ``name`` of a ``policy``, such as ``admissible.edge``."""
    group, _, entry = name.partition(".")
    return cast(Value, getattr(getattr(policy, group), entry))


def with_value(policy: Policy, name: str, value: Value) -> Policy:
    """``policy`` with another ``value`` of the number ``name``, such as ``admissible.edge``."""
    group, _, entry = name.partition(".")
    return replace(policy, **{group: replace(getattr(policy, group), **{entry: value})})
