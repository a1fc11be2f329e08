"""The tolerance where the prediction itself is not exact: wider by its bound, and by no more."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from notabug.adapters.base import Declaration
from notabug.metrics.admissible import admissible
from notabug.references.tracer.envelope import Envelope
from notabug.references.tracer.precision import ABSOLUTE, RELATIVE

SIZE = 16
BOX = Declaration("float64", "box", 0.5, quantum=0.0, relative_quantum=False, noisy=False, samples=64)
POINT = replace(BOX, filter="point", radius=0.0)


def envelope() -> Envelope:
    value = np.full((SIZE, SIZE, 3), 0.5)
    none = np.zeros((SIZE, SIZE))
    return Envelope(
        value, value, 0 * value, value, value, none.astype(np.int64), none > 0, none, none, none > 0, 0 * value
    )


def test_a_bound_of_more_than_is_asked_widens_the_tolerance_by_itself() -> None:
    exact = envelope()
    quarter = 0.25 * 0.5 * (RELATIVE + ABSOLUTE)
    bound = np.zeros_like(exact.mean)
    bound[2, 3], bound[4, 5] = 0.03, 0.9 * quarter
    before, after = (admissible(each, BOX).tau for each in (exact, replace(exact, bound=bound)))
    assert np.allclose(after[2, 3] - before[2, 3], 0.03)
    changed = np.flatnonzero((after != before).any(axis=2))
    assert changed.tolist() == [2 * SIZE + 3]


def test_at_a_pixels_centre_there_is_nothing_to_integrate() -> None:
    exact = envelope()
    loose = replace(exact, bound=np.full_like(exact.mean, 0.03))
    assert np.array_equal(admissible(exact, POINT).tau, admissible(loose, POINT).tau)


def test_edges_admit_more_than_the_bound_already() -> None:
    exact = envelope()
    edge = np.zeros((SIZE, SIZE), np.bool_)
    edge[:, 8] = True
    loose = replace(exact, edge=edge, bound=np.full_like(exact.mean, 0.03))
    tight = replace(exact, edge=edge)
    wider = (admissible(loose, BOX).tau - admissible(tight, BOX).tau).max(axis=2) > 0
    assert not wider[:, 7:10].any()
    assert wider[:, :7].all()
