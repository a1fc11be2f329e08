"""The bench of faults: the same cases each time, each fault is found and named, and it goes on where it was."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from notabug.bench import faults, faults_batch, faults_cases
from notabug.bench.faults import Part
from notabug.bench.faults_batch import Taken
from notabug.bench.faults_cases import KINDS, damaged, fault, is_sound
from notabug.command_line.options import BenchPart
from notabug.scenes_usd.errors import SelectionError


def test_what_is_damaged_is_good_before() -> None:
    assert is_sound()


@pytest.mark.parametrize("kind", KINDS)
def test_damaged_files_are_read_or_refused(kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NOTABUG_TRUST", "")
    assert {number: fault(kind, 7, number) for number in range(12) if fault(kind, 7, number)} == {}


def test_cases_are_the_same_each_time_and_differ() -> None:
    for kind in KINDS:
        cases = [damaged(kind, 0, number) for number in range(20)]
        assert cases == [damaged(kind, 0, number) for number in range(20)]
        assert len({data for _, data in cases}) > 15


def test_a_trace_is_a_fault(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(faults_cases._TAKERS, "records", lambda path: 1 / 0)
    assert fault("records", 0, 0) == "ZeroDivisionError: division by zero"


CHILD = """
import json, os, sys, time
first, count, notes, deed = int(sys.argv[1]), int(sys.argv[2]), sys.argv[3], sys.argv[4]
with open(notes, "a") as log:
    for number in range(first, first + count):
        print(json.dumps([number, None]), file=log, flush=True)
        if number == 3 and deed == "dies":
            os.abort()
        if number == 3 and deed == "sleeps":
            time.sleep(3600)
        if number == 1:
            print(json.dumps([number, "a trace"]), file=log, flush=True)
            print(json.dumps([number, {"seconds": 0.5, "memory": 7}]), file=log, flush=True)
"""


@pytest.mark.parametrize(
    ("deed", "took", "says"), [("nothing", 6, ""), ("dies", 4, "exit state -6"), ("sleeps", 4, "no end in")]
)
def test_the_case_that_ends_or_stops_its_process_is_named(
    deed: str, took: int, says: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(faults_batch, "STILL", 2.0)

    def program(kind: str, seed: int, first: int, count: int, notes: Path) -> list[str]:
        del kind, seed
        return [sys.executable, "-S", "-c", CHILD, str(first), str(count), str(notes), deed]

    taken = faults_batch.batch("records", 0, 0, 6, program)
    assert taken.cases == took
    assert taken.faults[0] == (1, "a trace")
    assert [number for number, _ in taken.faults[1:]] == ([3] if says else [])
    assert all(says in what for _, what in taken.faults[1:])
    assert (taken.longest, taken.memory) == (0.5, 7)


def test_what_a_batch_costs_is_told() -> None:
    taken = faults_batch.batch("configurations", 0, 0, 3)
    assert (taken.cases, taken.faults) == (3, ())
    assert 0.0 < taken.longest < faults_batch.SECONDS
    assert 1 << 20 < taken.memory < 2 << 30


def the_command(out: Path, *parts: str) -> int:
    return faults.command(parts=parts, quick=True, seed=1, out=out, resume=True, as_json=False)


def test_it_goes_on_where_it_was(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[tuple[str, int, int]] = []
    most = 4

    def take(name: str) -> Callable[[int, int, int], Taken]:
        def taken(seed: int, first: int, count: int) -> Taken:
            assert seed == 1
            if len(asked) == most:
                raise KeyboardInterrupt
            asked.append((name, first, count))
            return Taken(count, longest=float(first), memory=count)

        return taken

    parts = {name: Part(100, 12, 8, take(name)) for name in ("one", "two", "three")}
    monkeypatch.setattr(faults, "PARTS", parts)
    with pytest.raises(KeyboardInterrupt):
        the_command(tmp_path)
    most = 100
    assert the_command(tmp_path) == 0
    assert asked == [(name, at, count) for name in parts for at, count in ((0, 8), (8, 4))]
    told = json.loads((tmp_path / "faults.json").read_text())["parts"]
    assert {name: state["cases"] for name, state in told.items()} == dict.fromkeys(parts, 12)
    assert {(state["longest"], state["memory"]) for state in told.values()} == {(8.0, 8)}


def test_parts_by_name_a_fault_and_what_cannot_be_taken(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    parts = {
        "bad": Part(2, 2, 2, lambda seed, first, count: Taken(count, ((1, "it broke"),))),
        "not_here": Part(2, 2, 2, lambda seed, first, count: Taken(1 // 0), lambda: "no such system"),
        "good": Part(2, 2, 2, lambda seed, first, count: Taken(count)),
    }
    monkeypatch.setattr(faults, "PARTS", parts)
    assert the_command(tmp_path, "good", "not_here") == 0
    assert "not_here: skipped, no such system" in capsys.readouterr().out
    assert the_command(tmp_path, "bad") == 1
    assert "bad 1: it broke" in capsys.readouterr().out
    with pytest.raises(SelectionError, match="no part of faults"):
        the_command(tmp_path, "meshes")


def test_counts_are_what_was_promised() -> None:
    full = {name: part.full for name, part in faults.PARTS.items()}
    assert sum(full[kind] for kind in KINDS) == 100_000
    assert full["misdeeds"] >= 50
    assert (full["kills"], full["disks"]) == (100, 20)
    assert set(full) <= {part.value for part in BenchPart}
