"""Faces as exporters write them: corners in one place, needles, poles of balls, bent and concave ones; all are read."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from notabug.scenes_usd.errors import SceneError
from notabug.scenes_usd.faces import patches, shapes
from notabug.scenes_usd.reader import read_scene
from notabug.scenes_usd.reader_faces import sound_faces
from notabug.scenes_usd.scene import Mesh
from notabug.scenes_usd.triangulate import triangulate

Write = Callable[..., Path]

POINTS = "point3f[] points = [(0, 0, 0), (2, 0, 0), (2, 1, 0), (0, 1, 0)]"
NORMALS = (
    'normal3f[] normals = [(0, 0, 1), (0, 0, 1), (0, 0, 2), (0, 1, 1)] (\n                interpolation = "vertex"\n'
    "            )"
)
UV = (
    'texCoord2f[] primvars:st = [(0, 0), (1, 0), (1, 1), (0, 1)] (\n                interpolation = "vertex"\n'
    "            )"
)
GREY = ("rel material:binding = </Scene/Picture>", "rel material:binding = </Scene/Grey>")
OTHER = """def Mesh "Other" (
            prepend apiSchemas = ["MaterialBindingAPI"]
        )
        {
            rel material:binding = </Scene/Grey>
            int[] faceVertexCounts = [3]
            int[] faceVertexIndices = [0, 1, 2]
            point3f[] points = [(0, 0, 0), (1, 0, 0), (0, 1, 0)]
            uniform token subdivisionScheme = "none"
        }"""


def shape(points: Any, faces: Any, more: str = "") -> tuple[tuple[str, str], ...]:
    """The changes that give the square these points and faces, without normals and uv but for what ``more`` says."""
    flat = [corner for face in faces for corner in face]
    return (
        GREY,
        (POINTS, f"point3f[] points = {[tuple(map(float, each)) for each in points]}"),
        ("[4]", str([len(face) for face in faces])),
        ("[0, 1, 2, 3]", str(flat)),
        (NORMALS, ""),
        (UV, ""),
        ("# square", more),
    )


def meshes(path: Path) -> list[Mesh]:
    return list(read_scene(path).meshes)


CORNERS = [(0, 0, 0), (2, 0, 0), (1, 2, 0)]


@pytest.mark.parametrize("place", range(4))
@pytest.mark.parametrize("how", ["repeated index", "another point", "a rounding apart"])
def test_a_quad_with_two_corners_in_one_place_is_a_triangle(place: int, how: str, write: Write) -> None:
    face = [0, 1, 2]
    face.insert(place, face[place % 3])
    points = list(CORNERS)
    if how != "repeated index":
        aside = 1e-8 if how == "a rounding apart" else 0.0
        face[place] = 3
        x, y, z = points[[0, 1, 2][place % 3]]
        points.append((x + aside, y, z))
    (mesh,) = meshes(write(*shape(points, [face])))
    assert mesh.counts.tolist() == [3]
    np.testing.assert_allclose(np.sort(mesh.points[mesh.corners], axis=0), np.sort(CORNERS, axis=0), atol=1e-7)


@pytest.mark.parametrize("place", range(6))
def test_an_edge_without_length_goes_from_any_polygon(place: int, write: Write) -> None:
    """A pentagon with one corner twice is that pentagon, and its uv stay with their corners."""
    points = [(0, 0, 0), (2, 0, 0), (3, 1, 0), (1, 2, 0), (0, 1, 0)]
    face = list(range(5))
    face.insert(place, face[place % 5])
    st = [(points[k][0] / 4, points[k][1] / 4) for k in face]
    more = f'texCoord2f[] primvars:st = {st} (interpolation = "faceVarying")'
    (mesh,) = meshes(write(*shape(points, [face], more)))
    assert mesh.counts.tolist() == [5]
    assert mesh.uv is not None
    np.testing.assert_allclose(mesh.uv, mesh.points[mesh.corners][:, :2] / 4)


@pytest.mark.parametrize("face", [[0, 1, 2, 0, 0], [0, 0, 1, 1, 2, 2, 0], [0, 0, 0, 1, 2], [1, 2, 2, 2, 0, 0, 1]])
def test_rows_of_corners_in_one_place(face: list[int], write: Write) -> None:
    """However many, and across the first corner too, they are one."""
    (mesh,) = meshes(write(*shape(CORNERS, [face, [0, 1, 2]])))
    assert mesh.counts.tolist() == [3, 3]
    assert sorted(mesh.corners[:3].tolist()) == [0, 1, 2]


def test_what_is_no_face_is_left_out_and_the_rest_keeps_its_own(write: Write) -> None:
    """Of faces before, between and after dropped ones normals and uv stay right, by every interpolation."""
    points = [*CORNERS, (4, 4, 0), (1, 0, 0)]
    dropped = [[0, 0, 0], [0, 1, 4], [1, 1, 2, 2], [0, 1, 0, 1], [0, 4, 1, 4]]
    faces = [dropped[0], [0, 1, 2], dropped[1], dropped[2], [1, 3, 2], dropped[3], dropped[4]]
    uniform = ", ".join(f"({k + 1}, 0, 1)" for k in range(7))
    flat = [corner for face in faces for corner in face]
    st = [(float(points[k][0]), float(points[k][1])) for k in flat]
    more = (
        f'normal3f[] normals = [{uniform}] (interpolation = "uniform")\n'
        f'texCoord2f[] primvars:st = {st} (interpolation = "faceVarying")'
    )
    (mesh,) = meshes(write(*shape(points, faces, more)))
    assert mesh.counts.tolist() == [3, 3]
    assert mesh.corners.tolist() == [0, 1, 2, 1, 3, 2]
    assert mesh.normals is not None
    assert mesh.uv is not None
    np.testing.assert_allclose(mesh.normals[0], np.array([2, 0, 1]) / np.sqrt(5))
    np.testing.assert_allclose(mesh.normals[3], np.array([5, 0, 1]) / np.sqrt(26))
    np.testing.assert_array_equal(mesh.uv, mesh.points[mesh.corners][:, :2])


@pytest.mark.parametrize(
    "points",
    [
        [(0, 0, 0), (1, 0, 0), (2, 0, 0)],
        [(0, 0, 0), (1, 1e-8, 0), (2, 0, 0)],
        [(1, 1, 1), (1, 1, 1), (1, 1, 1)],
        [(0, 0, 0), (0.1, 0.1, 0.1), (0.3, 0.3, 0.3), (0.2, 0.2, 0.2)],
    ],
    ids=["collinear", "a needle", "a point", "four on a line"],
)
def test_a_mesh_without_an_area_is_nothing(points: Any, write: Write) -> None:
    changes = shape(points, [list(range(len(points)))], "# more")
    with pytest.raises(SceneError, match="nothing to draw"):
        read_scene(write(*changes))
    changes = (*changes[:-1], ("# square\n        }", "}\n" + OTHER))
    assert [each.path for each in meshes(write(*changes))] == ["/Scene/Group/Other"]


@pytest.mark.parametrize("scale", [1e-5, 1.0, 1e4])
def test_thin_is_not_empty(scale: float, write: Write) -> None:
    """A strip a thousand times as long as wide is a face, at any unit of length."""
    points = [(0, 0, 0), (scale, 0, 0), (scale, scale / 1000, 0), (0, scale / 1000, 0)]
    (mesh,) = meshes(write(*shape(points, [[0, 1, 2, 3]])))
    assert mesh.counts.tolist() == [4]
    assert patches(mesh).all()


def test_the_rows_at_a_balls_poles(write: Write) -> None:
    """Quads whose upper corners meet in the pole: triangles; with a uv of its own for each, quads cut into one."""
    angle = np.arange(8) * np.pi / 4
    rim = [(float(np.cos(a)), 0.0, float(np.sin(a))) for a in angle]
    points = [*rim, *[(0.0, 1.0, 0.0)] * 8]
    faces = [[8 + k, 8 + (k + 1) % 8, (k + 1) % 8, k] for k in range(8)]
    (plain,) = meshes(write(*shape(points, faces)))
    assert plain.counts.tolist() == [3] * 8
    st = [(each, v) for k in range(8) for each, v in ((k / 8, 1), (k / 8 + 0.125, 1), (k / 8 + 0.125, 0), (k / 8, 0))]
    more = f'texCoord2f[] primvars:st = {st} (interpolation = "faceVarying")'
    (textured,) = meshes(write(*shape(points, faces, more)))
    assert textured.counts.tolist() == [4] * 8
    assert not patches(textured).any()
    assert len(triangulate(textured).face) == 8


def test_zero_normals_count_only_where_a_face_is_seen(write: Write) -> None:
    """Exporters write (0, 0, 0) for the faces that have no area; at one that is drawn it is a fault."""
    faces = [[0, 1, 1], [0, 1, 2]]
    zeros = "(0, 0, 0), (0, 0, 0), (0, 0, 0)"
    normals = 'normal3f[] normals = [{}] (interpolation = "faceVarying")'
    seen = "(0, 0, 1), (0, 0, 1), (0, 0, 1)"
    (mesh,) = meshes(write(*shape(CORNERS, faces, normals.format(f"{zeros}, {seen}"))))
    assert mesh.normals is not None
    assert mesh.normals.tolist() == [[0, 0, 1]] * 3
    with pytest.raises(SceneError, match=r"Square\.normals: the normal of corner 3 has no length"):
        read_scene(write(*shape(CORNERS, faces, normals.format(f"{seen}, {zeros}"))))


@pytest.mark.parametrize(
    ("points", "flat"),
    [
        ([(0, 0, 0), (2, 0, 0), (0.2, 0.2, 0), (0, 1, 0)], True),
        ([(0, 0, 0), (2, 0, 0), (0, 1, 0), (2, 1, 0)], False),
        ([(0, 0, 0), (1, 0, 0), (2, 0, 0), (0, 1, 0)], True),
        ([(0, 0, 0), (2, 0, 0), (2, 1, 0.0001), (0, 1, 0)], False),
        ([(0, 0, 0), (2, 0, 0), (2, 1, 0), (1, 2, 0.5), (0, 1, 0)], False),
    ],
    ids=["concave", "crossed", "180 degrees", "bent", "bent pentagon"],
)
def test_faces_that_are_no_patches_are_read_as_they_are(points: Any, flat: bool, write: Write) -> None:
    uv = [(float(x), float(y) ** 2) for x, y, _ in points]
    more = f'texCoord2f[] primvars:st = {uv} (interpolation = "vertex")'
    (mesh,) = meshes(write(*shape(points, [list(range(len(points)))], more)))
    assert mesh.counts.tolist() == [len(points)]
    assert not patches(mesh).any()
    assert shapes(mesh).flat.tolist() == [flat]


def test_the_intent_must_be_something(write: Write) -> None:
    hidden = OTHER.replace('"Other" (', '"Meant" (').replace(
        "(0, 1, 0)]", '(2, 0, 0)]\n            token purpose = "guide"'
    )
    changes = (("string claim", 'string intent = "/Scene/Group/Meant"\nstring claim'), ("# group", hidden))
    with pytest.raises(SceneError, match="no face of the intent has an area"):
        read_scene(write(*changes))


def test_faces_that_are_sound_are_not_touched() -> None:
    """Every corner is kept, so no array of the corpus moves by a bit."""
    rng = np.random.default_rng(5)
    points = rng.random((50, 3))
    corners = np.arange(48, dtype=np.int32)
    counts = np.full(12, 4, np.int32)
    kept, left = sound_faces(points, counts, corners, None, None)
    assert kept.tolist() == corners.tolist()
    assert left.tolist() == counts.tolist()
