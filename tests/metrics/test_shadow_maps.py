"""Verdicts on shadow maps: what a map of that resolution and bias must do is a limitation, all else a bug."""

from __future__ import annotations

from dataclasses import replace
from typing import Any
from unittest import mock

import numpy as np
import pytest

from notabug.adapters.base import Declaration, Quality
from notabug.adapters.zbuffer import ZBuffer
from notabug.references.predict import configured
from notabug.references.raster import picture as rasterising
from notabug.references.raster.shadow_map import ShadowMaps, shadow_maps
from notabug.references.tracer.envelope import trace_picture
from notabug.scenes_usd.scene import Scene, ShadowMap

CENTRES = Quality()
SAMPLED = Quality(samples=16)
SHADOWED = ZBuffer(name="shadowmap", as_lit=True)
NAMES = {"shadow_map_acne", "shadow_map_steps", "shadow_map_detached"}
BOX, SLOPES, WALL = "shadow_map/box", "shadow_map/slopes", "shadow_map/thin_wall"


def small(studio: Any, name: str, said: ShadowMap, size: int = 64) -> Scene:
    scene = studio.scene(name)
    lights = tuple(replace(each, shadow_map=said) for each in scene.lights)
    return replace(scene, width=size, height=size, lights=lights)


def found(verdict: Any) -> tuple[str, set[str]]:
    return verdict.word, {each.name for each in verdict.findings}


def picture_of(studio: Any, scene: Scene, quality: Quality = CENTRES) -> Any:
    return studio.draw(SHADOWED, scene, quality)[0]


@pytest.mark.parametrize(
    ("name", "said", "shown"),
    [
        (BOX, ShadowMap(256, 0.0), "shadow_map_acne"),
        (SLOPES, ShadowMap(256, 0.02), "shadow_map_acne"),
        (WALL, ShadowMap(64, 0.03), "shadow_map_acne shadow_map_steps"),
        (SLOPES, ShadowMap(256, 0.15), "shadow_map_detached"),
        (WALL, ShadowMap(256, 0.2), "shadow_map_detached"),
        (BOX, ShadowMap(256, 0.0, 0.08), "shadow_map_detached"),
    ],
    ids=str,
)
def test_each_is_named(studio: Any, name: str, said: ShadowMap, shown: str) -> None:
    scene = small(studio, name, said)
    word, names = found(studio.verdict([picture_of(studio, scene)], scene, SHADOWED.declaration(CENTRES)))
    assert word == "limitation"
    assert set(shown.split()) <= names <= NAMES


def test_a_fine_map_with_a_fit_bias_shows_nothing(studio: Any) -> None:
    scene = small(studio, BOX, ShadowMap(2048, 0.008))
    assert found(studio.verdict([picture_of(studio, scene)], scene, SHADOWED.declaration(CENTRES))) == ("pass", set())


def test_no_light_at_all_is_no_stripes(studio: Any) -> None:
    """Without a bias stripes may be anywhere, but half of the surface is lit between them."""
    scene = small(studio, BOX, ShadowMap(256, 0.0))
    black = np.zeros_like(picture_of(studio, scene))
    assert studio.verdict([black], scene, SHADOWED.declaration(CENTRES)).word == "bug"


def test_in_means_over_samples_too(studio: Any) -> None:
    scene = small(studio, SLOPES, ShadowMap(128, 0.02), 48)
    word, names = found(studio.verdict([picture_of(studio, scene, SAMPLED)], scene, SHADOWED.declaration(SAMPLED)))
    assert word == "limitation"
    assert "shadow_map_acne" in names <= NAMES


def test_nobody_who_declares_rays_or_nothing_is_excused(studio: Any) -> None:
    scene = small(studio, BOX, ShadowMap(256, 0.0))
    declared = SHADOWED.declaration(CENTRES)
    for said in ("rays", "unknown"):
        verdict = studio.verdict(
            [picture_of(studio, scene)], scene, replace(declared, shadow_algorithm=said), naming=False
        )
        assert verdict.word == "bug"


# --- faults beside ------------------------------------------------------------------------------------------------


def lookup(studio: Any, scene: Scene, change: Any) -> Any:
    """The picture with maps that are drawn as they should be and looked up by views that ``change`` (m, 14) made."""

    def wrong(*arguments: Any) -> ShadowMaps:
        made = shadow_maps(*arguments)
        return made._replace(frame=np.ascontiguousarray(change(made.frame.copy(), made.depth.shape[1])))

    with mock.patch.object(rasterising, "shadow_maps", wrong):
        return studio_draw(studio, scene)


def studio_draw(studio: Any, scene: Scene, adapter: ZBuffer = SHADOWED) -> Any:
    """As ``Studio.draw``, not kept."""
    from notabug.scenes_usd.picture import read_picture

    out = studio.folder / "unkept"
    out.mkdir(exist_ok=True)
    (made,) = adapter.render(scene, out, CENTRES)
    return read_picture(made.image).pixels


def shifted(texels: float) -> Any:
    def change(frame: Any, cells: int) -> Any:
        across = frame[:, 3:6]
        frame[:, 0:3] += texels * 2.0 / cells * across / (across**2).sum(axis=1, keepdims=True)
        return frame

    return change


def transposed(frame: Any, cells: int) -> Any:
    frame[:, 3:9] = np.concatenate([frame[:, 6:9], frame[:, 3:6]], axis=1)
    return frame


def negated(scene: Scene) -> Scene:
    def other(said: ShadowMap) -> ShadowMap:
        return replace(said, bias=-said.bias)

    return replace(scene, lights=tuple(replace(each, shadow_map=other(each.shadow_map)) for each in scene.lights))


def with_bias(scene: Scene, bias: float, resolution: int) -> Scene:
    lights = tuple(replace(each, shadow_map=ShadowMap(resolution, bias)) for each in scene.lights)
    return replace(scene, lights=lights)


WRONG = (
    *("ten texels", "ten texels back", "transposed", "reversed", "no shadow", "bias negated", "ten times the bias"),
    "an eighth of the texels",
)


@pytest.mark.parametrize("fault", ["none", "half a texel", *WRONG])
@pytest.mark.parametrize("name", [BOX, SLOPES])
@pytest.mark.sweep_except(
    "shadow_map/box-reversed",
    "shadow_map/box-bias negated",
    "shadow_map/slopes-none",
    "shadow_map/slopes-half a texel",
    "shadow_map/slopes-ten texels",
    "shadow_map/slopes-ten texels back",
    "shadow_map/slopes-transposed",
    "shadow_map/slopes-no shadow",
    "shadow_map/slopes-ten times the bias",
    "shadow_map/slopes-an eighth of the texels",
)
def test_a_wrong_map_is_a_bug(studio: Any, name: str, fault: str) -> None:
    """A map that is off by half a texel is one that lies elsewhere by half a texel: no picture can tell."""
    if (name, fault) == (BOX, "ten times the bias"):
        name = WALL  # a closed box stands before what a bias lights: its shadow loses three pixels
    scene = small(studio, name, ShadowMap(256, 0.02))
    right = picture_of(studio, scene)
    unshadowed = rasterising.raster_picture(scene, dtype=np.float32)
    pictures = {
        "none": lambda: right,
        "half a texel": lambda: lookup(studio, scene, shifted(0.5)),
        "ten texels": lambda: lookup(studio, scene, shifted(10.0)),
        "ten texels back": lambda: lookup(studio, scene, shifted(-10.0)),
        "transposed": lambda: lookup(studio, scene, transposed),
        "reversed": lambda: unshadowed - right,
        "no shadow": lambda: unshadowed,
        "bias negated": lambda: studio_draw(studio, negated(scene)),
        "ten times the bias": lambda: studio_draw(studio, with_bias(scene, 0.2, 256)),
        "an eighth of the texels": lambda: studio_draw(studio, with_bias(scene, 0.02, 32)),
    }
    verdict = studio.verdict([pictures[fault]()], scene, SHADOWED.declaration(CENTRES), naming=False)
    assert (verdict.word == "bug") == (fault in WRONG)


@pytest.mark.parametrize("fault", ["shadow_map_moved", "shadow_map_reversed", "shadow_bias_negated"])
def test_a_fault_of_a_map_of_endless_resolution_has_its_name(studio: Any, fault: str) -> None:
    scene = small(studio, SLOPES, ShadowMap(256, 0.02))
    model = studio.model(scene, fault)
    picture = trace_picture(*configured(scene, (model,)))
    verdict = studio.verdict([picture], scene, SHADOWED.declaration(CENTRES))
    print(f"\n{fault}: {verdict.word} {[(each.kind, each.name) for each in verdict.findings]}")
    assert verdict.word == "bug"
    assert verdict.findings[0].name in {fault, "black" if fault == "shadow_bias_negated" else fault}


@pytest.mark.parametrize("change", ["dim", "spot", "leak"])
def test_what_a_map_cannot_do_is_a_bug_beside_its_stripes(studio: Any, change: str) -> None:
    """Stripes that are grey, a floor that is darker where no stripe can be, light in the midst of a shadow."""
    scene = small(studio, SLOPES, ShadowMap(256, 0.02))
    tampered = picture_of(studio, scene).copy()
    lit = rasterising.raster_picture(scene, dtype=np.float32)
    dark = (tampered == 0).all(axis=2) & (lit > 0).any(axis=2)
    ramp = tampered.shape[1] // 8
    if change == "dim":
        tampered[:, : 2 * ramp] *= 0.98
    elif change == "spot":
        tampered[50:53, 12:15] = 0.0  # of the level ramp's front, under nothing
    else:
        rows, columns = np.nonzero(dark)
        inside = [
            at for at in zip(rows, columns, strict=True) if dark[at[0] - 2 : at[0] + 3, at[1] - 2 : at[1] + 3].all()
        ]
        y, x = inside[0]
        tampered[y - 1 : y + 1, x - 1 : x + 1] = lit[y - 1 : y + 1, x - 1 : x + 1]
    assert not np.array_equal(tampered, picture_of(studio, scene))
    assert studio.verdict([tampered], scene, SHADOWED.declaration(CENTRES), naming=False).word == "bug"


def test_texels_that_are_weighed_admit_what_lies_between(studio: Any) -> None:
    """The mean of four lookups half a texel apart: right where that is declared, a bug where one texel is."""
    scene = small(studio, BOX, ShadowMap(48, 0.15))
    four = [lookup(studio, scene, across_and_up(right, up)) for right in (-0.5, 0.5) for up in (-0.5, 0.5)]
    picture = np.mean(four, axis=0)
    declared = SHADOWED.declaration(CENTRES)
    assert studio.verdict([picture], scene, declared, naming=False).word == "bug"
    word, names = found(studio.verdict([picture], scene, replace(declared, shadow_filter="linear")))
    assert word == "limitation"
    assert names <= NAMES


def across_and_up(right: float, up: float) -> Any:
    def change(frame: Any, cells: int) -> Any:
        for at, texels in ((3, right), (6, up)):
            axis = frame[:, at : at + 3].copy()
            frame[:, 0:3] += texels * 2.0 / cells * axis / (axis**2).sum(axis=1, keepdims=True)
        return frame

    return change


def test_a_depth_buffer_that_casts_shadows_is_not_excused_without_them(studio: Any) -> None:
    """Where surfaces fight a z-buffer without shadows shows the other one unshadowed; one with shadows does not."""
    from notabug.references.models.model import models

    scene = studio.scene("visibility/standing")
    (fight,) = [each for each in models(scene) if each.when == ("resolves", "depth_fixed24")]
    assert any(each.get("shadows") == "none" for each in fight.others)
    for declaration, unshadowed in (
        (SHADOWED.declaration(CENTRES), False),
        (ZBuffer().declaration(CENTRES), True),
        (replace(SHADOWED.declaration(CENTRES), shadows="unknown"), True),
    ):
        assert isinstance(declaration, Declaration)
        under = fight.under(declaration)
        assert any(each.get("shadows") == "none" for each in under.others) == unshadowed
