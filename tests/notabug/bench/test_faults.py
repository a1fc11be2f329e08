"""The bench of damaged files: the same cases each time, each fault is found and named, and it goes on where it was."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import pytest

from notabug.bench import faults, faults_cases
from notabug.bench.faults_cases import KINDS, damaged, fault, is_sound


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
"""


@pytest.mark.parametrize(
    ("deed", "took", "says"), [("nothing", 6, ""), ("dies", 4, "exit state -6"), ("sleeps", 4, "no end in")]
)
def test_the_case_that_ends_or_stops_its_process_is_named(
    deed: str, took: int, says: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(faults, "STILL", 2.0)

    def program(kind: str, seed: int, first: int, count: int, notes: Path) -> list[str]:
        del kind, seed
        return [sys.executable, "-S", "-c", CHILD, str(first), str(count), str(notes), deed]

    done, found = faults.batch("records", 0, 0, 6, program)
    assert done == took
    assert found[0] == [1, "a trace"]
    assert [number for number, _ in found[1:]] == ([3] if says else [])
    assert all(says in what for _, what in found[1:])


def test_it_goes_on_where_it_was(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[tuple[str, int, int]] = []

    def batch(kind: str, seed: int, first: int, count: int) -> tuple[int, list[Any]]:
        del seed
        if len(asked) == 4:
            raise KeyboardInterrupt
        asked.append((kind, first, count))
        return count, []

    monkeypatch.setattr(faults, "batch", batch)
    monkeypatch.setattr(faults, "QUICK", dict.fromkeys(KINDS, 12))
    monkeypatch.setattr(faults, "BATCH", 8)
    how: dict[str, Any] = {"quick": True, "seed": 1, "out": tmp_path, "resume": True, "as_json": False}
    with pytest.raises(KeyboardInterrupt):
        faults.command(**how)
    first, asked[:] = list(asked), []
    monkeypatch.setattr(
        faults, "batch", lambda *words: (asked.append((words[0], words[2], words[3])), (words[3], []))[1]
    )
    assert faults.command(**how) == 0
    assert first + asked == [(kind, at, count) for kind in KINDS for at, count in ((0, 8), (8, 4))]
    kinds = json.loads((tmp_path / "faults.json").read_text())["kinds"]
    assert {kind: state["cases"] for kind, state in kinds.items()} == dict.fromkeys(KINDS, 12)
