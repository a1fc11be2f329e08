"""Models: which apply to a scene, what each changes in its picture and what it leaves alone; predict and its cache."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from notabug.references import predict as prediction
from notabug.references.models.light import GAIN
from notabug.references.models.model import Model, models
from notabug.references.predict import configured, predict
from notabug.references.tracer.envelope import trace_picture
from notabug.references.tracer.options import Options
from notabug.scenes_usd import catalogue
from notabug.scenes_usd.reader import read_scene
from notabug.scenes_usd.scene import Emitter, Light, Material, Scene, Shaping, Texture

ANYWHERE = {"geometry_mirrored", "camera_moved", "field_of_view", "aspect"}
LIGHT = ANYWHERE | {
    "light_gain", "no_shadow", "acne", "no_epsilon", "epsilon_too_large", "epsilon_not_scaled",
    "shadow_map_acne", "shadow_map_steps", "shadow_map_detached",
    "shadow_map_reversed", "shadow_map_moved", "shadow_bias_negated",
    "light_colour", "light_moved", "light_up_axis", "light_negated", "shadow_ray_culled", "unshadowed",
}  # fmt: skip
FACES = {"subpixel_grid", "face_missing", "cracks"}  # of meshes; a single triangle has no cracks
POINT = {"falloff_linear", "falloff_none", "shadow_ray_unbounded", "albedo"}  # a point light, and a plain colour
SIZED = {  # a light with a size, exposure, beam and multipliers
    "light_size_ignored", "light_size", "normalize_ignored", "exposure_ignored", "cone_ignored",
    "light_multiplier_ignored", "light_shape", "light_both_sides", "light_cosine_ignored", "light_leak",
}  # fmt: skip
SEVERAL = {  # objects
    "coincident_surfaces", "another_wins", "colour_of_neither", "hole", "loser_wins",
    "object_missing", "materials_exchanged",
}  # fmt: skip
MESHES = {"gouraud_interpolation", "gouraud_pixel_shadows", "gouraud_unshadowed"}
NORMALS = {
    "facet_self_shadow", "silhouette_flip", "silhouette_black", "flat_normals", "normals_not_normalised",
    "flat_interpolation",
    "normals_flipped", "normals_swapped", "normals_lost", "normals_of_first_corner", "normals_up_axis",
    "normals_negated",
}  # fmt: skip
UV = {
    "affine_uv", "swapped_uv", "flipped_v", "shifted_uv",
    "texture_decoded", "texture_encoded", "texture_channels_swapped", "texture_wrap", "texel_centre", "texture_nearest",
    "nearest_texel", "texel_weights",
}  # fmt: skip


def names(scene: Scene) -> set[str]:
    return {each.name for each in models(scene)}


def model(scene: Scene, name: str) -> Model:
    return next(each for each in models(scene) if each.name == name)


def draw(scene: Scene, *applied: Model) -> Any:
    """The picture (h, w) of one channel, at pixel centres."""
    return trace_picture(*configured(scene, applied))[..., 0]


@pytest.fixture(scope="module")
def ball() -> Scene:
    return replace(read_scene("terminator/sphere", {"tessellation": "16x8"}), width=96, height=96)


@pytest.fixture(scope="module")
def quad() -> Scene:
    return replace(read_scene("texture/uneven_quad"), width=96, height=96)


# --- which apply --------------------------------------------------------------------------------------------------


def test_models_follow_from_what_a_scene_holds(make: Any, ball: Scene) -> None:
    assert names(ball) == LIGHT | POINT | MESHES | NORMALS | SEVERAL | FACES
    assert names(replace(ball, lights=())) == ANYWHERE | SEVERAL | FACES
    plain = make.scene([make.rectangle()], [make.point((0, 0, 1))], ball.camera)
    assert names(plain) == LIGHT | POINT | MESHES | FACES


def test_models_of_lights_with_a_size(make: Any, ball: Scene) -> None:
    emitter = Emitter(np.eye(3), exposure=2.0)
    rest = {"diffuse": 0.5, "shaping": Shaping(cone=40.0)}
    sized = Light("/Light", "disk", (1.0, 1.0, 1.0), position=(0.0, 0.0, 3.0), emitter=emitter, **rest)
    found = names(make.scene([make.rectangle()], [sized], ball.camera))
    maps = {each for each in LIGHT if each.startswith("shadow_map") or each == "shadow_bias_negated"}
    assert found == (LIGHT - maps) | SIZED | MESHES | FACES | {"albedo"}
    dome = Light("/Light", "dome", (1.0, 1.0, 1.0), emitter=Emitter())
    placed = {"light_moved", "light_negated", "light_up_axis"}
    found = names(make.scene([make.rectangle()], [dome], ball.camera))
    assert found == LIGHT - maps - placed | MESHES | FACES | {"albedo", "light_leak"}


@pytest.mark.parametrize(
    ("split", "limitations"),
    [
        ("quad", {"quad_split_02", "quad_split_13", "quad_split_shorter"}),
        ("split02", {"quad_split_02"}),
        ("split13", {"quad_split_13"}),
        ("grid15", {"coarse_uv"}),
    ],
)
def test_a_split_is_named_after_its_diagonal(split: str, limitations: set[str]) -> None:
    scene = read_scene("texture/uneven_quad", {"split": split})
    assert names(scene) == LIGHT | MESHES | UV | FACES | limitations
    anywhere = {
        "acne",
        "unshadowed",
        "shadow_map_acne",
        "shadow_map_steps",
        "shadow_map_detached",
        "subpixel_grid",
        "texel_weights",
        *MESHES,
    }
    found = [each for each in models(scene) if each.kind == "limitation" and each.name not in anywhere]
    assert {each.name for each in found} == limitations
    whens = {each.when for each in found}
    cuts = {("ngon_split", each) for each in ("02", "13", "shorter", "fan")}
    assert whens == (cuts if split == "quad" else {None})


def test_where_a_split_moves_no_uv_there_is_none(make: Any) -> None:
    uv = [(0.0, 0.0), (1, 0), (1, 1), (0, 1)]
    texture = Texture(Path("grey"), np.full((2, 2, 3), 0.5))
    textured = Material("/Textured", (0.0, 0, 0), 0)
    camera, light = make.camera((0, 0, 4), (0, 0, 0)), make.point((0, 0, 4))
    flat = make.scene([make.rectangle(0, 1, uv=uv)], [light], camera, materials=(textured,), textures=(texture,))
    border = {"border_not_filtered", "border_filter_lost"}  # the texture repeats, and is seen up to its border
    assert names(flat) == LIGHT | MESHES | POINT - {"albedo"} | UV | FACES | border
    bent = make.rectangle(0, 1, uv=[*uv[:3], (0.2, 0.8)])
    assert "quad_split_02" in names(replace(flat, objects=(bent,)))


def test_every_model_of_the_corpus_is_well_formed() -> None:
    for entry in catalogue.scenes():
        found = list(models(read_scene(entry.id)))
        assert len({(each.name, each.when, each.claim) for each in found}) == len(found)
        for each in found:
            assert each.claim
            assert each.cites
            assert each.rule != "any" or each.kind == "fault"  # or it would excuse everything
            assert each.kind != "convention" or each.rule == "choice"
            # a rule that admits much asks that the picture show something: else it hides bugs
            assert each.rule != "any" or each.shows in ("wide", "dots_everywhere")
            asked = each.rule != "set" or each.kind == "fault" or each.shows != "anything"
            assert asked or each.name in ("shadow_map_steps", "shadow_map_detached")
            assert each.rule in ("set", "hull", "any") or each.shows == "anything"
            assert (each.shows == "crossing") == (each.sure is not None)


# --- what each does -----------------------------------------------------------------------------------------------


def test_light_gain_is_a_factor_everywhere(ball: Scene) -> None:
    assert np.allclose(draw(ball, model(ball, "light_gain")), GAIN * draw(ball), rtol=1e-13, atol=0)


def test_no_shadow_only_brightens_what_was_dark(ball: Scene) -> None:
    before, after = draw(ball), draw(ball, model(ball, "no_shadow"))
    changed = after != before
    assert changed.sum() > 200
    assert (before[changed] == 0).all()


def test_facet_self_shadow_darkens_what_the_reference_spared(ball: Scene) -> None:
    """And nothing else: the shadow on the floor is the same."""
    envelope = predict(ball, cached=False)
    before, after = draw(ball), draw(ball, model(ball, "facet_self_shadow"))
    assert np.array_equal(after != before, envelope.spared_point > 0)
    assert (after[after != before] == 0).all()
    assert (after != before).sum() > 20


def on_ball(scene: Scene) -> Any:
    """Pixels (h, w) whose centre sees the mesh with interpolated normals."""
    (index,) = (k for k, each in enumerate(scene.meshes) if each.normals is not None)
    return predict(replace(scene, lights=()), cached=False).ids == index + 1


@pytest.mark.parametrize("name", ["flat_normals", "normals_not_normalised", "silhouette_flip", "silhouette_black"])
def test_normals_matter_on_the_smooth_mesh_only(ball: Scene, name: str) -> None:
    # from the light's side, where the silhouette is lit
    scene = replace(ball, lights=(replace(ball.lights[0], position=(6.0, 6.0, 8.0)),))
    before, after = draw(scene), draw(scene, model(scene, name))
    changed = np.abs(after - before) > 1e-12
    assert changed.any()
    assert not (changed & ~on_ball(scene)).any()
    if name == "silhouette_black":
        assert (after[changed] == 0).all()
    if name == "normals_not_normalised":
        assert (after[changed] < before[changed]).all()
        assert changed.sum() > 0.8 * (before > 0)[on_ball(scene)].sum()
    if name.startswith("silhouette"):
        assert changed.sum() < 0.05 * on_ball(scene).sum()


@pytest.mark.parametrize("name", ["quad_split_02", "quad_split_13", *sorted(UV - {"texture_wrap"})])
def test_uv_matter_on_the_texture_only(quad: Scene, name: str) -> None:
    before, after = draw(quad), draw(quad, model(quad, name))
    outline = draw(replace(quad, textures=tuple(replace(e, pixels=np.ones_like(e.pixels)) for e in quad.textures))) > 0
    changed = before != after
    assert changed.sum() > 200
    assert not (changed & ~outline).any()


def test_a_pre_split_quad_is_drawn_as_its_limitation_says() -> None:
    """The quad under the limitation 02, and the mesh split02 itself, are one picture; its reference is the quad's."""
    quad, split = (
        replace(read_scene("texture/uneven_quad", {"split": each}), width=64, height=64) for each in ("quad", "split02")
    )
    limited = draw(split, model(split, "quad_split_02"))
    assert np.allclose(limited, draw(quad, model(quad, "quad_split_02")), rtol=1e-12, atol=1e-12)
    assert np.allclose(draw(split), draw(quad), rtol=1e-12, atol=1e-12)
    assert not np.allclose(limited, draw(split), rtol=1e-2, atol=1e-2)


def test_a_shifted_texture_is_shifted_by_one_texel(quad: Scene) -> None:
    shifted, _ = configured(quad, [model(quad, "shifted_uv")])
    for before, after in zip(quad.meshes, shifted.meshes, strict=True):
        assert before.uv is not None
        assert after.uv is not None
        width = quad.textures[0].pixels.shape[1]
        assert np.allclose((after.uv - before.uv) * width, (1, 0))


@pytest.mark.parametrize("reverse", [False, True])
def test_a_faults_switch_wins_over_a_limitations(ball: Scene, reverse: bool) -> None:
    both = [model(ball, "facet_self_shadow"), model(ball, "no_shadow")]
    _, options = configured(ball, both[::-1] if reverse else both)
    assert options.shadows == "none"
    _, options = configured(ball, [both[0], model(ball, "normals_not_normalised")])
    assert (options.shadows, options.normals) == ("facets", "raw")


# --- predict ------------------------------------------------------------------------------------------------------


@pytest.fixture
def traced(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """An empty cache, and the digests of the scenes that were really traced."""
    found: list[str] = []
    real = prediction.trace_envelope

    def trace(scene: Scene, *arguments: Any, **named: Any) -> Any:
        found.append(scene.digest())
        return real(scene, *arguments, **named)

    monkeypatch.setenv("NOTABUG_CACHE", str(tmp_path))
    monkeypatch.setattr(prediction, "trace_envelope", trace)
    return found


@pytest.fixture
def small(ball: Scene) -> Scene:
    return replace(ball, width=24, height=24)


def same(a: Any, b: Any) -> bool:
    first, second = a.arrays(), b.arrays()
    return first.keys() == second.keys() and all(
        first[key].dtype == second[key].dtype and np.array_equal(first[key], second[key]) for key in first
    )


def files(folder: Path) -> list[Path]:
    return sorted(path for path in (folder / "envelopes").rglob("*") if path.is_file())


def test_a_second_prediction_is_the_first_bit_for_bit(small: Scene, traced: list[str], tmp_path: Path) -> None:
    first = predict(small)
    assert same(predict(small), first)
    assert len(traced) == 1
    assert same(predict(small, cached=False), first)
    assert len(traced) == 2
    assert len(files(tmp_path)) == 1


def test_uncached_predictions_leave_nothing(small: Scene, traced: list[str], tmp_path: Path) -> None:
    predict(small, cached=False)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("damage", ["empty", "short", "garbage"])
def test_a_damaged_cache_file_is_made_again(small: Scene, traced: list[str], tmp_path: Path, damage: str) -> None:
    first = predict(small)
    (path,) = files(tmp_path)
    whole = path.read_bytes()
    path.write_bytes({"empty": b"", "short": whole[: len(whole) // 2], "garbage": b"\x80garbage" * 99}[damage])
    assert same(predict(small), first)
    assert len(traced) == 2
    assert path.read_bytes() == whole


def test_the_key_holds_the_scene_the_models_and_the_code(
    small: Scene, traced: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    predict(small)
    light = small.lights[0]
    predict(replace(small, lights=(replace(light, intensity=(1.0, 1.0, 1.0)),)))
    predict(replace(small, materials=tuple(replace(each, diffuse=(0.1, 0.1, 0.1)) for each in small.materials)))
    predict(replace(small, camera=replace(small.camera, tan_x=0.3)))
    predict(small, [model(small, "facet_self_shadow")])
    monkeypatch.setattr(prediction, "SOURCE_HASH", "other code")
    predict(small)
    assert len(traced) == len(files(tmp_path)) == 6
    predict(replace(small, path=Path("elsewhere.usda")))  # where the file lies does not enter
    assert len(traced) == 6


def test_the_cache_forgets_the_oldest(
    small: Scene, traced: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    predict(small)
    (first,) = files(tmp_path)
    monkeypatch.setattr(prediction, "SWEEPS", ("",))  # look after every file
    monkeypatch.setattr(prediction, "CACHE_BYTES", first.stat().st_size * 3 // 2)
    predict(small, [model(small, "no_shadow")])
    (kept,) = files(tmp_path)
    assert kept != first


def test_the_area_of_facet_shadow_falls_as_one_over_the_facets() -> None:
    """terminator/sphere: 7,400 px over the number n of facets around, counting what differs by more than 0.002.

    A facet shadows the smooth surface where its own plane already faces away and the interpolated normal does not:
    beside the terminator, by up to half the angle 2 pi / n between two facets. The band is as long as the terminator
    whatever n is, and as wide as 1/n. Its contrast goes as 1/n, too, so what a threshold leaves out grows with n.
    """
    for n, m in ((8, 4), (16, 8), (24, 12), (48, 24), (96, 48)):
        scene = read_scene("terminator/sphere", {"tessellation": f"{n}x{m}"})
        lost = (trace_picture(scene) - trace_picture(scene, Options(shadows="facets"))).max(axis=2)
        area = int((lost > 0.002).sum())
        print(f"\n{n} x {m}: {area} px, times n {area * n}; any difference: {(lost > 0).sum() * n}")
        assert abs(area * n / 7400 - 1) < 0.05
        assert (lost >= 0).all()
