"""Words: numbers as people write them, and which findings a verdict's numbers speak of."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from notabug.metrics.verdict import Finding, Verdict
from notabug.results.record import Result
from notabug.results.wording import area, duration, finding_names, number, strongest, tally


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.0, "0"),
        (41.0, "41"),
        (0.00412345, "0.00412"),
        (1234.5, "1234"),
        (math.nan, "–"),
        (math.inf, "–"),
        (None, "–"),
        (0.8, "0.8"),
    ],
)
def test_numbers(value: float | None, text: str) -> None:
    assert number(value) == text


def test_the_numbers_of_a_verdict_are_those_of_what_made_it() -> None:
    limitation = Finding("limitation", "facet_self_shadow", 300.0, (0, 0, 9, 9), jnd=5.0)
    convention = Finding("convention", "silhouette_flip", 20.0, (0, 0, 9, 9), jnd=90.0)
    bug = Finding("bug", "flat_normals", 7.0, (0, 0, 9, 9), jnd=2.0)

    def of(word: str, *findings: Finding) -> tuple[float, float]:
        result = Result("a/b", "", "r", "1", Verdict(word, findings))  # type: ignore[arg-type]
        return area(result), strongest(result)

    assert of("limitation", limitation, convention) == (300.0, 5.0)
    assert of("bug", bug, limitation) == (7.0, 2.0)
    assert of("pass", convention) == (20.0, 90.0)
    assert of("pass") == (0, 0.0)
    both = Result("a/b", "", "r", "1", Verdict("bug", (bug, limitation, bug)))
    assert finding_names(both) == "flat normals beside facet self shadow"  # which is no bug
    assert finding_names(replace(both, verdict=Verdict("bug", (bug, bug)))) == "flat normals"
    assert finding_names(replace(both, verdict=Verdict("limitation", (limitation,)))) == "facet self shadow"
    unclear = Verdict("inconclusive", (limitation, convention))
    assert finding_names(replace(both, verdict=unclear)).startswith("facet self shadow, ")


def test_tally_goes_by_seriousness() -> None:
    assert tally(["bug", "pass", "pass"]) == "2 pass, 1 bug"
    assert tally([]) == "no results"


@pytest.mark.parametrize(
    ("seconds", "text"),
    [
        (0.4, "about 5 s"),
        (12.2, "about 15 s"),
        (54.9, "about 55 s"),
        (55.1, "about a minute"),
        (89.0, "about a minute"),
        (91.0, "about 2 minutes"),
        (3600.0, "about 60 minutes"),
    ],
)
def test_a_duration_is_told_as_roughly_as_it_is_known(seconds: float, text: str) -> None:
    assert duration(seconds) == text
