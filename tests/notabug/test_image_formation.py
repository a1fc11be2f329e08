"""Film: pixel filters keep light, noise is unbiased and as large as stated, encodings round as declared."""

from __future__ import annotations

import numpy as np
import pytest

from notabug.bench.verdict.image_formation import (
    BY_NAME,
    CONDITIONS,
    SPREAD,
    SUBSAMPLES,
    Condition,
    filtered,
    shoot,
    variance,
    written,
)
from notabug.metrics.admissible import filtered as judged
from notabug.metrics.admissible import widening

SIDE = 24


def flat(value: float = 0.5) -> np.ndarray:
    return np.full((SIDE * SUBSAMPLES, SIDE * SUBSAMPLES, 3), value)


@pytest.mark.parametrize("condition", CONDITIONS, ids=lambda each: each.name)
def test_a_flat_picture_stays_flat(condition: Condition) -> None:
    if not condition.samples:
        assert np.allclose(filtered(flat(), condition), 0.5)
        return
    mean = np.mean(list(shoot([flat()], condition, 1, 16)))
    error = 0.5 * SPREAD / np.sqrt(condition.samples * SIDE * SIDE * 16)
    bias = 0.5 * 50 * 2e-5 if condition.fireflies else 0.0
    assert mean == pytest.approx(0.5, abs=6 * error + 4 * bias)


def test_noise_is_as_large_as_stated() -> None:
    condition = BY_NAME["16 samples"]
    mean = np.mean(list(shoot([flat()], condition, 3)), axis=0)
    assert mean[..., 0].var() == pytest.approx(float(variance(flat(), condition).mean()), rel=0.2)


def test_a_wide_filter_correlates_neighbours_and_a_box_does_not() -> None:
    def lag(name: str) -> float:
        x = next(shoot([flat()], BY_NAME[name], 5, 1))[..., 0]
        x = x - x.mean()
        return float((x[:, 1:] * x[:, :-1]).mean() / (x * x).mean())

    assert abs(lag("64 samples")) < 0.15
    assert lag("64 samples, correlated") > 0.25


def test_the_point_condition_takes_the_centre() -> None:
    sub = np.random.default_rng(0).random((3 * SUBSAMPLES, 2 * SUBSAMPLES, 3))
    assert np.array_equal(filtered(sub, BY_NAME["point"])[1, 1], sub[SUBSAMPLES + 2, SUBSAMPLES + 2])


def test_encodings_round_by_half_a_step() -> None:
    ramp = np.linspace(0, 1, 4096).reshape(64, 64, 1).repeat(3, axis=2)
    for name, step in (("8-bit sRGB", 2.4 / 1.055 / 255), ("half float", 2.0**-11)):
        condition = BY_NAME[name]
        off = np.abs(written(ramp, condition) - ramp).max()
        assert 0.2 * step < off <= 0.55 * step
        assert condition.declaration().quantum == pytest.approx(step)


@pytest.mark.parametrize("name", ["tent", "gaussian"])
def test_the_judge_knows_the_filters(name: str) -> None:
    """The judge filters means over pixels, the film subsamples; on what is smooth in a few pixels they agree."""
    x = (np.arange(SIDE * SUBSAMPLES) + 0.5) / SUBSAMPLES
    wave = 0.5 + 0.4 * np.sin(2 * np.pi * x / 8.0)
    sub = np.broadcast_to(wave[None, :, None], (SIDE * SUBSAMPLES, SIDE * SUBSAMPLES, 3)).copy()
    condition = BY_NAME[name]
    box, taken = filtered(sub, BY_NAME["box"]), filtered(sub, condition)
    known = judged(box, widening(condition.declaration()))
    inside = slice(4, -4)
    assert np.abs(taken - box)[:, inside].max() > 0.008
    assert np.abs(taken - known)[:, inside].max() < 0.002
