"""Each scene shows its figure of the paper: docs/figures.md, as far as a formula or a law gives its numbers."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import numpy.typing as npt
import pytest
from scipy import ndimage

from notabug.references.tracer.envelope import trace_picture
from notabug.references.tracer.options import Options
from notabug.scenes_usd.catalogue import scenes
from notabug.scenes_usd.reader import read_scene
from notabug.scenes_usd.scene import Camera, Scene

Floats = npt.NDArray[np.float64]
Bools = npt.NDArray[np.bool_]
PLAIN = Options(ties="nearest")  # as a renderer draws that has no rule for ties
FACETS = replace(PLAIN, shadows="facets")
VISIBLE = 0.01


def drawn(scene: str, *, facets: bool = False, single: bool = False, **variants: str) -> Floats:
    read = read_scene(scene, variants)
    return trace_picture(read, FACETS if facets else PLAIN, dtype=np.float32 if single else np.float64)


def differ(a: Floats, b: Floats) -> Bools:
    return np.asarray(np.abs(a - b).max(axis=2) > VISIBLE)


def without_highlights(scene: Scene) -> Scene:
    return replace(scene, materials=tuple(replace(each, specular=(0.0, 0.0, 0.0)) for each in scene.materials))


@pytest.mark.slow
@pytest.mark.parametrize("scene", [each.id for each in scenes()])
def test_nothing_clips(scene: str) -> None:
    """16-bit pictures clip at 1, so no variant of any scene comes near it; and none is black."""
    sets = next(each.variants for each in scenes() if each.id == scene)
    for choice in [{}, *({name: each} for name, names in sets.items() for each in names)]:
        brightest = drawn(scene, **choice).max()
        assert 0.2 < brightest < 0.95, choice


def test_figure_1_acne_grows_as_the_light_sinks() -> None:
    """Float32 from 1,000 away: every lower elevation has more wrong pixels; from nearby nearly none."""
    wrong = []
    for elevation in ("5", "1", ".5", ".1", ".05"):
        at = {"light_elevation": elevation, "camera_distance": "1e3"}
        wrong.append(
            int(differ(drawn("acne/grazing_plane", **at), drawn("acne/grazing_plane", single=True, **at)).sum())
        )
    assert wrong == sorted(wrong)
    assert wrong[0] < 300 < 3000 < wrong[-1]
    near = {"light_elevation": "5"}
    assert not differ(drawn("acne/grazing_plane", **near), drawn("acne/grazing_plane", single=True, **near)).any()


def test_figure_1_offsets_change_nothing_exact() -> None:
    still = drawn("acne/sphere", facets=True)
    for offset in ("1e2", "1e6"):
        assert not differ(still, drawn("acne/sphere", facets=True, world_offset=offset)).any()


def test_figure_2_dots_and_steps_in_one_picture() -> None:
    """Steps of a facet's size are there in float64; dots of a pixel's size come with float32 and distance."""
    for distance, dotted in (("10", False), ("1e5", True)):
        smooth = drawn("acne/with_terminator", camera_distance=distance)
        exact = drawn("acne/with_terminator", facets=True, camera_distance=distance)
        single = drawn("acne/with_terminator", facets=True, single=True, camera_distance=distance)
        assert max(_sizes(differ(smooth, exact))) > 100
        dots = _sizes(differ(exact, single))
        assert bool(len(dots) > 300) == dotted
        assert not dotted or np.median(dots) <= 2


def _sizes(mask: Bools) -> list[float]:
    labels, count = ndimage.label(mask, np.ones((3, 3)))
    return [float(each) for each in ndimage.sum(mask, labels, range(1, count + 1))]


def test_figure_3_finer_facets_darken_less() -> None:
    area = [
        int(
            differ(
                drawn("terminator/sphere", tessellation=each),
                drawn("terminator/sphere", facets=True, tessellation=each),
            ).sum()
        )
        for each in ("8x4", "16x8", "24x12", "48x24", "96x48")
    ]
    assert area == sorted(area, reverse=True)
    assert area[0] > 10 * area[-1] > 100


def test_figure_3_spacing_counts() -> None:
    even, uneven = (
        int(
            differ(
                drawn("terminator/spacing", spacing=each), drawn("terminator/spacing", facets=True, spacing=each)
            ).sum()
        )
        for each in ("even", "uneven")
    )
    assert uneven > 1.5 * even > 300


@pytest.mark.parametrize("scene", ["terminator/mirror_sphere", "terminator/glass_sphere"])
def test_figure_3_secondary_rays(scene: str) -> None:
    finest = drawn(scene, tessellation="48x24")
    off = [int(differ(drawn(scene, tessellation=each), finest).sum()) for each in ("8x4", "16x8", "24x12")]
    assert off == sorted(off, reverse=True)
    assert off[-1] > 500


def test_bowl_shadows_itself_at_every_tessellation() -> None:
    """The rim's shadow is real: it takes more than a quarter of the light that falls in, and finer facets keep it."""
    for tessellation in ("16x8", "96x48"):
        scene = read_scene("terminator/bowl", {"tessellation": tessellation})
        bowl = replace(scene, objects=tuple(each for each in scene.objects if each.path.startswith("/Scene/Bowl")))
        lit = trace_picture(bowl, Options()).max(axis=2) > 0
        unshadowed = trace_picture(bowl, Options(shadows="none")).max(axis=2) > 0
        assert 0.25 < (unshadowed & ~lit).sum() / unshadowed.sum() < 0.5


def floor_point(camera: Camera, width: int, height: int, row: float, column: float) -> Floats:
    """Where the ray through a raster position meets z = 0."""
    local = np.array([(2 * column / width - 1) * camera.tan_x, (1 - 2 * row / height) * camera.tan_y, -1.0])
    direction = local @ camera.to_world[:3, :3]
    eye = camera.to_world[3, :3]
    return np.asarray(eye - direction * eye[2] / direction[2])


def test_figure_4_to_6_the_t() -> None:
    """Peaks where the formulas put them, parts that add up, and a bar wider than the stem."""
    both, diffuse, specular = (
        drawn("separation/t_highlight", part=each)[:, :, 0] for each in ("both", "diffuse", "specular")
    )
    np.testing.assert_allclose(both, diffuse + specular, rtol=0, atol=1e-12)
    camera = read_scene("separation/t_highlight").camera
    light, eye = np.array([0.0, 1.5, 1.2]), np.array([0.0, -6.0, 2.0])
    np.testing.assert_allclose(camera.to_world[3, :3], eye)
    assert math.degrees(2 * math.atan(camera.tan_x)) == pytest.approx(45.0, abs=1e-5)
    np.testing.assert_allclose(-camera.to_world[2, :3], np.array([0, 7, -2]) / math.sqrt(53), atol=1e-7)
    falls, shines = [], []
    for row in range(80, 384):
        x = floor_point(camera, 512, 384, row + 0.5, 256)
        to_light, to_eye = light - x, eye - x
        d = np.linalg.norm(to_light)
        to_light, to_eye = to_light / d, to_eye / np.linalg.norm(to_eye)
        mirrored = np.array([-to_light[0], -to_light[1], to_light[2]])
        falls.append(0.6 * to_light[2] / d**2)
        shines.append(max(mirrored @ to_eye, 0.0) ** 12 / d**2)
    assert 80 + int(np.argmax(falls)) == 181 == np.unravel_index(diffuse.argmax(), diffuse.shape)[0]
    assert 80 + int(np.argmax(shines)) == 233 == np.unravel_index(specular.argmax(), specular.shape)[0]
    np.testing.assert_allclose(both[80:, 256] / np.add(falls, shines), 4.6 / math.pi, rtol=1e-3)
    bright = both > 0.35 * both.max()
    across = bright.sum(axis=1)
    assert across[181] > 1.8 * across[215]  # the bar against the stem
    assert across[215] < 1.1 * across[233]  # which keeps its width


def rays(scene: Scene, rows: npt.NDArray[np.intp], columns: npt.NDArray[np.intp]) -> Floats:
    """Unit directions (n, 3) from the eye through the centres of pixels."""
    camera = scene.camera
    a = (2 * (columns + 0.5) / scene.width - 1) * camera.tan_x
    b = (1 - 2 * (rows + 0.5) / scene.height) * camera.tan_y
    d = np.stack([a, b, -np.ones_like(a)], axis=1) @ camera.to_world[:3, :3]
    return np.asarray(d / np.linalg.norm(d, axis=1, keepdims=True))


@pytest.mark.parametrize("lobe", ["phong", "blinn"])
def test_figure_7_the_highlight_is_cut(lobe: str) -> None:
    """Beside N.L = 0 the highlight still has what the lobe gives there, (-L.V)^n or (N.H)^n, and nothing beyond."""
    scene = read_scene("separation/cutoff", {"lobe": lobe})
    ball = replace(scene, objects=tuple(each for each in scene.objects if each.path == "/Scene/Ball"))
    ball = replace(ball, width=1024, height=1024)
    picture = trace_picture(ball)[:, :, 0]
    highlight = picture - trace_picture(without_highlights(ball))[:, :, 0]
    headlight = replace(ball.lights[0], direction=tuple((-ball.camera.to_world[2, :3]).tolist()))
    body = trace_picture(replace(ball, lights=(headlight,))).max(axis=2) > 0
    edge = (picture > 0) & ndimage.binary_dilation(body & (picture == 0))
    assert edge.sum() > 100
    to_light = -np.array(ball.lights[0].direction)
    peak = 0.55 * ball.lights[0].intensity[0] / math.pi
    if lobe == "phong":
        expected = peak * (rays(ball, *np.nonzero(edge)) @ to_light) ** 3
        assert np.median(highlight[edge] / expected) == pytest.approx(1.0, abs=0.05)
    else:
        assert highlight[edge].max() > 0.4 * peak
    assert highlight[edge].min() > 0
    assert highlight[body & (picture == 0)].max() == 0


WALLS = {"ball": (1, 1), "left": (-1, 1), "back": (1, -1), "both": (-1, -1)}


def test_figure_8_highlights_are_not_mirrored() -> None:
    """The highlight's peak lies where each mirrored eye sees it, far from the mirror image of the ball's own."""
    scene = read_scene("mirror/corner")
    highlight = (trace_picture(scene) - trace_picture(without_highlights(scene)))[:, :, 0]
    eye = scene.camera.to_world[3, :3]
    light = np.array(scene.lights[0].position)
    (ball,) = scene.spheres
    centre = ball.to_world[3, :3]
    normals, areas = {}, {}
    for name, (sx, sz) in WALLS.items():
        flip, shift = np.array([sx, 1, sz]), np.array([-3.6 * (sx < 0), 0, -3.6 * (sz < 0)])
        normals[name] = _peak(centre, ball.radius, light, eye * flip + shift)
        image = (centre + ball.radius * normals[name]) * flip + shift
        row, column = _raster(scene, image)
        around = np.s_[round(row) - 4 : round(row) + 5, round(column) - 4 : round(column) + 5]
        top = np.unravel_index(highlight[around].argmax(), (9, 9))
        assert abs(top[0] - 4) <= 2, name
        assert abs(top[1] - 4) <= 2, name
        labels, _ = ndimage.label(highlight > 0.5 * highlight[around].max())
        found = labels == labels[around][top]
        disc = (scene.camera.tan_x * np.linalg.norm(image - eye)) ** -2
        areas[name] = found.sum() / disc
    turn = {name: math.degrees(math.acos(float(each @ normals["ball"]))) for name, each in normals.items()}
    assert turn["left"] > 40 < turn["back"] < turn["both"]
    assert max(areas.values()) > 1.05 * min(areas.values())


def _peak(centre: Floats, radius: float, light: Floats, eye: Floats) -> Floats:
    """The normal where R.V^10 / d^2 is greatest for this eye."""
    theta, phi = np.meshgrid(np.linspace(0, np.pi, 500), np.linspace(0, 2 * np.pi, 1000), indexing="ij")
    n = np.stack([np.sin(theta) * np.sin(phi), np.cos(theta), np.sin(theta) * np.cos(phi)], axis=-1)
    x = centre + radius * n
    to_light, to_eye = light - x, eye - x
    d = np.linalg.norm(to_light, axis=-1)
    to_light /= d[..., None]
    to_eye /= np.linalg.norm(to_eye, axis=-1, keepdims=True)
    nl, nv = (n * to_light).sum(-1), (n * to_eye).sum(-1)
    rv = 2 * nl * nv - (to_light * to_eye).sum(-1)
    value = np.where((nl > 0) & (nv > 0), np.maximum(rv, 0) ** 10 / d**2, 0)
    return np.asarray(n[np.unravel_index(value.argmax(), value.shape)])


def _raster(scene: Scene, point: Floats) -> tuple[float, float]:
    """Row and column of the pixel that shows ``point``."""
    camera = scene.camera
    x, y, z = (point - camera.to_world[3, :3]) @ camera.to_world[:3, :3].T
    column = (x / -z / camera.tan_x + 1) / 2 * scene.width - 0.5
    return (1 - y / -z / camera.tan_y) / 2 * scene.height - 0.5, column


def blue(picture: Floats) -> int:
    return int((picture[:, :, 2] > 1.05 * picture[:, :, 0]).sum())


@pytest.mark.parametrize(
    ("scene", "tie", "fight"),
    [
        ("visibility/coincident_spheres", {"transform": "same"}, {"transform": "turned"}),
        ("visibility/coincident_spheres", {"transform": "same"}, {"transform": "turned", "surface": "sphere"}),
        ("visibility/coincident_planes", {"triangulation": "same"}, {"triangulation": "other"}),
    ],
)
@pytest.mark.parametrize("single", [False, True])
def test_figure_9_colours_mix(scene: str, tie: dict[str, str], fight: dict[str, str], single: bool) -> None:
    """Alike, the first in the scene wins; otherwise thousands of pixels go to the other; raised, the first wins."""
    first = blue(drawn(scene, single=single, **tie))
    assert blue(drawn(scene, single=single, **fight)) > first + 2000
    assert blue(drawn(scene, single=single, gap="1e-3", **fight)) < first + 20


def test_figure_9_standing_on_the_floor() -> None:
    """The bottoms fight with the floor, and not when raised; what is left are pixels on edges."""
    raised = drawn("visibility/standing", gap="1e-3")
    assert differ(drawn("visibility/standing", gap="0"), raised).sum() > 3000
    assert differ(drawn("visibility/standing", gap="1e-6"), raised).sum() < 100


def test_near_planes_do_not_move_a_ray() -> None:
    usual = drawn("visibility/near_clip")
    for near in ("1", ".01", ".001", ".0001"):
        np.testing.assert_array_equal(drawn("visibility/near_clip", near=near), usual)


def test_figure_11_finer_grids_come_closer() -> None:
    """The picture's error falls with the grid, and with as many but uneven cells it is larger than with even ones."""
    patch = drawn("texture/uneven_quad")
    error = {
        split: float(np.abs(drawn("texture/uneven_quad", split=split) - patch).mean())
        for split in ("split02", "split13", "grid2", "grid4", "grid15", "grid30", "grid8", "uneven8")
    }
    falling = [error[each] for each in ("split02", "grid2", "grid4", "grid15", "grid30")]
    assert falling == sorted(falling, reverse=True)
    assert error["split13"] > error["grid2"]
    assert error["split02"] > 100 * error["grid30"]
    assert error["uneven8"] > 3 * error["grid8"]


def test_simplifying_with_uv_keeps_the_texture() -> None:
    full, with_uv, without_uv = (
        drawn("texture/simplified", simplified=each) for each in ("full", "with_uv", "without_uv")
    )
    assert np.abs(without_uv - full).mean() > 5 * np.abs(with_uv - full).mean()


@pytest.mark.parametrize(("lobe", "aspect"), [("phong", 1.735), ("blinn", 1.0)])
def test_lobes_on_a_ball(lobe: str, aspect: float) -> None:
    """Phong's highlight is 1 / cos(half the angle from light to view) as long as it is wide; Blinn's is round."""
    scene = read_scene("phong/lobes", {"lobe": lobe, "n": "128" if lobe == "phong" else "32"})
    scene = replace(scene, width=1024, height=1024)
    highlight = (trace_picture(scene) - trace_picture(without_highlights(scene)))[:, :, 0]
    d = rays(scene, *np.nonzero(highlight > 0.7 * highlight.max()))
    eye = scene.camera.to_world[3, :3]
    t = -(d @ eye) - np.sqrt((d @ eye) ** 2 - (eye @ eye - 1))
    n = eye + t[:, None] * d
    to_light = -np.array(scene.lights[0].direction)
    across = np.cross(to_light, [0, 0, 1])
    across /= np.linalg.norm(across)
    half = to_light + np.array([0, 0, 1])
    half /= np.linalg.norm(half)
    long, wide = np.arcsin(n @ across), np.arcsin(n @ np.cross(across, half))
    assert np.ptp(long) / np.ptp(wide) == pytest.approx(aspect, rel=0.06)
