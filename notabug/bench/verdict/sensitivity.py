"""How a verdict depends on each number that decides: pictures judged with it halved and doubled.

``python -m notabug.bench.verdict.sensitivity OUT.json [ROW ...]`` judges a fixed sample of pictures as they are, and
notes which numbers each judgement reads: one that is never read cannot move it. Then it judges pictures that read a
number (or each of the rows alone) with the number at half and at twice its value, and adds to OUT.json by how many
words, names and figures that changes. A stopped bench goes on where it was; what was read is kept in OUT.reads.json.
"""

from __future__ import annotations

import importlib
import json
import math
import signal
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, nullcontext
from dataclasses import asdict, dataclass
from functools import partial
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec, PathFinder, SourceFileLoader
from itertools import zip_longest
from pathlib import Path
from types import CodeType, FrameType, ModuleType

from notabug.bench.verdict.numbers import SCALED, changed, scaled
from notabug.bench.verdict.reads import EVERY, FLOORS, imported_by, noting, own_cache
from notabug.bench.verdict.sensitivity_pictures import Planned, Said, Way, every, judged
from notabug.runs.folders import write_json

FACTORS = {"halved": 0.5, "doubled": 2.0}
FIRST: dict[Way, int] = {"word": 12, "eye": 4, "card": 12, "name": 4}
"""Pictures that are judged anew for every number that they read; the others only until one of them changes."""
ALSO_NAMED = 2  # of the pictures whose word alone was compared, where none changed
FELT = 0.1  # of a severity: a smaller change of it is a detail
MOST = 5.0  # times as much processor time as a picture took of which nothing was predicted: a longer search is stopped


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


@contextmanager
def with_number(row: str, factor: float) -> Iterator[None]:
    """The judge with the number of ``row`` times ``factor``; predictions that depend on it are not kept."""
    below = row.startswith("references.")
    with imported_by(_Finder(row, factor), FLOORS if below else FLOORS[-1:]), own_cache() if below else nullcontext():
        if not below:
            policy = importlib.import_module("notabug.metrics.policy")  # others take POLICY from it after this
            value = scaled(policy.value_of(policy.POLICY, row), factor)
            vars(policy)["POLICY"] = policy.with_value(policy.POLICY, row, value)
        yield


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


@dataclass(frozen=True, slots=True)
class Plain:
    """What is said of a picture as it is, the numbers that were read for that, and the processor time, in seconds."""

    said: Said
    rows: tuple[str, ...]
    seconds: float


Known = Mapping[tuple[int, Way], Plain]


def noted(samples: Sequence[Planned], kept: Path) -> Known:
    """What is said and read of each of ``samples`` in each of its ways; ``kept`` is written after each.

    The numbers of a way are those that no quicker way reads.
    """
    known: dict[tuple[int, Way], Plain] = {}
    places = {planned.name: at for at, planned in enumerate(samples)}
    if kept.exists():
        for name, way, said, rows, seconds in json.loads(kept.read_text("utf-8")):
            if name in places:
                said = Said(**{**said, "bugs": tuple(said["bugs"]), "limitations": tuple(said["limitations"])})
                known[places[name], way] = Plain(said, tuple(rows), seconds)
    missing = [at for at, planned in enumerate(samples) if not all((at, way) in known for way in planned.ways)]
    drawn = {at: samples[at].sample for at in missing}  # by the modules as they are
    with noting() as judge:
        for at, sample in drawn.items():
            before: frozenset[str] = frozenset()
            with judge.fresh():
                for way in samples[at].ways:
                    begun = time.process_time()
                    said, rows = judge.of(partial(judged, sample, way))
                    known[at, way] = Plain(said, tuple(sorted(rows - before)), time.process_time() - begun)
                    before |= rows
            told = [
                (samples[number].name, way, asdict(plain.said), plain.rows, plain.seconds)
                for (number, way), plain in known.items()
            ]
            kept.write_text(json.dumps(told), "utf-8")
    return known


def readers(row: str, samples: Sequence[Planned], known: Known) -> list[tuple[int, Way]]:
    """The pictures that read ``row``, each in the quickest way that does: quick ways first, labels in turn."""
    found = [key for key, plain in known.items() if row in plain.rows]
    order: list[tuple[int, Way]] = []
    for way in FIRST:
        labels = {samples[at].label for at, _ in found}
        by_label = [
            [key for key in found if key[1] == way and samples[key[0]].label == each] for each in sorted(labels)
        ]
        order += [key for keys in zip_longest(*by_label) for key in keys if key is not None]
    return order


def differences(before: Sequence[Said], after: Sequence[Said]) -> dict[str, object]:
    """How many of the verdicts ``after`` a change of a number are others than ``before``, and of which word."""
    pairs = list(zip(before, after, strict=True))
    moved = [f"{old.word} to {new.word}" for old, new in pairs if old.word != new.word]
    same = [(old, new) for old, new in pairs if old.word == new.word]
    named = sum((old.bugs, old.limitations) != (new.bugs, new.limitations) for old, new in same)
    felt = sum(not math.isclose(old.severity, new.severity, rel_tol=FELT, abs_tol=FELT) for old, new in pairs)
    details = sum(old.details != new.details for old, new in pairs)
    return {"words": len(moved), "names": named, "figures": felt, "details": details, "changes": sorted(moved)}


def effect(row: str, factor: float, samples: Sequence[Planned], known: Known) -> dict[str, object]:
    """What ``row`` times ``factor`` changes in pictures that read it, and how many were judged.

    Where the first of them show no change the others are judged too, until one does.
    """
    order = readers(row, samples, known)
    first = [key for way, count in FIRST.items() for key in [key for key in order if key[1] == way][:count]]
    rest = [key for key in order if key not in first]
    named: list[tuple[int, Way]] = [(at, "name") for at, way in order if way == "word" and samples[at].label == "bug"]
    tried: list[tuple[int, Way]] = []
    after: list[Said] = []
    for keys in (first, (*rest, *named[:ALSO_NAMED])):
        drawn = [samples[at].sample for at, _ in keys]  # by the modules as they are
        with with_number(row, factor):
            for key, sample in zip(keys, drawn, strict=True):
                if keys is not first and [known[other].said for other in tried] != after:
                    break
                tried.append(key)
                try:
                    with at_most(MOST * max(1.0, known[key].seconds)):
                        after.append(judged(sample, key[1]))
                except Exception as error:
                    return {"judged": len(tried), "fails": f"{type(error).__name__}: {error}"}
        if [known[key].said for key in tried] != after:
            break
    return {"judged": len(tried), **differences([known[key].said for key in tried], after)}


def measure(out: Path, rows: Sequence[str]) -> None:
    """Judge pictures with the number of each of ``rows`` halved and doubled; ``out`` is written after each."""
    samples = every()
    known = noted(samples, out.with_suffix(".reads.json"))
    told: dict[str, dict[str, object]] = json.loads(out.read_text("utf-8"))["rows"] if out.exists() else {}
    words = [known[at, sample.ways[0]].said.word for at, sample in enumerate(samples) if not sample.card]
    reads = {row: len(readers(row, samples, known)) for row in EVERY}
    about = {
        "pictures": len(words),
        "cards": sum(sample.card for sample in samples),
        "words": {word: words.count(word) for word in words},
        "reads": reads,
    }
    write_json(out, {**about, "rows": told})
    for row in rows:
        if row in told or not reads[row]:
            continue
        told[row] = {kind: effect(row, factor, samples, known) for kind, factor in FACTORS.items()}
        write_json(out, {**about, "rows": told})
        print(row, json.dumps(told[row]), flush=True)


if __name__ == "__main__":
    measure(Path(sys.argv[1]), sys.argv[2:] or EVERY)
