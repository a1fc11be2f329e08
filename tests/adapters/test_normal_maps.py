"""Mitsuba and Cycles on normal maps: conventions pass, their own defaults are limitations, a wrong tangent is a bug."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from notabug.adapters.base import Quality
from notabug.adapters.cycles import Cycles
from notabug.adapters.mitsuba import Mitsuba
from notabug.adapters.mitsuba_job import MIRRORED, job
from notabug.metrics.judge import judge
from notabug.references.tracer.envelope import trace_picture
from notabug.references.tracer.options import Options
from notabug.scenes_usd.reader import read_scene
from notabug.scenes_usd.reader_geometry import reversed_order
from notabug.scenes_usd.scene import Scene

CENTRES = Quality(samples=1)


def small(name: str, share: float = 0.5, **variants: str) -> Scene:
    scene = read_scene(f"normal_maps/{name}", variants)
    return replace(scene, width=int(scene.width * share), height=int(scene.height * share))


def judged(stage: Any, adapter: Mitsuba | Cycles, scene: Scene) -> tuple[str, list[str]]:
    picture = stage.draw(adapter, scene)
    verdict = judge([picture], scene, adapter.declaration(CENTRES), perceive=False).verdict
    return verdict.word, [each.name for each in verdict.findings]


@pytest.mark.parametrize(
    ("scene", "settings", "word", "named"),
    [
        ("bumps", {}, "pass", ["mapped_normal_flipped"]),
        ("bumps", {"normal_maps": "unflipped"}, "limitation", ["mapped_normal_black"]),
        ("bumps", {"normal_maps": "softened"}, "limitation", ["bump_terminator_softened", "mapped_normal_flipped"]),
        ("mirrored_uv", {}, "pass", []),
        ("mirrored_uv", {"tangents": "right_handed"}, "bug", ["tangent_handedness"]),
    ],
    ids=lambda x: "-".join(x.values()) if isinstance(x, dict) else None,
)
def test_verdicts(scene: str, settings: dict[str, Any], word: str, named: list[str], stage: Any, mitsuba: Any) -> None:
    found = judged(stage, replace(mitsuba, **settings), small(scene))
    assert (found[0], sorted(found[1])) == (word, named)


def test_each_setting_is_the_tracers(stage: Any, mitsuba: Any) -> None:
    """To float32's last digits, but where an edge passes through a pixel's centre."""
    scene = small("bumps")
    for settings, switches in (
        ({}, {"mapped_away": "flip"}),
        ({"normal_maps": "unflipped"}, {"mapped_away": "black"}),
        ({"normal_maps": "softened"}, {"mapped_away": "flip", "bump_light": "softened"}),
    ):
        drawn = stage.draw(replace(mitsuba, **settings), scene)
        expected = trace_picture(scene, Options(**switches))  # type: ignore[arg-type]
        apart = (np.abs(drawn - expected) > 2e-5 + 1e-3 * expected).any(axis=2)
        assert expected.max() > 0.2
        assert apart.sum() <= 3, settings


def test_an_identity_in_bytes_leans_in_mitsuba_as_specified(stage: Any, mitsuba: Any) -> None:
    plain, bytes_, level = (
        stage.draw(mitsuba, small("identity", 0.25, map=name)) for name in ("none", "bytes", "level")
    )
    assert level == pytest.approx(plain, rel=2e-5, abs=2e-6)
    expected = trace_picture(small("identity", 0.25, map="bytes"), Options(shadows="facets"))
    assert bytes_ == pytest.approx(expected, rel=2e-4, abs=2e-5)
    assert np.abs(bytes_ - plain).max() > 0.004 * plain.max()


def test_mirrored_faces_are_a_shape_with_a_map_of_their_own() -> None:
    scene = small("mirrored_uv", tile="plane")
    document, arrays = job(scene, CENTRES)
    assert [each["look"] for each in document["objects"]] == ["0", f"0{MIRRORED}"]
    own, turned = (document["looks"][name]["preview"] for name in ("0", f"0{MIRRORED}"))
    assert own is not None
    assert turned is not None
    maps = [arrays[document["textures"][str(each["normal_map"])]["pixels"]] for each in (own, turned)]
    assert maps[1] == pytest.approx(np.abs(maps[0] - [0, 1, 0]), abs=1e-7)
    assert len(job(scene, CENTRES, sided=False)[0]["objects"]) == 1
    (tile,) = scene.meshes
    assert tile.uv is not None
    whole = replace(scene, objects=(replace(tile, uv=tile.uv * [-1.0, 1.0]),))
    assert {each["look"] for each in job(whole, CENTRES)[0]["objects"]} == {"0", f"0{MIRRORED}"}


def height_correlated(scene: Scene) -> Scene:
    """``scene`` with the masking that Cycles has."""
    return replace(
        scene,
        materials=tuple(
            each if each.preview is None else replace(each, preview=replace(each.preview, masking="correlated"))
            for each in scene.materials
        ),
    )


CYCLES_SWITCHES = {
    False: {"mapped_away": "keep", "bump_light": "cut"},
    True: {"mapped_away": "raised", "bump_light": "softened_diffuse"},
}
OTHERS = (("mapped_away", ("keep", "flip", "black", "raised")), ("bump_light", ("cut", "lit", "softened", "tamed")))


@pytest.mark.slow
@pytest.mark.parametrize("correction", [False, True])
@pytest.mark.sweep_except("False")
def test_cycles_is_the_tracer_that_it_declares_and_no_other(correction: bool, stage: Any, cycles: Cycles) -> None:
    """To .1 percent of the brightest, and no switch of the tracer can be another: each moves pixels by more."""
    adapter, scene = replace(cycles, bump_correction=correction), small("bumps")
    declared = adapter.declaration(CENTRES)
    switches = CYCLES_SWITCHES[correction]
    assert switches == {name: getattr(declared, name) for name in switches}
    drawn, meant = stage.draw(adapter, scene), height_correlated(scene)

    def off(options: dict[str, str]) -> float:
        expected = trace_picture(meant, Options(**options))  # type: ignore[arg-type]
        return float(np.abs(drawn - expected).max() / expected.max())

    own = off(switches)
    assert own < 2e-3
    for name, ways in OTHERS:
        for way in ways:
            assert way == switches[name] or off(switches | {name: way}) > 3.0 * own, way
    verdict = judge([drawn], scene, declared, perceive=False).verdict
    named = {each.name for each in verdict.findings}
    assert (verdict.word, "bump_terminator_softened" in named) == (("pass", False), ("limitation", True))[correction]


@pytest.mark.slow
def test_the_frame_of_cycles_is_each_triangles(stage: Any, cycles: Cycles) -> None:
    """On a smooth, curved mesh with mirrored coordinates, as the adapter hands dP/du and dP/dv to Cycles."""
    scene = small("mirrored_uv", tile="curved")
    drawn, meant = stage.draw(cycles, scene), height_correlated(scene)

    def wrong(tangents: str) -> int:
        expected = trace_picture(meant, Options(tangents=tangents))  # type: ignore[arg-type]
        return int((np.abs(drawn - expected) > 3e-4 + 2e-3 * expected).any(axis=2).sum())

    assert cycles.declaration(CENTRES).tangents == "triangle"
    assert wrong("triangle") <= 3, "an edge through a pixel's centre"
    assert min(map(wrong, ("interpolated", "cotangent", "right_handed"))) > 50


@pytest.mark.slow
@pytest.mark.parametrize("name", ["mitsuba", "cycles"])
def test_from_behind_a_bump_is_a_dent(name: str, stage: Any, request: pytest.FixtureRequest) -> None:
    """The tile with its faces turned round, as its normals are: what the camera sees is its back."""
    adapter, front = request.getfixturevalue(name), small("mirrored_uv", tile="curved")
    (tile,) = front.meshes
    order = reversed_order(tile.counts)
    assert tile.normals is not None
    assert tile.uv is not None
    back = replace(tile, corners=tile.corners[order], normals=-tile.normals[order], uv=tile.uv[order])
    scene = replace(front, objects=(back,))
    drawn, meant = stage.draw(adapter, scene), height_correlated(scene) if name == "cycles" else scene

    def wrong(**options: bool) -> int:
        expected = trace_picture(meant, Options(**options))  # type: ignore[arg-type]
        return int((np.abs(drawn - expected) > 3e-4 + 2e-3 * expected).any(axis=2).sum())

    assert wrong() <= 3, "an edge through a pixel's centre"
    assert wrong(bumps_behind=True) > 50


@pytest.mark.slow
def test_an_identity_in_bytes_leans_in_cycles_as_specified(stage: Any, cycles: Cycles) -> None:
    scene = small("identity", 0.25, map="bytes")
    drawn, meant = stage.draw(cycles, scene), height_correlated(scene)
    level = height_correlated(small("identity", 0.25, map="level"))
    assert cycles.declaration(CENTRES).normal_level == "127.5"
    assert np.abs(drawn - trace_picture(meant)).max() < 1e-3
    assert np.abs(drawn - trace_picture(level)).max() > 0.004 * drawn.max()
