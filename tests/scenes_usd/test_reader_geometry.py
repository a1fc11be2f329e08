"""Meshes: transforms against a numpy oracle, interpolations, indices, winding."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from notabug.scenes_usd.catalogue import entry
from notabug.scenes_usd.reader import read_scene
from notabug.scenes_usd.scene import Mesh, Sphere

Write = Callable[..., Path]
UV_VERTEX = '[(0, 0), (1, 0), (1, 1), (0, 1)] (\n                interpolation = "vertex"'
NORMALS = "[(0, 0, 1), (0, 0, 1), (0, 0, 2), (0, 1, 1)]"
NORMALS_VERTEX = f'normal3f[] normals = {NORMALS} (\n                interpolation = "vertex"\n            )'
POINTS = np.array([(0, 0, 0), (2, 0, 0), (2, 1, 0), (0, 1, 0)], np.float64)
LOCAL_NORMALS = np.array([(0, 0, 1), (0, 0, 1), (0, 0, 2), (0, 1, 1)], np.float64)
IDENTITY = np.eye(4)


def mesh_of(path: Path, variants: dict[str, str] | None = None) -> Mesh:
    (mesh,) = read_scene(path, variants).meshes
    return mesh


def transform(matrix: np.ndarray[Any, Any]) -> str:
    rows = ", ".join(f"({', '.join(repr(float(x)) for x in row)})" for row in matrix)
    return f'matrix4d xformOp:transform = ( {rows} )\nuniform token[] xformOpOrder = ["xformOp:transform"]'


def affine(linear: Any, move: Any = (0, 0, 0)) -> np.ndarray[Any, Any]:
    matrix = np.eye(4)
    matrix[:3, :3], matrix[3, :3] = linear, move
    return matrix


def oracle_normals(matrix: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    """A normal stays perpendicular to the tangents: transformed as the cross product of two transformed tangents."""
    found = []
    for normal in LOCAL_NORMALS:
        seed = np.eye(3)[int(np.argmin(np.abs(normal)))]
        first = np.cross(normal, seed)
        second = np.cross(normal, first)
        turned = np.cross(first @ matrix[:3, :3], second @ matrix[:3, :3]) * np.sign(np.linalg.det(matrix[:3, :3]))
        found.append(turned / np.linalg.norm(turned))
    return np.array(found)


MATRICES = {
    "identity": IDENTITY,
    "uneven scale": affine(np.diag([1, 2, 5]), (3, -4, 7)),
    "mirrored": affine(np.diag([-1, 1, 1])),
    "mirrored and sheared": affine([[1, 0.5, 0], [0, -2, 0.25], [0.3, 0, 1]], (1, 2, 3)),
    "all axes mirrored": affine(-np.eye(3) * 0.1),
    "large": affine(np.diag([1e6, 1e6, 1e6]), (1e6, 0, 0)),
}


@pytest.mark.parametrize("name", MATRICES)
def test_points_and_normals(name: str, write: Write) -> None:
    matrix = MATRICES[name]
    mesh = mesh_of(write(("# group", transform(matrix))))
    np.testing.assert_allclose(mesh.points, POINTS @ matrix[:3, :3] + matrix[3, :3], rtol=1e-14, atol=1e-12)
    order = [0, 3, 2, 1] if np.linalg.det(matrix[:3, :3]) < 0 else [0, 1, 2, 3]
    assert mesh.corners.tolist() == order
    assert mesh.normals is not None
    assert mesh.uv is not None
    np.testing.assert_allclose(mesh.normals, oracle_normals(matrix)[order], rtol=1e-12, atol=1e-12)
    np.testing.assert_array_equal(mesh.uv, np.array([(0, 0), (1, 0), (1, 1), (0, 1)], np.float64)[order])
    np.testing.assert_array_equal(mesh.to_world, matrix)
    for array in (mesh.points, mesh.counts, mesh.corners, mesh.normals, mesh.uv):
        assert array.flags.c_contiguous
    face = mesh.points[mesh.corners]
    geometric = np.cross(face[1] - face[0], face[2] - face[0])
    assert geometric @ mesh.normals[0] > 0, "the winding agrees with the authored normals"


def test_left_handed(write: Write) -> None:
    left = ("# square", 'uniform token orientation = "leftHanded"')
    assert mesh_of(write(left)).corners.tolist() == [0, 3, 2, 1]
    mirrored = mesh_of(write(left, ("# group", transform(affine(np.diag([1, 1, -1]))))))
    assert mirrored.corners.tolist() == [0, 1, 2, 3], "turned twice"


finite = st.floats(-3, 3, allow_nan=False).map(lambda x: round(x, 3))


@st.composite
def affines(draw: st.DrawFn) -> np.ndarray[Any, Any]:
    linear = np.array(draw(st.lists(finite, min_size=9, max_size=9))).reshape(3, 3)
    linear += np.diag(draw(st.sampled_from([(6, 6, 6), (-6, 6, 6), (6, -9, 5), (-8, -8, -8)])))
    return affine(linear, draw(st.lists(finite, min_size=3, max_size=3)))


@settings(max_examples=25, deadline=None)
@given(outer=affines(), inner=affines())
def test_nested_transforms_compose(tmp_path_factory: pytest.TempPathFactory, outer: Any, inner: Any) -> None:
    """Local points through the inner matrix, then the outer one (row vectors), however each is built."""
    folder = tmp_path_factory.mktemp("nested")
    path = folder / "nested.usda"
    path.write_text(TRIANGLE.replace("# outer", transform(outer)).replace("# inner", transform(inner)))
    mesh = mesh_of(path)
    product = inner @ outer
    np.testing.assert_allclose(mesh.to_world, product, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(mesh.points, np.eye(3) @ product[:3, :3] + product[3, :3], rtol=1e-12, atol=1e-11)
    assert mesh.normals is not None
    assert mesh.normals == pytest.approx(np.tile(oracle_normals(product)[0], (3, 1)), abs=1e-11)
    a, b, c = mesh.points[mesh.corners]
    local = -np.array([1.0, 1.0, 1.0])  # the triangle is authored clockwise about (1, 1, 1)
    world = local @ np.linalg.inv(product[:3, :3]).T
    assert np.cross(b - a, c - a) @ world > 0


TRIANGLE = """#usda 1.0
(
    defaultPrim = "S"
)
def Xform "S" (
    customData = {
        dictionary notabug = {
            string class = "acne"
            string claim = "x"
        }
    }
)
{
    def Camera "C"
    {
    }
    def DistantLight "L"
    {
        float inputs:angle = 0
    }
    def RenderSettings "R"
    {
        rel camera = </S/C>
    }
    def Material "M"
    {
        token outputs:surface.connect = </S/M/P.outputs:surface>
        def Shader "P"
        {
            uniform token info:id = "UsdPreviewSurface"
            int inputs:useSpecularWorkflow = 1
            token outputs:surface
        }
    }
    def Xform "A"
    {
        # outer
        def Mesh "T" ( prepend apiSchemas = ["MaterialBindingAPI"] )
        {
            # inner
            rel material:binding = </S/M>
            int[] faceVertexCounts = [3]
            int[] faceVertexIndices = [0, 2, 1]
            point3f[] points = [(1, 0, 0), (0, 1, 0), (0, 0, 1)]
            normal3f[] normals = [(0, 0, 1)] ( interpolation = "constant" )
            uniform token subdivisionScheme = "none"
        }
    }
}
"""


def test_face_varying_normals_and_indexed_uv(write: Write) -> None:
    two = (("[4]", "[3, 3]"), ("[0, 1, 2, 3]", "[0, 1, 2, 0, 2, 3]"))
    own = "[(0, 0, 1), (0, 1, 0), (1, 0, 0), (0, 0, 2), (0, 2, 0), (2, 0, 0)]"
    normals = (NORMALS_VERTEX, f'normal3f[] normals = {own} (\ninterpolation = "faceVarying"\n)')
    uv = (
        UV_VERTEX + "\n            )",
        '[(0, 0), (1, 1)] (\ninterpolation = "faceVarying"\n)\nint[] primvars:st:indices = [0, 1, 0, 1, 1, 0]',
    )
    mesh = mesh_of(write(*two, normals, uv, ("# group", transform(affine(np.diag([-1, 1, 1]))))))
    assert mesh.corners.tolist() == [0, 2, 1, 0, 3, 2]
    assert mesh.normals is not None
    assert mesh.uv is not None
    order = [0, 2, 1, 3, 5, 4]
    expected = np.array([(0, 0, 1), (0, 1, 0), (-1, 0, 0)] * 2, np.float64)[order]
    np.testing.assert_array_equal(mesh.normals, expected)
    np.testing.assert_array_equal(mesh.uv[:, 0], np.array([0, 1, 0, 1, 1, 0])[order])


def test_primvar_normals_win(write: Write) -> None:
    text = 'normal3f[] primvars:normals = [(0, 3, 4)] (interpolation = "constant")'
    mesh = mesh_of(write(("# square", text)))
    assert mesh.normals is not None
    np.testing.assert_allclose(mesh.normals, np.tile((0, 0.6, 0.8), (4, 1)), atol=1e-15)


def test_uniform_normals(write: Write) -> None:
    two = (("[4]", "[3, 3]"), ("[0, 1, 2, 3]", "[0, 1, 2, 0, 2, 3]"))
    normals = (NORMALS_VERTEX, 'normal3f[] normals = [(0, 0, 1), (0, 1, 0)] (interpolation = "uniform")')
    mesh = mesh_of(write(*two, normals))
    assert mesh.normals is not None
    assert mesh.normals.tolist() == [[0, 0, 1]] * 3 + [[0, 1, 0]] * 3


def test_no_normals_means_facets(write: Write) -> None:
    assert mesh_of(write((NORMALS_VERTEX, ""))).normals is None


@pytest.mark.parametrize("offset", [0.0, 100.0, 1e4])
def test_planar_quads_far_from_the_origin(offset: float, write: Write) -> None:
    """Points are float32, so a tilted planar quad far away is as planar as its coordinates allow."""
    corners = np.array([(0, 0, 0), (2, 0, 0.1), (2, 1, 0.4), (0, 1, 0.3)]) + offset
    text = ", ".join(str(tuple(float(np.float32(x)) for x in row)) for row in corners)
    assert mesh_of(write((str_points(), f"point3f[] points = [{text}]"))).has_ngons


def str_points() -> str:
    return "point3f[] points = [(0, 0, 0), (2, 0, 0), (2, 1, 0), (0, 1, 0)]"


def test_pentagon_with_affine_uv(write: Write) -> None:
    changes = (
        ("[4]", "[5]"),
        ("[0, 1, 2, 3]", "[0, 1, 2, 3, 4]"),
        (str_points(), "point3f[] points = [(0, 0, 0), (2, 0, 0), (2, 1, 0), (1, 2, 0), (0, 1, 0)]"),
        (NORMALS_VERTEX, ""),
        ("[(0, 0), (1, 0), (1, 1), (0, 1)]", "[(0, 0), (1, 0), (1, 0.5), (0.5, 1), (0, 0.5)]"),
    )
    assert mesh_of(write(*changes)).counts.tolist() == [5]


def test_sphere(write: Write) -> None:
    matrix = affine(np.diag([1, 2, 3]), (1, 1, 1))
    ball = f'def Sphere "Ball"\n{{\nrel material:binding = </Scene/Grey>\ndouble radius = 0.5\n{transform(matrix)}\n}}'
    (sphere,) = read_scene(write(("# scene", ball))).spheres
    assert (sphere.path, sphere.radius) == ("/Scene/Ball", 0.5)
    np.testing.assert_array_equal(sphere.to_world, matrix)


def test_purpose_visibility_and_order(write: Write) -> None:
    def ball(name: str, text: str = "") -> str:
        return f'def Sphere "{name}"\n{{\nrel material:binding = </Scene/Grey>\n{text}\n}}\n'

    more = (
        ball("B")
        + ball("A")
        + ball("G", 'uniform token purpose = "guide"')
        + ball("P", 'uniform token purpose = "proxy"')
        + ball("R", 'uniform token purpose = "render"')
        + 'def Xform "Hidden"\n{\ntoken visibility = "invisible"\n'
        + ball("H")
        + 'def Cube "Unsupported"\n{\n}\n}\n'
    )
    scene = read_scene(write(("# scene", more)))
    assert [each.path for each in scene.objects] == ["/Scene/Group/Square", "/Scene/B", "/Scene/A", "/Scene/R"]
    assert [each.path for each in scene.materials] == ["/Scene/Picture", "/Scene/Grey"]


def test_instances_and_references(write: Write, tmp_path: Path) -> None:
    part = tmp_path / "part.usda"
    part.write_text('#usda 1.0\n(defaultPrim = "Part")\ndef Xform "Part"\n{\ndef Sphere "Ball"\n{\n}\n}\n')
    instance = (
        'def "{0}" (\ninstanceable = true\nreferences = @./part.usda@\n'
        'prepend apiSchemas = ["MaterialBindingAPI"]\n)\n{{\n'
        "rel material:binding = </Scene/Grey>\ndouble3 xformOp:translate = ({1}, 0, 0)\n"
        'uniform token[] xformOpOrder = ["xformOp:translate"]\n}}\n'
    )
    scene = read_scene(write(("# scene", instance.format("One", 1) + instance.format("Two", 2))))
    spheres = [each for each in scene.objects if isinstance(each, Sphere)]
    assert [each.path for each in spheres] == ["/Scene/One/Ball", "/Scene/Two/Ball"]
    assert [each.to_world[3, 0] for each in spheres] == [1, 2]
    assert {each.material for each in spheres} == {1}


@pytest.mark.parametrize("mirrored", [False, True])
@pytest.mark.parametrize("tessellation", entry("terminator/sphere").variants["tessellation"])
def test_sphere_is_inside_in(tessellation: str, mirrored: bool, tmp_path: Path) -> None:
    """The signed volume of n x m facets is positive and near 4/3 pi; corners point outwards like their normals."""
    source = entry("terminator/sphere").path
    if mirrored:
        path = tmp_path / "mirrored.usda"
        flip = 'double3 xformOp:scale = (-1, 1, 1)\nuniform token[] xformOpOrder = ["xformOp:scale"]\n'
        path.write_text(source.read_text().replace('    def Camera "Camera"', f'{flip}    def Camera "Camera"', 1))
        path.write_text(
            path.read_text().replace(
                "double3 xformOp:translate = (0, 4.2, 8.2)\n        float3 xformOp:rotateXYZ = (-23, 3.5, 0)\n"
                '        uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateXYZ"]',
                'uniform token[] xformOpOrder = ["!resetXformStack!"]',
            )
        )
    else:
        path = source
    mesh = next(iter(read_scene(path, {"tessellation": tessellation}).meshes))
    n, m = (int(each) for each in tessellation.split("x"))
    assert len(mesh.counts) == 2 * n * (m - 1)
    a, b, c = (mesh.points[mesh.corners[k::3]] - mesh.to_world[3, :3] for k in range(3))
    volume = float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6)
    # Stack of frusta: regular n-gons of area (n/2) sin(2 pi / n) r^2 at the latitudes.
    theta = np.pi * np.arange(m + 1) / m
    r, y = np.sin(theta), np.cos(theta)
    slabs = (y[:-1] - y[1:]) * (r[:-1] ** 2 + r[:-1] * r[1:] + r[1:] ** 2) / 3
    assert volume == pytest.approx(n / 2 * np.sin(2 * np.pi / n) * slabs.sum(), rel=1e-6)
    assert mesh.normals is not None
    np.testing.assert_allclose(mesh.normals[0::3], a, atol=2e-7)
    assert (np.einsum("ij,ij->i", np.cross(b - a, c - a), mesh.normals[0::3]) > 0).all()
