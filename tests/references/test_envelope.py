"""Edges: of what is seen, and of shadows."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from notabug.references.tracer.envelope import SEEN, changes, lattice, trace_envelope
from notabug.scenes_usd.reader import read_scene
from notabug.scenes_usd.scene import Material


def test_a_shadows_edge_is_told_from_an_outline() -> None:
    """The ball's shadow on the floor is the same object on both sides of its edge, the ball's outline is not."""
    scene = replace(read_scene("terminator/sphere"), width=96, height=96)
    found = trace_envelope(scene)
    dark, bare = found.ids, trace_envelope(replace(scene, lights=())).ids
    assert np.array_equal(dark & SEEN, bare)  # without lights none is blocked
    outline = changes(bare)
    cast = found.cast | changes(dark, cast=True)
    assert (outline & ~cast).sum() > 100
    assert (cast & ~outline).sum() > 100
    assert np.array_equal(found.edge | changes(dark), (found.edge | changes(dark)) | cast)
    assert not trace_envelope(replace(scene, lights=())).cast.any()


@pytest.mark.parametrize("sends", [{"mirror": (0.4,) * 3}, {"transmission": (0.4,) * 3, "ior": 1.2}, {"opacity": 0.6}])
def test_what_a_ray_meets_next_hides_no_shadows_edge_on_its_way(make: Any, sends: dict[str, Any]) -> None:
    """A floor that sends rays on, in a lit room: the edge of a shadow on it is an edge whatever is seen in it."""
    grey = (0.5,) * 3
    objects = [
        make.rectangle(),
        make.rectangle(1.0, 0.3, 1),
        make.rectangle(20.0, 90.0, 1),
        make.rectangle(-5.0, 90.0, 1),
    ]
    lights = [make.point((0.5, 0.2, 2.0), 9.0), make.point((0.0, 0.0, -2.0), 9.0)]  # one for what lies below

    def traced(floor: Material) -> Any:
        materials = (floor, Material("/Room", grey))
        return trace_envelope(make.scene(objects, lights, make.camera((1, -3, 4), (0, 0, 0)), materials=materials))

    alone, sending = traced(Material("/Floor", grey)), traced(Material("/Floor", grey, **sends))
    assert alone.cast.sum() > 50
    assert not (alone.cast & ~sending.edge).any()
    assert (alone.cast & sending.cast).sum() > 0.8 * alone.cast.sum()


@pytest.mark.parametrize("samples", [16, 64, 1024])
def test_each_column_and_row_of_a_lattice_holds_one_point(samples: int) -> None:
    rows = [lattice(samples) * s % samples for s in range(samples)]
    assert sorted(rows) == list(range(samples))


@pytest.mark.parametrize("above", [0.03, 0.31, 0.6928])
@pytest.mark.parametrize("thick", [0.003, 0.0224, 0.07])
def test_a_strip_along_a_border_that_no_row_of_a_grid_meets(make: Any, above: float, thick: float) -> None:
    """Black between white and grey, as the shadow under a sheet is: the pixels' means are those of the areas.

    The thinnest lie between two rows of the lattice too.
    """
    size, row = 16, 5
    world = 0.8 / size  # a pixel: from z = 2 straight above, with the tangent .2, -.4 to .4 are seen
    top = 0.4 - (row + above) * world
    bands = ((0, 9.0, top), (1, top, top - thick * world), (2, top - thick * world, -9.0))
    scene = make.scene(
        [
            make.mesh([(-9, a, 0), (-9, b, 0), (9, b, 0), (9, a, 0)], [(0, 1, 2, 3)], k, path=f"/Band{k}")
            for k, a, b in bands
        ],
        [make.distant((0, 0, -1), np.pi)],
        make.camera((0, 0, 2.0), (0, 0, 0), 0.2),
        materials=[Material(f"/M{k}", (each,) * 3) for k, each in enumerate((1.0, 0.0, 0.5))],
        size=size,
    )
    found = trace_envelope(scene)
    assert found.lo[row].max() == 0.0
    assert found.mean[row] == pytest.approx(above + 0.5 * (1.0 - above - thick), abs=1.5 / 64)
    assert found.mean[row - 1] == pytest.approx(1.0)
    assert found.mean[row + 1] == pytest.approx(0.5)
