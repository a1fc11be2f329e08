"""Edges: of what is seen, and of shadows."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from notabug.references.tracer.envelope import changes, trace_envelope
from notabug.references.tracer.render import SEEN
from notabug.scenes_usd.reader import read_scene


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
