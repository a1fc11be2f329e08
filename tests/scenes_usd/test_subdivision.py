"""Subdivision surfaces against closed forms of their limit, and against their own refinement far down."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from notabug.scenes_usd.reader import read_scene
from notabug.scenes_usd.scene import Mesh
from notabug.scenes_usd.schemes import Scheme
from notabug.scenes_usd.subdivision import Net, refine, with_boundary
from notabug.scenes_usd.subdivision_limit import limit_normals, limit_weights

CUBE = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
CORNERS = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], np.float64)
RIM = [(0, 1), (1, 3), (3, 2), (2, 0)]
SIDE = 7


def net(faces: list[list[int]], vertices: int) -> Net:
    corners = np.array([corner for face in faces for corner in face], np.int64)
    counts = np.array([len(face) for face in faces], np.int64)
    return Net(counts, corners, vertices, np.zeros(len(corners)), np.zeros(vertices))


def creased(of: Net, edges: list[tuple[int, int]], sharpness: float) -> Net:
    sharp, after = of.sharp.copy(), of.corners[of.following]
    for a, b in edges:
        sharp[((of.corners == a) & (after == b)) | ((of.corners == b) & (after == a))] = sharpness
    return Net(of.counts, of.corners, of.vertices, sharp, of.pointed)


def triangles(faces: list[list[int]]) -> list[list[int]]:
    return [part for face in faces for part in (face[:3], [face[0], face[2], face[3]])]


def grid(side: int) -> tuple[list[list[int]], Any]:
    """The quads of a grid, and its vertices' whole coordinates (n, 2)."""
    faces = [
        [y * side + x, y * side + x + 1, (y + 1) * side + x + 1, (y + 1) * side + x]
        for y in range(side - 1)
        for x in range(side - 1)
    ]
    return faces, np.array([(x, y) for y in range(side) for x in range(side)], np.float64)


def refined(of: Net, points: Any, scheme: Scheme, steps: int) -> tuple[Net, Any]:
    for _ in range(steps):
        step = refine(of, scheme)
        of, points = step.net, step.weights @ points
    return of, points


def test_the_limit_of_a_cube_is_known() -> None:
    """Catmull and Clark's vertex rule and the limit mask by hand: the corners come to half their distance."""
    fine, points = refined(net(CUBE, 8), CORNERS, "catmullClark", 1)
    limit = limit_weights(fine) @ points
    assert limit[:8] == pytest.approx(0.5 * CORNERS, abs=1e-14)
    normals = limit_normals(fine, points)
    at_corner = fine.corners < 8
    expected = CORNERS[fine.corners[at_corner]] / np.sqrt(3.0)
    side = np.sign((normals[at_corner] * expected).sum(axis=1))[:, None]
    assert normals[at_corner] * side == pytest.approx(expected, abs=1e-12)


def test_a_regular_net_is_the_uniform_bicubic_spline() -> None:
    """The cubic spline of the control values x^2 at whole x is x^2 + 1/3, and of x y it is x y."""
    faces, at = grid(SIDE)
    x, y = at.T
    fine, values = refined(net(faces, SIDE**2), np.stack([x, y, x**2, x * y], axis=1), "catmullClark", 1)
    limit = limit_weights(fine) @ values
    inside = ((limit[:, :2] > 1.9) & (limit[:, :2] < SIDE - 2.9)).all(axis=1)
    assert inside.sum() > 8
    assert limit[inside, 2] == pytest.approx(limit[inside, 0] ** 2 + 1 / 3, abs=1e-12)
    assert limit[inside, 3] == pytest.approx(limit[inside, 0] * limit[inside, 1], abs=1e-12)


def test_a_regular_net_of_triangles_is_the_box_spline() -> None:
    """Loop's limit of x^2 on a regular lattice is x^2 + 1/3, and of x it is x."""
    faces, at = grid(SIDE)
    fine, values = refined(net(triangles(faces), SIDE**2), np.stack([at[:, 0], at[:, 0] ** 2], axis=1), "loop", 1)
    limit = limit_weights(fine) @ values
    row = np.arange(SIDE**2)[((at > 2) & (at < SIDE - 3)).all(axis=1)]
    assert limit[row, 0] == pytest.approx(at[row, 0], abs=1e-12)
    assert limit[row, 1] == pytest.approx(at[row, 0] ** 2 + 1 / 3, abs=1e-12)


def test_a_boundary_is_the_cubic_spline_of_its_own_vertices() -> None:
    faces, at = grid(SIDE)
    points = np.column_stack([at, np.zeros(SIDE**2)])
    points[SIDE // 2] += (0.0, 0.0, 6.0)  # in the middle of the row y = 0
    points[SIDE + SIDE // 2] += (0.0, 0.0, 9.0)  # off the boundary: must not matter
    fine, values = refined(with_boundary(net(faces, SIDE**2), corners=True), points, "catmullClark", 1)
    limit = limit_weights(fine) @ values
    assert limit[SIDE // 2, 2] == pytest.approx(4.0, abs=1e-12), "4 / 6 of the vertex"
    assert limit[SIDE // 2 - 1, 2] == pytest.approx(1.0, abs=1e-12), "1 / 6 of its neighbour"
    assert limit[0] == pytest.approx(points[0], abs=1e-14), "a corner stays"
    smooth = with_boundary(net(faces, SIDE**2), corners=False)
    fine, values = refined(smooth, points, "catmullClark", 1)
    assert np.abs((limit_weights(fine) @ values)[0] - points[0]).max() > 0.1, "edgeOnly rounds it"


def _star(rng: Any) -> tuple[list[list[int]], Any]:
    """Seven quads round a vertex."""
    turn = 2.0 * np.pi * np.arange(7) / 7
    inner = np.stack([np.cos(turn), np.sin(turn), rng.normal(0.0, 0.2, 7)], axis=1)
    outer = 1.6 * np.stack([np.cos(turn + np.pi / 7), np.sin(turn + np.pi / 7), rng.normal(0.0, 0.1, 7)], axis=1)
    faces = [[0, 1 + i, 8 + i, 1 + (i + 1) % 7] for i in range(7)]
    return faces, np.concatenate([[[0.0, 0.0, 0.5]], inner, outer])


CASES: dict[str, tuple[Net, Any, Scheme]] = {}


def _cases() -> None:
    rng = np.random.default_rng(28)
    faces, at = grid(4)
    bent = np.column_stack([at, np.zeros(16)]) + rng.normal(0.0, 0.15, (16, 3))
    cube = CORNERS + rng.normal(0.0, 0.1, CORNERS.shape)
    for scheme, shape in (("catmullClark", CUBE), ("loop", triangles(CUBE))):
        CASES[f"{scheme} closed"] = net(shape, 8), cube, scheme  # type: ignore[assignment]
        CASES[f"{scheme} semi-sharp"] = creased(net(shape, 8), RIM, 1.3), cube, scheme  # type: ignore[assignment]
    CASES["crease"] = creased(net(CUBE, 8), RIM, np.inf), cube, "catmullClark"
    star, around = _star(rng)
    rim = with_boundary(net(star, len(around)), corners=True)
    CASES["crease with three and four faces beside it"] = creased(rim, [(0, 1), (0, 4)], np.inf), around, "catmullClark"
    CASES["boundary"] = with_boundary(net(faces, 16), corners=True), bent, "catmullClark"
    CASES["smooth corners"] = with_boundary(net(faces, 16), corners=False), bent, "catmullClark"
    CASES["triangles with a boundary"] = with_boundary(net(triangles(faces), 16), corners=True), bent, "loop"


_cases()


@pytest.mark.parametrize("case", CASES)
def test_masks_are_where_refinement_leads(case: str) -> None:
    """Places and normals by their masks, against the same vertices and their faces five steps on."""
    start, points, scheme = CASES[case]
    coarse, points = refined(start, points, scheme, 2)
    limit, normals = limit_weights(coarse) @ points, limit_normals(coarse, points)
    fine, deep = refined(coarse, points, scheme, 4)
    assert deep[: coarse.vertices] == pytest.approx(limit, abs=2e-3 * np.ptp(points))
    end = limit_weights(fine) @ deep
    before = np.arange(len(fine.corners)) - 1
    before[fine.first] = fine.first + fine.counts - 1
    own = end[fine.corners]
    flat = np.cross(end[fine.corners[fine.following]] - own, end[fine.corners[before]] - own)
    flat /= np.linalg.norm(flat, axis=1, keepdims=True)
    worst = 0.0
    for corner, vertex in enumerate(coarse.corners):
        around = flat[fine.corners == vertex]
        worst = max(worst, 1.0 - float((around @ normals[corner]).max()))
    assert worst < 1e-3, "within 2.6 degrees, which the facets there still turn by"


def test_a_crease_that_never_blunts_is_one_side_s_boundary() -> None:
    """Either side of an infinite crease is what it is without the other."""
    faces, at = grid(5)
    bent = np.column_stack([at, np.sin(at[:, 0] * 1.3) + at[:, 1] ** 2 / 5.0])
    middle = [(y * 5 + 2, (y + 1) * 5 + 2) for y in range(4)]
    whole = creased(with_boundary(net(faces, 25), corners=True), middle, np.inf)
    left = [face for face in faces if at[face, 0].max() <= 2]
    half = with_boundary(net(left, 25), corners=True)
    one, points = refined(whole, bent, "catmullClark", 2)
    two, others = refined(half, bent, "catmullClark", 2)
    one_limit, two_limit = limit_weights(one) @ points, limit_weights(two) @ others
    inner = [y * 5 + x for y in range(1, 4) for x in range(3)]
    assert one_limit[inner] == pytest.approx(two_limit[inner], abs=1e-12)


# --- through the reader ------------------------------------------------------------------------------------------

Write = Callable[..., Path]
PLAIN = 'uniform token subdivisionScheme = "none"'
SPHERE_LIKE = (
    ("int[] faceVertexCounts = [4]", "int[] faceVertexCounts = [4, 4, 4, 4, 4, 4]"),
    (
        "int[] faceVertexIndices = [0, 1, 2, 3]",
        "int[] faceVertexIndices = [0,1,3,2, 4,6,7,5, 0,4,5,1, 2,3,7,6, 0,2,6,4, 1,5,7,3]",
    ),
    (
        "point3f[] points = [(0, 0, 0), (2, 0, 0), (2, 1, 0), (0, 1, 0)]",
        f"point3f[] points = {[tuple(row) for row in CORNERS.tolist()]}",
    ),
    ("normal3f[] normals = [(0, 0, 1), (0, 0, 1), (0, 0, 2), (0, 1, 1)]", "normal3f[] normals = None"),
    ("texCoord2f[] primvars:st = [(0, 0), (1, 0), (1, 1), (0, 1)]", "texCoord2f[] primvars:map1 = None"),
    ("rel material:binding = </Scene/Picture>", "rel material:binding = </Scene/Grey>"),
)


@pytest.mark.parametrize("size", [16, 128])
def test_it_is_refined_to_a_tenth_of_a_pixel(size: int, write: Write) -> None:
    """The middle of every facet, held against the limit surface itself three steps further down."""
    path = write(*SPHERE_LIKE, (PLAIN, ""), ("resolution = (32, 32)", f"resolution = ({size}, {size})"))
    scene = read_scene(path)
    (mesh,) = scene.objects
    assert isinstance(mesh, Mesh)
    fine, points = refined(net(CUBE, 8), CORNERS, "catmullClark", 1)
    steps = round(np.log(len(mesh.counts) / len(fine.counts)) / np.log(4))
    shown, points = refined(fine, points, "catmullClark", steps)
    assert mesh.points[np.lexsort(mesh.points.T)] == pytest.approx(
        (limit_weights(shown) @ points)[np.lexsort((limit_weights(shown) @ points).T)], abs=1e-6
    )
    finer = refine(shown, "catmullClark")
    limit = limit_weights(finer.net) @ (finer.weights @ points)
    middles = limit[
        shown.vertices
        + len(np.unique(np.sort(np.stack([shown.corners, shown.corners[shown.following]]), 0), axis=1).T) :
    ]
    facets = limit[shown.corners].reshape(-1, 4, 3)
    off = np.linalg.norm(middles - (facets[:, 0] + facets[:, 2]) / 2.0, axis=1)
    depth = 5.0 - middles[:, 2]
    pixel = 2.0 * scene.camera.tan_x * depth / size
    assert (off / pixel).max() < 0.1
    assert (off / pixel).max() > 0.001, "no finer than that by far"


def test_normals_are_the_surface_s_own_and_leave_it(write: Write) -> None:
    (mesh,) = read_scene(write(*SPHERE_LIKE, (PLAIN, ""))).objects
    assert isinstance(mesh, Mesh)
    assert mesh.normals is not None
    outward = (mesh.normals * mesh.points[mesh.corners]).sum(axis=1)
    assert np.linalg.norm(mesh.normals, axis=1) == pytest.approx(1.0, abs=1e-12)
    assert abs(outward).min() > 0.3
    assert np.sign(outward).min() == np.sign(outward).max(), "all of them to one side"


@pytest.mark.parametrize("mirrored", [False, True])
@pytest.mark.parametrize("orientation", ["rightHanded", "leftHanded"])
def test_normals_are_on_the_side_that_the_faces_turn_to(orientation: str, mirrored: bool, write: Write) -> None:
    """Whichever way the faces turn, and whatever mirrors them, facet and normal agree."""
    turned = ("# square", f'uniform token orientation = "{orientation}"')
    scale = 'float3 xformOp:scale = (-1, 1, 1)\nuniform token[] xformOpOrder = ["xformOp:scale"]'
    changes = (*SPHERE_LIKE, (PLAIN, ""), turned, *((("# group", scale),) if mirrored else ()))
    (mesh,) = read_scene(write(*changes)).objects
    assert isinstance(mesh, Mesh)
    assert mesh.normals is not None
    quads = mesh.points[mesh.corners].reshape(-1, 4, 3)
    flat = np.cross(quads[:, 2] - quads[:, 0], quads[:, 3] - quads[:, 1])
    assert (np.repeat(flat, 4, axis=0) * mesh.normals).sum(axis=1).min() > 0.0
    outward = (flat * quads.mean(axis=1)).sum(axis=1)
    assert (np.sign(outward) == np.sign(outward[0])).all()


def test_seams_keep_their_texture_coordinates(write: Write) -> None:
    """Coordinates that say where a point is are the surface's places, smooth or linear, up to the boundary's rule."""
    flat = (
        (PLAIN, "# smooth"),
        ("normal3f[] normals = [(0, 0, 1), (0, 0, 1), (0, 0, 2), (0, 1, 1)]", "normal3f[] normals = None"),
    )
    (mesh,) = read_scene(write(*flat)).objects
    assert isinstance(mesh, Mesh)
    assert mesh.uv is not None
    place = mesh.points[mesh.corners][:, :2] / (2.0, 1.0)
    assert mesh.uv == pytest.approx(place, abs=1e-6), "the four corners are sharp, edges straight"
