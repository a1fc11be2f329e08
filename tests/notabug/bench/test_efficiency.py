"""Slopes, targets, floors and costs: from closed forms, and one tiny run."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from notabug.adapters.base import Declaration, Found
from notabug.adapters.inhouse import InHouse
from notabug.bench.efficiency import Line, Place, Setting, measure, slope, time_to
from notabug.bench.efficiency_cost import Cost
from notabug.bench.efficiency_error import errors, floor, relmse
from notabug.bench.efficiency_plan import renderers
from notabug.references.tracer.envelope import Envelope, trace_envelope
from notabug.scenes_usd.reader import read_scene
from notabug.scenes_usd.scene import Scene


@pytest.fixture(scope="module")
def scene() -> Scene:
    return replace(read_scene("terminator/sphere"), width=24, height=24)


@pytest.fixture(scope="module")
def of(scene: Scene) -> Envelope:
    return trace_envelope(scene)


def place(seconds: float, error: float) -> Place:
    return Place(1.0, seconds, seconds, seconds, seconds, 0.0, {"relmse": error}, {}, error, None, None)


def test_whatever_is_installed_can_be_timed(monkeypatch: pytest.MonkeyPatch) -> None:
    from notabug.adapters.registry import adapters

    known = set(adapters()) - {
        "inhouse",
        "zbuffer",
        "shadowmap",
        "opengl",
        "mitsuba",
    }  # Mitsuba is there by its variants
    for each in known:
        monkeypatch.setattr(type(adapters()[each]), "find", lambda adapter: Found("1", f"where {adapter.name} is"))
    assert known <= {name for name, *_ in renderers(quick=True)}


def test_the_slope_of_a_power_law_is_its_exponent() -> None:
    x = [4.0, 16.0, 64.0, 256.0]
    assert slope(x, [each**-0.75 for each in x]) == pytest.approx(-0.75)
    assert slope(x[:2], [1.0, 2.0]) is None
    assert slope(x, [0.0, 0.0, 0.0, 1.0]) is None


def test_the_time_to_a_target_lies_on_the_power_law() -> None:
    """Error 1 / t: 1e-3 is reached after 1000 times the time of 1."""
    places = [place(t, 1.0 / t) for t in (10.0, 100.0, 10_000.0)]
    assert time_to(places, 1e-3) == pytest.approx(1000.0)
    assert time_to(places, 1e-5) is None


def test_a_picture_is_not_off_itself(of: Envelope) -> None:
    assert set(errors(of.mean, of.mean).values()) == {0.0}
    worse, bad = errors(1.1 * of.mean, of.mean), errors(1.01 * of.mean, of.mean)
    assert all(worse[name] >= bad[name] for name in worse)
    assert worse["flip"] > bad["flip"] > 0.0


def test_relmse_of_a_constant_factor() -> None:
    assert relmse(np.full(4, 2.2), np.full(4, 2.0)) == pytest.approx(0.04 / 4.01)


@pytest.mark.parametrize(
    ("precision", "quantum", "relative", "cause"),
    [
        ("float64", 1 / 65535, False, "output in steps of 1/65535"),
        ("float64", 2.0**-11, True, "half-float output"),
        ("float64", 2.0**-24, True, "float32 output of float64 arithmetic"),
    ],
)
def test_the_floor_is_the_number_format(
    of: Envelope, precision: str, quantum: float, relative: bool, cause: str
) -> None:
    declared = Declaration(precision, "point", 0.0, quantum, relative, noisy=False)  # type: ignore[arg-type]
    if not relative:
        written = np.round(of.point / quantum) * quantum
    else:
        written = of.point.astype(np.float16 if quantum > 1e-4 else np.float32).astype(np.float64)
    found = floor(written, of, declared)
    assert found.cause == cause
    assert found.expected / 4.0 < found.median < found.expected * 4.0
    off = floor(1.01 * written, of, declared)
    assert off.cause == f"more than {cause} explains"


def test_the_start_is_taken_off_and_never_more() -> None:
    assert Cost(2.0, 1.0, 9.0).without(Cost(0.5, 0.25, 5.0)) == Cost(1.5, 0.75, 9.0)
    assert Cost(0.1, 0.1, 9.0).without(Cost(0.5, 0.25, 5.0)) == Cost(0.0, 0.0, 9.0)


@pytest.mark.slow
def test_a_tiny_run_has_theorys_slope(scene: Scene) -> None:
    settings = tuple(Setting(n, InHouse(), scene, n) for n in (4, 16, 64))
    (found,) = measure([Line("terminator/sphere", "inhouse float64", "samples", settings, -0.5)], repeats=2)
    assert found.message == ""
    assert found.slope == pytest.approx(-0.5, abs=0.12)
    assert found.floor is not None
    assert found.floor.cause == "float32 output of float64 arithmetic"
    assert found.bias > 0.0
    assert [each.value for each in found.places] == [4, 16, 64]
    for each in found.places:
        assert each.variance is not None
        assert each.wall >= each.wall_net >= 0.0
        assert each.memory > 10.0
