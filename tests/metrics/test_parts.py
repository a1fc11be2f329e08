"""Laws of the verdict's parts, each alone: tests of many values, tiles, variances, encodings, regions, records."""

from __future__ import annotations

import json

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from scipy import ndimage, stats

from notabug.metrics.causes import encoded, zoomed
from notabug.metrics.image_checks import box
from notabug.metrics.image_filters import blurred, extreme, laplacian, weighed, widened
from notabug.metrics.judge import regions
from notabug.metrics.noise import measure, tiles
from notabug.metrics.policy import POLICY
from notabug.metrics.significance import discoveries
from notabug.metrics.verdict import Finding, Leg, Verdict
from notabug.scenes_usd.srgb import decode_srgb

TILE = POLICY.noise.tile

Floats = npt.NDArray[np.floating]

FEW = settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.too_slow])
MANY = settings(FEW, max_examples=100)

seeds = st.integers(0, 2**32 - 1)
probabilities = hnp.arrays(np.float64, st.integers(1, 300), elements=st.floats(1e-6, 1.0))


@MANY
@given(probabilities, st.floats(0.1, 6.0), st.sampled_from([0.01, 0.05, 0.2]))
def test_discoveries_are_benjamini_and_hochbergs(p: Floats, power: float, rate: float) -> None:
    p = p**power
    adjusted = stats.false_discovery_control(p, method="bh")
    assume(not np.isclose(adjusted, rate, rtol=1e-9, atol=0).any())
    assert np.array_equal(discoveries(p, rate), adjusted <= rate)


def test_a_worked_example_of_benjamini_and_hochberg() -> None:
    """Benjamini and Hochberg 1995, section 4.1: fifteen p-values, four discoveries at .05."""
    p = np.array([1, 4, 19, 95, 201, 278, 298, 344, 459, 3240, 4262, 5719, 6528, 7590, 10000]) / 10000
    assert discoveries(p, 0.05).sum() == 4
    assert discoveries(p.reshape(3, 5), 0.05).shape == (3, 5)
    assert not discoveries(np.ones((4, 4))).any()


@MANY
@given(hnp.arrays(np.float64, hnp.array_shapes(min_dims=2, max_dims=3, max_side=50), elements=st.floats(-1, 1)))
def test_tiles_sum_what_they_cover(values: Floats) -> None:
    found = tiles(values)
    assert found.shape[:2] == tuple(-(-each // TILE) for each in values.shape[:2])
    for ty in range(found.shape[0]):
        for tx in range(found.shape[1]):
            part = values[ty * TILE : (ty + 1) * TILE, tx * TILE : (tx + 1) * TILE]
            assert found[ty, tx] == pytest.approx(part.sum(axis=(0, 1)), abs=1e-9)
    assert tiles(tiles(values, 4), TILE // 4) == pytest.approx(found, abs=1e-9)


@FEW
@given(seeds, st.sampled_from([2, 4, 8]))
def test_the_measured_variance_is_that_of_the_mean(seed: int, count: int) -> None:
    rng = np.random.default_rng(seed)
    stack = [0.5 + 0.1 * rng.standard_normal((48, 48, 3)) for _ in range(count)]
    found = measure(stack, np.zeros((48, 48), bool))
    assert found.mean == pytest.approx(np.mean(stack, axis=0), abs=1e-6)
    assert float(found.variance.mean()) == pytest.approx(0.01 / count, rel=0.1)
    assert (found.freedom, found.seeds, found.noisy) == (12.5 * (count - 1), count, True)
    assert found.variance.min() >= 0.0
    # equal pictures are one picture
    assert measure([stack[0]] * count, np.zeros((48, 48), bool)).seeds == 1


@pytest.mark.parametrize(
    ("linear", "stored"), [(0.0, 0.0), (0.0031308, 0.04045), (0.18, 0.461356), (0.5, 0.735357), (1.0, 1.0)]
)
def test_srgb_encoding(linear: float, stored: float) -> None:
    """IEC 61966-2-1; mid grey 0.18 is stored as 0.461356, that is 118 of 255."""
    assert float(encoded(np.array(linear))) == pytest.approx(stored, abs=1e-5)
    assert float(decode_srgb(np.array(stored))) == pytest.approx(linear, abs=1e-5)


@MANY
@given(hnp.arrays(np.float64, (5, 3), elements=st.floats(0, 1)))
def test_srgb_round_trip(linear: Floats) -> None:
    assert decode_srgb(encoded(linear)) == pytest.approx(linear, abs=1e-6)
    assert (np.diff(encoded(np.sort(linear, axis=0)), axis=0) >= 0).all()


def test_laplacian_and_zoom() -> None:
    y, x = np.mgrid[:9, :9].astype(float)
    bowl = np.repeat((x * x + 3 * y * y)[..., None], 3, axis=2)
    assert laplacian(bowl)[2:-2, 2:-2] == pytest.approx(np.full((5, 5, 3), 8.0))  # 2 + 6
    ramp = np.repeat((x - 4)[..., None], 3, axis=2)
    assert zoomed(ramp, 2.0)[4, :, 0] == pytest.approx((x[0] - 4) / 2)  # twice as large: half the slope


pictures = hnp.arrays(np.float64, hnp.array_shapes(min_dims=2, max_dims=2, max_side=30), elements=st.floats(-1, 1))


@MANY
@given(pictures, st.sampled_from([0.0, 0.7, 1.0]))
def test_filters_over_neighbours_are_ndimages(picture: Floats, deviation: float) -> None:
    assert np.array_equal(extreme(picture, np.maximum), ndimage.maximum_filter(picture, 3))
    assert np.array_equal(extreme(picture, np.minimum), ndimage.minimum_filter(picture, 3))
    assert np.array_equal(widened(picture > 0.5, 2), ndimage.binary_dilation(picture > 0.5, np.ones((5, 5))))
    there = weighed(picture, (0.5, 0.2, 0.05), 1)
    assert there == pytest.approx(ndimage.correlate1d(picture, [0.05, 0.2, 0.5, 0.2, 0.05], 1, mode="nearest"))
    gaussian = ndimage.gaussian_filter(picture, deviation, mode="nearest") if deviation else picture
    assert blurred(picture, deviation) == pytest.approx(gaussian, abs=1e-12)


masks = hnp.arrays(np.bool_, hnp.array_shapes(min_dims=2, max_dims=2, min_side=1, max_side=30))


@MANY
@given(masks)
def test_regions_cover_the_mask(mask: npt.NDArray[np.bool_]) -> None:
    found = regions(mask)
    covered = np.zeros_like(mask)
    for x0, y0, x1, y1 in found:
        assert mask[y0:y1, x0:x1].any()
        covered[y0:y1, x0:x1] = True
    assert bool(found) == mask.any()
    if len(found) < 12:
        assert covered[mask].all()
    x0, y0, x1, y1 = box(mask)
    assert mask[y0:y1, x0:x1].sum() == mask.sum()
    assert all(x0 <= a and y0 <= b and c <= x1 and d <= y1 for a, b, c, d in found)


def test_regions_by_size_and_distance() -> None:
    mask = np.zeros((40, 40), bool)
    mask[2:4, 2:4] = mask[20:30, 5:15] = True
    assert regions(mask) == ((5, 20, 15, 30), (2, 2, 4, 4))
    mask[3, 6] = True  # two pixels further right: the same part
    assert regions(mask) == ((5, 20, 15, 30), (2, 2, 7, 4))
    mask[3, 20] = True
    assert len(regions(mask)) == 3
    dust = np.zeros((100, 100), bool)
    dust[::10, ::10] = True
    assert len(regions(dust)) == 12


numbers = st.floats(allow_nan=False, allow_infinity=False)
boxes = st.tuples(*[st.integers(0, 4096)] * 4)
findings = st.builds(
    Finding,
    kind=st.sampled_from(["limitation", "convention", "bug"]),
    name=st.text(),
    area_px=numbers,
    region=boxes,
    jnd=numbers,
    z=numbers,
    visible=st.booleans(),
    message=st.text(),
    regions=st.lists(boxes, max_size=3).map(tuple),
)
legs = st.builds(Leg, pixels=st.integers(0, 10**7), flip=numbers, flip_max=numbers, itp=numbers)
verdicts = st.builds(
    Verdict,
    word=st.sampled_from(["pass", "limitation", "bug", "inconclusive", "unsupported", "error"]),
    findings=st.lists(findings, max_size=3).map(tuple),
    legs=st.fixed_dictionaries({"limitation": legs, "bug": legs}),
    triggers=st.lists(st.sampled_from(["pixels", "tile", "gain", "shift", "invalid"]), max_size=3).map(tuple),
    message=st.text(),
    numbers=st.dictionaries(st.text(), numbers, max_size=4),
)


@MANY
@given(verdicts)
def test_a_verdict_survives_json(verdict: Verdict) -> None:
    assert Verdict.from_dict(json.loads(json.dumps(verdict.as_dict(), allow_nan=False))) == verdict
