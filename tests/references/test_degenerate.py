"""References of faces that are hardly any: finite whatever there is, equal to the faces they stand for; or an error."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from notabug.exit_codes import ExitCode, exit_code
from notabug.references import store
from notabug.references.predict import ReferenceNotFiniteError, check_finite, predict
from notabug.references.tracer.envelope import trace_picture
from notabug.references.tracer.flatten import flatten
from notabug.scenes_usd.scene import Mesh, Scene
from notabug.scenes_usd.triangulate import split_ngons

TRIANGLE = [(0.0, 1, 0), (-1, -1, 0), (1, -1, 0)]
UP = [(0.0, 0, 1), (-0.3, 0, 1), (0.3, 0, 1)]


def unit(rows: Any) -> Any:
    rows = np.asarray(rows, float)
    return rows / np.linalg.norm(rows, axis=1, keepdims=True)


@pytest.fixture
def seen(make: Any) -> Any:
    """A scene in which a mesh is seen from the front, with a feature of every kind behind the camera."""

    def made(mesh: Mesh, size: int = 24, **parts: Any) -> Scene:
        lights = parts.pop("lights", [make.point((1.0, 2, 3), 30.0)])
        found: Scene = make.scene([mesh], lights, make.camera((0, 0, 4), (0, 0, 0)), size=size, full=True, **parts)
        return found

    return made


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
@pytest.mark.parametrize("place", range(4))
def test_a_quad_with_a_corner_twice_is_drawn_as_its_triangle(place: int, dtype: Any, make: Any, seen: Any) -> None:
    """Also where no reader has cleaned it: a mesh that was made in memory."""
    face = [0, 1, 2]
    face.insert(place, face[place % 3])
    quad = make.mesh(TRIANGLE, [face], normals=unit(UP), uv=np.array(TRIANGLE)[:, :2])
    plain = make.mesh(TRIANGLE, [[0, 1, 2]], normals=unit(UP), uv=np.array(TRIANGLE)[:, :2])
    pictures = [trace_picture(seen(each), dtype=dtype) for each in (quad, plain)]
    assert pictures[1].max() > 0.1
    np.testing.assert_allclose(pictures[0], pictures[1], atol=1e-6 if dtype is np.float32 else 1e-12)


@pytest.mark.parametrize("extent", [1e-30, 1e-12, 1e-9])
@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_nothing_is_not_finite_where_triangles_are_next_to_nothing(
    extent: float, dtype: Any, make: Any, seen: Any
) -> None:
    """Needles, points, and triangles whose normals' squares are 0 in float32, in front of one that is seen."""
    points = [*TRIANGLE, (0, 0, 0.1), (extent, 0, 0.1), (0, extent, 0.1), (0, 1, 0.1), (0, -1, 0.1)]
    faces = [[0, 1, 2], [3, 4, 5], [3, 3, 3], [6, 3, 7], [6, 4, 7], [3, 4, 5, 3], [6, 3, 7, 3]]
    mesh = make.mesh(points, faces, normals=np.tile((0.0, 0, 1), (8, 1)), uv=np.zeros((8, 2)))
    scene = seen(mesh, size=25)  # a pixel's centre looks at the middle
    flat = flatten(scene, dtype)
    edges = flat.points.reshape(-1, 3, 3).astype(np.float64)
    normal = np.cross(edges[:, 1] - edges[:, 0], edges[:, 2] - edges[:, 0]).astype(dtype)
    assert (np.square(normal).sum(axis=1) > 0).all()
    picture = trace_picture(scene, dtype=dtype)
    assert np.isfinite(picture).all()
    plain = trace_picture(seen(make.mesh(TRIANGLE, [[0, 1, 2]], normals=unit([(0, 0, 1)] * 3)), size=25), dtype=dtype)
    assert (np.abs(picture - plain).max(axis=2) > 1e-3).sum() <= 25, "a needle may be seen, along its own column"


def test_a_mesh_of_nothing_at_all(make: Any, seen: Any) -> None:
    nothing = make.mesh([(0.0, 0, 0)] * 4, [[0, 1, 2, 3], [0, 1, 2]], normals=[(0, 0, 1.0)] * 4, uv=np.zeros((4, 2)))
    assert not trace_picture(seen(nothing)).any()


BENT = np.array([(-1.0, -1, 0), (1, -1, 0), (1, 1, 0.8), (-1, 1, 0)])


def test_a_bent_quad_is_two_triangles(make: Any, seen: Any) -> None:
    """Its reference is that of its fan, shape, normals and uv alike; a flat one keeps its bilinear map."""
    rng = np.random.default_rng(3)
    normals, uv = unit(rng.random((4, 3)) - (0.5, 0.5, -1.0)), rng.random((4, 2))
    for points, same in ((BENT, True), (BENT * (1, 1, 0), False)):
        quad = make.mesh(points, [[0, 1, 2, 3]], normals=normals, uv=uv)
        off = np.abs(trace_picture(seen(quad)) - trace_picture(seen(split_ngons(quad, "02")))).max()
        assert bool(off == 0.0) is same


def test_the_halves_of_a_bent_quad_shadow_each_other(make: Any, seen: Any) -> None:
    """A ray that leaves one half meets the other, as if they were two faces: a valley lit from the side."""
    valley = np.array([(0.0, -1, 0), (1, 0, 1.5), (0, 1, 0), (-1, 0, 1.5)])
    lights = [make.point((6.0, 0, 2.2), 100.0)]
    quad = make.mesh(valley, [[0, 1, 2, 3]])
    both = make.mesh(valley, [[0, 1, 2], [0, 2, 3]])
    pictures = [trace_picture(seen(each, lights=lights)) for each in (quad, both)]
    np.testing.assert_array_equal(*pictures)
    alone = trace_picture(seen(make.mesh(valley, [[0, 2, 3]]), lights=lights))
    assert (alone - pictures[0]).max() > 0.05, "the near half does cast a shadow on the far one"


def test_a_value_that_is_not_finite_is_an_error_of_its_own(make: Any, seen: Any) -> None:
    scene = seen(make.mesh(TRIANGLE, [[0, 1, 2]]), 25)
    for wrong in (np.nan, np.inf, -np.inf):
        values = np.zeros((25, 25, 3))
        check_finite(values, scene)
        values[3, 7, 1] = wrong
        with pytest.raises(ReferenceNotFiniteError, match=r"1 of 625 pixels, the first at \(7, 3\)") as caught:
            check_finite(values, scene)
        assert exit_code(caught.value) is ExitCode.REFERENCE


@pytest.mark.parametrize("intensity", [1e29, 1e300])
def test_whatever_made_it_so(
    intensity: float, make: Any, seen: Any, tmp_path: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Every way to a reference ends in the error: predict, also from its cache, and the corpus."""
    monkeypatch.setenv("NOTABUG_CACHE", str(tmp_path / "cache"))
    scene = seen(make.mesh(TRIANGLE, [[0, 1, 2]]), 25, lights=[make.point((0.0, 0, 1), intensity)])
    for _ in range(2):
        with pytest.raises(ReferenceNotFiniteError):
            predict(scene)


def test_a_light_in_the_very_point_that_it_would_light_gives_it_none(make: Any, seen: Any) -> None:
    lights = [make.point((0.0, 0, 0), 1.0)]
    envelope = predict(seen(make.mesh(TRIANGLE, [[0, 1, 2]]), 25, lights=lights), cached=False)
    assert all(np.isfinite(each).all() for each in (envelope.point, envelope.mean, envelope.hi))
    normals = np.array([[0.0, 0, 1], [0, 0, -1], [0, 0, -1]])
    cancelled = make.mesh(TRIANGLE, [[0, 1, 2]], normals=normals)
    assert np.isfinite(predict(seen(cancelled, 25), cached=False).mean).all(), "the facet's normal where they cancel"


def test_the_corpus_holds_nothing_that_is_not_finite(
    make: Any, seen: Any, tmp_path: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene = seen(make.mesh(TRIANGLE, [[0, 1, 2]]), 25)
    monkeypatch.setattr(store, "CORPUS", tmp_path / "corpus")
    true = store.trace_envelope(scene)

    def wrong(*_: Any, **__: Any) -> Any:
        return replace(true, mean=np.where(true.mean > 0, np.nan, true.mean))

    store.build(scene)
    monkeypatch.setattr(store, "trace_envelope", wrong)
    for deed in (store.build, store.verify):
        with pytest.raises(ReferenceNotFiniteError):
            deed(scene)
    assert np.isfinite(store.read("test/scene").pixels).all(), "what was stored stays"


def test_a_faults_prediction_may_overflow(make: Any, seen: Any) -> None:
    """It is no reference: what it cannot say is the judge's to discard."""
    from notabug.references.models.model import models

    scene = seen(make.mesh(TRIANGLE, [[0, 1, 2]]), 25)
    fault = next(each for each in models(scene) if each.kind == "fault")
    huge = replace(fault, edit=lambda scene: replace(scene, lights=(make.point((0.0, 0, 1), 1e300),)), options={})
    assert not np.isfinite(predict(scene, [huge], cached=False).point).all()
