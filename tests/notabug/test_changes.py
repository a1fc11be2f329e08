"""One rule says what has changed between two runs: ``diff``, the report's baseline and the trend say alike."""

from __future__ import annotations

from typing import Any

import pytest

from notabug.gallery.trend import Course, _change
from notabug.metrics.verdict import Finding, Verdict
from notabug.report.comparison import changes
from notabug.results.changes import between, changed_numbers, compare
from notabug.results.record import Result

CASES = [
    # word, name, area and jnd before and after, and what the change is
    (("pass", "", 0.0, 0.0), ("bug", "light_gain", 9.0, 2.0), "worse"),
    (("bug", "light_gain", 9.0, 2.0), ("pass", "", 0.0, 0.0), "better"),
    (("limitation", "quad_split_02", 40.0, 2.0), ("limitation", "quad_split_02", 41.0, 2.0), "worse"),
    (("limitation", "quad_split_02", 41.0, 2.0), ("limitation", "quad_split_02", 40.0, 2.0), "better"),
    (("limitation", "quad_split_02", 40.0, 2.0), ("limitation", "quad_split_02", 40.0, 2.5), "worse"),
    (("limitation", "quad_split_02", 40.0, 2.0), ("limitation", "quad_split_13", 40.0, 2.0), "worse"),
    (("pass", "", 0.0, 0.0), ("inconclusive", "", 0.0, 0.0), "worse"),
    (("error", "", 0.0, 0.0), ("inconclusive", "", 0.0, 0.0), "better"),
    (("limitation", "quad_split_02", 40.0, 2.0), ("limitation", "quad_split_02", 40.0, 2.0), "same"),
    (("limitation", "quad_split_02", 40.0, 2.0), ("limitation", "quad_split_02", 40.0 + 1e-6, 2.0), "same"),
]


def result(word: Any, name: str, area: float, jnd: float) -> Result:
    kind: Any = "bug" if word == "bug" else "limitation"
    found = (Finding(kind, name, area, (0, 0, 8, 8), jnd=jnd, z=9.0),) if name else ()
    return Result("texture/uneven_quad", "split=quad", "grey", "1", Verdict(word, found))


@pytest.mark.parametrize(("old", "new", "expected"), CASES)
def test_diff_report_and_trend_say_the_same(old: Any, new: Any, expected: str) -> None:
    before, after = result(*old), result(*new)
    change = between(before, after)
    assert ("same" if change is None else change.course) == expected
    assert [found.worse for found in compare([before], [after])] == ([] if change is None else [change.worse])

    shown = _change(Course(after.scene, after.variant, (before, after), ()), before, after)
    trend = "same" if shown is None else {True: "better", False: "worse", None: "other"}[shown.better]
    assert trend == expected

    told = changes([before], [after]).get((after.scene, after.variant, after.renderer), "")
    assert {"": "same", "new": "worse", "fixed": "better"}.get(told, told) == expected


def test_what_is_new_or_gone_is_worse_only_where_it_is_wrong() -> None:
    wrong, fine = result("bug", "light_gain", 9.0, 2.0), result("pass", "", 0.0, 0.0)
    assert [found.course for found in compare([], [wrong])] == ["worse"]
    assert [found.course for found in compare([], [fine])] == ["other"]
    assert [found.course for found in compare([wrong], [])] == ["other"]


def test_the_numbers_that_two_runs_were_judged_by_are_compared() -> None:
    before = {"admissible.edge": 0.19, "admissible.grid": 0.2, "names.gone": 1.0}
    after = {"admissible.edge": 0.3, "admissible.grid": 0.2, "names.fresh": 2.0}
    assert changed_numbers(before, after) == {
        "admissible.edge": (0.19, 0.3),
        "names.gone": (1.0, None),
        "names.fresh": (None, 2.0),
    }
    assert changed_numbers({}, after) == changed_numbers(before, {}) == {}, "a record from before they were kept"
