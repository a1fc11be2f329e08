"""Interpolation and lobes are limitations where a renderer declares them, and bugs where not: on a real OpenGL too."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from notabug.adapters.base import Adapter, Quality
from notabug.adapters.inhouse import InHouse
from notabug.adapters.opengl import OpenGL
from notabug.adapters.zbuffer import ZBuffer
from notabug.metrics.verdict import Verdict
from notabug.references.models.phong import with_lobe
from notabug.references.raster.picture import RasterOptions, raster_picture
from notabug.references.tracer.envelope import trace_picture
from notabug.references.tracer.options import Options
from notabug.scenes_usd.scene import Scene

INTERPOLATIONS = ("phong", "gouraud", "flat")
LOBES = ("phong", "blinn")
RENDERERS = ("zbuffer", "opengl")


def small(studio: Any, name: str, **variants: str) -> Scene:
    return replace(studio.scene(name, **variants), width=96, height=96)


def interpolating(name: str, interpolation: Any, request: pytest.FixtureRequest) -> Adapter:
    if name == "zbuffer":
        return ZBuffer(normals=interpolation)
    opengl: OpenGL = request.getfixturevalue("opengl")
    return replace(opengl, interpolation=interpolation)


@pytest.mark.parametrize("interpolation", ["gouraud", "flat"])
def test_in_house_too(studio: Any, interpolation: Any) -> None:
    scene, adapter = small(studio, "phong/interpolation"), InHouse(interpolation=interpolation)
    verdict = verdict_of(studio, adapter, scene)
    assert (verdict.word, [each.name for each in verdict.findings]) == (
        "limitation",
        [f"{interpolation}_interpolation"],
    )


def verdict_of(
    studio: Any, adapter: Adapter, scene: Scene, drawn: Scene | None = None, *, naming: bool = True, **declared: Any
) -> Verdict:
    declaration = replace(adapter.declaration(Quality()), **declared)
    found: Verdict = studio.verdict(studio.draw(adapter, drawn or scene), scene, declaration, naming=naming)
    return found


@pytest.mark.parametrize("renderer", RENDERERS)
@pytest.mark.parametrize("lobe", LOBES)
@pytest.mark.parametrize("interpolation", INTERPOLATIONS)
@pytest.mark.sweep_except("phong-phong-zbuffer", "phong-blinn-opengl", "gouraud-phong-opengl", "flat-phong-zbuffer")
def test_each_interpolation_with_each_lobe(
    studio: Any, request: pytest.FixtureRequest, renderer: str, lobe: str, interpolation: str
) -> None:
    """Woo et al. 1996, Phong versus Phong: two choices, six combinations, and each is named after its interpolation."""
    adapter, scene = interpolating(renderer, interpolation, request), small(studio, "phong/interpolation", lobe=lobe)
    verdict = verdict_of(studio, adapter, scene)
    if interpolation == "phong":
        assert (verdict.word, verdict.findings) == ("pass", ())
        return
    assert (verdict.word, [each.name for each in verdict.findings]) == (
        "limitation",
        [f"{interpolation}_interpolation"],
    )
    undeclared = verdict_of(studio, adapter, scene, interpolation="phong")
    assert undeclared.word == "bug"
    assert undeclared.findings[0].name == {"flat": "flat_normals", "gouraud": "unexplained"}[interpolation]
    other = "flat" if interpolation == "gouraud" else "gouraud"
    assert verdict_of(studio, adapter, scene, interpolation=other, naming=False).word == "bug"


@pytest.mark.parametrize("meshes", ["smooth", "all", "unknown"])
def test_which_meshes_are_lit_at_corners_is_no_matter_where_all_are_smooth(studio: Any, meshes: str) -> None:
    scene, adapter = small(studio, "phong/interpolation"), ZBuffer(normals="gouraud")
    verdict = verdict_of(studio, adapter, scene, gouraud_meshes=meshes)
    assert (verdict.word, [each.name for each in verdict.findings]) == ("limitation", ["gouraud_interpolation"])


@pytest.mark.parametrize("interpolation", ["gouraud", "flat"])
def test_no_interpolation_excuses_another_exponent(
    studio: Any, request: pytest.FixtureRequest, interpolation: str
) -> None:
    adapter, scene = interpolating("opengl", interpolation, request), small(studio, "phong/interpolation")
    sharper = replace(scene, materials=tuple(replace(each, exponent=1.3 * each.exponent) for each in scene.materials))
    verdict = verdict_of(studio, adapter, scene, sharper)
    assert (verdict.word, verdict.findings[0].name) == ("bug", "exponent")


@pytest.mark.parametrize("lobe", LOBES)
def test_the_tracer_and_the_rasteriser_interpolate_alike(studio: Any, lobe: str) -> None:
    """No shadows; two codes, one formula."""
    scene = small(studio, "phong/interpolation", lobe=lobe)
    rasters = raster_picture(scene, RasterOptions(depth="exact", normals="gouraud"))
    traced = trace_picture(scene, Options(shadows="none", gouraud=True))
    assert np.abs(rasters - traced).max() < 1e-6
    assert np.abs(traced - trace_picture(scene, Options(shadows="none"))).max() > 0.05


def test_corners_in_a_real_shadow_stay_dark(studio: Any) -> None:
    """The ball's corners beyond its terminator are dark, and forgiving its facets lights no other."""
    scene = small(studio, "terminator/sphere", tessellation="24x12")
    forgiving, none, facets = (
        trace_picture(scene, Options(shadows=each, gouraud=True)) for each in ("forgiving", "none", "facets")
    )
    index = next(k for k, each in enumerate(scene.meshes) if each.normals is not None)
    ball = studio.predicted(replace(scene, lights=())).ids == index + 1
    assert ball.sum() > 500
    assert (np.abs(forgiving - none).max(axis=2) > 1e-9)[ball].sum() == 0
    assert (np.abs(forgiving - none).max(axis=2) > 1e-2)[~ball].sum() > 50  # on the floor there is a shadow
    assert (facets <= none + 1e-12).all()


@pytest.mark.parametrize("scene_lobe", LOBES)
@pytest.mark.parametrize("at", ["", "_matched"])
def test_the_other_lobe_of_a_real_renderer(studio: Any, opengl: OpenGL, scene_lobe: str, at: str) -> None:
    other = ("blinn" if scene_lobe == "phong" else "phong") + at
    scene = small(studio, "phong/floor_lobes", lobe=scene_lobe, n="32")
    adapter = replace(opengl, lobe=other)
    verdict = verdict_of(studio, adapter, scene)
    assert (verdict.word, [each.name for each in verdict.findings]) == ("limitation", [f"lobe_{other}"])
    assert verdict_of(studio, adapter, scene, lobe="authored", naming=False).word == "bug"


def test_another_exponent_is_no_lobe(studio: Any, opengl: OpenGL) -> None:
    """Also where the other lobe is declared: what lies between the lobes is excused by neither."""
    scene = small(studio, "phong/floor_lobes", lobe="phong", n="32")
    sharper = replace(scene, materials=tuple(replace(each, exponent=1.3 * each.exponent) for each in scene.materials))
    verdict = verdict_of(studio, opengl, scene, sharper)
    assert (verdict.word, verdict.findings[0].name) == ("bug", "exponent")
    verdict = verdict_of(studio, replace(opengl, lobe="blinn"), scene, sharper)
    assert (verdict.word, verdict.findings[0].name) == ("bug", "exponent")


@pytest.mark.parametrize("n", ["8", "32", "128"])
def test_fisher_and_woos_relation_holds_where_view_and_light_agree(studio: Any, n: str) -> None:
    """Phong's n against Blinn's 4n: cos(2a)^n and cos(a)^4n with the light at the viewer; far from it, not alike."""
    scene = small(studio, "phong/lobes", lobe="phong", n=n)
    towards = tuple((-scene.camera.to_world[2, :3]).tolist())
    headlight = replace(scene, lights=(replace(scene.lights[0], direction=towards),))
    a = np.linspace(0.0, np.pi / 4, 2000)
    formula = float(np.abs(np.cos(2 * a) ** float(n) - np.cos(a) ** (4 * float(n))).max())
    apart = {}
    for name, each in (("headlight", headlight), ("aside", scene)):
        bare = trace_picture(replace(each, materials=tuple(replace(m, specular=(0.0,) * 3) for m in each.materials)))
        phong, same, matched = (trace_picture(with_lobe(each, k)) - bare for k in ("phong", "blinn", "blinn_matched"))
        apart[name] = [float(np.abs(other - phong).max() / phong.max()) for other in (same, matched)]
    print(f"\nn = {n}: Blinn n and 4n are apart from Phong n by {apart}, of the peak; formula for 4n {formula:.4f}")
    assert apart["headlight"][1] < 1.1 * formula + 0.01
    assert apart["headlight"][0] > 0.3
    assert apart["aside"][1] > 0.2
