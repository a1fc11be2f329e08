"""Faults of acne and visibility: each is a bug of its own name, none hides behind the limitation of its own scene."""

from __future__ import annotations

from dataclasses import replace
from typing import Any
from unittest import mock

import numpy as np
import pytest

from notabug.adapters.base import Declaration, Quality
from notabug.adapters.inhouse import InHouse
from notabug.adapters.zbuffer import ZBuffer
from notabug.metrics.channels import pixels, put
from notabug.metrics.policy import POLICY, with_value
from notabug.scenes_usd.scene import Mesh, Scene

CENTRES = Quality(samples=1)
NOISY = Quality(samples=16, seeds=(0, 1, 2, 3))
FLOAT32 = Declaration("float32", "point", 0.0, 2.0**-24, relative_quantum=True, noisy=False)
CASES = [
    ("acne/sphere", {}, "no_epsilon"),
    ("acne/grazing_plane", {}, "no_epsilon"),
    ("acne/mirror", {}, "no_epsilon"),
    ("acne/grazing_plane", {}, "epsilon_too_large"),
    ("visibility/standing", {}, "colour_of_neither"),
    ("visibility/standing", {}, "hole"),
    ("visibility/coincident_planes", {}, "colour_of_neither"),
    ("visibility/coincident_planes", {}, "hole"),
    ("visibility/coincident_planes", {"gap": "1e-3"}, "loser_wins"),
]


# of two sheets the lower one everywhere is the picture without the upper one
ALIKE = {("visibility/coincident_planes", "loser_wins"): {"object_missing"}}


def small(scene: Scene, size: int = 128) -> Scene:
    return replace(scene, width=size, height=size)


@pytest.mark.parametrize(
    ("name", "variants", "fault", "quality"),
    # a mean over samples cannot tell a hole or a blend from a mixture of what the limitation admits
    [(*each, CENTRES) for each in CASES]
    + [(*each, NOISY) for each in CASES if each[2] in ("no_epsilon", "loser_wins")],
)
@pytest.mark.sweep_except(
    "acne/sphere-variants0-no_epsilon-quality0",
    "acne/grazing_plane-variants3-epsilon_too_large-quality3",
    "visibility/standing-variants5-hole-quality5",
    "visibility/coincident_planes-variants6-colour_of_neither-quality6",
    "visibility/coincident_planes-variants7-hole-quality7",
    "acne/mirror-variants11-no_epsilon-quality11",
    "visibility/coincident_planes-variants12-loser_wins-quality12",
)
def test_each_is_a_bug_of_its_name(studio: Any, name: str, variants: Any, fault: str, quality: Quality) -> None:
    scene = small(studio.scene(name, **variants), 96 if quality is CENTRES else 64)
    adapter = InHouse(faults=(fault,))
    verdict = studio.verdict(studio.draw(adapter, scene, quality), scene, adapter.declaration(quality))
    print(f"\n{name} {variants} {fault}: {verdict.word} {[each.name for each in verdict.findings]}")
    assert verdict.word == "bug"
    assert verdict.findings[0].name in {fault, *ALIKE.get((name, fault), ())}


def test_a_constant_epsilon_far_from_the_origin(studio: Any) -> None:
    """At an offset of 1000 float32 rounds to 6e-5: 1e-4 is too small where the light grazes, half a pixel would do."""
    scene = small(studio.scene("acne/sphere", world_offset="1e3"), 80)
    adapter = InHouse(precision="float32", faults=("epsilon_not_scaled",))
    verdict = studio.verdict(studio.draw(adapter, scene, CENTRES), scene, adapter.declaration(CENTRES))
    # its dots are also some of those that no epsilon at all would leave: the ranking does not always tell the two apart
    assert verdict.word == "bug"
    assert verdict.findings[0].name in {"epsilon_not_scaled", "no_epsilon"}


def test_a_constant_epsilon_in_a_tiny_scene(studio: Any) -> None:
    """A thousandth of the size: 1e-4 is then as long as the blocks are high, and their shadows are lost."""
    scene = scaled(small(studio.scene("acne/grazing_plane"), 80), 1e-3)
    adapter = InHouse(faults=("epsilon_not_scaled",))
    right = studio.verdict(studio.draw(InHouse(), scene, CENTRES), scene, InHouse().declaration(CENTRES))
    assert right.word == "pass"
    verdict = studio.verdict(studio.draw(adapter, scene, CENTRES), scene, adapter.declaration(CENTRES))
    assert (verdict.word, verdict.findings[0].name) == ("bug", "epsilon_not_scaled")


def scaled(scene: Scene, by: float) -> Scene:
    """``scene`` with everything ``by`` times as large: under distant light the same picture."""
    assert all(light.kind == "distant" for light in scene.lights)
    place = scene.camera.to_world.copy()
    place[3, :3] *= by
    camera = replace(scene.camera, to_world=place, near=scene.camera.near * by, far=scene.camera.far * by)
    meshes = tuple(replace(each, points=each.points * by) for each in scene.objects if isinstance(each, Mesh))
    return replace(scene, objects=meshes, camera=camera)


# --- what the limitations of these scenes must not excuse -----------------------------------------------------------


def support_of_acne(studio: Any, scene: Scene) -> Any:
    """(h, w) where the limitation may act for a float32 renderer, and the reference there."""
    model = studio.model(scene, "acne").under(FLOAT32)
    from notabug.references.predict import predict

    before, after = predict(scene).point, predict(scene, [model]).point
    return (after != before).any(-1), before


def test_dots_where_no_epsilon_helps_are_a_limitation_and_a_band_is_a_bug(studio: Any) -> None:
    """At one sample a pixel, that is: on average over samples acne itself is a narrow band that is half dark."""
    scene = small(studio.scene("acne/sphere", camera_distance="1e3"))
    band, picture = support_of_acne(studio, scene)
    assert 40 < band.sum() < 0.25 * (picture > 0).any(-1).sum()
    dots = band & (np.random.default_rng(3).random(band.shape) < 0.4)
    found = studio.verdict([np.where(dots[..., None], 0.0, picture)], scene, FLOAT32)
    assert (found.word, [each.name for each in found.findings]) == ("limitation", ["acne"])
    for shade in (0.5, 0.0):
        shaded = np.where(band[..., None], shade * picture, picture)
        assert studio.verdict([shaded], scene, FLOAT32, naming=False).word == "bug"


def test_what_facets_explain_is_not_called_dots(studio: Any) -> None:
    """Each would do by itself; the facets leave less open, and say where."""
    scene = small(studio.scene("acne/sphere", camera_distance="1e3"))
    inhouse = InHouse()
    declaration = replace(inhouse.declaration(NOISY), precision="float32", hit_error=2.0**-24)
    found = studio.verdict(studio.draw(inhouse, scene, NOISY), scene, declaration)
    assert (found.word, [each.name for each in found.findings]) == ("limitation", ["facet_self_shadow"])


def test_where_acne_may_be_everywhere_no_picture_can_tell(studio: Any) -> None:
    scene = small(studio.scene("acne/sphere", camera_distance="1e7"))
    band, picture = support_of_acne(studio, scene)
    dots = band & (np.random.default_rng(3).random(band.shape) < 0.4)
    found = studio.verdict([np.where(dots[..., None], 0.0, picture)], scene, FLOAT32)
    assert found.word == "inconclusive"
    assert "no picture can tell here" in found.message
    assert studio.verdict([picture], scene, FLOAT32).word == "pass"
    finer = replace(FLOAT32, precision="float64", hit_error=0.0)
    assert studio.verdict([np.where(dots[..., None], 0.0, picture)], scene, finer, naming=False).word == "bug"


def test_a_decal_that_is_missing_is_no_z_fight(studio: Any) -> None:
    """Raised by a thousandth, the decal is there with everybody; without it the picture is a bug, not a z-fight."""
    scene = small(studio.scene("visibility/coincident_planes", gap="1e-3"))
    without = replace(scene, objects=scene.objects[:1])
    drawn = studio.draw(InHouse(), without, CENTRES)
    verdict = studio.verdict(drawn, scene, FLOAT32)
    assert verdict.word == "bug"
    assert "coincident_surfaces" not in {each.name for each in verdict.findings}


@pytest.mark.parametrize("depth", ["fixed16", "fixed24", "float32", "reversed32"])
def test_one_model_of_resolution_is_admitted(studio: Any, depth: Any) -> None:
    from notabug.metrics.sets import admitted
    from notabug.references.models.model import models

    known = list(models(studio.scene("visibility/near_clip")))
    for declaration in (FLOAT32, replace(FLOAT32, depth=depth)):
        (found,) = (each for each in admitted(known, declaration) if each.name == "coincident_surfaces")
        assert found.when == ("resolves", declaration.resolves)


def test_a_fight_may_be_rare_where_only_depths_are_near(studio: Any) -> None:
    """The 24 bits of a depth buffer span a ball's front and back near its silhouette; the nearer one mostly wins."""
    scene, adapter = studio.scene("acne/with_terminator", camera_distance="1e5"), ZBuffer()
    verdict = studio.verdict(studio.draw(adapter, scene, CENTRES), scene, adapter.declaration(CENTRES))
    assert (verdict.word, [each.name for each in verdict.findings]) == ("limitation", ["coincident_surfaces"])


def test_a_fight_is_not_rare_where_surfaces_coincide(studio: Any) -> None:
    """Fifty pixels at half their value, on spheres whose unlit samples would look so."""
    scene = small(studio.scene("visibility/coincident_spheres"))
    picture = studio.predicted(scene).mean.copy()
    lit = np.flatnonzero((picture > 0.1).all(axis=2))
    picture.reshape(-1, 3)[np.random.default_rng(1).choice(lit, 50, replace=False)] *= 0.5
    assert studio.verdict([picture], scene, studio.box, naming=False).word == "bug"
    with mock.patch("notabug.metrics.structure.POLICY", with_value(POLICY, "rules.least_fought", 0.0)):  # the control
        assert studio.verdict([picture], scene, studio.box, naming=False).word == "limitation"


def test_a_winner_may_be_rare_in_the_samples_of_a_pixel(studio: Any) -> None:
    """A fifth of the samples see the other plane; with only its red mixed in no pixel is on the way to it."""
    scene = small(studio.scene("visibility/coincident_planes", gap="0", triangulation="same"))
    first, other = (studio.predicted(scene, *names).mean for names in ((), ("another_wins",)))
    seen = studio.verdict([first + 0.2 * (other - first)], scene, studio.box, naming=False)
    assert (seen.word, [each.name for each in seen.findings]) == ("limitation", ["coincident_surfaces"])
    dyed = first + np.array([0.2, 0.0, 0.0]) * (other - first)
    assert studio.verdict([dyed], scene, studio.box, naming=False).word == "bug"
    with mock.patch("notabug.metrics.structure.POLICY", with_value(POLICY, "rules.most_between", -1.0)):  # the control
        assert studio.verdict([dyed], scene, studio.box, naming=False).word == "limitation"


def test_the_first_may_win_where_the_other_does_elsewhere(studio: Any) -> None:
    """The order of a hierarchy of boxes has another winner in one of its boxes."""
    scene = small(studio.scene("visibility/coincident_planes", gap="0", triangulation="same"))
    first, other = (studio.predicted(scene, *names).point for names in ((), ("another_wins",)))
    both = np.flatnonzero((other != first).any(axis=2))
    wedge = both[-both.size // 40 :]
    picture = put(other, wedge, pixels(first, wedge))
    verdict = studio.verdict([picture], scene, replace(FLOAT32, coincident="unknown"), naming=False)
    assert (verdict.word, {each.name for each in verdict.findings}) == (
        "limitation",
        {"another_wins", "coincident_surfaces"},
    )


@pytest.mark.parametrize("name", ["coincident_planes", "coincident_spheres"])
@pytest.mark.parametrize("seen", ["first", "another"])
def test_a_fight_may_be_rare_where_it_is_dots(studio: Any, name: str, seen: str) -> None:
    """A depth buffer that holds nearly all depths alike, as Filament's, shows the last drawn but for dots."""
    scene = small(studio.scene(f"visibility/{name}"))
    base, other = (studio.predicted(scene, *names).point for names in ((), ("another_wins",)))
    base, other = (base, other) if seen == "first" else (other, base)
    both = np.flatnonzero((np.abs(other - base) > 0.05).all(axis=2))
    few = both.size // 120
    declared = replace(FLOAT32, coincident="unknown")
    dots = np.random.default_rng(3).choice(both, few, replace=False)
    verdict = studio.verdict([put(base, dots, pixels(other, dots))], scene, declared, naming=False)
    assert (verdict.word, verdict.findings[-1].name) == ("limitation", "coincident_surfaces")
    wedge = both[both.size // 2 :][:few]  # on spheres, where the last bits differ, it may be a fight
    for wrong, value in [(dots, 0.5 * other), *([(wedge, other)] if name == "coincident_planes" else [])]:
        verdict = studio.verdict([put(base, wrong, pixels(value, wrong))], scene, declared, naming=False)
        assert verdict.word == "bug"
