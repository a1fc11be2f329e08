"""How a verdict depends on each number that decides: pictures of the tuning half, judged with it halved and doubled.

``python -m notabug.bench.verdict.sensitivity OUT.json [ROW ...]`` judges a fixed sample of pictures as they are, then
with each number (or with those of the rows alone) at half and at twice its value, and adds to OUT.json by how many
words, names and figures that changes, and how much longer it takes. A stopped bench goes on where it was.
"""

from __future__ import annotations

import importlib
import json
import math
import os
import signal
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, replace
from functools import partial
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec, PathFinder, SourceFileLoader
from pathlib import Path
from types import CodeType, FrameType, ModuleType

import numpy as np
import numpy.typing as npt

from notabug.bench.verdict.design import QUICK, Group, groups, number
from notabug.bench.verdict.evaluate import drawing, fault_of, filmed, scene_of, subsamples
from notabug.bench.verdict.image_formation import BY_NAME, shoot, written
from notabug.bench.verdict.numbers import SCALED, changed, found, scaled
from notabug.runs.folders import write_json
from notabug.scenes_usd.scene import Scene

SIDE = 40  # pixels of a picture's side
PICTURES = {"clean": 8, "limitation": 9, "bug": 10}  # of each label
NAMED = 4  # of the bugs: to name one takes ten times as long as to judge it
BESIDE = ("calibration", "perceive")  # the files whose numbers take no part in this bench's verdicts
NAMES = ("names", "naming", "likely", "causes")  # the files whose numbers name a bug and never change a word
FACTORS = {"halved": 0.5, "doubled": 2.0}
UPPER = ("notabug.references", "notabug.adapters", "notabug.metrics")  # the floors that are read again
FELT = 0.1  # of a figure: a smaller change of it is not counted
MOST = 15.0  # times as much processor time as the sample takes as it is: a longer search is stopped


@dataclass(frozen=True, slots=True, eq=False)
class Sample:
    """One picture of the sample, before it is judged; ``declared`` holds the fields of its declaration."""

    label: str
    scene: Scene
    pictures: tuple[npt.NDArray[np.float32], ...]
    declared: Mapping[str, object]


@dataclass(frozen=True, slots=True)
class Said:
    """What of a verdict is compared."""

    word: str
    bugs: tuple[str, ...]
    limitations: tuple[str, ...]
    severity: float


def chosen() -> list[tuple[Group, str]]:
    """The groups of the sample and the condition of each: of every label as many different scenes as there are."""
    design = groups(replace(QUICK, sides=("tuning",), side=SIDE))
    result: list[tuple[Group, str]] = []
    for label, count in PICTURES.items():
        of_label = [group for group in design if group.label == label]
        seen: dict[str, int] = {}
        ranked: list[tuple[int, int, Group]] = []
        for group in of_label:
            ranked.append((seen.get(group.scene, 0), len(ranked), group))
            seen[group.scene] = seen.get(group.scene, 0) + 1
        for at, (_, _, group) in enumerate(sorted(ranked, key=lambda entry: entry[:2])[:count]):
            result.append((group, group.conditions[at % len(group.conditions)]))
    return result


def taken(group: Group, condition_name: str) -> Sample:
    """The picture of ``group`` under a condition."""
    scene = scene_of(group)
    condition = BY_NAME[condition_name]
    picture, _, declared = drawing(group, scene, subsamples(scene, ()))
    fault = fault_of(group)
    pictures = tuple(
        written(filmed(fault, shot, group.strength), condition)
        for shot in shoot((picture,), condition, number("sensitivity", group.key()))
    )
    return Sample(group.label, scene, pictures, {**asdict(condition.declaration()), **declared})


def judged(sample: Sample, *, naming: bool) -> Said:
    """What the judge says that is imported now."""
    judge = importlib.import_module("notabug.metrics.judge").judge
    declaration = importlib.import_module("notabug.adapters.base").Declaration(**sample.declared)
    verdict = judge(sample.pictures, sample.scene, declaration, perceive=False, naming=naming).verdict
    names = {
        kind: tuple(sorted(finding.name for finding in verdict.findings if finding.kind == kind))
        for kind in ("bug", "limitation")
    }
    severity = verdict.numbers.get("severity", math.inf if verdict.word == "bug" else 0.0)
    return Said(verdict.word, names["bug"], names["limitation"], severity)


class _Loader(SourceFileLoader):
    """Loads a module of references/ with its constant ``name`` times ``factor``."""

    def __init__(self, fullname: str, path: str, name: str, factor: float) -> None:
        super().__init__(fullname, path)
        self.constant, self.factor = name, factor

    def get_code(self, fullname: str) -> CodeType:
        tree = changed(Path(self.get_filename(fullname)).read_text("utf-8"), self.constant)
        return compile(tree, self.get_filename(fullname), "exec", dont_inherit=True)

    def exec_module(self, module: ModuleType) -> None:
        module.__dict__[SCALED] = partial(scaled, factor=self.factor)
        super().exec_module(module)


class _Finder(MetaPathFinder):
    """Finds the module of references/ with the number of ``row`` for ``_Loader``."""

    def __init__(self, row: str, factor: float) -> None:
        self.module, _, self.constant = f"notabug.{row}".rpartition(".")
        self.factor = factor

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        spec = PathFinder.find_spec(fullname, path, target) if fullname == self.module else None
        if spec is not None and spec.origin is not None:
            spec.loader = _Loader(fullname, spec.origin, self.constant, self.factor)
        return spec


def _read_again(floors: Sequence[str]) -> dict[str, ModuleType]:
    """Forget the modules of ``floors``, so that they are imported anew; the C++ module has no second copy."""
    known = {name: module for name, module in sys.modules.items() if name.startswith(tuple(floors))}
    for name in known:
        if not name.endswith("_native"):
            del sys.modules[name]
    return known


def _put_back(known: Mapping[str, ModuleType]) -> None:
    """Import what was ``known`` again as it was, also where it is asked for as a part of its package."""
    sys.modules.update(known)
    for name, module in known.items():
        package, _, part = name.rpartition(".")
        if package in sys.modules:
            setattr(sys.modules[package], part, module)


@contextmanager
def with_number(row: str, factor: float) -> Iterator[None]:
    """The judge with the number of ``row`` times ``factor``; predictions that depend on it are not kept."""
    below = row.startswith("references.")
    floors = UPPER if below else UPPER[-1:]
    known = _read_again(floors)
    finder = _Finder(row, factor)
    sys.meta_path.insert(0, finder)
    before = os.environ.get("NOTABUG_CACHE")
    with tempfile.TemporaryDirectory() as folder:
        if below:
            os.environ["NOTABUG_CACHE"] = folder
        try:
            if not below:
                policy = importlib.import_module("notabug.metrics.policy")  # others take POLICY from it after this
                value = scaled(policy.value_of(policy.POLICY, row), factor)
                vars(policy)["POLICY"] = policy.with_value(policy.POLICY, row, value)
            yield
        finally:
            sys.meta_path.remove(finder)
            _read_again(floors)
            _put_back(known)
            if before is None:
                os.environ.pop("NOTABUG_CACHE", None)
            else:
                os.environ["NOTABUG_CACHE"] = before


@contextmanager
def at_most(seconds: float) -> Iterator[None]:
    """Raise TimeoutError inside where it takes more processor time; of the main thread only.

    A machine that has other work to do makes no search longer by this clock.
    """

    def stop(_: int, __: FrameType | None) -> None:
        raise TimeoutError(f"stopped after {seconds:.0f} s")

    before = signal.signal(signal.SIGPROF, stop)
    signal.setitimer(signal.ITIMER_PROF, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, before)


def differences(samples: Sequence[Sample], before: Sequence[Said], after: Sequence[Said]) -> dict[str, object]:
    """How many of the verdicts ``after`` a change of a number are others than ``before``, and of which word."""
    pairs = list(zip(samples, before, after, strict=True))
    moved = [f"{old.word} to {new.word}" for _, old, new in pairs if old.word != new.word]
    named = sum(
        old.word == new.word and (old.bugs, old.limitations) != (new.bugs, new.limitations) for _, old, new in pairs
    )
    felt = sum(not math.isclose(old.severity, new.severity, rel_tol=FELT, abs_tol=FELT) for _, old, new in pairs)
    return {"words": len(moved), "names": named, "figures": felt, "changes": sorted(moved)}


def measure(out: Path, rows: Sequence[str]) -> None:
    """Judge the sample with the number of each of ``rows`` halved and doubled; ``out`` is written after each.

    A number that only names bugs is tried on those bugs of the sample that are found, and their names are compared.
    """
    samples = [taken(group, condition) for group, condition in chosen()]
    plain = [judged(sample, naming=False) for sample in samples]
    bugs = [sample for sample, said in zip(samples, plain, strict=True) if sample.label == said.word == "bug"]
    before: dict[bool, tuple[Sequence[Sample], Sequence[Said], float]] = {}
    for naming, some in ((False, samples), (True, bugs[:NAMED])):
        for _ in range(2):  # the first fills the cache
            begun = time.process_time()
            told = [judged(sample, naming=naming) for sample in some]
        before[naming] = some, told, time.process_time() - begun
    known: dict[str, dict[str, object]] = json.loads(out.read_text())["rows"] if out.exists() else {}
    words = [said.word for said in plain]
    sizes = {"pictures": len(samples), "bugs": len(bugs[:NAMED]), "words": {word: words.count(word) for word in words}}
    for row in rows:
        if row in known:
            continue
        known[row] = {}
        naming = row.partition(".")[0] in NAMES
        tried, expected, seconds = before[naming]
        for kind, factor in FACTORS.items():
            begun = time.process_time()
            with with_number(row, factor):
                try:
                    with at_most(MOST * seconds):
                        result = differences(tried, expected, [judged(sample, naming=naming) for sample in tried])
                except Exception as error:
                    result = {"fails": f"{type(error).__name__}: {error}"}
            result["time"] = (time.process_time() - begun) / seconds
            known[row][kind] = result
        write_json(out, {**sizes, "rows": known})
        print(row, json.dumps(known[row]), flush=True)


if __name__ == "__main__":
    every = [row for row in found() if row.partition(".")[0] not in BESIDE]
    measure(Path(sys.argv[1]), sys.argv[2:] or every)
