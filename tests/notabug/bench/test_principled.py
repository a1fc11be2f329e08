"""The experiment of description length: its misfit, its bits, and the word that its costs give."""

from __future__ import annotations

import numpy as np
import pytest

from notabug.bench.verdict.principled import Costs, Row, compared, described, entropy, errors, printed, rho, table
from notabug.bench.verdict.sensitivity_pictures import chosen
from notabug.metrics.policy import POLICY
from notabug.references.models.model import Model


def test_misfit_is_that_of_normal_noise_near_zero_and_grows_evenly_far_out() -> None:
    assert rho(np.array([0.0, 1.0])) == pytest.approx([0.0, 0.5 / np.log(2.0)])
    near, far = POLICY.regression.huber * np.array([1 - 1e-9, 1 + 1e-9])
    assert rho(np.array([near])) == pytest.approx(rho(np.array([far])))
    assert np.diff(rho(np.array([10.0, 20.0, 30.0]))) == pytest.approx(10 * POLICY.regression.huber / np.log(2.0))


def test_bits_of_an_answer() -> None:
    assert [entropy(share) for share in (0.0, 0.5, 1.0)] == [0.0, 1.0, 0.0]
    assert entropy(0.11) == pytest.approx(entropy(0.89))


@pytest.mark.parametrize("rule", ["set", "partial", "hull", "any"])
def test_what_shows_nothing_says_nothing_and_what_shows_more_says_more(rule: str) -> None:
    model = Model("some", "limitation", "", "", rule=rule)  # type: ignore[arg-type]
    within = np.ones((8, 8), np.bool_)
    little, much = np.zeros((8, 8)), np.zeros((8, 8))
    little[0, :2], much[:2] = 1.0, 1.0
    assert described(model, np.zeros((8, 8)), within, 30.0) == 0.0
    assert 0.0 < described(model, little, within, 30.0) < described(model, much, within, 30.0)


@pytest.mark.parametrize(
    ("costs", "margin", "word"),
    [
        (Costs(0.0, 5.0, False, True), 9.0, "pass"),  # nothing is left: nothing to be told apart
        (Costs(1.0, 5.0, False, False), 9.0, "inconclusive"),
        (Costs(1.0, 5.0, False, False), 2.0, "pass"),
        (Costs(1.0, 5.0, True, False), 2.0, "limitation"),
        (Costs(50.0, 5.0, True, False), 9.0, "bug"),
    ],
)
def test_the_word_is_that_of_the_cheapest(costs: Costs, margin: float, word: str) -> None:
    assert costs.word(margin) == word


def test_the_tables_count_pictures() -> None:
    costs = {f"{factor:g}": Costs(50.0, 5.0, False, False) for factor in (0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0)}
    rows = [
        Row("clean", "", "box", "bug", costs, {"rules": 1.0, "principled": 2.0}),
        Row("bug", "gamma", "box", "pass", costs, {"rules": 1.0, "principled": 2.0}),
        Row("limitation", "acne", "box", "inconclusive", costs, {"rules": 1.0, "principled": 2.0}),
    ]
    assert errors(table(rows, lambda row: row.rules)) == (1, 1, 1)
    assert "false alarms 1, missed 1, inconclusive 1" in printed(rows)


def test_a_clean_picture_costs_no_bug_and_a_bug_does() -> None:
    some = {group.label: (group, condition) for group, condition in reversed(chosen())}
    assert compared(*some["clean"]).costs["0.1"].word(0.0) == "pass"
    assert compared(*some["bug"]).costs["0.1"].word(0.0) == "bug"
