"""Highlights, mirrors, glass and opacity of both renderers, against closed forms and the in-house ray tracer.

Tolerances are half a step of a 16-bit integer for POV-Ray. Mitsuba's are float32's where no ray goes on; its
secondary rays start about 9e-5 (1 + |p|) off the surface, which shows where what they see varies.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import notabug.adapters.mitsuba
from notabug.adapters.base import Adapter, Quality, UnsupportedError
from notabug.adapters.llvm import Library
from notabug.adapters.mitsuba import Mitsuba
from notabug.adapters.povray import PovRay
from notabug.references.tracer.envelope import trace_picture
from notabug.references.tracer.options import Options
from notabug.scenes_usd.scene import Mesh, Sphere, Texture

HALF_STEP = 0.51 / 65535
COLOUR = (0.4, 0.2, 0.9)
GREY = (0.6, 0.6, 0.6)  # where colour is not the point: POV-Ray draws a coloured highlight channel by channel
UP = np.array([0.0, 0.0, 1.0])


@pytest.fixture(params=["povray", "mitsuba"])
def adapter(request: pytest.FixtureRequest) -> Adapter:
    return request.getfixturevalue(request.param)


def near(adapter: Adapter, mitsuba: float = 5e-6) -> float:
    """Half a step of POV-Ray's picture (which is four times as wide where it reaches 1), and what Mitsuba is within."""
    return HALF_STEP + 2e-6 if adapter.name == "povray" else mitsuba


def traced(scene: Any, samples: int = 1) -> Any:
    """What the in-house tracer makes of it under the conventions that both renderers share."""
    return trace_picture(scene, Options(shadows="facets", silhouette="flip"), samples=samples)


def ball(at: Any, radius: float, material: int) -> Sphere:
    to_world = np.eye(4)
    to_world[3, :3] = at
    return Sphere("/Scene/Sphere", radius, material, to_world)


def prism(section: Any, y: tuple[float, float], material: int = 0) -> Mesh:
    """A convex polygon in the xz plane, counter-clockwise as seen from -y, extruded along y; closed, facing outward."""
    n = len(section)
    points = np.array([[x, each, z] for each in y for x, z in section], float)
    sides = [[i, (i + 1) % n, (i + 1) % n + n, i + n] for i in range(n)]
    faces = [list(range(n))[::-1], [i + n for i in range(n)], *sides]
    faces = [face[::-1] for face in faces]
    counts = np.array([len(face) for face in faces], np.int32)
    return Mesh("/Scene/Prism", points, counts, np.concatenate(faces).astype(np.int32), material)


def shining(stage: Any, P: Any, V: Any, N: Any, light: Any, look: Any) -> Any:
    """Phong's or Blinn's model as its authors write it, without shadows: (h, w, 3)."""
    to = np.array(light.position) - P if light.kind == "point" else -np.array(light.direction) + 0 * P
    L = to / np.linalg.norm(to, axis=-1, keepdims=True)
    E, cosine = stage.lit(P, N, light)
    if look.lobe == "phong":
        R = 2 * (L * N).sum(-1, keepdims=True) * N - L
        lobe = np.maximum((R * V).sum(-1), 0) ** look.exponent
    else:
        H = (L + V) / np.linalg.norm(L + V, axis=-1, keepdims=True)
        lobe = np.maximum((N * H).sum(-1), 0) ** look.exponent
    if look.cosine_weighted:
        lobe = lobe * cosine
    part = np.array(look.diffuse) * cosine[..., None] + np.array(look.specular) * lobe[..., None]
    return np.where(cosine[..., None] > 0, part * E[..., None] / np.pi, 0)


def floor(stage: Any, **look: Any) -> Any:
    light = stage.point((0.5, 0.3, 2.0))
    return stage.scene([stage.quad()], [light], stage.camera((0, -3, 4)), [stage.replace(stage.grey(0.5), **look)])


@pytest.mark.parametrize("lobe", ["phong", "blinn"])
@pytest.mark.parametrize("exponent", [8.0, 32.0, 128.0])
@pytest.mark.sweep_except("povray-8.0-phong", "povray-32.0-blinn", "mitsuba-8.0-blinn", "mitsuba-128.0-phong")
def test_coloured_highlights(stage: Any, adapter: Adapter, lobe: str, exponent: float) -> None:
    scene = floor(stage, specular=COLOUR, exponent=exponent, lobe=lobe)
    look = scene.materials[0]
    expected = shining(stage, stage.on_plane(scene), -stage.rays(scene)[1], UP, scene.lights[0], look)
    picture = stage.draw(adapter, scene)
    assert np.abs(picture - expected).max() < near(adapter)
    assert np.abs(expected - traced(scene)).max() < 1e-12


@pytest.mark.parametrize("lobe", ["phong", "blinn"])
@pytest.mark.sweep_except("povray-phong", "mitsuba-blinn")
def test_highlight_of_a_large_exponent(stage: Any, adapter: Adapter, lobe: str) -> None:
    """At n = 1e5 the lobe is half as bright 0.2 degrees off; it peaks where the view ray mirrors the light's."""
    light = stage.distant((0.2, 0.1, 1.0), (2.0, 2.0, 2.0))
    x, y, z = np.array(light.direction) * -5
    look = stage.replace(stage.grey(0), specular=GREY, exponent=1e5, lobe=lobe)
    camera = stage.camera((0.01 - x, 0.005 - y, z), (0.03, -0.01, 0), tan=0.02)
    scene = stage.scene([stage.quad()], [light], camera, [look])
    picture = stage.draw(adapter, scene)
    P = stage.on_plane(scene)
    assert np.abs(picture - shining(stage, P, -stage.rays(scene)[1], UP, light, look)).max() < near(adapter)
    y, x = np.unravel_index(picture[..., 2].argmax(), (64, 64))
    assert P[y, x, :2] == pytest.approx([0.01, 0.005], abs=0.005)
    assert picture[y, x, 2] == pytest.approx(0.6 * 2 / np.pi, rel=0.05)


@pytest.mark.parametrize("lobe", ["phong", "blinn"])
@pytest.mark.sweep_except("povray-phong", "mitsuba-blinn")
def test_highlight_ends_at_the_terminator(stage: Any, adapter: Adapter, lobe: str) -> None:
    """With n = 1 the highlight is bright where N.L is 0, and cut there: black beyond."""
    sphere, light = ball((0, 0, 0), 1.0, 0), stage.point((3.0, -1.0, 0.5), (12,) * 3)
    look = stage.replace(stage.grey(0.1), specular=GREY, exponent=1.0, lobe=lobe)
    scene = stage.scene([sphere], [light], stage.camera((-1.5, -3, 1)), [look])
    picture = stage.draw(adapter, scene)
    hit, P, N = stage.on_sphere(scene, sphere)
    expected = np.where(hit[..., None], shining(stage, P, -stage.rays(scene)[1], N, light, look), 0)
    cosine = (N * (np.array(light.position) - P)).sum(-1)
    facing = -(N * stage.rays(scene)[1]).sum(-1)
    sure = hit & (np.abs(cosine) > 1e-3) & (facing > 0.02)
    assert np.abs(picture - expected)[sure].max() < near(adapter)
    assert expected[sure & (cosine > 0) & (cosine < 0.1)].max() > 0.02
    assert (picture[sure & (cosine < 0)] == 0).all()


def test_both_sides_shine_alike(stage: Any, adapter: Adapter) -> None:
    scene = floor(stage, specular=GREY, exponent=16.0)
    back = stage.replace(stage.quad(), corners=np.array([0, 3, 2, 1], np.int32))
    assert np.abs(stage.draw(adapter, stage.replace(scene, objects=(back,))) - traced(scene)).max() < near(adapter)


@pytest.mark.parametrize("lobe", ["phong", "blinn"])
@pytest.mark.sweep_except("povray-phong", "mitsuba-blinn")
def test_highlights_on_interpolated_normals(stage: Any, adapter: Adapter, lobe: str) -> None:
    """On a 24 x 12 sphere under two lights; pixels at which a facet's edge or shadow passes are left out."""
    look = stage.replace(stage.grey(0.3), specular=GREY, exponent=12.0, lobe=lobe)
    lights = [stage.point((3, -1, 2.0), (9, 9, 9)), stage.distant((-1, -1, 2), (0.2, 0.5, 0.3))]
    scene = stage.scene([stage.ball()], lights, stage.camera((1, -3, 2)), [look], size=(96, 96))
    wrong = np.abs(stage.draw(adapter, scene) - traced(scene)).max(-1) > near(adapter, 2e-5)
    assert wrong.sum() <= 4


def test_cosine_weighted_highlight(stage: Any, mitsuba: Mitsuba) -> None:
    for lobe in ("phong", "blinn"):
        scene = floor(stage, specular=COLOUR, exponent=16.0, lobe=lobe, cosine_weighted=True)
        look = scene.materials[0]
        expected = shining(stage, stage.on_plane(scene), -stage.rays(scene)[1], UP, scene.lights[0], look)
        assert np.abs(stage.draw(mitsuba, scene) - expected).max() < 5e-6


def test_texture_under_a_highlight(stage: Any, adapter: Adapter) -> None:
    uv = np.array([[0, 0], [1, 0], [1, 1], [0, 1.0]])
    texture = Texture(Path("t.png"), np.random.default_rng(2).random((6, 8, 3)))
    scene = floor(stage, specular=GREY, exponent=16.0, texture=0)
    scene = stage.replace(scene, objects=(stage.quad(2.5, uv=uv),), textures=(texture,))
    assert adapter.declaration(stage.centres).texture_filter == "bilinear"
    assert np.abs(stage.draw(adapter, scene) - traced(scene)).max() < near(adapter, 8e-6) + HALF_STEP


def test_plane_mirror(stage: Any, adapter: Adapter) -> None:
    """In the mirror z = 0 a ball is seen exactly where its mirrored twin would be, lit by the mirrored lamp."""
    look = stage.replace(stage.grey(0.7), specular=(0.3,) * 3, exponent=8.0)
    glass = stage.replace(stage.grey(0), mirror=(0.8, 0.6, 0.4))
    light = stage.point((2.0, -2.0, 4.0), (30,) * 3)
    camera = stage.camera((0, -4, 1.5), (0, 0, -0.8), tan=0.3)
    scene = stage.scene([stage.quad(), ball((0.3, 0.2, 0.9), 0.6, 1)], [light], camera, [glass, look])
    direct, _, _ = stage.on_sphere(scene, scene.objects[1])
    picture = stage.draw(adapter, scene) * ~direct[..., None]
    hit, P, N = stage.on_sphere(scene, ball((0.3, 0.2, -0.9), 0.6, 1))
    twin = stage.replace(light, position=(2.0, -2.0, -4.0))
    value = shining(stage, P, -stage.rays(scene)[1], N, twin, look)
    expected = np.where((hit & ~direct)[..., None], np.array(glass.mirror) * value, 0)
    lit = expected[..., 0] > 1e-3
    assert lit.sum() > 200
    assert ((picture[..., 0] > 1e-3) != lit).sum() <= 2
    facing = -(N * stage.rays(scene)[1]).sum(-1)
    sure = (facing > 0.1) | ~hit
    assert np.abs(picture - expected)[sure].max() < near(adapter, 5e-4)
    for axis in (0, 1):
        centre = [np.average(np.indices(lit.shape)[axis], weights=each[..., 0]) for each in (picture, expected)]
        assert centre[0] == pytest.approx(centre[1], abs=5e-3)


def test_curved_mirror(stage: Any, adapter: Adapter) -> None:
    red = stage.replace(stage.grey(), diffuse=(0.7, 0.2, 0.1), specular=COLOUR, exponent=20.0)
    shiny = stage.replace(stage.grey(0.1), mirror=(0.8, 0.6, 0.4), specular=(0.2, 0.2, 0.2), exponent=50.0)
    objects = [stage.ball(), ball((1.6, 0.3, 1.1), 0.5, 1), stage.quad(at=(0, 0, -1), material=1)]
    lights = [stage.point((2, -2, 5), (20,) * 3), stage.distant((-0.6, -0.3, 1), (0.5, 0.7, 0.9))]
    scene = stage.scene(objects, lights, stage.camera((0, -5, 3)), [shiny, red])
    wrong = np.abs(stage.draw(adapter, scene) - traced(scene)).max(-1) > near(adapter, 2e-4)
    assert wrong.sum() <= 4


def test_eight_bounces(stage: Any, adapter: Adapter) -> None:
    """Between two facing mirrors a ray advances by tan a each time; nine points that it meets are summed up."""
    light = stage.point((0.1, 0.2, 0.5), (1,) * 3)
    look = stage.replace(stage.grey(0.05), mirror=(1.0, 1.0, 1.0))
    facing = [stage.quad(40), stage.quad(40, at=(0, 0, 1))]
    scene = stage.scene(facing, [light], stage.camera((0, -0.05, 0.5), (0, 0, 0), tan=0.1), [look])
    O, D = stage.rays(scene)  # noqa: E741 - origin
    slope = D / -D[..., 2:]
    met = []
    for bounce in range(9):
        P = O * (1, 1, 0) + slope * (1, 1, 0) * (0.5 + bounce)
        E, cosine = stage.lit(P, UP, light)  # the light is as far from either mirror
        met.append((0.05 / np.pi * E * cosine)[..., None])
    expected = np.sum(met, axis=0)
    assert met[-1].min() > 1e-3
    assert np.abs(stage.draw(adapter, scene) - expected).max() < near(adapter, 1e-4)
    assert np.abs(traced(scene) - expected).max() < 1e-12


def test_slab_of_glass_displaces_by_snells_law(stage: Any, adapter: Adapter) -> None:
    """A floor lit from under the slab is seen displaced by d (tan b - tan a), sin a = 1.5 sin b, times T twice."""
    glass = stage.replace(stage.grey(0), transmission=(0.9, 0.6, 1.0), ior=1.5)
    light = stage.point((0.2, 0.3, 0.4), (0.6,) * 3)
    slab = prism([(-9, 0.5), (9, 0.5), (9, 1.0), (-9, 1.0)], (-9, 9), 1)
    scene = stage.scene([stage.quad(), slab], [light], stage.camera((0, -1.5, 2), tan=0.4), [stage.grey(), glass])
    picture = stage.draw(adapter, scene)
    D = stage.rays(scene)[1]
    across = np.linalg.norm(D[..., :2], axis=-1)
    b = np.arcsin(across / 1.5)
    shift = 0.5 * (np.tan(b) - across / -D[..., 2])
    P = stage.on_plane(scene)
    P[..., :2] += shift[..., None] * D[..., :2] / across[..., None]
    E, cosine = stage.lit(P, UP, light)
    expected = (0.8 / np.pi * E * cosine)[..., None] * np.array(glass.transmission) ** 2
    assert np.abs(shift).max() > 0.1
    assert np.abs(picture - expected).max() < near(adapter, 1e-3)
    assert np.quantile(np.abs(picture - expected), 0.9) < near(adapter, 2e-4)


def test_total_internal_reflection(stage: Any, adapter: Adapter) -> None:
    """A 45 degree prism shows the wall under it; the mirror ray's weight is T by the contract, 1 in POV-Ray."""
    glass = stage.replace(stage.grey(0), transmission=(0.8, 0.5, 1.0), ior=1.5)
    light = stage.distant((-1.0, 0, 0.25), (9,) * 3)
    objects = [prism([(0, 0), (1, 0), (0, 1)], (-1, 1), 1), stage.quad(at=(0, 0, -1))]
    camera = stage.camera((-3, 0, 0.5), (0, 0, 0.5), tan=0.05)
    scene = stage.scene(objects, [light], camera, [stage.grey(), glass], size=(16, 16))
    whole = adapter.declaration(stage.centres).total_reflection == "whole"
    T = np.array(glass.transmission)
    wall = 0.8 / np.pi * 9 * 0.25 / np.hypot(1, 0.25)
    expected = wall * T**2 * (1 if whole else T)
    assert whole == (adapter.name == "povray")
    assert np.abs(stage.draw(adapter, scene) - expected).max() < near(adapter)
    assert np.abs(traced(scene) - wall * T**3).max() < 1e-12


def test_ball_of_glass(stage: Any, adapter: Adapter) -> None:
    """Over a checked floor that is lit from below the ball, so that no shadow of glass is seen."""
    uv = np.array([[0, 0], [1, 0], [1, 1], [0, 1.0]]) * 3
    ground = stage.replace(stage.grey(), texture=0)
    texture = Texture(Path("t.png"), np.random.default_rng(3).random((8, 8, 3)))
    light = stage.point((1.0, 1.0, 0.3), (2,) * 3)
    for ior in (1.5, 0.7):
        glass = stage.replace(stage.grey(0), transmission=(1.0, 1.0, 1.0), ior=ior)
        objects = [stage.quad(6, uv=uv), ball((0, 0, 1.4), 1.0, 1)]
        scene = stage.scene(objects, [light], stage.camera((0.3, -4, 4)), [ground, glass], textures=[texture])
        seen, _, _ = stage.on_sphere(scene, objects[1])
        plain = traced(stage.replace(scene, objects=objects[:1]))
        expected = traced(scene)
        assert np.abs(expected - plain)[seen].max() > 0.05
        difference = np.abs(stage.draw(adapter, scene) - expected).max(-1)[seen]
        lit = expected[seen].max(-1) > 0
        assert np.quantile(difference[lit], 0.98) < near(adapter, 2e-3) + HALF_STEP


def test_shadow_of_glass_is_the_declared_one(stage: Any, adapter: Adapter) -> None:
    """A shadow ray goes straight on through both sides of a slab; it is never refracted."""
    glass = stage.replace(stage.grey(0), transmission=(0.8, 0.5, 1.0), ior=1.5)
    slab = prism([(-1, 1.0), (1, 1.0), (1, 1.5), (-1, 1.5)], (-1, 1), 1)
    light = stage.distant((2, 0, 1), (np.pi * 5**0.5,) * 3)
    scene = stage.scene([stage.quad(), slab], [light], stage.camera((-2.5, 0, 5), (-2.5, 0, 0)), [stage.grey(), glass])
    declared = adapter.declaration(stage.centres).glass_shadow
    row = stage.draw(adapter, scene)[32]
    x = stage.on_plane(scene)[32, :, 0]
    through = {"attenuate": np.array(glass.transmission), "opaque": np.zeros(3)}[declared]
    inside = (x > -2.9) & (x < -1.7)  # both sides; x + 2, x + 3 meet the slab's faces
    beside = (x < -4.1) | (x > 2)
    assert inside.any()
    assert beside.any()
    assert np.abs(row[inside] - 0.8 * through**2).max() < near(adapter)
    assert np.abs(row[beside & (x < 0)] - 0.8).max() < near(adapter)


def test_painted_glass(stage: Any, adapter: Adapter) -> None:
    """A sheet with a diffuse colour, a highlight and a coloured transmission of up to 1 over a floor."""
    sheet = stage.replace(
        stage.grey(), diffuse=(0.3, 0.2, 0.1), specular=COLOUR, exponent=20.0, transmission=(1.0, 0.5, 0.0), ior=1.0
    )
    light = stage.point((0.5, 0.3, 2.0))
    objects = [stage.quad(at=(0, 0, 0.5), material=1), stage.quad()]
    scene = stage.scene(objects, [light], stage.camera((0, -3, 4)), [stage.grey(), sheet])
    P = stage.on_plane(scene)
    O, D = stage.rays(scene)  # noqa: E741 - origin
    above = O + D * ((0.5 - O[2]) / D[..., 2])[..., None]
    E, cosine = stage.lit(P, UP, light)
    T = np.array(sheet.transmission)
    lit = T if adapter.declaration(stage.centres).glass_shadow == "attenuate" else 0 * T
    expected = shining(stage, above, -D, UP, light, sheet) + (0.8 / np.pi * E * cosine)[..., None] * T * lit
    assert np.abs(stage.draw(adapter, scene) - expected).max() < near(adapter) * 4


def test_opacity_composites_and_attenuates_shadows(stage: Any, adapter: Adapter) -> None:
    """Two sheets of opacity 0.5 over a floor, lit at 45 degrees; their highlights are scaled by the opacity too."""
    sheet = stage.replace(stage.grey(0.4), opacity=0.5, specular=(0.2,) * 3, exponent=2.0)
    light = stage.distant((-1, 0, 1), (np.pi * 2**0.5,) * 3)
    objects = [stage.quad(), stage.quad(0.5, (0.5, 0, 1), 1), stage.quad(0.5, (0.5, 0, 1.01), 1)]
    scene = stage.scene(objects, [light], stage.camera((0, 0, 5)), [stage.grey(0.8), sheet])
    assert adapter.declaration(stage.centres).opacity_shadow == "attenuate"
    picture = stage.draw(adapter, scene)[32, :, 0]
    P, V = stage.on_plane(scene)[32], -stage.rays(scene)[1][32]
    x = P[:, 0]
    above = 0.8 * x
    own = shining(stage, P, V, UP, light, sheet)[:, 0]
    behind = np.where((x > 1) & (x < 2), 0.25 * 0.8, 0.8)
    over = 0.5 * own + 0.5 * (0.5 * 0.5 * own + 0.5 * behind)
    expected = np.where((above > 0) & (above < 1), over, behind)
    edges = np.minimum.reduce([np.abs(above), np.abs(above - 1), np.abs(x - 1), np.abs(x - 2)]) < 0.03
    assert np.abs(picture - expected)[~edges].max() < near(adapter)


def test_straight_passages_are_no_bounces(stage: Any, adapter: Adapter) -> None:
    """Ten black sheets of opacity 0.1 pass 0.9^10 of the light, and of what is seen."""
    sheets = [stage.quad(at=(0, 0, 0.3 * k), material=1) for k in range(1, 11)]
    light = stage.distant((0, 0, 1), (np.pi,) * 3)
    materials = [stage.grey(), stage.replace(stage.grey(0), opacity=0.1)]
    scene = stage.scene([stage.quad(), *sheets], [light], stage.camera((0, 0, 8)), materials, size=(8, 8))
    assert stage.draw(adapter, scene) == pytest.approx(0.8 * 0.9**20, abs=near(adapter))


def crowded(stage: Any) -> Any:
    """A box of which every surface reflects, refracts, passes, scatters and shines."""
    look = stage.replace(
        stage.grey(0.5), specular=COLOUR, exponent=9.0, mirror=(0.1, 0.15, 0.2), transmission=(0.3, 0.2, 0.1), ior=1.5
    )
    box = prism([(-1, 0.6), (1, 0.6), (1, 1.2), (-1, 1.2)], (-1, 1), 1)
    materials = [stage.grey(), stage.replace(look, opacity=0.7)]
    lights = [stage.point((3, -2, 5), (30,) * 3)]
    return stage.scene([stage.quad(6), box], lights, stage.camera((0.3, -4, 4)), materials, size=(32, 32))


@pytest.mark.parametrize("llvm", [True, False])
def test_rays_chosen_at_random_have_the_right_mean(
    stage: Any, mitsuba: Mitsuba, monkeypatch: pytest.MonkeyPatch, llvm: bool
) -> None:
    if not llvm:
        monkeypatch.setattr(notabug.adapters.mitsuba, "find_library", lambda: Library(None, "no LLVM >= 19"))
    scene = crowded(stage)
    picture = stage.draw(mitsuba, scene, Quality(samples=16 if llvm else 4, seeds=tuple(range(8))))
    error = picture - traced(scene, 1024)
    assert error.std() < (0.003 if llvm else 0.009)
    assert np.abs(error.mean((0, 1))).max() < 4 * error.std() / 32


def test_a_choice_at_pixel_centres_is_refused(stage: Any, mitsuba: Mitsuba) -> None:
    with pytest.raises(UnsupportedError, match="raise the samples"):
        mitsuba.render(crowded(stage), stage.out, Quality(samples=1))


def test_without_llvm_mirrors_and_glass_are_the_same(
    stage: Any, mitsuba: Mitsuba, monkeypatch: pytest.MonkeyPatch
) -> None:
    glass = stage.replace(stage.grey(0.2), transmission=(0.9, 0.6, 1.0), ior=1.5, specular=COLOUR, exponent=30.0)
    silver = stage.replace(stage.grey(0.2), mirror=(0.5, 0.6, 0.7))
    objects = [stage.quad(material=1), ball((0, 0, 1.4), 1.0, 0)]
    lights = [stage.point((3, -2, 5), (30,) * 3)]
    scene = stage.scene(objects, lights, stage.camera((0.3, -4, 4)), [glass, silver], size=(32, 32))
    fast = stage.draw(mitsuba, scene)
    monkeypatch.setattr(notabug.adapters.mitsuba, "find_library", lambda: Library(None, "no LLVM >= 19"))
    assert np.abs(stage.draw(mitsuba, scene) - fast).max() < 2e-5


def test_what_povray_cannot_say_is_named(stage: Any, povray: PovRay) -> None:
    clear = {"transmission": (1.0, 1.0, 1.0), "ior": 1.5}
    with pytest.raises(UnsupportedError, match="one ray through a surface"):
        povray.render(floor(stage, **clear, opacity=0.5), stage.out, Quality())
    uv = np.array([[0, 0], [1, 0], [1, 1], [0, 1.0]])
    scene = floor(stage, **clear, texture=0)
    scene = stage.replace(scene, objects=(stage.quad(uv=uv),), textures=(Texture(Path("t.png"), np.ones((2, 2, 3))),))
    with pytest.raises(UnsupportedError, match="no texture"):
        povray.render(scene, stage.out, Quality())
