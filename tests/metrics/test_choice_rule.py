"""The structural rules: what a limitation excuses, and what it does not although it lies between two right pictures."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from scipy import ndimage

from notabug.metrics.verdict import Verdict
from notabug.scenes_usd.scene import Scene

Floats = npt.NDArray[np.floating]


@pytest.fixture(scope="module")
def quad(studio: Any) -> Scene:
    return studio.scene("texture/uneven_quad", split="quad")


@pytest.fixture(scope="module")
def ball(studio: Any) -> Scene:
    return studio.scene("terminator/sphere", tessellation="24x12")


def _between(studio: Any, scene: Scene, model: str, alpha: float | Floats, kind: str = "point") -> Floats:
    """The picture at ``alpha`` between the reference (0) and ``model`` (1)."""
    reference, other = (getattr(each, kind) for each in (studio.predicted(scene), studio.predicted(scene, model)))
    return reference + alpha * (other - reference)


def _names(verdict: Verdict) -> list[str]:
    return [each.name for each in verdict.findings]


# ---- choice: all or nothing


@pytest.mark.parametrize("diagonal", ["02", "13"])
@pytest.mark.parametrize("kind", ["point", "box"])
def test_a_choice_admits_the_whole_other_picture(studio: Any, quad: Scene, diagonal: str, kind: str) -> None:
    declaration = replace(getattr(studio, kind), ngon_split=diagonal)
    name = f"quad_split_{diagonal}"
    verdict = studio.verdict([_between(studio, quad, name, 1.0, kind.replace("box", "mean"))], quad, declaration)
    assert (verdict.word, _names(verdict)) == ("limitation", [name])


@pytest.mark.parametrize("alpha", [0.1, 0.25, 0.5, 0.75, 0.9])
def test_a_choice_admits_nothing_between(studio: Any, quad: Scene, alpha: float) -> None:
    declaration = replace(studio.point, ngon_split="02")
    picture = _between(studio, quad, "quad_split_02", alpha)
    assert studio.verdict([picture], quad, declaration, naming=False).word == "bug"


def test_a_choice_holds_for_the_whole_object(studio: Any, quad: Scene) -> None:
    """The left half cut, the right half not: no algorithm does that."""
    left = (np.arange(quad.width) < quad.width / 2)[None, :, None].astype(float)
    declaration = replace(studio.point, ngon_split="unknown")
    picture = _between(studio, quad, "quad_split_02", left)
    assert studio.verdict([picture], quad, declaration, naming=False).word == "bug"


@pytest.mark.parametrize(("shown", "declared"), [("02", ""), ("13", ""), ("13", "02"), ("02", "13")])
def test_another_cut_than_declared_is_a_bug(studio: Any, quad: Scene, shown: str, declared: str) -> None:
    picture = studio.predicted(quad, f"quad_split_{shown}").point
    verdict = studio.verdict([picture], quad, replace(studio.point, ngon_split=declared), naming=False)
    assert verdict.word == "bug"


def test_unknown_making_may_have_either_cut(studio: Any, quad: Scene) -> None:
    declaration = replace(studio.point, ngon_split="unknown")
    for diagonal in ("02", "13"):
        verdict = studio.verdict([studio.predicted(quad, f"quad_split_{diagonal}").point], quad, declaration)
        assert (verdict.word, _names(verdict)) == ("limitation", [f"quad_split_{diagonal}"])


@pytest.mark.parametrize(("scene", "shown"), [("split02", "13"), ("split13", "02")])
def test_the_other_cut_than_the_scenes_is_a_bug(studio: Any, quad: Scene, scene: str, shown: str) -> None:
    cut = studio.scene("texture/uneven_quad", split=scene)
    picture = studio.predicted(quad, f"quad_split_{shown}").point
    declaration = replace(studio.point, ngon_split="unknown")
    assert studio.verdict([picture], cut, declaration, naming=False).word == "bug"


def test_the_intent_itself_passes_where_the_scene_is_cut(studio: Any, quad: Scene) -> None:
    """A renderer that undoes the cut shows what was meant."""
    cut = studio.scene("texture/uneven_quad", split="split02")
    verdict = studio.verdict([studio.predicted(quad).point], cut, studio.point)
    assert (verdict.word, verdict.findings) == ("pass", ())


# ---- partial: any value on the segment, and nothing beside it


@pytest.fixture(scope="module")
def full_area(studio: Any, ball: Scene) -> float:
    verdict = studio.verdict([_between(studio, ball, "facet_self_shadow", 1.0)], ball, studio.point)
    return float(verdict.findings[0].area_px)


@pytest.mark.parametrize("alpha", [0.4, 0.5, 0.75, 1.0])
def test_part_of_the_facets_shadow_is_still_that_limitation(
    studio: Any, ball: Scene, full_area: float, alpha: float
) -> None:
    """Workarounds take part of it away; the area counts what is left."""
    verdict = studio.verdict([_between(studio, ball, "facet_self_shadow", alpha)], ball, studio.point)
    assert (verdict.word, _names(verdict)) == ("limitation", ["facet_self_shadow"])
    assert verdict.findings[0].area_px == pytest.approx(alpha * full_area, rel=0.02)


def test_a_workaround_may_clear_half_of_the_pixels(studio: Any, ball: Scene, full_area: float) -> None:
    cleared = np.random.default_rng(1).random((ball.height, ball.width, 1)) < 0.5
    verdict = studio.verdict([_between(studio, ball, "facet_self_shadow", 1.0 - cleared)], ball, studio.point)
    assert (verdict.word, _names(verdict)) == ("limitation", ["facet_self_shadow"])
    assert verdict.findings[0].area_px == pytest.approx(0.5 * full_area, rel=0.15)


@pytest.mark.parametrize("alpha", [-0.3, 1.3])
def test_beyond_the_segment_is_a_bug(studio: Any, ball: Scene, alpha: float) -> None:
    """Negative light is refused before; brighter than the reference is no shadow."""
    picture = _between(studio, ball, "facet_self_shadow", alpha)
    assert studio.verdict([picture], ball, studio.point, naming=False).word == "bug"


@pytest.fixture(scope="module")
def lit(studio: Any, ball: Scene) -> tuple[int, int]:
    """A pixel (y, x) on the ball's lit side, six pixels or more from every edge and from the limitation's support."""
    reference, limited = studio.predicted(ball), studio.predicted(ball, "facet_self_shadow")
    red = reference.point[..., 0] > 1.05 * reference.point[..., 2]  # clay, not grey
    support = np.abs(limited.mean - reference.mean).max(axis=2) > 1e-4
    inside = red & ~support & ~reference.edge & (reference.point[..., 0] > 0.3 * reference.point[..., 0].max())
    depth = ndimage.distance_transform_edt(inside)
    assert depth.max() > 6
    y, x = np.unravel_index(int(depth.argmax()), depth.shape)
    return int(y), int(x)


@pytest.mark.parametrize("size", [1, 2, 4])
@pytest.mark.parametrize("factor", [0.0, 0.9, 1.1])
@pytest.mark.sweep_except("0.0-1", "0.9-1", "0.9-4", "1.1-2")
def test_a_blotch_outside_the_support_is_a_bug(
    studio: Any, ball: Scene, lit: tuple[int, int], size: int, factor: float
) -> None:
    picture = _between(studio, ball, "facet_self_shadow", 1.0)
    y, x = lit
    picture[y : y + size, x : x + size] *= factor
    verdict = studio.verdict([picture], ball, studio.point, naming=(size, factor) == (4, 1.1))
    assert verdict.word == "bug"
    assert verdict.findings[0].region == (x, y, x + size, y + size)
    assert verdict.findings[0].area_px == size * size
    assert "facet_self_shadow" in _names(verdict)


@pytest.mark.parametrize("tint", [(1.0, 0.0, 0.0), (3.0, 3.0, 3.0)])
def test_a_blotch_inside_the_support_is_a_bug_unless_it_is_a_shadow(
    studio: Any, ball: Scene, tint: tuple[float, float, float]
) -> None:
    """Off the segment in colour, or beyond its lit end."""
    reference = studio.predicted(ball).point
    picture = _between(studio, ball, "facet_self_shadow", 1.0)
    shadowed = np.abs(picture - reference).max(axis=2) > 0.03
    assert shadowed.sum() > 60
    picture[shadowed] = reference[shadowed] * tint
    assert studio.verdict([picture], ball, studio.point, naming=False).word == "bug"


def test_fifty_wrong_pixels_are_a_bug(studio: Any, ball: Scene) -> None:
    picture = _between(studio, ball, "facet_self_shadow", 1.0)
    lit = np.argwhere(picture.min(axis=2) > 0.1)
    y, x = np.random.default_rng(2).permutation(lit)[:50].T
    picture[y, x] *= 1.05
    verdict = studio.verdict([picture], ball, studio.point, naming=False)
    assert verdict.word == "bug"
    assert 40 <= verdict.findings[0].area_px <= 50


@pytest.mark.parametrize("gain", [0.98, 0.99, 1.01, 1.02])
def test_one_percent_of_light_is_a_bug_inside_a_limitation_scene(studio: Any, ball: Scene, gain: float) -> None:
    picture = gain * _between(studio, ball, "facet_self_shadow", 1.0)
    verdict = studio.verdict([picture], ball, studio.point)
    assert (verdict.word, verdict.findings[0].name) == ("bug", "light_gain")
    assert f"{gain:.4g}" in verdict.message


def test_within_the_stated_tolerance_nothing_is_wrong(studio: Any, ball: Scene) -> None:
    picture = 1.003 * _between(studio, ball, "facet_self_shadow", 1.0)
    assert studio.verdict([picture], ball, studio.point).word == "limitation"
    assert studio.verdict([picture], ball, studio.point, tolerance=0.001, naming=False).word == "bug"


@pytest.mark.parametrize("name", ["terminator/sphere", "texture/uneven_quad", "calibration/card"])
def test_a_few_pixels_beside_an_edge_may_see_the_other_side(studio: Any, name: str) -> None:
    """Two renderers' last bits: up to eight pixels at edges, and not one elsewhere."""
    scene = studio.scene(name)
    envelope = studio.predicted(scene)
    picture = envelope.point.copy()
    neighbour = picture[:, 1:]
    outside = np.maximum(envelope.lo[:, :-1] - neighbour, neighbour - envelope.hi[:, :-1]).max(axis=2) > 0.02
    y, x = np.argwhere(outside & (envelope.ids[:, 1:] != envelope.ids[:, :-1]))[::3][:20].T
    assert y.size > 8
    for count, word in ((8, "pass"), (y.size, "bug")):
        swapped = picture.copy()
        swapped[y[:count], x[:count]] = picture[y[:count], x[:count] + 1]
        assert studio.verdict([swapped], scene, studio.point, naming=False).word == word, count
