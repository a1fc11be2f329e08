"""Verdicts on area shadows: what few points or a declared bias must show is a limitation, another penumbra a bug."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from notabug.adapters.base import Quality
from notabug.adapters.inhouse import InHouse
from notabug.adapters.povray import PovRay
from notabug.adapters.povray_scene import scene_text
from notabug.references.tracer.envelope import trace_picture
from notabug.references.tracer.options import Options
from notabug.scenes_usd.emitters import resized
from notabug.scenes_usd.errors import NotabugError
from notabug.scenes_usd.scene import Scene

CENTRES = Quality(samples=1)
PENUMBRA, WALL, NEAR = "area_shadows/penumbra", "area_shadows/thin_wall", "area_shadows/near_light"
SIDE = 32


def small(studio: Any, name: str, side: int = SIDE, **variants: str) -> Scene:
    return replace(studio.scene(name, **variants), width=side, height=side)


def found(verdict: Any) -> tuple[str, set[str]]:
    return verdict.word, {each.name for each in verdict.findings}


def drawn(studio: Any, scene: Scene, renderer: Any, meant: Scene | None = None, **said: Any) -> tuple[str, set[str]]:
    """What is found in ``renderer``'s picture of ``scene``, judged by ``meant``, whose declaration says this too."""
    declaration = replace(renderer.declaration(CENTRES), **said)
    return found(studio.verdict(studio.draw(renderer, scene, CENTRES), meant or scene, declaration))


# --- n x n points -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", [PENUMBRA, WALL, NEAR])
@pytest.mark.sweep_except("area_shadows/penumbra", "area_shadows/near_light")
def test_declared_points_are_a_limitation_and_many_of_them_none(studio: Any, name: str) -> None:
    scene = small(studio, name)
    assert drawn(studio, scene, InHouse(light_grid=4)) == ("limitation", {"light_grid"})
    assert drawn(studio, scene, InHouse()) == ("pass", set())


def test_points_that_nobody_declares_are_found_out(studio: Any) -> None:
    scene = small(studio, PENUMBRA)
    unknown = {"light_grid": -1, "light_grid_shadow": "unknown"}
    assert drawn(studio, scene, InHouse(light_grid=3), **unknown) == ("limitation", {"light_grid"})


@pytest.mark.parametrize("said", [0, 3, 5])
@pytest.mark.sweep_except("0", "5")
def test_other_points_than_are_declared_are_a_bug(studio: Any, said: int) -> None:
    scene = small(studio, NEAR)
    renderer = InHouse(light_grid=4)
    declaration = replace(renderer.declaration(CENTRES), light_grid=said)
    pictures = studio.draw(renderer, scene, CENTRES)
    assert studio.verdict(pictures, scene, declaration, naming=False).word == "bug"


@pytest.mark.parametrize(("factor", "keep"), [(2.0, True), (0.5, True), (0.5, False), (5 / 4, True)])
@pytest.mark.parametrize("points", [0, 4])
@pytest.mark.sweep_except("0-0.5-True", "4-2.0-True")
def test_a_penumbra_of_the_wrong_size_is_a_bug_on_a_grid_too(
    studio: Any, points: int, factor: float, keep: bool
) -> None:
    """A diameter that is read for a radius, and the reverse."""
    scene = small(studio, PENUMBRA)
    wrong = replace(scene, lights=(resized(scene.lights[0], factor, keep_power=keep),))
    word, names = drawn(studio, wrong, InHouse(light_grid=points), scene)
    assert word == "bug"
    if factor != 5 / 4:
        assert "light_size" in names


@pytest.mark.parametrize("unknown", [False, True])
def test_no_unknown_number_of_points_excuses_half_the_size(studio: Any, unknown: bool) -> None:
    scene = small(studio, PENUMBRA)
    wrong = replace(scene, lights=(resized(scene.lights[0], 0.5, keep_power=True),))
    declaration = replace(InHouse().declaration(CENTRES), light_grid=-1 if unknown else 0, light_grid_shadow="unknown")
    assert studio.verdict(studio.draw(InHouse(), wrong, CENTRES), scene, declaration, naming=False).word == "bug"


@pytest.mark.parametrize(
    ("name", "variants", "fault"),
    [
        (PENUMBRA, {}, "light_size_ignored"),
        (PENUMBRA, {}, "light_shape"),
        (PENUMBRA, {"shape": "disk"}, "light_shape"),
        (PENUMBRA, {"shape": "sphere"}, "light_size"),
        (PENUMBRA, {}, "no_shadow"),
        (WALL, {"thick": "0"}, "shadow_ray_culled"),
        (WALL, {}, "normalize_ignored"),
        (NEAR, {}, "light_both_sides"),
        (NEAR, {}, "light_cosine_ignored"),
    ],
    ids=lambda each: each if isinstance(each, str) else "".join(each.values()),
)
@pytest.mark.sweep_except(
    "area_shadows/penumbra--light_shape",
    "area_shadows/thin_wall-0-shadow_ray_culled",
    "area_shadows/thin_wall--normalize_ignored",
    "area_shadows/near_light--light_both_sides",
    "area_shadows/near_light--light_cosine_ignored",
)
def test_a_fault_is_named(studio: Any, name: str, variants: dict[str, str], fault: str) -> None:
    word, names = drawn(studio, small(studio, name, **variants), InHouse(faults=(fault,)))
    assert (word, fault in names) == ("bug", True), names


# --- noise ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("directions", [2, 8])
@pytest.mark.sweep_except("2")
def test_points_chosen_anew_at_each_place_are_noise_and_no_bug(studio: Any, directions: int) -> None:
    """As right in the mean as the reference: too few directions widen what the seeds tell, and no more."""
    scene = small(studio, PENUMBRA)
    quality = Quality(samples=16)
    pictures = [trace_picture(scene, samples=16, seed=seed, directions=directions) for seed in range(4)]
    assert np.std([each.mean() for each in pictures]) > 0
    verdict = studio.verdict(pictures, scene, InHouse().declaration(quality))
    assert verdict.word in ("pass", "inconclusive"), verdict.findings
    wrong = [1.03 * each for each in pictures]
    assert studio.verdict(wrong, scene, InHouse().declaration(quality), naming=False).word == "bug"


# --- biases -----------------------------------------------------------------------------------------------------------


def test_a_leak_is_a_limitation_of_its_declared_bias_alone(studio: Any) -> None:
    scene = small(studio, WALL, 48)
    leaky = InHouse(shadow_bias=0.2)
    assert drawn(studio, scene, leaky) == ("limitation", {"light_leak"})
    pictures = studio.draw(leaky, scene, CENTRES)
    for said in (-1.0, 0.04):
        declaration = replace(leaky.declaration(CENTRES), shadow_bias=said)
        assert studio.verdict(pictures, scene, declaration, naming=False).word == "bug"
    thick = small(studio, WALL, 48, thick=".1")
    assert drawn(studio, thick, InHouse(shadow_bias=0.05)) == ("pass", set())


def test_a_bug_beside_a_leak_stays_one(studio: Any) -> None:
    scene = small(studio, WALL, 48)
    missing = replace(scene, objects=tuple(each for each in scene.objects if each.path != "/Scene/Wall"))
    leaky = InHouse(shadow_bias=0.2)
    pictures = studio.draw(leaky, missing, CENTRES)
    assert studio.verdict(pictures, scene, leaky.declaration(CENTRES), naming=False).word == "bug"


# --- POV-Ray's area_light ---------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def povray() -> PovRay:
    try:
        PovRay().find()
    except NotabugError as error:
        pytest.skip(str(error))
    return PovRay()


@pytest.mark.parametrize("name", [PENUMBRA, WALL, NEAR])
@pytest.mark.parametrize("points", [2, 4, 8])
@pytest.mark.sweep_except("4-area_shadows/penumbra", "2-area_shadows/near_light")
def test_povray_draws_what_is_declared_of_it_to_its_step(studio: Any, povray: PovRay, name: str, points: int) -> None:
    """Wherever a shadow's edge does not decide by rounding: its points share their shadows."""
    scene = small(studio, name)
    (picture,) = studio.draw(replace(povray, light_grid=points), scene, CENTRES)
    predicted = trace_picture(scene, Options(light_grid=points, light_grid_shared=True))
    off = np.abs(picture - predicted).max(axis=2)
    assert (off > 1e-4).sum() <= 2
    each = np.abs(picture - trace_picture(scene, Options(light_grid=points))).max(axis=2)
    assert (each > 1e-3).sum() > 10, "and not by themselves"


def test_povray_takes_powers_of_two(povray: PovRay) -> None:
    """It quarters a light again and again: of 3 x 3 points the middle ones weigh more than the others."""
    with pytest.raises(NotabugError, match="light_grid"):
        replace(povray, light_grid=3)


def test_povray_has_the_limitation(studio: Any, povray: PovRay) -> None:
    assert drawn(studio, small(studio, NEAR), povray) == ("limitation", {"light_grid"})


def test_povrays_points_on_the_lights_edges_are_a_named_bug(studio: Any, povray: PovRay) -> None:
    """As whoever writes the light's size for the axes gets them: its penumbras are a third too wide."""
    scene = small(studio, NEAR)

    def to_edges(text: str) -> str:
        right, wide = (scene_text(each, light_grid=4) for each in (scene, wider))
        before, after = (each.split("area_light ")[1].split(" 4 4 ")[0] for each in (right, wide))
        assert before in text
        return text.replace(before, after)

    wider = replace(scene, lights=(resized(scene.lights[0], 4 / 3, keep_power=True),))
    wrong = replace(povray, edit=to_edges)
    word, names = drawn(studio, scene, wrong)
    assert (word, names) == ("bug", {"light_grid_to_edges"})
