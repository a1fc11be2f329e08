"""Normal maps against formulas written anew: frames of tangents, and what becomes of view and light behind a normal."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from notabug.references.models.model import models
from notabug.references.models.normal_maps import mirrored, of_bytes
from notabug.references.predict import configured
from notabug.references.tracer.envelope import trace_picture
from notabug.references.tracer.options import Options
from notabug.references.tracer.tangents import corner_tangents
from notabug.scenes_usd.reader import read_scene
from notabug.scenes_usd.scene import Material, Preview, Scene, Texture

Floats = npt.NDArray[np.float64]

ALBEDO = np.array([0.8, 0.5, 0.1])
ROUGHNESS, F0 = 0.6, 0.04
NORMALS = {
    "mapped_normal_flipped", "mapped_normal_raised", "mapped_normal_black", "bump_light_leak",
    "bump_terminator_softened", "tangents_interpolated", "tangents_cotangent", "normal_map_in_world_space",
    "mapped_normal_not_normalised", "normal_green_flipped", "normal_red_flipped", "normal_map_ignored",
    "normal_unscaled", "normal_map_as_srgb",
}  # fmt: skip


def unit(v: Any) -> Floats:
    return np.asarray(v, float) / float(np.linalg.norm(v))


def parts(N: Floats, L: Floats, V: Floats) -> tuple[Floats, Floats]:
    """The diffuse and the glossy radiance of unit irradiance: a dielectric of ior 1.5 as its specification has it."""
    nl, nv, H = float(N @ L), float(N @ V), unit(L + V)
    if nl <= 0:
        return np.zeros(3), np.zeros(3)
    fresnel = F0 + (1.0 - F0) * (1.0 - float(V @ H)) ** 5
    diffuse = ALBEDO * (1.0 - fresnel) * nl / math.pi
    if nv <= 0:
        return diffuse, np.zeros(3)
    alpha2 = ROUGHNESS**4
    d = alpha2 / (math.pi * (float(N @ H) ** 2 * (alpha2 - 1.0) + 1.0) ** 2)
    masking = [2.0 * x / (x + math.sqrt(alpha2 + (1.0 - alpha2) * x * x)) for x in (nl, nv)]
    return diffuse, np.full(3, d * masking[0] * masking[1] * fresnel / (4.0 * nv))


def said(vector: Any) -> Texture:
    return Texture(Path("map.exr"), np.asarray(vector, float).reshape(1, 1, 3))


def floor(make: Any, vector: Any, light: Any, eye: Any, uv: Any = ((0, 0), (1, 0), (1, 1), (0, 1))) -> Scene:
    """One floor z = 0 from -2 to 2 whose map says ``vector`` everywhere, under a distant light from ``light``."""
    look = Material("/Look", tuple(ALBEDO), preview=Preview(roughness=ROUGHNESS, normal_map=0))
    made: Scene = make.scene(
        [make.rectangle(size=2.0, uv=list(uv))],
        [make.distant(tuple(-unit(light)))],
        make.camera(eye, (0.0, 0.0, 0.0), tangent=0.05),
        size=3,
        materials=(look,),
        textures=(said(vector),),
    )
    return made


def middle(scene: Scene, **switches: Any) -> Floats:
    return np.asarray(trace_picture(scene, Options(**switches)))[1, 1]


UP = np.array([0.0, 0.0, 1.0])
EYE = (0.3, -3.0, 0.9)  # 17 degrees above the floor
AWAY = (0.1, 0.9, 0.5)  # leans away from it by 61 degrees
LIGHTS = {"over": (0.4, 1.0, 1.2), "low": (-0.8, 0.9, 0.15), "behind": (0.2, 1.5, -0.2)}


# --- the viewer on the other side of the mapped normal ------------------------------------------------------------


@pytest.mark.parametrize("light", LIGHTS)
def test_what_faces_away_is_kept_turned_or_black(light: str, make: Any) -> None:
    L, V, N = unit(LIGHTS[light]), unit(EYE), unit(AWAY)
    scene = floor(make, AWAY, L, EYE)
    assert N @ V < 0 < UP @ V
    above = float(UP @ L > 0)
    assert middle(scene) == pytest.approx(above * parts(N, L, V)[0], rel=1e-12), "no facet reflects"
    turned = N * [-1.0, -1.0, 1.0]
    expected = above * sum(parts(turned, L, V))
    assert middle(scene, mapped_away="flip") == pytest.approx(expected, rel=1e-12)
    assert not middle(scene, mapped_away="black").any()


@pytest.mark.parametrize("way", ["flip", "black", "raised"])
def test_what_faces_the_viewer_stays(way: str, make: Any) -> None:
    scene = floor(make, (0.2, -0.3, 0.9), LIGHTS["over"], EYE)
    assert np.array_equal(middle(scene, mapped_away=way), middle(scene))


@pytest.mark.parametrize("vector", [AWAY, (0.0, 0.5, 0.8), (-0.6, 0.6, 0.5)])
def test_a_raised_normal_mirrors_the_view_just_above_the_facet(vector: Any, make: Any) -> None:
    """Found by bisection along the arc from the mapped normal to the facet's, not by the quadratic of the kernel."""
    L, V, N = unit(LIGHTS["over"]), unit(EYE), unit(vector)
    least = min(0.9 * float(V @ UP), 0.01)

    def mirror(normal: Floats) -> float:
        return float((2.0 * (normal @ V) * normal - V) @ UP)

    assert mirror(N) < least
    low, high = 0.0, 1.0  # of the way to the facet's normal
    for _ in range(200):
        half = 0.5 * (low + high)
        low, high = (half, high) if mirror(unit((1 - half) * N + half * UP)) < least else (low, half)
    raised = unit((1 - high) * N + high * UP)
    scene = floor(make, vector, L, EYE)
    expected = parts(N, L, V)[0] + parts(raised, L, V)[1]
    assert middle(scene, mapped_away="raised") == pytest.approx(expected, rel=1e-9)
    assert expected.max() > 1.01 * middle(scene).max()


# --- light on the other side of the surface -------------------------------------------------------------------------


def test_light_from_behind_the_surface_is_cut_or_leaks(make: Any) -> None:
    eye, vector = (0.3, -2.0, 2.0), (0.0, 0.8, 0.4)
    L, V, N = unit(LIGHTS["behind"]), unit(eye), unit(vector)
    scene = floor(make, vector, L, eye)
    assert UP @ L < 0 < N @ L
    assert not middle(scene).any()
    assert middle(scene, bump_light="lit") == pytest.approx(sum(parts(N, L, V)), rel=1e-12)
    hidden = replace(scene, objects=(*scene.objects, make.rectangle(-0.5, 9.0)))
    assert not middle(hidden, bump_light="lit").any(), "something is in its way"


@pytest.mark.parametrize("degrees", [3.0, 20.0, 60.0])
def test_light_fades_as_the_papers_say(degrees: float, make: Any) -> None:
    """Estevez, Lecocq and Stein 2019, listing 1; Chiang, Li and Burley 2019, section 2."""
    turn = math.radians(degrees)
    eye, vector = (0.3, -2.0, 2.0), (0.5, 0.4, 0.7)
    L, V, N = np.array([math.cos(turn), 0.0, math.sin(turn)]), unit(eye), unit(vector)
    scene = floor(make, vector, L, eye)
    diffuse, glossy = parts(N, L, V)
    lean = math.acos(float(N @ UP))
    alpha2 = min(0.125 * math.tan(lean) ** 2, 1.0)
    soft = 2.0 / (1.0 + math.sqrt(1.0 + alpha2 / math.tan(turn) ** 2))
    g = math.sin(turn) / (float(N @ L) * math.cos(lean))
    tame = 1.0 if g >= 1.0 else -(g**3) + g**2 + g
    assert middle(scene) == pytest.approx(diffuse + glossy, rel=1e-12)
    assert middle(scene, bump_light="softened") == pytest.approx(soft * (diffuse + glossy), rel=1e-12)
    assert middle(scene, bump_light="softened_diffuse") == pytest.approx(soft * diffuse + glossy, rel=1e-12)
    assert middle(scene, bump_light="tamed") == pytest.approx(tame * (diffuse + glossy), rel=1e-12)


# --- frames of tangents -----------------------------------------------------------------------------------------------

SKEWED = ((0.0, 0.0), (1.0, 0.2), (1.5, 2.2), (0.5, 2.0))  # a parallelogram: s and t are not square to each other
VECTOR = (0.4, -0.3, 0.8)


@pytest.mark.parametrize("turned", [False, True], ids=["as its corners", "mirrored"])
def test_frames_of_skewed_coordinates(turned: bool, make: Any) -> None:
    """On a floor P = A (s, t) + c: the columns of A are dP/ds and dP/dt, the rows of its inverse their gradients."""
    uv = np.array(SKEWED) * ([-1.0, 1.0] if turned else [1.0, 1.0])
    eye = (0.3, -1.0, 2.0)
    L, V = unit(LIGHTS["over"]), unit(eye)
    scene = floor(make, VECTOR, L, eye, uv)
    to_uv = np.array([uv[1] - uv[0], uv[3] - uv[0]]).T / 4.0
    along, up = np.linalg.inv(to_uv).T

    def lit(T: Any, B: Any, size: float = 0.0) -> Floats:
        normal = VECTOR[0] * np.append(T, 0.0) + VECTOR[1] * np.append(B, 0.0) + VECTOR[2] * UP
        return np.asarray(sum(parts(normal if size else unit(normal), L, V)))

    T = unit(along)
    B = unit(up - (up @ T) * T)
    assert middle(scene) == pytest.approx(lit(T, B), rel=1e-12)
    assert middle(scene, tangents="interpolated") == pytest.approx(lit(T, B), rel=1e-12), "alike at every corner"
    longest = max(np.linalg.norm(row) for row in to_uv)
    assert middle(scene, tangents="cotangent") == pytest.approx(lit(*(to_uv / longest)), rel=1e-12)
    side = -1.0 if turned else 1.0
    assert middle(scene, tangents="right_handed") == pytest.approx(lit(T, side * B), rel=1e-12)
    assert middle(scene, tangents="world") == pytest.approx(sum(parts(unit(VECTOR), L, V)), rel=1e-12)


def test_a_mapped_normal_that_is_not_normalised_scales_diffuse_light(make: Any) -> None:
    scene = floor(make, np.array(VECTOR) * 0.5, LIGHTS["over"], (0.3, -1.0, 2.0))
    matt = replace(scene.materials[0], preview=Preview(specular_workflow=True, normal_map=0, roughness=ROUGHNESS))
    scene = replace(scene, materials=(matt,))
    short = float(np.linalg.norm(np.array(VECTOR) * 0.5))
    drawn = trace_picture(scene, Options(raw_mapped=True))[1, 1]
    L, V, N = unit(LIGHTS["over"]), unit((0.3, -1.0, 2.0)), unit(VECTOR)
    fresnel = (1.0 - float(V @ unit(L + V))) ** 5
    diffuse = ALBEDO * (1.0 - fresnel) * float(N @ L) / math.pi
    assert drawn == pytest.approx(short * diffuse, rel=0.2), "and what grazing light adds"
    assert middle(scene) == pytest.approx(diffuse, rel=0.2)


def test_tangents_at_corners_follow_the_surface() -> None:
    """On a paraboloid of 24 by 24 cells they are its derivative along s, within the angle that a cell turns by."""
    scene = read_scene("normal_maps/mirrored_uv", {"tile": "curved"})
    (tile,) = scene.meshes
    found = corner_tangents(tile)
    assert np.linalg.norm(found, axis=1) == pytest.approx(1.0, abs=1e-12)
    assert tile.normals is not None
    assert np.abs((found * tile.normals).sum(axis=1)).max() < 1e-12, "square to the normal"
    x, y = tile.points[tile.corners, 0], tile.points[tile.corners, 1]
    side = np.repeat(np.where(x.reshape(-1, 3).mean(axis=1) < 0, -1.0, 1.0), 3)  # s grows from the middle to both sides
    along = np.stack([side, 0.0 * x, -0.5 * x * side], axis=1)  # of (x, y, .5 (1 - (x^2 + y^2) / 2))
    slope = np.stack([0.5 * x, 0.5 * y, np.ones_like(x)], axis=1)
    along -= (along * slope).sum(axis=1, keepdims=True) / (slope**2).sum(axis=1, keepdims=True) * slope
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    inner = (np.abs(x) < 0.9) & (np.abs(y) < 0.9) & (np.abs(x) > 0.1)  # around a corner at a rim there are half as many
    assert (found * along).sum(axis=1)[inner].min() > math.cos(math.radians(0.2))
    assert (found * along).sum(axis=1).min() > math.cos(math.radians(3.0)), "also along the middle: sides are not mixed"


# --- models -----------------------------------------------------------------------------------------------------------


def test_they_apply_to_meshes_with_a_normal_map_alone() -> None:
    assert not names("normal_maps/identity", map="none")
    assert names("normal_maps/identity", map="bytes") == NORMALS | {"normal_map_level"}
    assert names("normal_maps/identity", map="level") == NORMALS, "nought is said: no byte can be taken for it"
    assert names("normal_maps/mirrored_uv", tile="plane") == NORMALS | {"normal_map_level", "tangent_handedness"}
    scene = read_scene("normal_maps/bumps")
    assert not {each.name for each in models(replace(scene, lights=()))} & NORMALS


def names(scene: str, **variants: str) -> set[str]:
    found = {each.name for each in models(read_scene(scene, variants))}
    return found & (NORMALS | {"normal_map_level", "tangent_handedness"})


def test_which_faces_are_mirrored() -> None:
    (tile,) = read_scene("normal_maps/mirrored_uv", {"tile": "plane"}).meshes
    assert mirrored(tile).tolist() == [True, True, False, False] * 2


def test_what_bytes_say() -> None:
    whole = np.arange(12).reshape(2, 2, 3) * 20.0
    assert of_bytes(Texture(Path("a"), whole / 127.5 - 1.0))
    assert of_bytes(Texture(Path("a"), (whole / 127.5 - 1.0).astype(np.float32).astype(float)))
    assert not of_bytes(Texture(Path("a"), (whole + 0.2) / 127.5 - 1.0))


def mapped_normals(scene: Scene) -> tuple[Floats, Floats, Floats]:
    """Of each pixel's centre of normal_maps/bumps N', N and V, by planes and a bilinear lookup of their own."""
    eye, c = scene.camera.to_world[3, :3], scene.camera
    y, x = np.mgrid[: scene.height, : scene.width]
    right = (2.0 * (x + 0.5) / scene.width - 1.0) * c.tan_x
    up = (1.0 - 2.0 * (y + 0.5) / scene.height) * c.tan_y
    towards = right[..., None] * c.to_world[0, :3] + up[..., None] * c.to_world[1, :3] - c.to_world[2, :3]
    mapped, own = np.full((*y.shape, 3), np.nan), np.full((*y.shape, 3), np.nan)
    (texture,) = (
        scene.textures[k] for k in {scene.materials[each.material].preview.normal_map for each in scene.meshes}
    )  # type: ignore[union-attr]
    for mesh in scene.meshes:
        assert mesh.uv is not None
        a, b, _, d = mesh.points
        N = unit(np.cross(b - a, d - a))
        t = ((a - eye) @ N) / (towards @ N)
        at = eye + t[..., None] * towards - a
        s, r = at @ (b - a) / ((b - a) @ (b - a)), at @ (d - a) / ((d - a) @ (d - a))
        seen = (t > 0) & (s > 0) & (s < 1) & (r > 0) & (r < 1) & np.isnan(own[..., 0])
        n = len(texture.pixels)
        u, v = 4.0 * s * n - 0.5, (1.0 - 2.0 * r) * n - 0.5
        i, j = np.floor(u).astype(int), np.floor(v).astype(int)
        fu, fv = (u - i)[..., None], (v - j)[..., None]
        p = texture.pixels
        value = (1 - fv) * ((1 - fu) * p[j % n, i % n] + fu * p[j % n, (i + 1) % n])
        value += fv * ((1 - fu) * p[(j + 1) % n, i % n] + fu * p[(j + 1) % n, (i + 1) % n])
        turned = value[..., :1] * unit(b - a) + value[..., 1:2] * unit(d - a) + value[..., 2:] * N
        mapped[seen] = (turned / np.linalg.norm(turned, axis=2, keepdims=True))[seen]
        own[seen] = N
    return mapped, own, -towards / np.linalg.norm(towards, axis=2, keepdims=True)


@pytest.mark.parametrize("camera", ["low", "high"])
def test_each_acts_only_where_normals_disagree(camera: str) -> None:
    scene = read_scene("normal_maps/bumps", {"camera": camera})
    reference = trace_picture(scene, Options())
    mapped, own, V = mapped_normals(scene)
    L = -np.asarray(scene.lights[0].direction)
    away = (mapped * V).sum(axis=2) <= 0
    leaks = ((own @ L) <= 0) & ((mapped @ L) > 0)
    lit = ((own @ L) > 0) & ((mapped @ L) > 0)
    supports = {
        "mapped_normal_black": away & lit,
        "mapped_normal_flipped": away & ((own @ L) > 0),
        "mapped_normal_raised": (own @ L) > 0,
        "bump_light_leak": leaks,
        "bump_terminator_softened": lit & ((mapped * own).sum(axis=2) < 1.0 - 1e-9),
    }
    for model in models(scene):
        if model.name in supports:
            drawn = trace_picture(configured(scene, [model])[0], configured(scene, [model])[1])
            changed = (drawn != reference).any(axis=2)
            assert changed.any(), model.name
            assert not (changed & ~supports[model.name]).any(), model.name
            if model.name in ("mapped_normal_black", "bump_light_leak"):
                assert np.array_equal(changed, supports[model.name]), "and everywhere there"


def test_128_as_nought_is_no_map() -> None:
    """Byte 255 is 1 in both readings: a map of (128, 128, 255) is then the very surface."""
    plain = trace_picture(read_scene("normal_maps/identity", {"map": "none"}), Options())
    scene = read_scene("normal_maps/identity", {"map": "bytes"})
    (level,) = (each for each in models(scene) if each.name == "normal_map_level")
    drawn = trace_picture(configured(scene, [level])[0], Options())
    assert drawn == pytest.approx(plain, rel=1e-9, abs=1e-12)
    said_level = trace_picture(read_scene("normal_maps/identity", {"map": "level"}), Options())
    assert said_level == pytest.approx(plain, rel=1e-5, abs=1e-7)
    as_specified = trace_picture(scene, Options())
    assert np.abs(as_specified - plain).max() > 0.004 * plain.max()
