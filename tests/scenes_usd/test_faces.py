"""What faces are, whatever float32 and transforms do to them, and how those are cut that are not convex."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from notabug.scenes_usd.faces import are_affine, local_points, patches, shapes
from notabug.scenes_usd.scene import Floats, Mesh
from notabug.scenes_usd.transform import rotation, transformed, translation
from notabug.scenes_usd.triangulate import Diagonal, split_ngons, triangulate

KITE = np.array([(-1.6, -1.05, 0), (1.65, -0.8, 0), (0.55, 0.95, 0), (-0.1, 1.15, 0)])
SQUARE = np.array([(0.0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)])
ARROW = np.array([(0.0, 0, 0), (2, 0, 0), (0.2, 0.2, 0), (0, 2, 0)])  # concave at corner 2
ELL = np.array([(0.0, 0, 0), (2, 0, 0), (2, 1, 0), (1, 1, 0), (1, 2, 0), (0, 2, 0)])  # concave at corner 3
BOW = np.array([(0.0, 0, 0), (2, 0, 0), (0, 1, 0), (2, 1, 0)])
STRAIGHT = np.array([(0.0, 0, 0), (1, 0, 0), (2, 0, 0), (2, 2, 0), (1, 2, 0), (0, 2, 0)])  # two corners of 180 degrees

SHEAR = np.array([[1.0, 0.5, 0, 0], [0, 1, 0.25, 0], [0.3, 0, 1, 0], [1, 2, 3, 1]])
MATRICES = {
    "none": np.eye(4),
    "turned": rotation((1, 2, 3), 33.0),
    "uneven": np.diag([1.0, 3.0, 0.2, 1.0]),
    "sheared": SHEAR,
    "mirrored": np.diag([-1.0, 1.0, 1.0, 1.0]) @ rotation((1, 1, 0), 70.0),
    "far": rotation((3, 1, 2), 20.0) @ translation(300.0, -200.0, 100.0),
    "small": rotation((3, 1, 2), 20.0) @ np.diag([1e-4, 1e-4, 1e-4, 1.0]),
}


def mesh_of(points: Floats, to_world: Floats | None = None, **parts: Any) -> Mesh:
    """One face with these corners, in world space."""
    count = len(points)
    return Mesh(
        "/Face",
        np.ascontiguousarray(points, np.float64),
        np.array([count], np.int32),
        np.arange(count, dtype=np.int32),
        0,
        to_world=np.eye(4) if to_world is None else to_world,
        **parts,
    )


def placed(points: Floats, matrix: Floats, *, baked: bool) -> Mesh:
    """The face under ``matrix``: baked into float32 points, or by the prim's transform, from float32 points."""
    world = points @ matrix[:3, :3] + matrix[3, :3]
    if baked:
        return mesh_of(world.astype(np.float32))
    return mesh_of(points.astype(np.float32).astype(np.float64) @ matrix[:3, :3] + matrix[3, :3], matrix)


def area(points: Floats) -> Floats:
    """The signed areas (t,) of triangles (t, 3, 3) in the plane z."""
    x, y = points[..., 0], points[..., 1]
    return ((x[:, 1] - x[:, 0]) * (y[:, 2] - y[:, 0]) - (y[:, 1] - y[:, 0]) * (x[:, 2] - x[:, 0])) / 2


@pytest.mark.parametrize("baked", [True, False])
@pytest.mark.parametrize("name", MATRICES)
def test_a_flat_quad_is_a_patch_under_every_transform(name: str, baked: bool) -> None:
    mesh = placed(KITE, MATRICES[name], baked=baked)
    assert patches(mesh).tolist() == [True]
    uv = np.array([(0.0, 0), (1, 0), (1, 1), (0, 1)])
    corners = local_points(mesh)[mesh.corners][None]
    assert not are_affine(corners, uv[None])[0], "the kite's uv are not affine, however it is turned"
    flat = uv[[0, 1]][None].repeat(2, axis=1)[:, [0, 2, 2, 0]] * 0.0 + 0.25
    assert are_affine(corners, flat)[0], "a constant is"
    linear = (
        (corners[0] - corners[0, 0]) @ np.linalg.pinv(corners[0, 1:3] - corners[0, 0]) @ np.array([(1.0, 0), (1, 1)])
    )
    assert are_affine(corners, linear[None].astype(np.float32).astype(np.float64))[0], "what was made so is"


@pytest.mark.parametrize("baked", [True, False])
@pytest.mark.parametrize("name", [each for each in MATRICES if each not in ("far",)])
@pytest.mark.parametrize("bend", [1e-4, 0.01, 0.5])
def test_a_bent_quad_is_none(name: str, baked: bool, bend: float) -> None:
    bent = KITE + np.array([(0, 0, 0), (0, 0, 0), (0, 0, bend), (0, 0, 0)])
    mesh = placed(bent, MATRICES[name], baked=baked)
    assert not shapes(mesh).flat[0]
    assert not patches(mesh)[0]


def test_the_tolerance_grows_with_the_coordinates_that_were_rounded() -> None:
    """A flat quad at 1e4 is flat up to float32 there; one that bends by 20 roundings is not."""
    matrix = rotation((3, 1, 2), 20.0) @ translation(1e4, -2e4, 1e4)
    assert shapes(placed(KITE, matrix, baked=True)).flat[0]
    bent = KITE + np.array([(0, 0, 0), (0, 0, 0), (0, 0, 0.2), (0, 0, 0)])
    assert not shapes(placed(bent, matrix, baked=True)).flat[0]


@pytest.mark.parametrize(
    ("points", "flat", "convex"),
    [
        (SQUARE, True, True),
        (ARROW, True, False),
        (ELL, True, False),
        (STRAIGHT, True, False),
        (BOW, False, False),
        (np.array([(np.cos(a), np.sin(a), 0) for a in np.arange(5) * 4 * np.pi / 5]), True, False),
        (SQUARE[[0, 1, 1, 2, 3]], True, False),
    ],
    ids=["square", "arrow", "ell", "straight", "bow tie", "pentagram", "repeated"],
)
def test_shapes(points: Floats, flat: bool, convex: bool) -> None:
    found = shapes(mesh_of(points))
    assert (found.flat.tolist(), found.convex.tolist()) == ([flat], [convex])


@pytest.mark.parametrize("diagonal", ["02", "13", "shorter"])
@pytest.mark.parametrize("points", [SQUARE, KITE, ARROW, ELL, STRAIGHT, np.roll(ARROW, 1, 0), np.roll(ELL, 2, 0)])
def test_every_cut_covers_the_face_once(points: Floats, diagonal: Diagonal) -> None:
    found = area(triangulate(mesh_of(points), diagonal).points)
    x, y = points[:, 0], points[:, 1]
    whole = (x * np.roll(y, -1) - y * np.roll(x, -1)).sum() / 2
    assert (found > 0).all(), "no triangle is turned round, none is empty"
    assert found.sum() == pytest.approx(whole, rel=1e-12)


def test_a_fan_that_does_not_fit_covers_more() -> None:
    arrow = mesh_of(np.roll(ARROW, 1, axis=0))  # the concave corner is 3: the diagonal 02 lies outside
    assert (area(triangulate(arrow, "fan").points) < 0).any()
    assert (area(triangulate(arrow, "02").points) > 0).all()
    assert triangulate(mesh_of(KITE), "fan").corner.tolist() == triangulate(mesh_of(KITE), "02").corner.tolist()


def test_the_shorter_diagonal() -> None:
    lengths = [float(np.linalg.norm(KITE[b] - KITE[a])) for a, b in ((0, 2), (1, 3))]
    wanted = "02" if lengths[0] < lengths[1] else "13"
    both = mesh_of(np.concatenate([KITE, np.roll(KITE, 1, axis=0)]))
    both = replace(both, counts=np.array([4, 4], np.int32))
    corner = triangulate(both, "shorter").corner
    first = triangulate(mesh_of(KITE), wanted).corner
    second = triangulate(mesh_of(KITE), "13" if wanted == "02" else "02").corner
    assert corner[:2].tolist() == first.tolist()
    assert (corner[2:] - 4).tolist() == second.tolist()
    assert triangulate(mesh_of(SQUARE), "shorter").corner.tolist() == triangulate(mesh_of(SQUARE), "02").corner.tolist()


@pytest.mark.parametrize("place", range(4))
@pytest.mark.parametrize("diagonal", ["02", "13", "shorter", "fan"])
def test_a_quad_with_two_corners_in_one_place_is_a_triangle(place: int, diagonal: Diagonal) -> None:
    """Where the two corners differ in their uv, which one counts goes by the diagonal."""
    points = np.array([(0.0, 0, 0), (2, 0, 0), (1, 2, 0)])
    corners = [0, 1, 2]
    corners.insert(place, corners[place % 3])
    mesh = mesh_of(points[corners], uv=np.arange(8.0).reshape(4, 2))
    cut = triangulate(mesh, diagonal)
    assert area(cut.points).tolist() == [2.0]
    pinched = {k for k in range(4) if corners[k] == corners[k - 1]}
    pair = {next(iter(pinched)), next(iter(pinched)) - 1 & 3}
    kept = pair & set(cut.corner.ravel().tolist())
    if diagonal in ("02", "fan"):
        assert kept == {each for each in pair if each % 2 == 0}
    elif diagonal == "13":
        assert kept == {each for each in pair if each % 2 == 1}


def test_split_ngons_keeps_what_belongs_to_corners() -> None:
    mesh = mesh_of(ELL, uv=ELL[:, :2].copy(), normals=np.tile((0.0, 0, 1), (6, 1)))
    cut = split_ngons(mesh, "02")
    assert cut.uv is not None
    np.testing.assert_array_equal(cut.points[cut.corners][:, :2], cut.uv)


def test_answers_do_not_depend_on_the_unit_of_length() -> None:
    for scale in (1e-6, 1e6):
        for points in (KITE, ARROW, STRAIGHT, BOW):
            a, b = shapes(mesh_of(points)), shapes(mesh_of(points * scale))
            assert (a.flat == b.flat).all()
            assert (a.convex == b.convex).all()


def test_no_polygon_is_cut_into_less_than_itself() -> None:
    """The triangles of a star, however it is turned, have its area; ears are found in each."""

    @given(st.integers(5, 12), st.floats(0.1, 0.9), st.floats(0.0, 6.3), st.integers(0, 11))
    def holds(tips: int, depth: float, turn: float, roll: int) -> None:
        angle = turn + np.arange(2 * tips) * np.pi / tips
        radius = np.where(np.arange(2 * tips) % 2, depth, 1.0)
        star = np.roll(np.stack([radius * np.cos(angle), radius * np.sin(angle), 0 * angle], axis=1), roll, axis=0)
        found = area(triangulate(mesh_of(star)).points)
        assert len(found) == 2 * tips - 2
        assert (found > 0).all()
        assert found.sum() == pytest.approx(tips * depth * np.sin(np.pi / tips), rel=1e-9)

    holds()


def test_a_polygon_that_crosses_itself_is_drawn_in_its_own_corners() -> None:
    turns = np.arange(5) * 4 * np.pi / 5
    star = np.stack([np.cos(turns), np.sin(turns), 0 * turns], axis=1)
    assert [len(triangulate(mesh_of(each)).face) for each in (BOW, star)] == [2, 3]


def test_a_scene_that_is_moved_keeps_its_faces(make_scene: Any) -> None:
    scene = make_scene(mesh_of(KITE.astype(np.float32)))
    moved = transformed(scene, rotation((1, 2, 3), 50.0) @ translation(1e5, 0, 0))
    (mesh,) = moved.meshes
    assert patches(mesh).tolist() == [True]


@pytest.fixture
def make_scene() -> Any:
    from pathlib import Path

    from notabug.scenes_usd.scene import Camera, Card, Light, Material, Scene

    camera = Camera("/C", np.eye(4), 0.4, 0.4, 0.1, 100.0)
    light = Light("/L", "point", (1.0, 1.0, 1.0))

    def made(mesh: Mesh) -> Scene:
        card = Card("texture", "x")
        return Scene("x", Path("x.usda"), {}, card, camera, 8, 8, (mesh,), (light,), (Material("/M", (1.0,) * 3),))

    return made
