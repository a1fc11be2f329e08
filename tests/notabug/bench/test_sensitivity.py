"""The bench of the judge's numbers: it changes the number that is asked for, that one alone, and puts it back."""

from __future__ import annotations

import importlib
import importlib.util
import json
import signal
import sys
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from notabug.bench.verdict.numbers import FOLDER, changed, found, module_of, scaled
from notabug.bench.verdict.sensitivity import Said, Sample, at_most, differences, with_number

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
    for row in ROWS:
        source = (FOLDER / f"{module_of(row).rpartition('.')[2]}.py").read_text("utf-8")
        compile(changed(source, row), row, "exec")


def test_a_number_that_is_not_there_is_told() -> None:
    with pytest.raises(ValueError, match="holds no number"):
        changed("EDGE = 0.19\n", "admissible.ELSEWHERE")


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


@pytest.mark.parametrize(
    ("row", "name"), [("admissible.EDGE", "EDGE"), ("significance.FEWEST", "FEWEST"), ("excused.RATE", "RATE")]
)
def test_a_number_is_another_one_inside_and_itself_again_after(row: str, name: str) -> None:
    module = importlib.import_module(module_of(row))
    before = getattr(module, name)
    with with_number(row, 2.0):
        inside = importlib.import_module(module_of(row))
        assert inside is not module
        assert getattr(inside, name) == scaled(before, 2.0)
        other = importlib.import_module("notabug.metrics.rules")
        assert other.MEAN_ALPHA == 0.25
    assert sys.modules[module_of(row)] is module
    assert getattr(module, name) == before


def test_a_number_that_others_import_is_changed_there_too() -> None:
    with with_number("rules.MEAN_ALPHA", 0.5):
        assert importlib.import_module("notabug.metrics.explain").MEAN_ALPHA == 0.125


def test_a_number_without_a_name_is_changed_where_it_stands() -> None:
    """The degrees of freedom of a pooled variance: 12.5 for each seed beyond the first."""
    pictures = list(np.random.default_rng(1).uniform(size=(4, 32, 32, 3)).astype(np.float32))

    def freedom() -> float:
        measured = importlib.import_module("notabug.metrics.noise").measure(pictures, np.zeros((32, 32), np.bool_))
        return float(measured.freedom * max(1.0, measured.kappa / 2.0))

    assert freedom() == pytest.approx(37.5)
    with with_number("noise: 12.5", 2.0):
        assert freedom() == pytest.approx(75.0)
    assert freedom() == pytest.approx(37.5)


def test_what_takes_too_long_is_stopped() -> None:
    def search() -> None:
        with at_most(0.05):
            while True:  # it is processor time that counts
                pass

    with pytest.raises(TimeoutError):
        search()
    assert signal.getitimer(signal.ITIMER_PROF) == (0.0, 0.0)  # no alarm is left


def test_words_names_and_figures_are_told_apart() -> None:
    samples: list[Sample] = [Sample("clean", None, (), {})] * 3  # type: ignore[arg-type]
    before = [Said("pass", (), (), 0.5), Said("bug", ("light_gain",), (), 4.0), Said("pass", (), (), 0.5)]
    after = [Said("bug", ("unexplained",), (), 2.0), Said("bug", ("gamma",), (), 4.0), Said("pass", (), (), 0.52)]
    told = differences(samples, before, after)
    assert told == {"words": 1, "names": 1, "figures": 1, "changes": ["pass to bug"]}


def test_the_page_says_what_is_kept(pages: ModuleType) -> None:
    measured = json.loads(pages.KEPT.read_text("utf-8"))
    assert pages.PAGE.read_text("utf-8") == pages.page(measured), "run python docs/judge_sensitivity.py"
    assert set(measured["rows"]) - set(found()) == set(), "rows of numbers that are gone"
