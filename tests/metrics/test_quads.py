"""Quads and other polygons as renderers cut them: named, never a bug, whatever transform they are under."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any, get_args

import numpy as np
import pytest

from notabug.adapters.base import Declaration, Quality
from notabug.adapters.povray import PovRay
from notabug.references.tracer.envelope import trace_picture
from notabug.scenes_usd.scene import Camera, Card, Floats, Light, Material, Mesh, Scene, Texture
from notabug.scenes_usd.transform import rotation
from notabug.scenes_usd.triangulate import Diagonal, split_ngons, triangulate

SIZE = 64
KITE = np.array([(-1.6, -1.05, 0), (1.65, -0.8, 0), (0.55, 0.95, 0), (-0.1, 1.15, 0)])
UV = np.array([(0.0, 0), (1, 0), (1, 1), (0, 1)])
SHEAR = np.array([[1.0, 0.4, 0, 0], [0, 0.8, 0.25, 0], [0.3, 0, 1, 0], [0, 0, 0, 1]])
MATRICES = {
    "plain": np.eye(4),
    "turned": rotation((1, 0.4, 0.2), 33.0),
    "sheared": SHEAR,
    "mirrored": rotation((0, 1, 0), 25.0) @ np.diag([-1.0, 1, 1, 1]),
    "uneven": rotation((0, 0, 1), 40.0) @ np.diag([1.0, 0.6, 2.0, 1.0]),
}


def square(seed: int = 1, side: int = 4) -> Texture:
    return Texture(Path("four.png"), np.random.default_rng(seed).random((side, side, 3)), "clamp", "clamp")


def scene_of(points: Floats, *, textured: bool, normals: Floats | None = None, matrix: Floats | None = None) -> Scene:
    """One face in front of the camera, with the uv of a square or with normals."""
    count = len(points)
    camera, light = np.eye(4), Light("/L", "point", (40.0,) * 3, (0.5, 0.8, 4.0))
    camera[3, 2] = 4.0
    mesh = Mesh(
        "/Face",
        np.ascontiguousarray(points, np.float64),
        np.array([count], np.int32),
        np.arange(count, dtype=np.int32),
        0,
        normals,
        np.ascontiguousarray(UV if count == 4 else points[:, :2] ** 2) if textured else None,
        np.eye(4) if matrix is None else matrix,
    )
    material = Material("/M", (0.7, 0.6, 0.5), 0 if textured else -1)
    return Scene(
        "quads", Path("quads.usda"), {}, Card("texture", "A face."), Camera("/C", camera, 0.45, 0.45, 0.1, 100.0), SIZE,
        SIZE, (mesh,), (light,), (material,), (square(),) if textured else (),
    )  # fmt: skip


def under(matrix: Floats, *, baked: bool, textured: bool, bend: float = 0.0) -> Scene:
    """The kite under ``matrix``, facing the camera: its points are float32, with the transform or without."""
    local = KITE + np.array([(0, 0, 0), (0, 0, 0), (0, 0, bend), (0, 0, 0)])
    if np.linalg.det(matrix[:3, :3]) < 0:  # as the reader does
        local = local[[0, 3, 2, 1]]
    normals = None
    if not textured:
        normals = np.array([(-0.4, 0, 1.0), (0.5, -0.2, 1), (0.1, 0.6, 1), (0.3, -0.5, 1)])
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    if baked:
        return scene_of((local @ matrix[:3, :3]).astype(np.float32), textured=textured, normals=normals)
    world = local.astype(np.float32).astype(np.float64) @ matrix[:3, :3]
    return scene_of(world, textured=textured, normals=normals, matrix=matrix)


def cut(scene: Scene, diagonal: Diagonal) -> Floats:
    """The picture of a renderer that cuts the faces along ``diagonal``."""
    return trace_picture(replace(scene, objects=tuple(split_ngons(each, diagonal) for each in scene.meshes)))


def judged(studio: Any, picture: Floats, scene: Scene, **declared: Any) -> tuple[str, list[str]]:
    declaration: Declaration = replace(studio.point, **declared)
    verdict = studio.verdict([picture.astype(np.float32)], scene, declaration, naming=False)
    return verdict.word, [each.name for each in verdict.findings]


@pytest.mark.parametrize("textured", [True, False])
@pytest.mark.parametrize("baked", [True, False])
@pytest.mark.parametrize("name", MATRICES)
@pytest.mark.sweep_except(
    "plain-False-False", "turned-True-False", "sheared-True-False", "mirrored-True-True", "uneven-False-False"
)
def test_a_flat_quads_cut_has_its_name_under_every_transform(
    name: str, baked: bool, textured: bool, studio: Any
) -> None:
    scene = under(MATRICES[name], baked=baked, textured=textured)
    for diagonal in ("02", "13"):
        picture = cut(scene, diagonal)
        for declared in (diagonal, "unknown"):
            assert judged(studio, picture, scene, ngon_split=declared) == ("limitation", [f"quad_split_{diagonal}"])
    assert judged(studio, trace_picture(scene), scene, ngon_split="unknown") == ("pass", [])
    assert judged(studio, cut(scene, "13"), scene, ngon_split="02")[0] == "bug", "that is not how it says it cuts"


@pytest.mark.parametrize("textured", [True, False])
def test_a_fan_from_the_first_corner_is_the_cut_along_02_of_a_convex_quad(textured: bool, studio: Any) -> None:
    flat = under(MATRICES["turned"], baked=True, textured=textured)
    assert judged(studio, cut(flat, "02"), flat, ngon_split="fan") == ("limitation", ["quad_split_02"])
    assert judged(studio, cut(flat, "13"), flat, ngon_split="fan")[0] == "bug"
    bent = under(MATRICES["turned"], baked=True, textured=textured, bend=0.4)
    assert judged(studio, cut(bent, "02"), bent, ngon_split="fan") == ("pass", [])


@pytest.mark.parametrize("textured", [True, False])
@pytest.mark.parametrize("name", ["plain", "turned", "sheared"])
@pytest.mark.parametrize("bend", [0.003, 0.4])
@pytest.mark.sweep_except("0.003-plain-True", "0.003-sheared-True", "0.4-turned-False")
def test_a_bent_quad_is_its_fan_or_the_other_two_triangles(bend: float, name: str, textured: bool, studio: Any) -> None:
    scene = under(MATRICES[name], baked=True, textured=textured, bend=bend)
    for declared in ("02", "unknown"):
        assert judged(studio, cut(scene, "02"), scene, ngon_split=declared) == ("pass", [])
    for declared in ("13", "unknown"):
        assert judged(studio, cut(scene, "13"), scene, ngon_split=declared) == ("limitation", ["quad_split_13"])


def test_the_shape_of_a_bent_quad_is_a_choice_without_uv_and_normals_too(studio: Any) -> None:
    """A kite that bends by a fifth of its size: either diagonal is a ridge or a valley."""
    scene = scene_of(KITE + np.array([(0, 0, 0), (0, 0, 0), (0, 0, 0.6), (0, 0, 0)]), textured=False)
    assert judged(studio, cut(scene, "13"), scene, ngon_split="unknown") == ("limitation", ["quad_split_13"])
    assert judged(studio, cut(scene, "13"), scene, ngon_split="02")[0] == "bug"
    other = scene_of(KITE + np.array([(0, 0, 0), (0, 0, 0), (0, 0, -0.3), (0, 0, 0)]), textured=False)
    assert judged(studio, cut(other, "02"), scene, ngon_split="unknown")[0] == "bug", "another shape is no other cut"


def test_the_shorter_diagonal_is_a_cut_of_its_own(studio: Any) -> None:
    """Of two quads one is cut along 02 and one along 13; that is neither of these."""
    left = KITE * 0.45 - (0.8, 0, 0)
    right = np.roll(KITE, 1, axis=0) * 0.45 + (0.7, 0, 0)
    base = scene_of(KITE, textured=True)
    (mesh,) = base.meshes
    both = replace(
        mesh,
        points=np.concatenate([left, right]),
        counts=np.array([4, 4], np.int32),
        corners=np.arange(8, dtype=np.int32),
        uv=np.concatenate([UV, UV]),
    )
    scene = replace(base, objects=(both,))
    faces = [triangulate(both, each).corner for each in ("02", "13", "shorter")]
    assert not any(np.array_equal(faces[2], each) for each in faces[:2])
    picture = cut(scene, "shorter")
    for declared in ("shorter", "unknown"):
        assert judged(studio, picture, scene, ngon_split=declared) == ("limitation", ["quad_split_shorter"])
    assert judged(studio, picture, scene, ngon_split="02")[0] == "bug"


PENTAGON = np.array([(-1.2, -1, 0), (1.3, -0.8, 0), (1.4, 0.6, 0), (0.1, 1.3, 0), (-1.4, 0.5, 0)])
ARROW = np.array([(1.2, 1.2, 0), (-1.2, 0.9, 0), (0.1, 0.4, 0), (0.4, -1.3, 0)])


@pytest.mark.parametrize("diagonal", ["02", "13", "shorter"])
@pytest.mark.parametrize("bend", [0.0, 0.4])
def test_larger_polygons(bend: float, diagonal: Diagonal, studio: Any) -> None:
    """Of uv that are not affine, or bent: a fan from the first corner; the others are choices."""
    scene = scene_of(PENTAGON + np.array([(0, 0, bend * (k == 2)) for k in range(5)]), textured=True)
    wanted = ("pass", []) if diagonal == "02" else ("limitation", [f"quad_split_{diagonal}"])
    assert judged(studio, cut(scene, diagonal), scene, ngon_split="unknown") == wanted


def test_a_concave_face_is_what_it_encloses(studio: Any) -> None:
    """Cut inside itself it passes; as a plain fan it covers more, which has a name."""
    scene = scene_of(ARROW, textured=False)
    assert judged(studio, cut(scene, "02"), scene, ngon_split="unknown") == ("pass", [])
    rolled = scene_of(np.roll(ARROW, 1, axis=0), textured=False)
    assert judged(studio, cut(rolled, "02"), rolled, ngon_split="unknown") == ("pass", [])
    fans = [judged(studio, cut(each, "fan"), each, ngon_split="unknown") for each in (scene, rolled)]
    assert sorted(fans) == [("limitation", ["quad_split_fan"]), ("pass", [])]


def test_faults_are_still_found_on_quads(studio: Any) -> None:
    for bend in (0.0, 0.4):
        scene = under(MATRICES["turned"], baked=True, textured=True, bend=bend)
        (mesh,) = scene.meshes
        assert mesh.uv is not None
        swapped = replace(scene, objects=(replace(mesh, uv=np.ascontiguousarray(mesh.uv[:, ::-1])),))
        assert judged(studio, cut(swapped, "02"), scene, ngon_split="unknown")[0] == "bug"
        for picture in (np.zeros((SIZE, SIZE, 3)), np.random.default_rng(2).random((SIZE, SIZE, 3))):
            assert judged(studio, picture, scene, ngon_split="unknown")[0] == "bug"


def test_every_cut_that_can_be_declared_has_a_model() -> None:
    from notabug.references.models.model import models

    scenes = [scene_of(each, textured=False) for each in (ARROW, np.roll(ARROW, 1, axis=0))]
    open_to = [each.when[1] for scene in scenes for each in models(scene) if each.when and each.when[0] == "ngon_split"]
    assert set(open_to) == {"fan"}, "a concave face in the plane is cut in one way"
    bent = scene_of(KITE + np.array([(0, 0, 0.5 * (k == 2)) for k in range(4)]), textured=False)
    found = {each.when[1] for each in models(bent) if each.when and each.when[0] == "ngon_split"}
    assert found | {"fan"} == set(get_args(Diagonal))


def ball(rows: int, columns: int, *, quads: bool) -> Mesh:
    """A ball whose pole rows are quads with two corners in one place, or the same ball with triangles there."""
    theta, phi = np.pi * np.arange(rows + 1) / rows, 2 * np.pi * np.arange(columns) / columns
    y, r = np.cos(theta), np.sin(theta)
    r[[0, -1]] = 0.0
    points = np.stack([np.outer(r, np.cos(phi)), np.repeat(y[:, None], columns, 1), np.outer(r, -np.sin(phi))], axis=2)
    faces = []
    for i in range(rows):
        for k in range(columns):
            n = (k + 1) % columns
            face = [i * columns + k, (i + 1) * columns + k, (i + 1) * columns + n, i * columns + n]
            if not quads and i == 0:
                face = face[:3]
            if not quads and i == rows - 1:
                face = [face[0], face[1], face[3]]
            faces.append(face)
    corners = np.array([each for face in faces for each in face], np.int32)
    at = np.ascontiguousarray(points.reshape(-1, 3).astype(np.float32).astype(np.float64))
    return Mesh("/Ball", at, np.array([len(face) for face in faces], np.int32), corners, 0, at[corners])


def test_povray_draws_a_ball_with_quads_at_its_poles_as_one_with_triangles(
    povray: PovRay, studio: Any, tmp_path: Path
) -> None:
    """Through the file: read, cleaned and written; to the last bit, with facet self-shadow named."""
    from notabug.scenes_usd.reader import read_scene
    from notabug.scenes_usd.writer import write_scene

    pictures = []
    for quads in (True, False):
        mesh = ball(8, 16, quads=quads)
        base = scene_of(KITE, textured=False)
        camera = replace(base.camera, path="/Scene/Camera")
        light = replace(base.lights[0], path="/Scene/Light", position=(4.0, 3.0, 0.5))
        material = replace(base.materials[0], path="/Scene/Looks/M")
        made = replace(
            base,
            objects=(replace(mesh, path="/Scene/Ball"),),
            camera=camera,
            lights=(light,),
            materials=(material,),
        )
        scene = read_scene(write_scene(made, tmp_path / f"ball{quads}.usda"))
        assert set(next(scene.meshes).counts.tolist()) == {3, 4}
        pictures += studio.draw(povray, scene)
        verdict = studio.verdict(pictures[-1:], scene, povray.declaration(Quality()), others=lambda: ())
        assert "facet_self_shadow" in [each.name for each in verdict.findings]
        assert verdict.word == "limitation"
    np.testing.assert_array_equal(*pictures)
