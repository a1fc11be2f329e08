"""POV-Ray and Mitsuba: their limitations are named and measured alike, and small changes of the scene are bugs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from notabug.adapters.base import Adapter, Quality
from notabug.adapters.inhouse import InHouse
from notabug.metrics.verdict import Finding, Verdict
from notabug.results.record import Result
from notabug.scenes_usd.catalogue import expected
from notabug.scenes_usd.scene import Light, Material, Mesh, Scene

TESSELLATIONS = ("8x4", "16x8", "24x12", "48x24", "96x48")
SPLITS = ("quad", "split02", "split13", "grid15")
EVERYTHING = [
    *(("terminator/sphere", {"tessellation": each}) for each in TESSELLATIONS),
    *(("texture/uneven_quad", {"split": each}) for each in SPLITS),
    ("calibration/card", {}),
]
RENDERERS = ("inhouse", "povray", "mitsuba")
DEFAULT = Quality()
SIDE = 128  # pixels: it takes a quarter of the corpus's to see a fault and to name it


def _adapter(name: str, request: pytest.FixtureRequest) -> Adapter:
    return InHouse() if name == "inhouse" else request.getfixturevalue(name)


@pytest.fixture(params=RENDERERS)
def renderer(request: pytest.FixtureRequest) -> Adapter:
    return _adapter(request.param, request)


@pytest.fixture
def all_three(request: pytest.FixtureRequest) -> list[Adapter]:
    return [_adapter(each, request) for each in RENDERERS]


@pytest.fixture
def verdict_of(studio: Any) -> Callable[..., Verdict]:
    """The verdict on what ``adapter`` draws of ``drawn``, judged as a picture of ``scene``."""

    def judge(adapter: Adapter, scene: Scene, drawn: Scene | None = None, **options: Any) -> Verdict:
        pictures = studio.draw(adapter, drawn or scene, DEFAULT)
        return studio.verdict(pictures, scene, adapter.declaration(DEFAULT), **options)

    return judge


def _limitation(verdict: Verdict, name: str) -> Finding:
    (found,) = (each for each in verdict.findings if each.kind == "limitation")
    assert found.name == name
    return found


@pytest.mark.parametrize(
    ("name", "variants"), [pytest.param(*each, id="-".join([each[0], *each[1].values()])) for each in EVERYTHING]
)
@pytest.mark.sweep_except(
    "inhouse-terminator/sphere-8x4",
    "inhouse-terminator/sphere-16x8",
    "inhouse-terminator/sphere-24x12",
    "inhouse-texture/uneven_quad-quad",
    "inhouse-texture/uneven_quad-split02",
    "inhouse-texture/uneven_quad-grid15",
    "inhouse-calibration/card",
    "povray-terminator/sphere-48x24",
    "povray-texture/uneven_quad-split13",
    "povray-calibration/card",
    "mitsuba-terminator/sphere-96x48",
    "mitsuba-texture/uneven_quad-split13",
    "mitsuba-calibration/card",
)
def test_the_table_beside_the_scene_holds(
    studio: Any, verdict_of: Callable[..., Verdict], renderer: Adapter, name: str, variants: dict[str, str]
) -> None:
    scene = studio.scene(name, **variants)
    table = expected(scene)
    verdict = verdict_of(renderer, scene)
    stated = table.get(renderer.name, table.get("*", ""))
    assert stated, "the table states nothing"
    assert not Result(scene.id, scene.variant, renderer.name, "", verdict, expected=stated).surprising, (
        stated,
        verdict.word,
        [each.name for each in verdict.findings],
        verdict.message,
    )
    assert verdict.numbers["bug_pixels"] <= 8


def test_the_facets_shadow_takes_the_same_area_everywhere(
    studio: Any, verdict_of: Callable[..., Verdict], all_three: list[Adapter]
) -> None:
    scene = studio.scene("terminator/sphere", tessellation="24x12")
    areas = {}
    for adapter in all_three:
        verdict = verdict_of(adapter, scene)
        assert verdict.word == "limitation"
        areas[adapter.name] = _limitation(verdict, "facet_self_shadow").area_px
    print(f"\n{areas}")
    assert max(areas.values()) < 1.1 * min(areas.values())


@pytest.mark.parametrize("renderer", ["inhouse", "povray"], indirect=True)
def test_finer_facets_shadow_less(studio: Any, verdict_of: Callable[..., Verdict], renderer: Adapter) -> None:
    """Woo et al. 1996, section 3: tessellate more finely. The band along the terminator is as wide as its facets."""
    areas = [
        _limitation(
            verdict_of(renderer, studio.scene("terminator/sphere", tessellation=each)), "facet_self_shadow"
        ).area_px
        for each in TESSELLATIONS
    ]
    print(f"\n{renderer.name}: {dict(zip(TESSELLATIONS, areas, strict=True))}")
    assert all(coarse > 1.5 * fine for coarse, fine in pairwise(areas))


@pytest.mark.parametrize("split", ["split02", "split13"])
def test_the_cut_in_the_scene_names_its_diagonal(
    studio: Any, verdict_of: Callable[..., Verdict], renderer: Adapter, split: str
) -> None:
    verdict = verdict_of(renderer, studio.scene("texture/uneven_quad", split=split))
    assert verdict.word == "limitation"
    _limitation(verdict, f"quad_split_{split[-2:]}")


def test_the_quad_is_bilinear_in_house_and_cut_elsewhere(
    studio: Any, verdict_of: Callable[..., Verdict], renderer: Adapter
) -> None:
    verdict = verdict_of(renderer, studio.scene("texture/uneven_quad", split="quad"))
    if renderer.name == "inhouse":
        assert (verdict.word, verdict.findings) == ("pass", ())
    else:
        assert verdict.word == "limitation"
        _limitation(verdict, "quad_split_02")


def test_subdivision_is_ten_times_weaker_than_one_cut(
    studio: Any, verdict_of: Callable[..., Verdict], renderer: Adapter
) -> None:
    """Woo et al. 1996, section 8: 15 x 15 cells make the kinks all but vanish."""
    cut, cells = (
        verdict_of(renderer, studio.scene("texture/uneven_quad", split=each), perceive=True)
        for each in ("split02", "grid15")
    )
    print(f"\n{renderer.name}: {cut.legs['limitation']} {cells.legs['limitation']}")
    assert cells.word in ("pass", "limitation")
    assert cells.legs["limitation"].flip < 0.1 * cut.legs["limitation"].flip
    assert cells.legs["limitation"].itp < 0.1 * cut.legs["limitation"].itp


def test_the_calibration_card_passes(studio: Any, verdict_of: Callable[..., Verdict], renderer: Adapter) -> None:
    verdict = verdict_of(renderer, studio.scene("calibration/card"))
    assert (verdict.word, verdict.findings, verdict.triggers) == ("pass", (), ())


# ---- genuine bugs, made by drawing another scene than the one that is judged


def _lights(scene: Scene, change: Callable[[Light], Light]) -> Scene:
    return replace(scene, lights=tuple(change(each) for each in scene.lights))


def _light_times(factor: float) -> Callable[[Scene], Scene]:
    def brighter(light: Light) -> Light:
        r, g, b = light.intensity
        return replace(light, intensity=(r * factor, g * factor, b * factor))

    return lambda scene: _lights(scene, brighter)


def _light_moved(scene: Scene) -> Scene:
    """By 1 % of its distance from the ball, across the line to it."""

    def moved(light: Light) -> Light:
        position = np.array(light.position)
        to_ball = np.array([0.0, 1.05, 0.0]) - position
        across = np.cross(to_ball, (0.0, 1.0, 0.0))
        position += 0.01 * np.linalg.norm(to_ball) * across / np.linalg.norm(across)
        return replace(light, position=tuple(map(float, position)))

    return _lights(scene, moved)


def _albedo(prim: str, value: float) -> Callable[[Scene], Scene]:
    """The material of that name with ``value`` for the red of its colour, the others in proportion."""

    def one(material: Material) -> Material:
        if not material.path.endswith(prim):
            return material
        r, g, b = material.diffuse
        return replace(material, diffuse=(value, g * value / r, b * value / r))

    return lambda scene: replace(scene, materials=tuple(one(each) for each in scene.materials))


def _half_pixel(scene: Scene) -> Scene:
    """The camera turned about its own up axis until the middle of the picture has moved by half a pixel."""
    angle = np.arctan(scene.camera.tan_x / scene.width)
    turn = np.eye(4)
    turn[[0, 0, 2, 2], [0, 2, 0, 2]] = np.cos(angle), -np.sin(angle), np.sin(angle), np.cos(angle)
    return replace(scene, camera=replace(scene.camera, to_world=turn @ scene.camera.to_world))


def _normals(change: Callable[[Mesh], Any]) -> Callable[[Scene], Scene]:
    def one(mesh: Any) -> Any:
        if not isinstance(mesh, Mesh) or mesh.normals is None:
            return mesh
        normals = change(mesh)
        if normals is not None:
            normals = np.ascontiguousarray(normals / np.linalg.norm(normals, axis=1, keepdims=True))
        return replace(mesh, normals=normals)

    return lambda scene: replace(scene, objects=tuple(one(each) for each in scene.objects))


def _six_flipped(mesh: Mesh) -> Any:
    """The normals at the six vertices nearest to the point of the ball that faces camera and light."""
    towards = np.array([0.45, 0.6, 0.6])
    assert mesh.normals is not None
    distance = np.linalg.norm(mesh.points - mesh.points.mean(axis=0) - towards / np.linalg.norm(towards), axis=1)
    flipped = np.isin(mesh.corners, np.argsort(distance)[:6])
    return np.where(flipped[:, None], -mesh.normals, mesh.normals)


CHANGES: dict[str, tuple[str, Callable[[Scene], Scene], set[str]]] = {
    # renderer, change, names that are right ("unexplained" is always honest)
    "mitsuba-light_1.01": ("mitsuba", _light_times(1.01), {"light_gain"}),
    "mitsuba-light_1.02": ("mitsuba", _light_times(1.02), {"light_gain"}),
    "mitsuba-light_moved": ("mitsuba", _light_moved, {"light_moved"}),
    "mitsuba-sphere_albedo": ("mitsuba", _albedo("Clay", 0.66), {"albedo"}),
    "mitsuba-floor_albedo": ("mitsuba", _albedo("Grey", 0.51), {"light_gain", "albedo"}),
    "mitsuba-half_pixel": ("mitsuba", _half_pixel, {"pixel_shift"}),
    "mitsuba-flat_normals": ("mitsuba", _normals(lambda mesh: None), {"flat_normals"}),
    "mitsuba-six_normals_flipped": ("mitsuba", _normals(_six_flipped), set()),
    "mitsuba-normals_stretched": ("mitsuba", _normals(lambda mesh: mesh.normals * [1.0, 1.0, 1.3]), set()),
    "povray-light_1.01": ("povray", _light_times(1.01), {"light_gain"}),
    "povray-light_1.02": ("povray", _light_times(1.02), {"light_gain"}),
    "povray-light_moved": ("povray", _light_moved, {"light_moved"}),
    "povray-half_pixel": ("povray", _half_pixel, {"pixel_shift"}),
    "povray-six_normals_flipped": ("povray", _normals(_six_flipped), set()),
}


@pytest.mark.parametrize("name", CHANGES)
@pytest.mark.sweep_except(
    "mitsuba-light_1.01",
    "mitsuba-light_moved",
    "mitsuba-sphere_albedo",
    "mitsuba-flat_normals",
    "mitsuba-six_normals_flipped",
    "mitsuba-normals_stretched",
    "povray-light_1.01",
    "povray-half_pixel",
)
def test_a_changed_scene_is_a_bug(
    studio: Any, verdict_of: Callable[..., Verdict], request: pytest.FixtureRequest, name: str
) -> None:
    """Faults put into pictures of real renderers are found."""
    by, change, names = CHANGES[name]
    adapter, whole = _adapter(by, request), studio.scene("terminator/sphere", tessellation="24x12")
    scene = replace(whole, width=SIDE, height=SIDE)
    verdict = verdict_of(adapter, scene, change(scene))
    bug = verdict.findings[0] if verdict.findings else None
    pixels = verdict.numbers["bug_pixels"]
    print(f"\n{name}: {verdict.word} {bug and bug.name} {verdict.triggers} {pixels:.0f} px: {verdict.message}")
    assert verdict.word == "bug"
    assert bug is not None
    assert bug.name in names | {"unexplained"}


def test_povray_without_shadows(studio: Any, verdict_of: Callable[..., Verdict], povray: Any) -> None:
    verdict = verdict_of(replace(povray, shadows=False), studio.scene("terminator/sphere", tessellation="24x12"))
    assert (verdict.word, verdict.findings[0].name) == ("bug", "no_shadow")


def test_two_planes_of_the_same_triangles_are_no_bug(
    verdict_of: Callable[..., Verdict], studio: Any, renderer: Adapter
) -> None:
    """Which plane wins is up to the order in which a renderer meets them: one, but for a wedge, or both by turns."""
    scene = replace(
        studio.scene("visibility/coincident_planes", gap="0", triangulation="same"), width=SIDE, height=SIDE
    )
    verdict = verdict_of(renderer, scene)
    print(f"\n{renderer.name}: {verdict.word} {[each.name for each in verdict.findings]}")
    assert verdict.word in ("pass", "limitation")
