"""Renderers that nobody here wrote, beside POV-Ray and Mitsuba: each passes the card, and its mutants are bugs.

A mutant is the renderer with an edited scene text or job: a coding error that its own code, or our adapter, could have.
Pictures are small: it takes a tenth of the pixels to see these.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from notabug.adapters.babylon import Babylon
from notabug.adapters.base import Adapter, Quality
from notabug.adapters.child_job import Arrays
from notabug.adapters.cycles import Cycles
from notabug.adapters.filament import Filament
from notabug.adapters.luxcore import LuxCore
from notabug.adapters.tachyon import Tachyon
from notabug.adapters.threejs import ThreeJs
from notabug.metrics.verdict import Verdict
from notabug.scenes_usd.scene import Scene

RENDERERS = ("babylon", "cycles", "filament", "luxcore", "panda3d", "pygfx", "tachyon", "threejs", "vtk")
TEXTURED = ("babylon", "cycles", "filament", "luxcore", "panda3d", "pygfx", "threejs", "vtk")
Z_BUFFERS = ("babylon", "panda3d", "pygfx", "threejs", "vtk")
Job = dict[str, Any]


def small(studio: Any, name: str, **variants: str) -> Scene:
    return replace(studio.scene(name, **variants), width=96, height=96)


def verdict_of(studio: Any, adapter: Adapter, scene: Scene, **declared: Any) -> Verdict:
    declaration = replace(adapter.declaration(Quality()), **declared)
    found: Verdict = studio.verdict(studio.draw(adapter, scene), scene, declaration)
    return found


def _check_mutant(studio: Any, mutant: Adapter, what: str, scene: str, names: set[str]) -> None:
    """A renderer with a fault in it is a bug on ``scene``, and has one of ``names`` or none."""
    verdict = verdict_of(studio, mutant, small(studio, scene))
    print(f"\n{mutant.name} {what}: {verdict.word} {[finding.name for finding in verdict.findings]}")
    assert verdict.word == "bug"
    assert verdict.findings[0].name in names | {"unexplained"}


@pytest.mark.parametrize("name", RENDERERS)
def test_the_plain_card_passes(studio: Any, request: pytest.FixtureRequest, name: str) -> None:
    verdict = verdict_of(studio, request.getfixturevalue(name), small(studio, "calibration/plain_card"))
    assert (verdict.word, verdict.findings, verdict.triggers) == ("pass", (), ())


@pytest.mark.parametrize("name", TEXTURED)
def test_the_card_with_a_texture_passes(studio: Any, request: pytest.FixtureRequest, name: str) -> None:
    verdict = verdict_of(studio, request.getfixturevalue(name), small(studio, "calibration/card"))
    assert (verdict.word, verdict.findings, verdict.triggers) == ("pass", (), ())


# ---- what they do differently is named


@pytest.mark.parametrize(
    ("name", "scene", "limitations"),
    [
        ("babylon", "texture/perspective_floor", ["subpixel_grid"]),
        ("cycles", "terminator/sphere", ["facet_self_shadow"]),
        ("filament", "texture/uneven_quad", ["quad_split_02"]),
        ("luxcore", "terminator/sphere", ["facet_self_shadow"]),
        ("panda3d", "phong/interpolation", ["gouraud_interpolation", "lobe_blinn"]),
        ("panda3d", "separation/t_highlight", ["gouraud_interpolation"]),
        ("pygfx", "phong/floor_lobes", ["highlight_cosine", "lobe_blinn", "lobe_normalised_n2over8"]),
        ("tachyon", "terminator/sphere", ["facet_self_shadow"]),
        ("threejs", "texture/perspective_floor", ["subpixel_grid"]),
        ("threejs", "phong/floor_lobes", ["highlight_cosine", "lobe_blinn", "lobe_normalised_n2over8"]),
        ("vtk", "texture/uneven_quad", ["quad_split_02"]),
    ],
)
def test_a_limitation_has_its_name(
    studio: Any, request: pytest.FixtureRequest, name: str, scene: str, limitations: list[str]
) -> None:
    verdict = verdict_of(studio, request.getfixturevalue(name), small(studio, scene))
    assert (verdict.word, sorted(finding.name for finding in verdict.findings)) == ("limitation", limitations)


@pytest.mark.parametrize(("bias", "limitation"), [("0", "shadow_map_acne"), (".3", "shadow_map_detached")])
def test_shadow_maps_of_three_js_are_limitations_by_their_bias(
    studio: Any, threejs: ThreeJs, bias: str, limitation: str
) -> None:
    verdict = verdict_of(studio, replace(threejs, shadow_maps=True), small(studio, "shadow_map/box", bias=bias))
    assert (verdict.word, verdict.findings[0].name) == ("limitation", limitation)


def test_a_bias_with_the_wrong_sign_is_a_bug_of_three_js(studio: Any, threejs: ThreeJs) -> None:
    """All of the picture is black, for which light from below is an explanation as good as any."""

    def negated(job: Job, arrays: Arrays) -> None:
        job["shadow_map"]["bias"] *= -1.0

    mutant = replace(threejs, shadow_maps=True, edit=negated)
    _check_mutant(studio, mutant, "bias_negated", "shadow_map/box", {"shadow_bias_negated", "light_negated"})


# ---- mutants of the renderers that read a job


def _light_times(factor: float) -> Callable[[Job, Arrays], object]:
    def edit(job: Job, arrays: Arrays) -> None:
        for light in job["lights"]:
            light["intensity"] = [factor * value for value in light["intensity"]]

    return edit


def _half_pixel(job: Job, arrays: Arrays) -> None:
    """The camera is turned about its own up axis, until the middle of the picture has moved by half a pixel."""
    angle = math.atan(job["camera"]["tan_x"] / job["width"])
    turn = np.eye(4)
    turn[[0, 0, 2, 2], [0, 2, 0, 2]] = math.cos(angle), -math.sin(angle), math.sin(angle), math.cos(angle)
    job["camera"]["to_world"] = (turn @ np.array(job["camera"]["to_world"])).tolist()


def _gamma_in_colours(job: Job, arrays: Arrays) -> None:
    """Colours that are linear are taken for sRGB, and decoded once more."""
    for material in job["materials"]:
        material["diffuse"] = [value**2.2 for value in material["diffuse"]]


def _normals_upside_down(job: Job, arrays: Arrays) -> None:
    for shape in job["objects"]:
        if "normals" in shape:
            arrays[shape["normals"]] = -arrays[shape["normals"]]


def _uv_swapped(job: Job, arrays: Arrays) -> None:
    for shape in job["objects"]:
        if "uv" in shape:
            arrays[shape["uv"]] = np.ascontiguousarray(arrays[shape["uv"]][:, ::-1])


def _no_highlights(job: Job, arrays: Arrays) -> None:
    for material in job["materials"]:
        material["specular"] = [0.0, 0.0, 0.0]


MUTANTS: dict[str, tuple[str, Callable[[Job, Arrays], object], set[str]]] = {
    # scene, edit, names that are right ("unexplained" is always honest)
    "missing_pi": ("calibration/plain_card", _light_times(math.pi), {"light_gain"}),
    "half_pixel": ("calibration/card", _half_pixel, {"pixel_shift"}),
    "gamma_twice": ("calibration/plain_card", _gamma_in_colours, {"gamma"}),
    "normals_upside_down": ("phong/interpolation", _normals_upside_down, {"normals_flipped"}),
    "uv_swapped": ("texture/perspective_floor", _uv_swapped, {"swapped_uv"}),
    "no_highlights": ("phong/interpolation", _no_highlights, {"specular_missing"}),
}

HIDDEN = {
    ("panda3d", "no_highlights"),  # colours lit at corners hardly show a highlight
    ("babylon", "normals_upside_down"),  # its picture is black but for the rim; see below
}


@pytest.mark.parametrize(
    ("name", "mutant"),
    [(name, mutant) for name in Z_BUFFERS for mutant in MUTANTS if (name, mutant) not in HIDDEN],
)
def test_a_mutant_of_a_z_buffer_is_a_bug(studio: Any, request: pytest.FixtureRequest, name: str, mutant: str) -> None:
    scene, edit, names = MUTANTS[mutant]
    _check_mutant(studio, replace(request.getfixturevalue(name), edit=edit), mutant, scene, names)


# ---- more mutants of the renderers with shaders of their own


def _rounder_highlights(job: Job, arrays: Arrays) -> None:
    for material in job["materials"]:
        material["exponent"] *= 0.7


def _upside_down(job: Job, arrays: Arrays) -> None:
    """The camera's own y axis points down, and its x axis to the left: the picture is turned by half a turn."""
    turn = np.diag([-1.0, -1.0, 1.0, 1.0])
    job["camera"]["to_world"] = (turn @ np.array(job["camera"]["to_world"])).tolist()


SHADERS: dict[str, tuple[str, Callable[[Job, Arrays], object], set[str]]] = {
    "rounder_highlights": ("phong/floor_lobes", _rounder_highlights, {"exponent"}),
    "upside_down": ("calibration/card", _upside_down, {"rotated", "orientation"}),
}


@pytest.mark.parametrize(
    ("name", "mutant"), [(name, mutant) for name in ("babylon", "pygfx", "threejs") for mutant in SHADERS]
)
def test_a_mutant_with_shaders_is_a_bug(studio: Any, request: pytest.FixtureRequest, name: str, mutant: str) -> None:
    scene, edit, names = SHADERS[mutant]
    _check_mutant(studio, replace(request.getfixturevalue(name), edit=edit), mutant, scene, names)


def test_babylons_normals_upside_down_are_a_bug(studio: Any, babylon: Babylon) -> None:
    """Nearly all of the picture is black, for which values cut off at 0 are an explanation as good as any."""
    _check_mutant(
        studio,
        replace(babylon, edit=_normals_upside_down),
        "normals_upside_down",
        "phong/interpolation",
        {"normals_flipped", "clamped"},
    )


# ---- mutants of LuxCore, a path tracer whose own pictures are one row too low


def _no_lambert(job: Job, arrays: Arrays) -> None:
    """The ball's normals are those of a ball that lies elsewhere."""
    for shape in job["objects"]:
        if "normals" in shape:
            arrays[shape["normals"]] = np.ascontiguousarray(np.roll(arrays[shape["normals"]], 1, axis=1))


LUXCORE: dict[str, tuple[str, dict[str, Any], set[str]]] = {
    "its_own_row": ("calibration/plain_card", {"raised": 0.0}, {"pixel_shift"}),
    "missing_pi": ("calibration/plain_card", {"edit": _light_times(math.pi)}, {"light_gain"}),
    "gamma_twice": ("calibration/plain_card", {"edit": _gamma_in_colours}, {"gamma"}),
    "normals_turned": ("terminator/sphere", {"edit": _no_lambert}, set()),
}


@pytest.mark.parametrize("mutant", LUXCORE)
def test_a_mutant_of_luxcore_is_a_bug(studio: Any, luxcore: LuxCore, mutant: str) -> None:
    scene, changes, names = LUXCORE[mutant]
    _check_mutant(studio, replace(luxcore, **changes), mutant, scene, names)


# ---- mutants of Filament, which draws matt surfaces, and of Cycles, which draws them with shadows

FILAMENT: dict[str, tuple[str, dict[str, Any], set[str]]] = {
    "missing_pi": ("calibration/plain_card", {"edit": _light_times(math.pi)}, {"light_gain"}),
    "half_pixel": ("calibration/card", {"edit": _half_pixel}, {"pixel_shift"}),
    "gamma_twice": ("calibration/plain_card", {"edit": _gamma_in_colours}, {"gamma"}),
    "uv_swapped": ("texture/perspective_floor", {"edit": _uv_swapped}, {"swapped_uv"}),
    "upside_down": ("calibration/card", {"edit": _upside_down}, {"rotated", "orientation"}),
    "normals_upside_down": ("acne/sphere", {"edit": _normals_upside_down}, {"normals_flipped", "clamped"}),
    "its_own_far_lamps": ("visibility/near_clip", {"unit": 64.0}, {"black"}),
}

CYCLES: dict[str, tuple[str, dict[str, Any], set[str]]] = {
    "missing_pi": ("calibration/plain_card", {"edit": _light_times(math.pi)}, {"light_gain"}),
    "half_pixel": ("calibration/card", {"edit": _half_pixel}, {"pixel_shift"}),
    "gamma_twice": ("calibration/plain_card", {"edit": _gamma_in_colours}, {"gamma"}),
    "uv_swapped": ("texture/perspective_floor", {"edit": _uv_swapped}, {"swapped_uv"}),
    "normals_turned": ("terminator/sphere", {"edit": _no_lambert}, set()),
}


@pytest.mark.parametrize("mutant", FILAMENT)
def test_a_mutant_of_filament_is_a_bug(studio: Any, filament: Filament, mutant: str) -> None:
    scene, changes, names = FILAMENT[mutant]
    _check_mutant(studio, replace(filament, **changes), mutant, scene, names)


@pytest.mark.parametrize("mutant", CYCLES)
def test_a_mutant_of_cycles_is_a_bug(studio: Any, cycles: Cycles, mutant: str) -> None:
    scene, changes, names = CYCLES[mutant]
    _check_mutant(studio, replace(cycles, **changes), mutant, scene, names)


# ---- mutants of Tachyon, which reads a text


def _times(pattern: str, factor: float) -> Callable[[str], str]:
    """Multiply the number that follows ``pattern``."""
    return lambda text: re.sub(f"({pattern}) (\\S+)", lambda match: f"{match[1]} {float(match[2]) * factor!r}", text)


def _gamma_in_the_text(text: str) -> str:
    """Colours that are linear are taken for sRGB, and decoded once more."""

    def decoded(match: re.Match[str]) -> str:
        return f"color {' '.join(repr(float(value) ** 2.2) for value in match[1].split())} texfunc"

    return re.sub("color ([^a-z]*) texfunc", decoded, text)


def _half_a_pixel_aside(text: str) -> str:
    """The camera looks half a pixel of 96 to its right."""
    looks, ups, zoom = (
        np.array(re.search(f"^{word} (.*)$", text, re.MULTILINE)[1].split(), float)  # type: ignore[index]
        for word in ("viewdir", "updir", "zoom")
    )
    turned = looks + np.cross(looks, ups) * 0.5 / zoom[0] / 96
    return re.sub("viewdir .*", "viewdir " + " ".join(map(repr, turned.tolist())), text)


TACHYON: dict[str, tuple[str, dict[str, Any], set[str]]] = {
    "no_shadows": ("terminator/sphere", {"shadows": False}, {"no_shadow"}),
    "missing_pi": ("calibration/plain_card", {"edit": _times("diffuse", math.pi)}, {"light_gain"}),
    "half_pixel": ("calibration/plain_card", {"edit": _half_a_pixel_aside}, {"pixel_shift"}),
    "exponent": ("phong/floor_lobes", {"edit": _times("phong_size", 1.3)}, {"exponent"}),
    "gamma_twice": ("calibration/plain_card", {"edit": _gamma_in_the_text}, {"gamma"}),
}


@pytest.mark.parametrize("mutant", TACHYON)
def test_a_mutant_of_tachyon_is_a_bug(studio: Any, tachyon: Tachyon, mutant: str) -> None:
    scene, changes, names = TACHYON[mutant]
    _check_mutant(studio, replace(tachyon, **changes), mutant, scene, names)
