"""Mesh files become scenes: OBJ with its polygons, others by trimesh; what the contract cannot say is cut."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from notabug.meshes.cutting import clipped, cut
from notabug.meshes.files import LARGEST, MeshFileError, RawMesh, parse_obj, read_mesh_file
from notabug.meshes.scene import scene_from_mesh, scene_from_mesh_file
from notabug.scenes_usd.reader import read_scene
from notabug.scenes_usd.scene import Floats
from notabug.scenes_usd.writer import write_scene

CUBE = """# a cube of quads
mtllib none.mtl
o cube
v 0 0 0
v 1 0 0
v 1 1 0
v 0 1 0
v 0 0 1
v 1 0 1
v 1 1 1
v 0 1 1
f 4 3 2 1
f 5 6 7 8
f 1 2 6 5
f -6 -5 -1 -2
f 2 3 7 6
f 1 5 8 4
"""


def polygon(*rows: tuple[float, ...]) -> Floats:
    return np.array(rows, float)


def mesh(points: Floats, uv: Floats | None = None) -> RawMesh:
    n = len(points)
    return RawMesh(points, np.array([n], np.int32), np.arange(n, dtype=np.int32), uv=uv)


def test_polygons_and_indices_from_the_end_are_kept() -> None:
    made = parse_obj(CUBE)
    assert made.counts.tolist() == [4] * 6
    assert made.corners[12:16].tolist() == [2, 3, 7, 6]
    assert made.normals is None
    assert made.uv is None


def test_normals_and_coordinates_by_corner() -> None:
    text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0 0\nvt .5\nvn 0 0 2\nf 1/1/1 2/2/1 3/3/1\n"
    made = parse_obj(text)
    assert made.uv is not None
    assert made.uv.tolist() == [[0, 0], [1, 0], [0.5, 0]]
    assert made.normals is not None
    assert made.normals.tolist() == [[0, 0, 2]] * 3
    assert parse_obj(text + "f 1//1 2//1 3//1\n").uv is None  # not every corner has one
    assert parse_obj("v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\nf 1//1 \\\n2//1 3//1\n").normals is not None


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("v 0 0\n", "2 numbers"),
        ("v 0 0 x\n", "x"),
        ("v 0 0 0\nf 1 1 2\n", "index 2 of 1 v"),
        ("v 0 0 0\nf 0 1 1\n", "index 0"),
        ("v 0 0 0\nf 1 1\n", "a face of 2 corners"),
        ("v 0 0 0\nf /1 1 1\n", "of 0 vt"),
    ],
)
def test_a_broken_line_is_named(text: str, says: str) -> None:
    with pytest.raises(MeshFileError, match=says) as raised:
        parse_obj(text, "broken.obj")
    assert f"broken.obj:{len(text.splitlines())}" in str(raised.value)


@pytest.mark.parametrize(
    ("name", "content", "says"),
    [
        ("a.obj", "# nothing\n", "no faces"),
        ("a.obj", "v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "not finite"),
        ("a.fbx", "", "not a known kind"),
        ("a.stl", "no stl", "no faces"),
        ("a.ply", "ply\nformat ascii 1.0\nelement vertex x\nend_header\n", "trimesh cannot read it"),
        ("gone.obj", None, "cannot be read"),
    ],
)
def test_a_file_that_is_no_mesh_is_an_error(name: str, content: str | None, says: str, tmp_path: Path) -> None:
    pytest.importorskip("trimesh")
    path = tmp_path / name
    if content is not None:
        path.write_text(content)
    with pytest.raises(MeshFileError, match=says):
        read_mesh_file(path)


def test_a_huge_file_is_not_opened(tmp_path: Path) -> None:
    path = tmp_path / "huge.obj"
    with path.open("wb") as file:
        file.truncate(LARGEST + 1)
    with pytest.raises(MeshFileError, match="too large"):
        read_mesh_file(path)


@pytest.mark.parametrize("suffix", [".stl", ".ply", ".off"])
def test_other_kinds_are_read(suffix: str, tmp_path: Path) -> None:
    trimesh = pytest.importorskip("trimesh")
    path = tmp_path / f"box{suffix}"
    trimesh.creation.box(extents=(1.0, 2.0, 3.0)).export(path)
    made = read_mesh_file(path)
    assert made.counts.tolist() == [3] * 12
    assert np.ptp(made.points, axis=0).tolist() == [1.0, 2.0, 3.0]
    scene = scene_from_mesh(made, size=(16, 16))
    assert read_scene(write_scene(scene, tmp_path / "box.usda")).width == 16


SQUARE = ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.0, 1.0, 0.0), (0.0, 1.0, 0.0))


@pytest.mark.parametrize(
    ("points", "left"),
    [
        (polygon(*SQUARE), [4]),
        (polygon(*SQUARE[:3], (0.0, 1.0, 1e-3)), [3, 3]),  # bent
        (polygon(*SQUARE[:2], (0.2, 0.2, 0.0), SQUARE[3]), [3, 3]),  # concave
        (polygon(*SQUARE[:2], SQUARE[1], SQUARE[2]), [3, 3]),  # a corner twice
        (polygon(*([SQUARE[0]] * 4)), [3, 3]),  # no area at all
        (polygon(*SQUARE, (-0.5, 0.5, 0.0)), [5]),
        (polygon(*SQUARE) * 1e6, [4]),
    ],
)
def test_faces_that_the_contract_cannot_say_are_cut(points: Floats, left: list[int]) -> None:
    assert cut(mesh(points)).counts.tolist() == left


def test_bent_quads_are_kept_where_they_may_be() -> None:
    points = polygon(*SQUARE[:3], (0.0, 1.0, 0.05))
    assert cut(mesh(points), bent=True).counts.tolist() == [4]
    assert cut(mesh(polygon(*SQUARE[:2], (0.2, 0.2, 0.0), SQUARE[3])), bent=True).counts.tolist() == [3, 3]


def test_five_corners_with_coordinates_are_cut() -> None:
    points = polygon(*SQUARE, (-0.5, 0.5, 0.0))
    made = cut(mesh(points, uv=np.random.default_rng(0).uniform(0, 1, (5, 2))))
    assert made.counts.tolist() == [3, 3, 3]
    assert made.uv is not None
    assert made.uv.shape == (9, 2)


def test_clipped_ears_cover_a_concave_polygon_once() -> None:
    outline = polygon((0, 0, 0), (4, 0, 0), (4, 3, 0), (2, 1, 0), (0, 3, 0))
    turned = outline @ np.linalg.qr(np.random.default_rng(2).normal(size=(3, 3)))[0]
    for points in (outline, turned, turned[::-1]):
        parts = clipped(points)
        areas = [np.linalg.norm(np.cross(points[b] - points[a], points[c] - points[a])) / 2 for a, b, c in parts]
        assert sum(areas) == pytest.approx(8.0)
        assert sorted({k for part in parts for k in part}) == list(range(5))


def test_a_mesh_file_becomes_a_scene_that_reads_back(tmp_path: Path) -> None:
    (tmp_path / "cube.obj").write_text(CUBE)
    made = scene_from_mesh_file(tmp_path / "cube.obj", size=(24, 16))
    again = read_scene(write_scene(made, tmp_path / "cube.usda"))
    (box,) = again.meshes
    assert box.counts.tolist() == [4] * 6
    assert (again.width, again.height, len(again.lights), again.card.artifact_class) == (24, 16, 1, "terminator")


def test_normals_without_a_length_are_the_faces(tmp_path: Path) -> None:
    text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 0\nvn 0 3 4\nf 1//1 2//2 3//2\n"
    (part,) = scene_from_mesh(parse_obj(text)).meshes
    assert part.normals is not None
    assert part.normals.tolist() == [[0, 0, 1], [0, 0.6, 0.8], [0, 0.6, 0.8]]
