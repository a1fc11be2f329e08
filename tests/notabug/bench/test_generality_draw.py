"""Random scenes: the same for a seed, inside the contract, and together with every feature."""

from __future__ import annotations

from collections import Counter
from dataclasses import fields
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest

import notabug.bench.generality.decks as decks
from notabug.bench.generality.decks import DECK, DECKS, Traits, generator, traits
from notabug.bench.generality.defects import with_defects
from notabug.bench.generality.draw import write_random_scene
from notabug.bench.generality.jobs import sized
from notabug.bench.generality.placing import placed
from notabug.bench.generality.shapes import SHAPES, Shape, floor
from notabug.scenes_usd.framing import FILL, bounds_of, framed
from notabug.scenes_usd.reader import read_scene
from notabug.scenes_usd.scene import Material, Mesh, Scene, Sphere

DRAWN = 40
CELLS = ("triangles", "quads", "ngons")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("random")


@pytest.fixture(scope="module")
def scenes(folder: Path) -> list[Scene]:
    """Every one of them is read by the reader: inside the contract."""
    return [read_scene(write_random_scene(3, index, folder / str(index))) for index in range(DRAWN)]


def test_every_deck_has_its_cards() -> None:
    assert {name: sum(cards.values()) for name, cards in DECKS.items()} == dict.fromkeys(DECKS, DECK)
    assert list(DECKS) == [each.name for each in fields(Traits)]


@pytest.mark.parametrize("seed", [0, 1, 7])
def test_each_block_deals_each_deck_whole(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(decks, "DEGENERATE", True)
    for block in range(3):
        dealt = [traits(seed, DECK * block + place) for place in range(DECK)]
        for name, cards in DECKS.items():
            assert Counter(getattr(each, name) for each in dealt) == cards


def test_four_hundred_scenes_hold_nearly_every_pair_of_features() -> None:
    dealt = [traits(0, index) for index in range(400)]
    for a, b in combinations(("shape", "cells", "transform", "normals", "look", "lights", "placing"), 2):
        seen = {(getattr(each, a), getattr(each, b)) for each in dealt}
        assert len(seen) >= 0.95 * len(DECKS[a]) * len(DECKS[b]), (a, b)


def test_nothing_is_degenerate_until_it_is_switched_on(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(decks, "DEGENERATE", False)
    assert {traits(0, index).degenerate for index in range(DECK)} == {"no"}


def test_the_same_seed_gives_the_same_bytes(tmp_path: Path) -> None:
    for index in range(6):
        a, b = (write_random_scene(5, index, tmp_path / name / str(index)) for name in "ab")
        assert a.read_bytes() == b.read_bytes()
        assert {p.name: p.read_bytes() for p in a.parent.glob("*.png")} == {
            p.name: p.read_bytes() for p in b.parent.glob("*.png")
        }
    assert a.read_bytes() != write_random_scene(6, index, tmp_path / "c").read_bytes()


def test_numbers_are_the_same_on_every_machine() -> None:
    """NumPy promises PCG64's stream: what a seed meant yesterday it means tomorrow."""
    assert generator(0, 0).integers(0, 1 << 30, 3).tolist() == generator(0, 0).integers(0, 1 << 30, 3).tolist()
    assert traits(0, 0) == traits(0, 0)
    assert traits(0, 0) != traits(1, 0) or traits(0, 1) != traits(1, 1)


def test_forty_scenes_hold_every_feature(scenes: list[Scene]) -> None:
    meshes = [mesh for scene in scenes for mesh in scene.meshes]
    corners = {int(n) for mesh in meshes for n in mesh.counts}
    assert {3, 4} <= corners
    assert max(corners) > 4
    materials = [each for scene in scenes for each in scene.materials]
    assert {each.lobe for each in materials if any(each.specular)} == {"phong", "blinn"}
    for part in ("mirror", "transmission", "specular"):
        assert any(any(getattr(each, part)) for each in materials), part
    assert any(each.opacity < 1 for each in materials)
    assert any(each.texture >= 0 for each in materials)
    assert {len(scene.lights) for scene in scenes} == {1, 2, 3}
    assert {light.kind for scene in scenes for light in scene.lights} == {"point", "distant"}
    assert any(isinstance(each, Sphere) for scene in scenes for each in scene.objects)
    assert {mesh.normals is None for mesh in meshes} == {True, False}
    signs = {np.linalg.det(mesh.to_world[:3, :3]) < 0 for mesh in meshes}
    assert signs == {True, False}
    assert all(48 <= max(scene.width, scene.height) <= 96 for scene in scenes)


def test_points_are_float32_and_not_round(scenes: list[Scene]) -> None:
    baked = [mesh for scene in scenes for mesh in scene.meshes if np.array_equal(mesh.to_world, np.eye(4))]
    assert baked
    for mesh in baked:
        assert np.array_equal(mesh.points, mesh.points.astype(np.float32).astype(np.float64))


def test_smooth_normals_point_out_of_the_front(scenes: list[Scene]) -> None:
    """A mirror that was forgotten would turn them round."""
    for scene in scenes:
        for mesh in scene.meshes:
            if mesh.normals is None:
                continue
            first = np.cumsum(mesh.counts) - mesh.counts
            after = np.arange(len(mesh.corners)) + 1
            after[first + mesh.counts - 1] = first
            middle = np.repeat(np.add.reduceat(mesh.points[mesh.corners], first) / mesh.counts[:, None], mesh.counts, 0)
            spokes = mesh.points[mesh.corners] - middle
            area = np.add.reduceat(np.cross(spokes, spokes[after]), first)
            outward = np.einsum("ij,ij->i", area, np.add.reduceat(mesh.normals, first))
            assert (outward > 0).mean() > 0.9, (scene.id, mesh.path)


@pytest.mark.parametrize("cells", CELLS)
@pytest.mark.parametrize("name", SHAPES)
def test_faces_wind_outwards_and_closed_shapes_have_no_rim(name: str, cells: str) -> None:
    for seed in range(3):
        shape = SHAPES[name](np.random.default_rng(seed), cells)
        first = 0
        for face in shape.faces:
            points = shape.points[list(face)] - shape.points[list(face)].mean(axis=0)
            area = np.cross(points, np.roll(points, -1, axis=0)).sum(axis=0)
            assert area @ shape.normals[first : first + len(face)].sum(axis=0) > 0
            first += len(face)
        if shape.closed:
            assert rim(shape) == []


def rim(shape: Shape) -> list[tuple[int, int]]:
    """Edges without a face on the other side."""
    edges = {(a, b) for face in shape.faces for a, b in zip(face, face[1:] + face[:1], strict=True)}
    return [(a, b) for a, b in edges if (b, a) not in edges]


def test_defects_leave_what_is_there() -> None:
    whole = SHAPES["torus"](np.random.default_rng(0), "quads")
    for seed in range(8):
        spoilt = with_defects(np.random.default_rng(seed), whole)
        assert spoilt.faces[: len(whole.faces)] == whole.faces
        added = spoilt.faces[len(whole.faces) :]
        assert added
        for face in added:
            a, b, c = spoilt.points[list(face)]
            assert np.linalg.norm(np.cross(b - a, c - a)) < 1e-12
        assert len(spoilt.normals) == len(spoilt.uv) == sum(map(len, spoilt.faces))


@pytest.mark.parametrize("kind", ["rigid", "uneven", "shear", "mirror"])
def test_a_place_is_the_matrix_that_usd_makes_of_its_ops(kind: str) -> None:
    from pxr import Gf, Usd, UsdGeom

    place = placed(np.random.default_rng(4), kind, np.array([1.0, 2.0, 3.0]), 0.8)
    for text in (
        f'#usda 1.0\ndef Xform "A"\n{{\n{place.parent()}\ndef Mesh "B"\n{{\n{place.own()}\n}}\n}}\n',
        f'#usda 1.0\ndef Xform "A"\n{{\ndef Mesh "B"\n{{\n{place.whole()}\n}}\n}}\n',
    ):
        stage = Usd.Stage.CreateInMemory()
        assert stage.GetRootLayer().ImportFromString(text)
        found = UsdGeom.XformCache().GetLocalToWorldTransform(stage.GetPrimAtPath("/A/B"))
        assert np.allclose(np.array(found), place.matrix, rtol=0, atol=1e-6)
        assert isinstance(found, Gf.Matrix4d)
    assert (np.linalg.det(place.matrix[:3, :3]) < 0) == (kind == "mirror")


@pytest.mark.parametrize("up", ["Y", "Z"])
@pytest.mark.parametrize("size", [(64, 64), (96, 48), (30, 90)])
def test_what_is_framed_is_seen_whole(up: str, size: tuple[int, int]) -> None:
    rng = np.random.default_rng(1)
    points = rng.uniform(-3.0, 5.0, (50, 3)) * [1.0, 0.2, 3.0]
    mesh = Mesh("/M", points, np.array([3], np.int32), np.arange(3, dtype=np.int32), 0)
    for azimuth, elevation in ((0.0, 0.0), (123.0, 40.0), (-70.0, -35.0), (10.0, 90.0)):
        scene = framed([mesh], [Material("/L", (0.5,) * 3)], size=size, azimuth=azimuth, elevation=elevation, up=up)
        to_camera = np.linalg.inv(scene.camera.to_world)
        x, y, z, _ = (np.column_stack([points, np.ones(len(points))]) @ to_camera).T
        assert (z < 0).all()
        reach = max(np.abs(x / z / scene.camera.tan_x).max(), np.abs(y / z / scene.camera.tan_y).max())
        assert 0.4 * FILL < reach <= FILL + 1e-9
        assert (-z > scene.camera.near).all()
        assert (-z < scene.camera.far).all()
        assert scene.camera.tan_x / scene.camera.tan_y == pytest.approx(size[0] / size[1])


def test_bounds_of_a_stretched_sphere() -> None:
    matrix = np.diag([2.0, 1.0, 1.0, 1.0])
    matrix[3, :3] = 1.0, 0.0, 0.0
    low, high = bounds_of([Sphere("/S", 0.5, 0, matrix)])
    assert low.tolist() == [0.0, -0.5, -0.5]
    assert high.tolist() == [2.0, 0.5, 0.5]


def test_a_smaller_picture_keeps_its_square_pixels(scenes: list[Scene]) -> None:
    for scene in scenes[:8]:
        small = sized(scene, 32)
        assert max(small.width, small.height) == 32
        assert small.camera.tan_x / small.camera.tan_y == pytest.approx(small.width / small.height)
        assert sized(scene, 0) is scene


def test_the_ground_is_level() -> None:
    made = floor(3, 2.0, 4.0, "quads")
    assert not made.points[:, 1].any()
    assert len(made.faces) == 9
