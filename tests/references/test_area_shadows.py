"""Lights of n x n points, and shadow rays with a bias: closed forms of what each shows, and where it can act."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from notabug.adapters.base import Declaration, Quality
from notabug.adapters.inhouse import InHouse
from notabug.adapters.povray import PovRay
from notabug.adapters.registry import adapter
from notabug.references.models.area_shadows import LARGEST_GRID, UNSAID_GRIDS
from notabug.references.models.model import Model, models
from notabug.references.tracer.envelope import trace_envelope, trace_picture
from notabug.references.tracer.options import Options
from notabug.references.tracer.precision import ABSOLUTE, RELATIVE
from notabug.references.tracer.probe import probe
from notabug.scenes_usd.emitters import side
from notabug.scenes_usd.reader import read_scene
from notabug.scenes_usd.scene import Camera, Card, Emitter, Floats, Light, Material, Mesh, Scene

WHITE = Material("/White", (1.0, 1.0, 1.0))
SMALL = 1e-9


def quad(name: str, *corners: tuple[float, float, float]) -> Mesh:
    return Mesh(name, np.array(corners, float), np.array([4], np.int32), np.arange(4, dtype=np.int32), 0)


FLOOR = quad("/Floor", (-50.0, -50.0, 0.0), (50.0, -50.0, 0.0), (50.0, 50.0, 0.0), (-50.0, 50.0, 0.0))
EDGE, HEIGHT = 0.1, 1.0  # of a half plane that hides all beyond x = EDGE
HALF = quad("/Half", (EDGE, -40.0, HEIGHT), (40.0, -40.0, HEIGHT), (40.0, 40.0, HEIGHT), (EDGE, 40.0, HEIGHT))


def lamp(axes: object = (0.4, 0.3), at: tuple[float, float, float] = (0.2, 0.1, 2.0), kind: Any = "rect") -> Light:
    """A rectangle of radiance 1 that shines down."""
    frame = np.diag([*np.asarray(axes, float), 1.0])
    return Light("/Lamp", kind, (1.0, 1.0, 1.0), position=at, emitter=Emitter(frame))


def points(light: Light, n: int, ends: bool = False) -> Floats:
    """The middles of n x n equal parts of the rectangle (n n, 3); or those whose outermost lie on its edges."""
    assert light.emitter is not None
    along = np.linspace(-1.0, 1.0, n) if ends else (2.0 * np.arange(n) + 1.0) / n - 1.0
    x, y, _ = light.emitter.axes
    return np.array([np.array(light.position) + a * x + b * y for b in along for a in along])


def sent(light: Light, from_points: Floats, place: Floats) -> Floats:
    """The radiance (n,) of a white floor at ``place`` under each of the points."""
    assert light.emitter is not None
    x, y, _ = light.emitter.axes
    area = 4.0 * np.linalg.norm(np.cross(x, y)) / len(from_points)
    to = from_points - place
    squared = (to**2).sum(axis=1)
    return np.asarray(area * np.maximum(-to @ side(light.emitter), 0.0) * to[:, 2] / squared**2 / math.pi)


def seen(place: Floats, options: Options, light: Light, *more: Mesh) -> float:
    """The value of a pixel that looks straight down on ``place``, from just above it."""
    frame = np.eye(4)
    frame[3, :3] = place + np.array([0.0, 0.0, 0.05])
    camera = Camera("/Camera", frame, SMALL, SMALL, 0.01, 100.0, orthographic=True)
    scene = Scene("x", Path(), {}, Card("own", ""), camera, 1, 1, (FLOOR, *more), (light,), (WHITE,))
    return float(trace_picture(scene, options)[0, 0, 0])


PLACES = [np.array([x, y, 0.0]) for x, y in ((0.0, 0.0), (1.3, -0.4), (-2.0, 3.0))]
TURNED = replace(lamp(), emitter=Emitter(np.array([[0.3, 0.1, 0.1], [-0.1, 0.3, 0.0], [-0.03, -0.01, 0.1]])))


@pytest.mark.parametrize("light", [lamp(), lamp((1.5, 0.2), (0.0, 0.0, 0.3)), TURNED], ids=["far", "near", "turned"])
@pytest.mark.parametrize("ends", [False, True])
def test_an_open_floor_shows_the_sum_over_the_points(light: Light, ends: bool) -> None:
    for n in (2, 3, 5):
        for place in PLACES:
            expected = sent(light, points(light, n, ends), place).sum()
            for shared in (False, True):
                options = Options(light_grid=n, light_grid_ends=ends, light_grid_shared=shared)
                assert seen(place, options, light) == pytest.approx(expected, rel=1e-11)


def test_of_one_point_on_the_edges_there_is_the_first_corner_alone() -> None:
    options = Options(light_grid=1, light_grid_ends=True)
    assert np.isfinite(seen(PLACES[0], options, lamp()))


@pytest.mark.parametrize("n", [2, 4, 7])
def test_behind_a_half_plane_there_are_n_hard_shadows(n: int) -> None:
    """The columns of points go one after the other; where each goes, similar triangles say."""
    light = lamp()
    where = points(light, n)
    shares = []
    for x in np.linspace(-1.0, 1.0, 81):
        place = np.array([x, 0.0, 0.0])
        crossing = place[0] + (where[:, 0] - place[0]) * HEIGHT / where[:, 2]
        visible = crossing < EDGE
        each = sent(light, where, place)
        assert seen(place, Options(light_grid=n), light, HALF) == pytest.approx((each * visible).sum(), abs=1e-13)
        shared = Options(light_grid=n, light_grid_shared=True)
        assert seen(place, shared, light, HALF) == pytest.approx(each.sum() * visible.mean(), abs=1e-13)
        shares.append(int(visible.sum()))
    assert sorted(set(shares)) == [n * column for column in range(n + 1)], "levels of k / n, and no others"


def test_penumbras_of_a_half_plane_end_where_the_light_does() -> None:
    """Of the light's two edges: at EDGE - its x, over the heights; and n points come as near as half of a part."""
    light = lamp()
    first, last = (2.0 * EDGE - edge for edge in (0.6, -0.2))
    for options, inset in (
        (Options(), 0.0),
        (Options(light_grid=4), 0.1),
        (Options(light_grid=4, light_grid_ends=True), 0.0),
    ):
        full, none = (np.array([x, 0.0, 0.0]) for x in (first + inset - 0.01, last - inset + 0.01))
        assert seen(full, options, light, HALF) == pytest.approx(seen(full, options, light), rel=1e-3)
        assert seen(none, options, light, HALF) == 0.0
        within = [np.array([x, 0.0, 0.0]) for x in (first + inset + 0.01, last - inset - 0.01)]
        assert seen(within[0], options, light, HALF) < (1 - 1e-4) * seen(within[0], options, light)
        assert seen(within[1], options, light, HALF) > 0.0


def test_many_points_come_to_the_integral_unless_they_share_their_shadows() -> None:
    """Near the light a quarter of its points, those that are farthest away, are not a quarter of its light."""
    light = lamp((1.0, 0.5), (0.0, 0.0, 0.5))
    half = quad("/Half", (0.0, -40.0, 0.25), (40.0, -40.0, 0.25), (40.0, 40.0, 0.25), (0.0, 40.0, 0.25))
    place = np.array([0.5, 0.0, 0.0])  # what lies at x < -0.5 of the light is seen from there: columns of 4 and of 16
    exact = seen(place, Options(), lamp((0.25, 0.5), (-0.75, 0.0, 0.5)))
    assert seen(place, Options(), light, half) == pytest.approx(exact, rel=0.03)  # one sample's 233 directions
    errors = [abs(seen(place, Options(light_grid=n), light, half) / exact - 1.0) for n in (4, 16)]
    assert errors[1] < min(0.01, errors[0])
    assert abs(seen(place, Options(light_grid=16, light_grid_shared=True), light, half) / exact - 1.0) > 0.3


def test_the_cosine_at_the_light_is_left_out_by_its_fault_alone() -> None:
    """Under a small light, 60 degrees off its normal, there is twice as much without it."""
    light = lamp((1e-3, 1e-3), (0.0, 0.0, 1.0))
    aside, under = np.array([math.sqrt(3.0), 0.0, 0.0]), np.array([0.0, 0.0, 0.0])
    wrong = Options(light_uncosined=True)
    assert seen(aside, wrong, light) == pytest.approx(2.0 * seen(aside, Options(), light), rel=1e-3)
    assert seen(under, wrong, light) == pytest.approx(seen(under, Options(), light), rel=1e-3)
    ball = lamp((1e-3, 1e-3), (0.0, 0.0, 1.0), "sphere")
    ball = replace(ball, emitter=Emitter(np.eye(3) * 1e-3))
    assert seen(aside, wrong, ball) == seen(aside, Options(), ball)


# --- in the scenes --------------------------------------------------------------------------------------------------


def small(name: str, **variants: str) -> Scene:
    return replace(read_scene(f"area_shadows/{name}", variants), width=32, height=32)


def test_a_grid_acts_in_the_penumbra_and_nowhere_else() -> None:
    """In the umbra nothing; where all of the light is seen, at this distance, less than the tolerance of a value."""
    scene = small("penumbra")
    exact, open_floor = trace_picture(scene), trace_picture(scene, Options(shadows="none"))
    grid = trace_picture(scene, Options(light_grid=4))
    share = exact[..., 0] / np.maximum(open_floor[..., 0], 1e-9)
    off = np.abs(grid - exact).max(axis=2)
    assert (off[share < 1e-12] == 0).all()
    lit = np.abs(share - 1.0) < 1e-9
    assert lit.sum() > 700
    assert (off <= RELATIVE * exact.max(axis=2) + ABSOLUTE * exact.max())[lit].all()
    assert off.max() > 0.02


def test_hard_shadows_are_edges_of_the_envelope() -> None:
    scene = small("penumbra")
    smooth, stepped = (trace_envelope(scene, options) for options in (Options(), Options(light_grid=4)))
    new = stepped.cast & ~smooth.cast
    assert new.sum() > 15
    assert (stepped.hi - stepped.lo).max(axis=2)[new].min() > 0.0


@pytest.mark.parametrize(("thick", "bias", "leaks"), [(".01", 0.15, True), ("0", 0.15, True), (".1", 0.05, False)])
def test_light_leaks_only_within_the_bias_of_a_thinner_wall(thick: str, bias: float, leaks: bool) -> None:
    scene = small("thin_wall", thick=thick)
    exact, leaky = trace_picture(scene), trace_picture(scene, Options(shadow_gap=bias))
    more = (leaky - exact).max(axis=2)
    assert (more >= -1e-12).all(), "it only lights"
    assert (more.max() > 0.02) == leaks
    for row, column in np.argwhere(more > 1e-3):
        place = probe(scene, Options(), column + 0.5, row + 0.5).position
        behind = 0.1 - float(thick) - place[2]  # the wall's dark side is at z = 0.1 - thick
        assert -1e-6 < behind < bias, place
    if leaks:
        assert (more > 1e-3).sum() > 8


def test_a_start_along_the_normal_shortens_the_shadow_of_a_curb() -> None:
    """A curb of height .2 under a narrow light throws the shadow of one of .2 less what the rays start higher."""
    sun = Light("/Sun", "sun", (1.0, 1.0, 1.0), direction=(-math.sqrt(0.5), 0.0, -math.sqrt(0.5)),
                emitter=Emitter(half_angle=1e-3))  # fmt: skip
    curb = quad("/Curb", (0.0, -5.0, 0.0), (0.0, 5.0, 0.0), (0.0, 5.0, 0.2), (0.0, -5.0, 0.2))
    for lift, dark, lit in ((0.0, -0.19, -0.21), (0.05, -0.14, -0.16), (0.25, None, -0.01)):
        options = Options(shadow_lift=lift)
        if dark is not None:
            assert seen(np.array([dark, 0.0, 0.0]), options, sun, curb) == 0.0
        assert seen(np.array([lit, 0.0, 0.0]), options, sun, curb) > 0.0


# --- which models a declaration leaves open ---------------------------------------------------------------------------


def open_to(scene: Scene, declaration: Declaration, name: str = "light_grid") -> list[Model]:
    return [each for each in models(scene) if each.name == name and each.open_to(declaration)]


def declared(**said: Any) -> Declaration:
    return replace(adapter("inhouse").declaration(Quality()), light_grid_shadow="unknown", **said)


def test_a_declared_number_of_points_is_the_only_one() -> None:
    scene = small("penumbra")
    for n in (2, 7, LARGEST_GRID):
        found = open_to(scene, declared(light_grid=n))
        assert [each.options["light_grid"] for each in found] == [n, n]
        assert len(open_to(scene, declared(light_grid=n), "light_grid_to_edges")) == 2
    assert open_to(scene, declared(light_grid=0)) == []
    assert open_to(scene, declared(light_grid=1)) == [], "one point is a light without a size"
    unsaid = open_to(scene, declared(light_grid=-1))
    assert {each.options["light_grid"] for each in unsaid} == set(UNSAID_GRIDS)
    (mine,) = open_to(scene, InHouse(light_grid=8).declaration(Quality()))
    (theirs,) = open_to(scene, PovRay(light_grid=8).declaration(Quality()))
    assert (mine.options["light_grid_shared"], theirs.options["light_grid_shared"]) == (False, True)


def test_leaks_are_admitted_of_a_declared_bias_of_rays() -> None:
    scene = small("thin_wall")
    assert open_to(scene, declared(), "light_leak") == []
    assert open_to(scene, declared(shadow_bias=0.0), "light_leak") == []
    assert open_to(scene, declared(shadow_bias=0.1, shadow_algorithm="map"), "light_leak") == []
    (found,) = open_to(scene, declared(shadow_bias=0.1), "light_leak")
    assert found.under(declared(shadow_bias=0.1)).options["shadow_gap"] == 0.1
    (found,) = open_to(scene, declared(shadow_normal_bias=0.2), "light_leak")
    assert found.under(declared(shadow_normal_bias=0.2)).options["shadow_lift"] == 0.2


def test_lights_that_have_no_such_points_have_no_such_models() -> None:
    assert "light_grid" not in {each.name for each in models(small("penumbra", shape="sphere"))}
    assert not {"light_grid", "light_leak"} & {each.name for each in models(read_scene("acne/sphere"))}
