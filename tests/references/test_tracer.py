"""The ray tracer against closed forms, written again here in numpy, and against the properties it must have."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy import ndimage

from notabug.references import _native
from notabug.references.tracer import bvh
from notabug.references.tracer.envelope import trace_envelope, trace_picture
from notabug.references.tracer.flatten import flatten
from notabug.references.tracer.options import Options
from notabug.scenes_usd.scene import Material, Texture
from notabug.scenes_usd.triangulate import split_ngons

BLACK = (0.0, 0.0, 0.0)
RHO = 0.6
GREY = Material("/Grey", (RHO,) * 3)


def hit_plane(scene: Any, rays: Any, z: float) -> tuple[Any, Any]:
    """Where the pixel centres' rays meet the plane ``z``, and the unit directions."""
    origin, d = rays(scene)
    return origin + ((z - origin[2]) / d[:, :, 2])[..., None] * d, d


def lambert(p: Any, position: Any, intensity: float = 1.0, albedo: float = 1.0) -> Any:
    """Radiance of a floor z = const seen from above under a point light, without shadow."""
    to = np.asarray(position) - p
    r2 = (to * to).sum(-1)
    return intensity / r2 * albedo * np.maximum(to[..., 2], 0) / np.sqrt(r2) / math.pi


def close(got: Any, expected: Any, rel: float = 1e-12) -> bool:
    return bool(np.allclose(got, expected, rtol=rel, atol=rel * np.abs(expected).max()))


# --- the hierarchy ------------------------------------------------------------------------------------------------


def globe(n: int, m: int) -> tuple[Any, list[Any]]:
    """A closed sphere of triangles about the origin."""
    theta, phi = np.pi * np.arange(1, m) / m, 2 * np.pi * np.arange(n) / n
    ring = np.stack(
        [
            np.outer(np.sin(theta), np.cos(phi)),
            np.outer(np.sin(theta), np.sin(phi)),
            np.outer(np.cos(theta), 1 + 0 * phi),
        ],
        axis=2,
    )
    points = np.concatenate([ring.reshape(-1, 3), [(0, 0, 1.0), (0, 0, -1.0)]])
    top, bottom = len(points) - 2, len(points) - 1
    faces = [(top, i, (i + 1) % n) for i in range(n)]
    for j in range(m - 2):
        for i in range(n):
            a, b, c, d = j * n + i, (j + 1) * n + i, (j + 1) * n + (i + 1) % n, j * n + (i + 1) % n
            faces += [(a, b, c), (a, c, d)]
    return points, faces + [((m - 2) * n + i, bottom, (m - 2) * n + (i + 1) % n) for i in range(n)]


def box(n: int) -> tuple[Any, list[Any]]:
    """A closed cube of n x n squares a side, each cut in two; all edges are along the axes or diagonal."""
    points: dict[tuple[int, ...], int] = {}
    faces = []

    def at(*place: int) -> int:
        return points.setdefault(place, len(points))

    for axis in range(3):
        for end in (0, n):
            for i in range(n):
                for j in range(n):
                    square = [
                        at(*np.roll((end, a, b), axis)) for a, b in ((i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1))
                    ]
                    faces += [tuple(square[:3]), (square[0], square[2], square[3])]
    return np.array(list(points), float) * 2 / n - 1, faces


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
@pytest.mark.parametrize("shape", ["globe", "box"])
def test_no_ray_leaks_through_edges_or_vertices(make: Any, shape: str, dtype: Any) -> None:
    """From inside a closed mesh every ray must hit it: 100,000 aimed at points of edges, and all vertices, thrice."""
    points, faces = globe(24, 12) if shape == "globe" else box(8)
    scene = make.scene([make.mesh(points, faces)], [], make.camera((0, 0, 5), (0, 0, 0)))
    flat = flatten(scene, dtype)
    rng = np.random.default_rng(0)
    corners = np.array(faces)
    edges = np.concatenate([corners[:, :2], corners[:, 1:], corners[:, ::2]])
    leaks = count = 0
    for origin in ((0.0, 0.0, 0.0), (0.25, 0.125, -0.5), tuple(rng.uniform(-0.5, 0.5, 3))):
        edge = edges[rng.integers(0, len(edges), 33_334)]
        s = rng.uniform(0, 1, (len(edge), 1)).astype(dtype)
        vertices = points.astype(dtype)
        targets = np.concatenate([vertices[edge[:, 0]] * (1 - s) + vertices[edge[:, 1]] * s, vertices])
        directions = np.ascontiguousarray(targets - np.array(origin, dtype), dtype)
        n = len(directions)
        hits, t, b = _native.trace(flat, np.tile(np.array(origin, dtype), (n, 1)), directions)
        leaks += int((hits < 0).sum())
        count += n
        assert np.abs(t[hits >= 0] - 1).max() < 1e3 * np.finfo(dtype).eps
        assert np.abs(b[hits >= 0].sum(1) - 1).max() < 8 * np.finfo(dtype).eps
    print(f"\n{shape}, {np.dtype(dtype).name}: {leaks} of {count} rays leak")
    assert leaks == 0


def soup(kind: str, rng: np.random.Generator) -> Any:
    """Triangles (n, 3, 3) that are hard on a hierarchy."""
    p = rng.uniform(-1, 1, (300, 1, 3)) + rng.uniform(-0.3, 0.3, (300, 3, 3))
    if kind == "duplicates":
        return np.concatenate([p[:100], p[:100], np.repeat(p[:1], 60, axis=0)])
    if kind == "degenerate":  # points and needles among the others
        p[:60] = p[:60, :1]
        p[60:120, 2] = p[60:120, 1]
        return p
    if kind == "flat":
        p[:, :, 2] = np.round(p[:, :, 2])
        return p
    if kind == "clustered":  # sizes and distances over sixty powers of two
        return p * 2.0 ** -(np.arange(300)[:, None, None] ** 0.7)
    return p


@pytest.mark.parametrize("kind", ["random", "duplicates", "degenerate", "flat", "clustered"])
def test_the_hierarchy_finds_what_brute_force_finds(make: Any, kind: str) -> None:
    rng = np.random.default_rng(4)
    triangles = soup(kind, rng)
    n = len(triangles)
    mesh = make.mesh(triangles.reshape(-1, 3), np.arange(3 * n).reshape(n, 3))
    flat = flatten(make.scene([mesh], [], make.camera((0, 0, 5), (0, 0, 0))))
    origins = rng.uniform(-2, 2, (120, 3))
    directions = triangles[rng.integers(0, n, 120)].mean(1) - origins
    directions[:20] = np.eye(3)[rng.integers(0, 3, 20)] * rng.choice([-1, 1], (20, 1))
    hits, t, _ = _native.trace(flat, origins, directions)
    found = 0
    for k, (o, d) in enumerate(zip(origins, directions, strict=True)):
        best = (math.inf, n)
        for i in range(len(flat.points)):  # points and needles of no area are not among them
            each = _native.ray_triangle(o, d, flat.points[i])[0]
            if 0 < each < math.inf:
                best = min(best, (each, int(flat.face[i])))  # of two at the same place the first in the scene
        assert (t[k], flat.face[hits[k]] if hits[k] >= 0 else n) == best
        found += hits[k] >= 0
    assert found > 60


@pytest.mark.parametrize("kind", ["random", "duplicates", "degenerate", "flat", "clustered"])
def test_the_hierarchy_is_one(kind: str) -> None:
    """Every triangle in one leaf, inside the bounds of all nodes above it, and no deeper than the traversal's stack."""
    triangles = soup(kind, np.random.default_rng(5))
    bounds, child, count, order = bvh.build(triangles.reshape(-1, 9))
    assert sorted(order) == list(range(len(triangles)))
    stack = [(0, 1)]
    seen: list[int] = []
    while stack:
        node, depth = stack.pop()
        assert depth < bvh.STACK
        if count[node]:
            inside = triangles[order[child[node] : child[node] + count[node]]]
            seen += range(child[node], child[node] + count[node])
            assert (inside.reshape(-1, 3).min(0) == bounds[node, :3]).all()
            assert (inside.reshape(-1, 3).max(0) == bounds[node, 3:]).all()
        else:
            for each in (child[node], child[node] + 1):
                assert (bounds[each, :3] >= bounds[node, :3]).all()
                assert (bounds[each, 3:] <= bounds[node, 3:]).all()
                stack.append((each, depth + 1))
    assert sorted(seen) == list(range(len(triangles)))


def test_an_empty_scene_is_black(make: Any) -> None:
    scene = make.scene([], [make.point((0, 0, 1))], make.camera((0, 0, 5), (0, 0, 0)), size=4)
    assert not trace_picture(scene).any()


# --- light --------------------------------------------------------------------------------------------------------


def floor(make: Any, lights: Any, eye: Any = (1, -3, 4), **options: Any) -> Any:
    objects = [make.rectangle(), *options.pop("objects", ())]
    return make.scene(
        objects, lights, make.camera(eye, (0, 0, 0), 0.4), materials=(GREY, *options.pop("materials", ())), **options
    )


@pytest.mark.parametrize("full", [False, True])
def test_a_floor_under_a_point_light(make: Any, rays: Any, full: bool) -> None:
    """L = I cos / d^2 * albedo / pi; the same with every other feature compiled in."""
    scene = floor(make, [make.point((0.5, 0.2, 2), 7.0)], full=full)
    p, _ = hit_plane(scene, rays, 0)
    assert close(trace_picture(scene), lambert(p, (0.5, 0.2, 2), 7.0, RHO)[..., None])


def test_a_floor_under_a_distant_light(make: Any) -> None:
    scene = floor(make, [make.distant((1, 2, -2), 3.0)])
    assert close(trace_picture(scene), RHO * 3 * (2 / 3) / math.pi)


def test_lights_add_and_shine_on_the_side_that_is_seen(make: Any) -> None:
    lights = [make.distant((0, 0, -1), 1.0), make.distant((0, 1, -1), 2.0), make.distant((0, 0, 1), 50.0)]
    above = trace_picture(floor(make, lights))
    assert close(above, RHO * (1 + math.sqrt(2)) / math.pi)
    assert close(trace_picture(floor(make, lights, eye=(1, -3, -4))), RHO * 50 / math.pi)


def test_shadow_of_a_square_ends_where_it_must(make: Any, rays: Any) -> None:
    """A small square above the floor: the shadow is its central projection from the light."""
    light = np.array((0.3, 0.1, 3.0))
    scene = floor(make, [make.point(light)], objects=[make.rectangle(1.0, 0.2)], eye=(4, -4, 6))
    p, _ = hit_plane(scene, rays, 0)
    through = light + (p - light) * (2 / 3)  # where the shadow ray passes z = 1
    dark = (np.abs(through[..., :2]) < 0.2).all(-1)
    sheet, _ = hit_plane(scene, rays, 1)
    seen = ~(np.abs(sheet[..., :2]) < 0.2).all(-1)
    picture = trace_picture(scene)[..., 0]
    assert (dark & seen).sum() > 20
    assert (picture[dark & seen] == 0).all()
    assert close(picture[~dark & seen], lambert(p, light, 1.0, RHO)[~dark & seen])
    assert (trace_picture(scene, Options(shadows="none"))[..., 0][seen] > 0).all()


@pytest.mark.parametrize("angle", [0.0, 20.0])
def test_the_area_of_a_sphere_on_the_screen(make: Any, angle: float) -> None:
    """A cone of half angle a about an axis t off the camera's cuts the screen in an ellipse with the semi-axes
    sin a cos a / (cos^2 t - sin^2 a) and sin a / sqrt(cos^2 t - sin^2 a)."""
    t, distance, radius, tangent, size = math.radians(angle), 5.0, 1.2, 0.8, 384
    centre = distance * np.array([math.sin(t), 0.0, -math.cos(t)])
    camera = make.camera((0, 0, 0), (0, 0, -1), tangent)
    scene = make.scene([make.sphere(centre, radius)], [make.point((0, 0, 0))], camera, size=size, full=True)
    drawn = (trace_picture(scene) > 0)[..., 0].sum()
    sine2 = (radius / distance) ** 2
    rest = math.cos(t) ** 2 - sine2
    area = math.pi * math.sqrt(sine2 * (1 - sine2)) / rest * math.sqrt(sine2 / rest) * (size / (2 * tangent)) ** 2
    print(f"\nsphere {angle} degrees off axis: {drawn} px, closed form {area:.1f}")
    assert abs(drawn / area - 1) < 2e-3  # lattice points of a disc of 200 px across: about R^(2/3) off


def test_a_stretched_sphere_is_shaded_by_the_inverse_transpose(make: Any, rays: Any) -> None:
    place = np.array([[1.5, 0.2, 0, 0], [0, 0.7, 0.3, 0], [0.1, 0, 1, 0], [0.2, -0.1, 0.3, 1.0]])
    ball = make.sphere((0, 0, 0), 0.8)
    ball = type(ball)(ball.path, ball.radius, 0, place)
    L = np.array((1.0, 1, 2)) / math.sqrt(6)
    scene = make.scene([ball], [make.distant(-L)], make.camera((0, 0, 6), (0, 0, 0)), full=True)
    origin, d = rays(scene)
    inverse = np.linalg.inv(place)
    o, v = origin @ inverse[:3, :3] + inverse[3, :3], d @ inverse[:3, :3]
    a, b, c = (v * v).sum(-1), (v * o).sum(-1), o @ o - 0.64
    hit = b * b > a * c
    t = (-b - np.sqrt(np.maximum(b * b - a * c, 0))) / a
    normal = (o + t[..., None] * v) @ inverse[:3, :3].T
    cosine = (normal @ L) / np.linalg.norm(normal, axis=-1)
    assert hit.sum() > 200
    assert close(trace_picture(scene)[..., 0], np.where(hit, np.maximum(cosine, 0), 0) / math.pi, 1e-10)


@pytest.mark.parametrize("weighted", [False, True])
@pytest.mark.parametrize("lobe", ["phong", "blinn"])
def test_lobes(make: Any, rays: Any, lobe: Any, weighted: bool) -> None:
    """L = E (albedo N.L + specular lobe [N.L]) / pi; the highlight's peak is E specular / pi where R = V, N = H."""
    n, ks, light = 40.0, 0.3, np.array((0.0, 2.0, 4.0))
    shiny = Material("/Shiny", (0.2,) * 3, specular=(ks,) * 3, exponent=n, lobe=lobe, cosine_weighted=weighted)
    camera = make.camera((0, -2, 4), (0, 0, 0), 0.3)
    scene = make.scene([make.rectangle()], [make.point(light, 20.0)], camera, materials=(shiny,), size=65, full=True)
    p, d = hit_plane(scene, rays, 0)
    to = light - p
    r2 = (to * to).sum(-1)
    L, V = to / np.sqrt(r2)[..., None], -d
    H = L + V
    nl = L[..., 2]
    cosine = H[..., 2] / np.linalg.norm(H, axis=-1) if lobe == "blinn" else 2 * nl * V[..., 2] - (L * V).sum(-1)
    value = 20 / r2 * (0.2 * nl + ks * np.maximum(cosine, 0) ** n * (nl if weighted else 1)) / math.pi
    picture = trace_picture(scene)[..., 0]
    assert close(picture, value, 1e-11)
    peak = 20 / 20 * (0.2 * math.sqrt(0.8) + ks * (math.sqrt(0.8) if weighted else 1)) / math.pi
    assert picture[32, 32] == pytest.approx(peak, rel=1e-11)  # the centre sees the origin, where R = V


def test_a_mirror_shows_the_mirrored_scene(make: Any) -> None:
    """What a perfect mirror z = 0 shows is the scene mirrored in it, seen without the mirror."""
    points, faces = globe(12, 6)
    points = points * [0.5, 0.6, 0.4] + [0.1, 0.2, 1.0]
    flip = np.array([1, 1, -1.0])
    mirror = Material("/Mirror", BLACK, mirror=(0.8,) * 3)
    camera = make.camera((0, -6, 2), (0, 0.2, -1), 0.15)
    light = (1.0, -2.0, 3.0)
    real = make.mesh(points, faces, 0)
    image = make.mesh(points * flip, [each[::-1] for each in faces], 0)
    shown = trace_picture(
        make.scene([real, make.rectangle(material=1)], [make.point(light)], camera, materials=(GREY, mirror), full=True)
    )
    expected = trace_picture(make.scene([image], [make.point(flip * light)], camera, materials=(GREY,), full=True))
    assert (expected > 0).sum() > 300
    assert close(shown, 0.8 * expected, 1e-10)


def glass(ior: float) -> Material:
    return Material("/Glass", BLACK, transmission=(1.0,) * 3, ior=ior)


def test_a_glass_slab_displaces_as_snell_says(make: Any, rays: Any) -> None:
    """Between z = 1 and 2 the ray runs at the refracted angle; the light is below the slab, whose shadow is opaque."""
    top, bottom = make.rectangle(2.0, material=1), make.rectangle(1.0, material=1)
    bottom = type(bottom)(bottom.path, bottom.points, bottom.counts, bottom.corners[::-1].copy(), 1)
    light = (0.4, 0.3, 0.7)
    scene = floor(make, [make.point(light)], (1, -3, 4), objects=[top, bottom], materials=(glass(1.5),), full=True)
    origin, d = rays(scene)
    lateral = d[..., :2]
    sine = np.linalg.norm(lateral, axis=-1, keepdims=True)
    inside = sine / 1.5
    length = 3 * sine / -d[..., 2:] + inside / np.sqrt(1 - inside**2)  # three units of air, one of glass
    p = np.concatenate([origin[:2] + lateral / sine * length, np.zeros_like(sine)], axis=-1)
    assert close(trace_picture(scene)[..., 0], lambert(p, light, 1.0, RHO), 1e-10)


def test_total_internal_reflection(make: Any, rays: Any) -> None:
    """From within glass: beyond the critical angle the surface above mirrors the floor, else it shows black space."""
    light = (0.4, 0.3, 0.7)
    camera = make.camera((0, 0, 1), (0, 1, 2.1), 0.5)
    scene = make.scene(
        [make.rectangle(), make.rectangle(2.0, material=1)],
        [make.point(light)],
        camera,
        materials=(GREY, glass(1.5)),
        full=True,
    )
    _, d = rays(scene)
    up = d[..., 2]
    total = np.hypot(d[..., 0], d[..., 1]) > 1 / 1.5
    mirrored = d * [1, 1, -1]
    p = np.array((0, 0, 3.0)) + (3 / up)[..., None] * mirrored  # as if seen from the image of the eye at z = 3
    assert 500 < total.sum() < total.size - 500
    picture = trace_picture(scene)[..., 0]
    assert (picture[~total] == 0).all()
    assert close(picture[total], lambert(p, light, 1.0, RHO)[total], 1e-10)


def test_half_opacity_is_half_the_sheet_and_half_of_what_is_behind_in_half_a_shadow(make: Any, rays: Any) -> None:
    half = Material("/Half", (0.9,) * 3, opacity=0.5)
    light = (0.0, 0.0, 5.0)
    sheet = make.rectangle(1.0, 0.8, material=1)
    scene = floor(make, [make.point(light)], (0.5, -3, 4), objects=[sheet], materials=(half,), full=True)
    p, _ = hit_plane(scene, rays, 0)
    q, _ = hit_plane(scene, rays, 1)
    over = (np.abs(q[..., :2]) < 0.8).all(-1)
    shaded = (np.abs(p[..., :2]) * 0.8 < 0.8).all(-1)
    ground = lambert(p, light, 1.0, RHO) * np.where(shaded, 0.5, 1)
    expected = np.where(over, 0.5 * lambert(q, light, 1.0, 0.9) + 0.5 * ground, ground)
    assert min((over & shaded).sum(), (over & ~shaded).sum(), (~over & shaded).sum()) > 20
    assert close(trace_picture(scene)[..., 0], expected)


# --- textures and interpolation -----------------------------------------------------------------------------------


@pytest.mark.parametrize("wrap", ["repeat", "clamp"])
def test_textures_are_bilinear(make: Any, rays: Any, wrap: Any) -> None:
    """Against scipy's interpolation; v = 0 is the bottom edge, texel centres lie at half-integers."""
    pixels = np.random.default_rng(6).uniform(0, 1, (3, 5, 3))
    picture = Texture(Path("random"), pixels, wrap, wrap)
    material = Material("/Picture", BLACK, 0)
    uv = np.array([(-0.3, -0.4), (1.6, -0.4), (1.6, 1.5), (-0.3, 1.5)])
    camera = make.camera((0, 0, 4), (0, 0, 0), 0.25)
    square = make.rectangle(0.0, 1.0, uv=uv)
    scene = make.scene(
        [square], [make.distant((0, 0, -1), math.pi)], camera, materials=(material,), textures=(picture,), full=True
    )
    p, _ = hit_plane(scene, rays, 0)
    s, t = (p[..., 0] + 1) / 2, (p[..., 1] + 1) / 2
    x, y = (-0.3 + 1.9 * s) * 5 - 0.5, (1 - (-0.4 + 1.9 * t)) * 3 - 0.5
    expected = np.stack(
        [
            ndimage.map_coordinates(
                pixels[..., k], [y, x], order=1, mode="grid-wrap" if wrap == "repeat" else "nearest"
            )
            for k in range(3)
        ],
        axis=2,
    )
    assert (np.abs(p[..., :2]) <= 1).all()
    assert close(trace_picture(scene), expected, 1e-11)


GRADIENT = Texture(Path("gradient"), np.array([[[0.0, 0, 0], [1, 1, 1]]]), "clamp", "clamp")  # u 1/4..3/4 -> 0..1


@pytest.mark.parametrize("diagonal", ["02", "13"])
def test_on_a_parallelogram_the_bilinear_map_is_that_of_two_triangles(make: Any, diagonal: Any) -> None:
    points = np.array([(-1, -0.5, 0), (0.8, -0.8, 0.3), (1.3, 0.5, 0.1), (-0.5, 0.8, -0.2)])
    uv = np.array([(0.25, 0.1), (0.7, 0.2), (0.75, 0.8), (0.3, 0.7)])
    material = Material("/Picture", BLACK, 0)
    quad = make.mesh(points, [(0, 1, 2, 3)], uv=uv)
    camera = make.camera((0.3, -0.4, 4), (0.1, 0, 0), 0.35)
    pictures = [
        trace_picture(
            make.scene(
                [mesh], [make.distant((0, 0, -1))], camera, materials=(material,), textures=(GRADIENT,), full=True
            )
        )
        for mesh in (quad, split_ngons(quad, diagonal))
    ]
    assert (pictures[0] > 0).sum() > 1000
    assert np.abs(pictures[0] - pictures[1]).max() < 1e-13


def test_affine_interpolation_is_linear_on_the_screen(make: Any, rays: Any) -> None:
    """The fault: u, here the picture's value, becomes a linear function of the raster position."""
    points = np.array([(-1.0, -1, 1), (1, -1, 0.5), (0, 1.5, -4)])
    uv = np.array([(0.25, 0.5), (0.5, 0.5), (0.75, 0.5)])
    material = Material("/Picture", BLACK, 0)
    mesh = make.mesh(points, [(0, 1, 2)], uv=uv)
    scene = make.scene(
        [mesh], [make.point((0, 0, 4), 1.0)], make.camera((0, 0, 4), (0, 0, 0), 0.4),
        materials=(material,), textures=(GRADIENT,), full=True,
    )  # fmt: skip
    affine, correct = (trace_picture(scene, Options(affine=each))[..., 0] for each in (True, False))
    plain = trace_picture(make.scene([make.mesh(points, [(0, 1, 2)])], scene.lights, scene.camera, full=True))[..., 0]
    inside = plain > 0
    y, x = np.nonzero(inside)
    columns = np.stack([x, y, np.ones(len(x))], axis=1)
    for picture, straight in ((affine, True), (correct, False)):
        value = picture[inside] / plain[inside]
        fitted = columns @ np.linalg.lstsq(columns, value, rcond=None)[0]
        assert (np.abs(value - fitted).max() < 1e-11) == straight


def test_raw_normals_are_shorter_than_unit_ones(make: Any, rays: Any) -> None:
    """Half way between normals 90 degrees apart the raw sum has the length 1/sqrt(2)."""
    points = np.array([(-1.0, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)])
    a, b = np.array((-1.0, 0, 1)) / math.sqrt(2), np.array((1.0, 0, 1)) / math.sqrt(2)
    mesh = make.mesh(points, [(0, 1, 2), (0, 2, 3)], 0, [a, b, b, a])
    scene = make.scene([mesh], [make.distant((0, 0, -1))], make.camera((0, 0, 4), (0, 0, 0), 0.2))
    p, _ = hit_plane(scene, rays, 0)
    s = (p[..., 0] + 1) / 2
    raw = (1 - s)[..., None] * a + s[..., None] * b
    assert close(trace_picture(scene, Options(normals="raw"))[..., 0], raw[..., 2] / math.pi)
    assert close(trace_picture(scene)[..., 0], raw[..., 2] / np.linalg.norm(raw, axis=-1) / math.pi)


def test_silhouette_normals_are_kept_turned_or_painted_black(make: Any) -> None:
    """A facet faces the viewer, its interpolated normal N' does not: N'.V < 0."""
    points = np.array([(-9.0, -9, 0), (9, -9, 0), (0, 9, 0)])
    normal = np.array((0.8, 0, -0.6))
    mesh = make.mesh(points, [(0, 1, 2)], 0, [normal] * 3)
    lights = [make.distant((-1, 0, 0), 1.0), make.distant((1, 0, -1), 10.0)]  # N'.L: 0.8; -N'.L: 1.4/sqrt(2)
    scene = make.scene([mesh], lights, make.camera((0, 0, 4), (0, 0, 0), 0.2), size=8)
    drawn = {each: trace_picture(scene, Options(silhouette=each)) for each in ("keep", "flip", "black")}
    assert close(drawn["keep"], 0.8 / math.pi)
    assert close(drawn["flip"], 10 * 1.4 / math.sqrt(2) / math.pi)
    assert not drawn["black"].any()


# --- sampling -----------------------------------------------------------------------------------------------------


def test_seeds_and_threads(make: Any) -> None:
    """The same seed gives the same bits with any number of threads; another seed gives another picture."""
    scene = floor(make, [make.point((0.5, 0.2, 2))], objects=[make.rectangle(1.0, 0.3)], size=48)
    one = trace_picture(scene, samples=5, seed=3, threads=1)
    assert np.array_equal(one, trace_picture(scene, samples=5, seed=3, threads=4))
    assert not np.array_equal(one, trace_picture(scene, samples=5, seed=4, threads=1))
    first, second = (trace_envelope(scene, threads=each).arrays() for each in (1, 3))
    assert all(np.array_equal(first[key], second[key]) for key in first)


def test_random_samples_and_the_grid_agree(make: Any) -> None:
    """The mean over the footprint, twice: 400 random samples within five standard errors of the envelope's."""
    scene = floor(make, [make.point((0.5, 0.2, 2))], objects=[make.rectangle(1.0, 0.3)], size=24)
    envelope = trace_envelope(scene, grid=16, refine=0)
    drawn = trace_picture(scene, samples=400, seed=1)
    error = np.abs(drawn - envelope.mean)
    # regular samples have an error of their own at edges: one of 16 rows of them at most
    slack = 5 * np.sqrt(envelope.variance / 400) + np.where(
        envelope.edge[..., None], (envelope.hi - envelope.lo) / 16, 0
    )
    assert (error <= slack + 1e-3 * envelope.mean).all()
    assert (envelope.lo <= drawn + 1e-15).all()
    assert (drawn <= envelope.hi + 1e-15).all()
