"""The bench of the judge's numbers: it changes the number that is asked for, that one alone, and puts it back."""

from __future__ import annotations

import importlib
import importlib.util
import json
import signal
import sys
from dataclasses import asdict
from functools import partial
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from notabug.bench.verdict.numbers import changed, found, scaled
from notabug.bench.verdict.reads import EVERY, named, noting
from notabug.bench.verdict.sensitivity import FACTORS, at_most, differences, noted, readers, with_number
from notabug.bench.verdict.sensitivity_pictures import WAYS, Planned, Said, Sample, Way, judged, small_pictures
from notabug.metrics.policy import POLICY, value_of, with_value

ROOT = Path(__file__).resolve().parents[3]
ROWS = sorted(found())


@pytest.fixture(scope="module")
def pages() -> ModuleType:
    spec = importlib.util.spec_from_file_location("judge_sensitivity", ROOT / "docs" / "judge_sensitivity.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_every_number_can_be_changed() -> None:
    for name in ROWS:
        value = value_of(POLICY, name)
        assert value_of(with_value(POLICY, name, scaled(value, 2.0)), name) != value, name


def test_a_constant_that_is_not_there_is_told() -> None:
    with pytest.raises(ValueError, match="has no constant ELSEWHERE"):
        changed("EDGE = 0.19\n", "ELSEWHERE")


@pytest.mark.parametrize(
    ("value", "factor", "expected"),
    [
        (4, 0.5, 2),
        (1, 0.5, 1),
        (3, 2.0, 6),
        (0.2, 2.0, 0.4),
        ((4, 0.75), 2.0, (8, 1.5)),
        ({2: 4, 3: 2}, 0.5, {2: 2, 3: 1}),
    ],
)
def test_whole_numbers_stay_whole(value: object, factor: float, expected: object) -> None:
    assert scaled(value, factor) == expected


@pytest.mark.parametrize("name", ["admissible.edge", "significance.fewest", "likely.steps", "quick.nearer"])
def test_a_number_is_another_one_inside_and_itself_again_after(name: str) -> None:
    module = importlib.import_module(f"notabug.metrics.{name.partition('.')[0]}")
    before = value_of(POLICY, name)
    with with_number(name, 2.0):
        inside = importlib.import_module(module.__name__)
        assert inside is not module
        assert value_of(inside.POLICY, name) == scaled(before, 2.0)
        other = importlib.import_module("notabug.metrics.rules")
        assert other.POLICY is inside.POLICY
        assert asdict(other.POLICY.rules) == asdict(POLICY.rules)
    assert sys.modules[module.__name__] is module
    assert value_of(importlib.import_module("notabug.metrics.policy").POLICY, name) == before


def test_a_number_of_the_references_is_changed_where_others_import_it() -> None:
    with with_number("references.tracer.precision.RELATIVE", 0.5):
        assert importlib.import_module("notabug.metrics.judge").RELATIVE == 0.002
    assert importlib.import_module("notabug.metrics.judge").RELATIVE == 0.004


def test_what_is_computed_from_a_number_at_import_changes_with_it() -> None:
    """The degrees of freedom of a pooled variance: half of its pixels, for each seed beyond the first."""
    pictures = list(np.random.default_rng(1).uniform(size=(4, 32, 32, 3)).astype(np.float32))

    def freedom() -> float:
        measured = importlib.import_module("notabug.metrics.noise").measure(pictures, np.zeros((32, 32), np.bool_))
        return float(measured.freedom * max(1.0, measured.kappa / 2.0))

    assert freedom() == pytest.approx(37.5)
    with with_number("noise.reach", 2.0):
        assert freedom() == pytest.approx(121.5)  # 9 x 9 pixels
    assert freedom() == pytest.approx(37.5)


def test_what_takes_too_long_is_stopped() -> None:
    def search() -> None:
        with at_most(0.05):
            while True:  # it is processor time that counts
                pass

    with pytest.raises(TimeoutError):
        search()
    assert signal.getitimer(signal.ITIMER_PROF) == (0.0, 0.0)  # no alarm is left


def test_words_names_figures_and_details_are_told_apart() -> None:
    before = [Said("pass", (), (), 0.5), Said("bug", ("light_gain",), (), 4.0), Said("pass", (), (), 0.5, "a")]
    after = [Said("bug", ("unexplained",), (), 2.0), Said("bug", ("gamma",), (), 4.0), Said("pass", (), (), 0.52, "b")]
    told = differences(before, after)
    assert told == {"words": 1, "names": 1, "figures": 1, "details": 1, "changes": ["pass to bug"]}


# --- which numbers are read -------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("module", "name", "rows"),
    [
        ("metrics.noise", "SIDE", {"noise.reach"}),
        ("metrics.judge", "RELATIVE", {"references.tracer.precision.RELATIVE"}),
        ("references.tracer.precision", "MOST", {"references.tracer.precision.MOST"}),
    ],
)
def test_a_name_stands_for_the_number_that_it_was_made_of(module: str, name: str, rows: set[str]) -> None:
    assert named(f"notabug.{module}")[name] == rows


def test_every_constant_of_the_references_is_a_name_of_its_module() -> None:
    for row in EVERY:
        module, _, constant = row.rpartition(".")
        assert not module.startswith("references.") or row in named(f"notabug.{module}")[constant]


@pytest.fixture(scope="module")
def ball() -> Sample:
    """A small picture that is a little too bright."""
    return next(planned.sample for planned in small_pictures() if planned.label == "bug")


@pytest.fixture(scope="module")
def read(ball: Sample) -> dict[Way, tuple[Said, frozenset[str]]]:
    before = importlib.import_module("notabug.metrics.judge")
    with noting() as judge, judge.fresh():
        found = {way: judge.of(partial(judged, ball, way)) for way in WAYS}
    assert importlib.import_module("notabug.metrics.judge") is before
    return found


def test_reads_are_noted_wherever_a_number_is_used(read: dict[Way, tuple[Said, frozenset[str]]]) -> None:
    _, rows = read["word"]
    assert "admissible.grid" in rows, "through the policy"
    assert "noise.reach" in rows or "noise.tile" in rows, "as a name at the top of a file, or a default"
    assert {"references.tracer.precision.RELATIVE", "references.tracer.envelope.GRID"} <= rows, "imported"
    assert {"names.better", "calibration.shift", "perceive.white"}.isdisjoint(rows)
    assert "perceive.white" in read["eye"][1]
    assert "causes.black" in read["name"][1]


def test_what_was_noted_is_known_by_its_name_and_not_drawn_again(tmp_path: Path, ball: Sample) -> None:
    kept = tmp_path / "some.reads.json"
    first = noted([Planned("bug", lambda: ball, name="one")], kept)

    def never() -> Sample:
        raise AssertionError("it was judged already")

    again = noted([Planned("clean", lambda: ball, name="new"), Planned("bug", never, name="one")], kept)
    assert {way: again[1, way] for way in WAYS} == {way: first[0, way] for way in WAYS}
    assert (0, "word") in again
    row = "references.tracer.precision.RELATIVE"
    assert readers(row, [Planned("clean", never), Planned("bug", never)], again) == [(1, "word"), (0, "word")]


def test_what_is_noted_says_the_same_as_what_is_not(ball: Sample, read: dict[Way, tuple[Said, frozenset[str]]]) -> None:
    for way in WAYS:
        assert judged(ball, way) == read[way][0]
    with with_number("admissible.grid", 1.0):
        assert judged(ball, "name") == read["name"][0]


@pytest.mark.parametrize("row", ["names.better", "rules.most_striped", "calibration.tones"])
def test_a_number_that_is_not_read_moves_nothing(
    ball: Sample, read: dict[Way, tuple[Said, frozenset[str]]], row: str
) -> None:
    assert row not in read["word"][1]
    for factor in FACTORS.values():
        with with_number(row, factor):
            assert judged(ball, "word") == read["word"][0]


def test_a_number_that_decides_is_seen_to(ball: Sample, read: dict[Way, tuple[Said, frozenset[str]]]) -> None:
    with with_number("references.tracer.precision.RELATIVE", 20.0):
        assert judged(ball, "word").word == "pass" != read["word"][0].word


def test_the_page_says_what_is_kept(pages: ModuleType) -> None:
    measured = json.loads(pages.KEPT.read_text("utf-8"))
    assert pages.PAGE.read_text("utf-8") == pages.page(measured), "run python docs/judge_sensitivity.py"
    assert set(measured["rows"]) - set(EVERY) == set(), "rows of numbers that are gone"
    assert set(measured["reads"]) == set(EVERY), "run python -m notabug.bench.verdict.sensitivity"
