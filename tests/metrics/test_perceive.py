"""What an eye makes of a difference: against the recommendation, the paper, and by laws."""

from __future__ import annotations

import flip_evaluator
import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from notabug.metrics.perceive import delta_itp, flip, jnd
from notabug.metrics.policy import POLICY

PIXELS_PER_DEGREE = POLICY.perceive.pixels_per_degree
REACH = POLICY.perceive.reach

Floats = npt.NDArray[np.floating]

FEW = settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.too_slow])
MANY = settings(FEW, max_examples=100)


def _pq(luminance: npt.ArrayLike) -> Floats:
    """SMPTE ST 2084 (ITU-R BT.2100-2, table 4), the inverse EOTF."""
    m1, m2, c1, c2, c3 = 2610 / 16384, 2523 / 4096 * 128, 3424 / 4096, 2413 / 4096 * 32, 2392 / 4096 * 32
    y = (np.asarray(luminance, float) / 1e4) ** m1
    return ((c1 + c2 * y) / (1 + c3 * y)) ** m2


def _itp(linear: Floats) -> Floats:
    """ITU-R BT.2087 (matrix to BT.2020), BT.2100 (ICtCp), BT.2124 (ITP: half of Ct); white at 100 cd/m^2."""
    wide = np.array([[0.6274, 0.3293, 0.0433], [0.0691, 0.9195, 0.0114], [0.0164, 0.0880, 0.8956]])
    lms = np.array([[1688, 2146, 262], [683, 2951, 462], [99, 309, 3688]]) / 4096
    ictcp = np.array([[2048, 2048, 0], [6610, -13613, 7003], [17933, -17390, -543]]) / 4096
    return _pq(100.0 * linear @ wide.T @ lms.T) @ ictcp.T * [1.0, 0.5, 1.0]


colours = hnp.arrays(np.float64, (7, 3), elements=st.floats(0.0, 4.0))


def test_delta_itp_agrees_with_colour_science() -> None:
    """An implementation that is not ours, which takes a second to load: it comes with matplotlib."""
    colour = pytest.importorskip("colour")
    one, other = np.random.default_rng(1).random((2, 500, 3)) ** 3 * 4.0
    spaces = colour.RGB_COLOURSPACES
    wide = colour.matrix_RGB_to_RGB(spaces["ITU-R BT.709"], spaces["ITU-R BT.2020"])
    coded = [colour.RGB_to_ICtCp(each @ wide.T * 100.0) for each in (one, other)]
    assert delta_itp(one, other) == pytest.approx(colour.difference.delta_E_ITP(*coded), rel=1e-9)


def test_delta_itp_of_published_greys() -> None:
    """For greys it is 720 times the step in PQ; ITU-R BT.2408, table 1: 100 cd/m^2 is 51 %, 1,000 is 75 %."""
    grey = np.array([[0.0] * 3, [1.0] * 3, [10.0] * 3])
    step = np.diff(_pq([0.0, 100.0, 1000.0])) * 720
    assert step / 720 == pytest.approx([0.508, 0.752 - 0.508], abs=1e-3)
    assert delta_itp(grey[:-1], grey[1:]) == pytest.approx(step, rel=1e-3)


@MANY
@given(colours, colours)
def test_delta_itp_agrees_with_the_recommendation(one: Floats, other: Floats) -> None:
    wanted = 720 * np.linalg.norm(_itp(one) - _itp(other), axis=1)
    # the recommendation prints its matrix with four digits, which PQ magnifies near black
    assert delta_itp(one, other) == pytest.approx(wanted, rel=5e-3, abs=0.7)


@MANY
@given(colours, colours, colours)
def test_delta_itp_is_a_distance(a: Floats, b: Floats, c: Floats) -> None:
    assert delta_itp(a, a) == pytest.approx(np.zeros(7))
    assert delta_itp(a, b) == pytest.approx(delta_itp(b, a))
    assert (delta_itp(a, c) <= delta_itp(a, b) + delta_itp(b, c) + 1e-9).all()


def test_what_is_infinite_is_as_bright_as_what_nearly_is() -> None:
    one, most = np.ones((1, 3)), np.full((1, 3), 1e15)
    assert delta_itp(one, np.full((1, 3), np.inf)) == pytest.approx(delta_itp(one, most))


def test_jnd_is_the_95th_percentile_over_the_mask() -> None:
    black, grey = np.zeros((10, 10, 3)), np.zeros((10, 10, 3))
    grey[0, :] = np.linspace(0.1, 1.0, 10)[:, None]
    mask = np.zeros((10, 10), bool)
    assert jnd(black, grey, mask) == 0.0
    mask[0] = True
    assert jnd(black, grey, mask) == pytest.approx(float(np.percentile(delta_itp(black[0], grey[0]), 95)))


def test_flip_of_black_and_white() -> None:
    """Andersson et al. 2020, sections 4.1 and 4.2.2, by hand: HyAB 100 on L* against the span from green to blue."""
    green, blue = (87.7347, -86.1827, 83.1793), (32.2970, 79.1875, -107.8602)  # CIE L*a*b* of the sRGB primaries
    (l1, a1, b1), (l2, a2, b2) = ((lab[0], 0.01 * lab[0] * lab[1], 0.01 * lab[0] * lab[2]) for lab in (green, blue))
    largest = (abs(l1 - l2) + np.hypot(a1 - a2, b1 - b2)) ** 0.7
    knee = 0.4 * largest
    wanted = 0.95 + (100.0**0.7 - knee) / (largest - knee) * 0.05
    found = flip(np.zeros((48, 48, 3)), np.ones((48, 48, 3)))
    assert found == pytest.approx(np.full((48, 48), wanted), abs=2e-3)


pictures = hnp.arrays(np.float64, (4, 4, 3), elements=st.floats(0.1, 0.8)).map(
    lambda each: np.kron(each, np.ones((8, 8, 1)))
)


@FEW
@given(pictures, pictures)
def test_flip_is_symmetric_and_in_range(one: Floats, other: Floats) -> None:
    assert flip(one, one).max() == 0.0
    assume(not np.array_equal(one, other))
    there = flip(one, other)
    assert there.shape == (32, 32)
    assert there == pytest.approx(flip(other, one), abs=1e-6)
    assert 0.0 <= there.min() <= there.max() <= 1.0
    assert there.max() > 0.0


@FEW
@given(pictures, st.floats(0.02, 0.2), st.floats(1.5, 4.0))
def test_flip_grows_with_the_step(picture: Floats, step: float, times: float) -> None:
    """An even step on grey is only a step in lightness."""
    grey = np.full_like(picture, 0.2)
    assert flip(grey, grey + step).mean() < flip(grey, grey + times * step).mean()


@FEW
@given(st.integers(0, 2**32 - 1), st.integers(0, 90), st.integers(0, 110), st.integers(1, 40))
def test_flip_around_a_difference_is_flip_of_the_whole(seed: int, y: int, x: int, size: int) -> None:
    rng = np.random.default_rng(seed)
    one = rng.random((100, 120, 3))
    other = one.copy()
    other[y : y + size, x : x + size] = rng.random(other[y : y + size, x : x + size].shape)
    whole, _, _ = flip_evaluator.evaluate(
        one.astype(np.float32), other.astype(np.float32), "LDR", False, False, False, {"ppd": PIXELS_PER_DEGREE}
    )
    found = flip(one, other)
    assert np.array_equal(found, whole.reshape(100, 120))
    beyond = np.ones(found.shape, bool)
    beyond[max(0, y - REACH) : y + size + REACH, max(0, x - REACH) : x + size + REACH] = False
    assert not found[beyond].any()
