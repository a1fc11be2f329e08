"""Peer gates: each passes the reference itself, fails on a black picture, and turns at its published numbers."""

from __future__ import annotations

import numpy as np
import pytest

from notabug.bench.verdict.gates import Floats, Gate, Pair, eight_bit, gates
from notabug.scenes_usd.picture import decode_srgb

GATES = {each.name: each for each in gates()}
SIDE = 64
PIXELS = SIDE * SIDE


@pytest.fixture(scope="module")
def reference() -> Floats:
    """A ramp whose 8-bit sRGB values are exact."""
    levels = np.linspace(60, 200, SIDE).round() / 255.0
    return decode_srgb(np.broadcast_to(levels[None, :, None], (SIDE, SIDE, 3)))


def pair(picture: Floats, reference: Floats) -> Pair:
    return Pair(picture, reference, np.zeros_like(reference))


def encoded_steps(reference: Floats, steps: int, pixels: int) -> Floats:
    """``reference`` with ``pixels`` pixels brighter by ``steps`` 8-bit steps."""
    coded = eight_bit(reference)
    coded.reshape(-1, 3)[:pixels] += steps / 255.0
    return decode_srgb(coded)


def linear_steps(reference: Floats, step: float, pixels: int) -> Floats:
    picture = reference.copy()
    picture.reshape(-1, 3)[:pixels] += step
    return picture


@pytest.mark.parametrize("gate", GATES.values(), ids=GATES)
def test_a_gate_passes_the_reference_and_fails_on_black(gate: Gate, reference: Floats) -> None:
    itself, black = (gate.score(pair(each, reference)) for each in (reference, np.zeros_like(reference)))
    assert itself < 1e-3 if gate.own else itself < black
    if gate.own:
        assert black > 1.0


@pytest.mark.parametrize(
    ("name", "steps", "share"),
    [("Cycles", 5, 0.01), ("Cycles, volumes", 13, 0.03), ("EEVEE", 5, 0.0008), ("Filament", 6, 0.001)],
)
def test_gates_on_encoded_values_turn_at_their_numbers(name: str, steps: int, share: float, reference: Floats) -> None:
    few, many = int(share * PIXELS), int(share * PIXELS) + 1
    score = GATES[name].score
    assert score(pair(encoded_steps(reference, steps, few), reference)) <= 1.0
    assert score(pair(encoded_steps(reference, steps, many), reference)) > 1.0
    assert score(pair(encoded_steps(reference, steps - 1, PIXELS), reference)) <= 1.0


@pytest.mark.parametrize(
    ("name", "step", "share"), [("OpenImageIO", 0.008, 0.0004), ("arnold-usd", 1e-5, 0.33334), ("OSL cornell", 0.01, 0)]
)
def test_gates_on_linear_values_turn_at_their_numbers(name: str, step: float, share: float, reference: Floats) -> None:
    few, many = int(share * PIXELS), int(share * PIXELS) + 1
    score = GATES[name].score
    assert score(pair(linear_steps(reference, 1.2 * step, few), reference)) <= 1.0
    assert score(pair(linear_steps(reference, 1.3 * step, many), reference)) > 1.0
    assert score(pair(linear_steps(reference, 0.5 * step, PIXELS), reference)) <= 1.0


def test_hard_failures_need_one_pixel(reference: Floats) -> None:
    assert GATES["OpenImageIO"].score(pair(linear_steps(reference, 0.025, 1), reference)) > 1.0
    assert GATES["OpenImageIO"].score(pair(linear_steps(reference, 0.023, 1), reference)) <= 1.0


def test_appleseed_allows_eight_channels(reference: Floats) -> None:
    score = GATES["appleseed"].score
    assert score(pair(encoded_steps(reference, 3, 2), reference)) <= 1.0  # six channels
    assert score(pair(encoded_steps(reference, 3, 4), reference)) > 1.0  # twelve
    assert score(pair(encoded_steps(reference, 2, PIXELS), reference)) <= 1.0


def test_three_js_counts_pixels_in_yiq(reference: Floats) -> None:
    score = GATES["three.js"].score
    assert score(pair(encoded_steps(reference, 50, 4), reference)) <= 1.0
    assert score(pair(encoded_steps(reference, 50, 5), reference)) > 1.0
    assert score(pair(encoded_steps(reference, 5, PIXELS), reference)) <= 1.0


def test_khronos_allows_22_decibels(reference: Floats) -> None:
    """A grey difference d everywhere has the YIQ distance .5053 d^2, of at most .5415: -22 dB is d = .0822."""
    score = GATES["Khronos glTF"].score
    assert score(pair(encoded_steps(reference, 20, PIXELS), reference)) <= 1.0
    assert score(pair(encoded_steps(reference, 22, PIXELS), reference)) > 1.0


def test_mitsuba_allows_a_quarter_of_a_percent(reference: Floats) -> None:
    """With the variance floor of 1e-4 a step of .1 is ten standard errors."""
    few = int(0.0025 * PIXELS)
    score = GATES["Mitsuba z-test"].score
    assert score(pair(linear_steps(reference, 0.1, few), reference)) <= 1.0
    assert score(pair(linear_steps(reference, 0.1, few + 1), reference)) > 1.0
    assert score(pair(linear_steps(reference, 0.02, PIXELS), reference)) <= 1.0  # two standard errors


def test_the_perceptual_gate_needs_a_visible_difference(reference: Floats) -> None:
    score = GATES["OpenUSD, strict"].score
    assert score(pair(linear_steps(reference, 0.001, PIXELS), reference)) <= 1.0
    assert score(pair(linear_steps(reference, 0.3, 400), reference)) > 1.0


def test_openimageio_passes_a_picture_of_nan(reference: Floats) -> None:
    """As published: NaN never counts as failed. That is why the judge looks for it first."""
    assert GATES["OpenImageIO"].score(pair(np.full_like(reference, np.nan), reference)) <= 1.0
