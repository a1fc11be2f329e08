"""Fireflies are noise, gains of one channel are found, rounding and filters are no gain."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import ndimage

from notabug.adapters.base import Declaration
from notabug.metrics.admissible import Admissible, Floats, filtered, widening
from notabug.metrics.global_fit import global_fit, untold_gain
from notabug.metrics.noise import measure
from notabug.metrics.significance import significance

SIDE = 64
NONE = np.zeros((SIDE, SIDE), bool)


def ramp() -> Floats:
    values = np.linspace(0.2, 0.8, SIDE)
    return np.broadcast_to(values[None, :, None], (SIDE, SIDE, 3)).copy()


def target(value: Floats, slack: float = 5e-4) -> Admissible:
    return Admissible(value, value, value, 0.004 * value + slack, NONE, np.zeros((SIDE, SIDE)))


def noisy(value: Floats, seeds: int = 4) -> list[Floats]:
    rng = np.random.default_rng(1)
    return [value * rng.normal(1.0, 0.05, value.shape) for _ in range(seeds)]


def test_a_firefly_in_one_seed_is_noise_and_a_wrong_pixel_in_all_is_not() -> None:
    value = ramp()
    pictures = noisy(value)
    pictures[0][10, 10] += 5.0
    measured = measure(pictures, NONE)
    assert not significance(measured.mean - value, measured, target(value)).pixels.any()
    for each in pictures:
        each[40, 40] *= 0.3
    measured = measure(pictures, NONE)
    wrong = significance(measured.mean - value, measured, target(value)).pixels
    assert np.argwhere(wrong).tolist() == [[40, 40]]


def squares(across: float = 1.0, down: float = 1.0, right: float = 0.0) -> Floats:
    """A soft chequered picture, magnified about its middle and moved."""
    y, x = (np.mgrid[0:SIDE, 0:SIDE] - SIDE / 2) / np.array([down, across])[:, None, None]
    value = 0.5 + 0.3 * np.tanh(3 * np.sin((x - right) / 3)) * np.tanh(3 * np.sin(y / 3))
    return np.repeat(value[..., None], 3, axis=2)


@pytest.mark.parametrize(
    ("picture", "pixels"),
    [
        (squares(1.02, 1.02), 0.02 * SIDE / 2 * np.sqrt(2)),
        (squares(1.02, 1.0), 0.02 * SIDE / 2),
        (squares(1.0, 0.98), 0.02 * SIDE / 2),
        (squares(right=0.5), 0.0),
        (squares() * 1.01, 0.0),
        (squares(), 0.0),
    ],
)
def test_a_warp_is_measured_and_a_shift_or_gain_is_none(picture: Floats, pixels: float) -> None:
    """Were every pixel at an edge, a picture could be magnified by 2 % and nowhere leave what edges admit."""
    found = global_fit(measure([picture], NONE), target(squares()), NONE)
    assert found.warp == pytest.approx(pixels, rel=0.15, abs=0.02)
    assert found.warped == (pixels > 0)


def test_a_warp_is_as_large_as_the_picture_shows() -> None:
    """A band of rows shows how far it is stretched along itself, and not how far a corner would move across it."""
    band = np.zeros((SIDE, 1, 1), bool)
    band[12:20] = True
    flat, along, across = (np.where(band, each, 0.5) for each in (squares(), squares(across=1.02), squares(down=1.02)))
    assert global_fit(measure([along], NONE), target(flat), NONE).warp == pytest.approx(0.02 * SIDE / 2, rel=0.2)
    assert not global_fit(measure([across], NONE), target(flat), NONE).warped


@pytest.mark.parametrize("moved", [0.0, 0.4])
def test_a_shift_is_found_where_noise_exceeds_what_it_changes(moved: float) -> None:
    rng = np.random.default_rng(5)
    pictures = [squares(right=moved) + 0.2 * rng.normal(0.0, 1.0, (SIDE, SIDE, 3)) for _ in range(4)]
    found = global_fit(measure(pictures, NONE), target(squares()), NONE)
    assert found.shifted == (moved > 0)
    assert found.shift[0] == pytest.approx(moved, abs=3 * found.shift_error[0] + 0.03)


def test_noise_along_a_horizon_is_no_shift_across() -> None:
    """Below the black sky, whose pixels agree to the last bit, light falls off slowly: noise tells little of x."""
    value = np.zeros((SIDE, SIDE, 3))
    value[SIDE // 2 :] = (1.0 - 0.4 * np.abs(np.linspace(-1.0, 1.0, SIDE)))[:, None]
    fits = []
    for seed in range(40):
        rng = np.random.default_rng(seed)
        pictures = [value * rng.normal(1.0, 0.05, (SIDE, SIDE, 1)) for _ in range(4)]
        found = global_fit(measure(pictures, NONE), target(value), NONE)
        assert not found.shifted
        fits.append((found.shift[0], found.shift_error[0]))
    given = np.array([each for each in fits if each[0]])
    assert given[:, 1].min() > 0.3 * given[:, 0].std()  # the error stated is of the size of what is seen


def test_noise_is_no_warp() -> None:
    for strength in (0.02, 0.2, 1.0):
        rng = np.random.default_rng(3)
        pictures = [squares() + strength * rng.normal(0.0, 1.0, (SIDE, SIDE, 3)) for _ in range(4)]
        assert not global_fit(measure(pictures, NONE), target(squares()), NONE).warped


@pytest.mark.parametrize("channel", [0, 1, 2])
def test_a_gain_of_one_channel_is_found(channel: int) -> None:
    value = ramp()
    gains = np.where(np.arange(3) == channel, 1.02, 1.0)
    assert not global_fit(measure(noisy(value), NONE), target(value), NONE).gained
    assert global_fit(measure(noisy(value * gains), NONE), target(value), NONE).gained


def test_rounding_a_flat_picture_is_no_gain() -> None:
    value = np.full((SIDE, SIDE, 3), 0.3)
    rounded = value + 0.004  # half a step of 8-bit sRGB
    assert not global_fit(measure([rounded], NONE), target(value, 0.005), NONE).gained
    assert global_fit(measure([rounded], NONE), target(value), NONE).gained


@pytest.mark.parametrize(
    ("name", "radius", "variance"),
    [("tent", 1.0, 1 / 6 - 1 / 12), ("gaussian", 4.0, 0.25 - 1 / 12), ("box", 0.5, 0.0), ("unknown", 2.0, 0.0)],
)
def test_a_filter_widens_by_its_second_moment(name: str, radius: float, variance: float) -> None:
    declaration = Declaration("float64", name, radius, 0.0, True, False)  # type: ignore[arg-type]
    assert widening(declaration) == pytest.approx(variance, abs=1e-4)
    dot = np.zeros((9, 9, 3))
    dot[4, 4] = 1.0
    spread = filtered(dot, variance)[..., 0]
    x = np.arange(9) - 4.0
    assert spread.sum() == pytest.approx(1.0)
    assert (spread.sum(axis=0) * x * x).sum() == pytest.approx(variance)


def chequers(right: float = 0.0) -> Floats:
    """Hard squares, by the means over 8 x 8 subsamples, turned by five degrees and moved."""
    y, x = np.mgrid[0 : SIDE * 8, 0 : SIDE * 8] / 8.0
    c, s = np.cos(np.radians(5.0)), np.sin(np.radians(5.0))
    u, v = c * (x - right) + s * y, c * y - s * (x - right)
    fine = np.sign(np.sin(u / 6.0 + 0.3) * np.sin(v / 6.0 + 0.1))
    value = 0.5 + 0.3 * fine.reshape(SIDE, 8, SIDE, 8).mean(axis=(1, 3))
    return np.repeat(value[..., None], 3, axis=2)


@pytest.mark.parametrize("moved", [0.0, 0.25])
def test_a_shift_is_found_across_hard_edges(moved: float) -> None:
    """There a picture is no line from pixel to pixel, and only with both blurred does a shift leave little."""
    found = global_fit(measure(noisy(chequers(moved)), NONE), target(chequers()), NONE)
    assert found.shifted == (moved > 0)
    assert found.shift == pytest.approx((moved, 0.0), abs=0.03)


# --- few lit pixels ------------------------------------------------------------------------------------------------


def few(shape: str, radius: float, turn: float = 0.0, samples: int = 16, fine: int = 32) -> tuple[Admissible, Floats]:
    """What is admissible of a small ``disc``, or of thin ``wires``, in the dark, and a picture by 4 x 4 samples."""

    def drawn(per: int) -> Floats:
        y, x = (np.mgrid[0 : SIDE * per, 0 : SIDE * per] + 0.5) / per - SIDE / 2 - 0.3
        c, s = np.cos(turn), np.sin(turn)
        if shape == "disc":
            lit = (x**2 + y**2 < radius**2) * (0.4 - 0.01 * x)
        else:
            lit = ((np.abs((c * y - s * x + 8.0) % 16.0 - 8.0) < radius) & (np.abs(c * x + s * y) < 24)) * 0.4
        return np.asarray(lit.reshape(SIDE, per, SIDE, per))

    subsamples = drawn(fine)
    value, low, high = (
        np.repeat(each[..., None], 3, axis=2)
        for each in (subsamples.mean(axis=(1, 3)), subsamples.min(axis=(1, 3)), subsamples.max(axis=(1, 3)))
    )
    edge = ((high - low) > 0.1)[..., 0]
    slack = 0.19 * (high - low) if samples >= 16 else high - low
    at = edge[..., None]
    lo, hi = (np.where(at, each, value) for each in (np.maximum(low, value - slack), np.minimum(high, value + slack)))
    to = Admissible(value, lo, hi, 0.1 * value + 2e-4, edge, np.zeros((SIDE, SIDE)), samples=(low, high))
    return to, np.repeat(drawn(4).mean(axis=(1, 3))[..., None], 3, axis=2)


@pytest.mark.parametrize("radius", [2.5, 3.5, 4.5])
@pytest.mark.parametrize("gain", [0.95, 1.02, 1.05, 1.5])
def test_a_gain_of_a_small_ball_is_found(radius: float, gain: float) -> None:
    """Every lit pixel is off in one direction, within what its own tolerance admits."""
    to, picture = few("disc", radius)
    right, wrong = (global_fit(measure([each], to.edge), to, NONE) for each in (picture, gain * picture))
    assert not right.gained
    assert not untold_gain(right)
    assert wrong.gained
    assert wrong.gain == pytest.approx(gain, abs=0.01)


@pytest.mark.parametrize("radius", [0.4, 0.8, 1.2])
@pytest.mark.parametrize("turn", [0.0, 0.05, 0.4, np.pi / 4])
@pytest.mark.parametrize("samples", [0, 16])
@pytest.mark.sweep_except("0-0.05-1.2", "0-0.4-0.8", "0-0.7853981633974483-1.2", "16-0.0-0.4")
def test_a_gain_of_thin_wires_is_found_or_said_to_be_open(radius: float, turn: float, samples: int) -> None:
    """All of their pixels are edges, which 4 x 4 samples may have a row more or less of."""
    to, picture = few("wires", radius, turn, samples)
    exact = to.value
    for each in (exact, picture):
        assert not global_fit(measure([each], to.edge), to, NONE).gained
    assert not untold_gain(global_fit(measure([exact], to.edge), to, NONE))
    for gain in (0.95, 1.05, 1.2):
        found = global_fit(measure([gain * exact], to.edge), to, NONE)
        assert found.gained or "too few pixels to tell a gain" in untold_gain(found)


def test_nothing_lit_has_no_gain() -> None:
    dark = np.zeros((SIDE, SIDE, 3))
    found = global_fit(measure([dark], NONE), target(dark), NONE)
    assert (found.gain, found.gained, untold_gain(found)) == (1.0, False, "")


def test_a_wider_filter_on_a_small_ball_is_no_gain() -> None:
    """It lowers the peak and leaves the sum."""
    to, picture = few("disc", 3.5, samples=0)
    wide = ndimage.gaussian_filter(picture, (0.7, 0.7, 0))
    assert not global_fit(measure([wide], to.edge), to, NONE).gained


@pytest.mark.parametrize(("share", "gained"), [(0.0, True), (0.6, False)])
def test_what_fine_texture_hides_from_samples_is_no_gain(share: float, gained: bool) -> None:
    """Six pixels of an object without an edge, whose tolerance holds ``share`` of their value, are 5 % too bright."""
    value = np.zeros((SIDE, SIDE, 3))
    value[30:33, 30:32] = 0.4
    to = Admissible(value, value, value, (0.004 + share) * value + 2e-4, NONE, np.zeros((SIDE, SIDE)))
    assert global_fit(measure([1.05 * value], NONE), to, NONE).gained == gained


def test_the_border_of_what_a_limitation_may_change_does_not_stand_for_it() -> None:
    """Where surfaces coincide any of them may be seen, so nothing but the edges around them is left to tell a gain."""
    to, picture = few("disc", 8.0)
    picture = picture.copy()
    picture[to.edge] *= 1.05
    found = global_fit(measure([picture], to.edge), to, ~to.edge)
    assert not found.gained
    assert not untold_gain(found)


def fireflies(value: Floats, seeds: int = 4) -> list[Floats]:
    """Rare samples that carry most of the light: the mean is right, and most pixels are too dark."""
    rng = np.random.default_rng(3)
    shape = value.shape[:2]
    return [value * rng.gamma(0.35, 1 / 0.35, (16, *shape)).mean(axis=0)[..., None] for _ in range(seeds)]


@pytest.mark.parametrize("factor", [1.0, 1.02])
def test_skewed_noise_is_no_gain(factor: float) -> None:
    value = ramp()
    found = global_fit(measure([factor * each for each in fireflies(value)], NONE), target(value), NONE)
    assert not found.gained


@pytest.mark.parametrize("factor", [0.6, 1.5])
def test_a_gain_under_skewed_noise_is_one(factor: float) -> None:
    value = ramp()
    found = global_fit(measure([factor * each for each in fireflies(value)], NONE), target(value), NONE)
    assert found.gained


@pytest.mark.parametrize("factor", [0.94, 1.06])
def test_a_small_gain_under_even_noise_is_one(factor: float) -> None:
    value = ramp()
    assert global_fit(measure([factor * each for each in noisy(value)], NONE), target(value), NONE).gained
