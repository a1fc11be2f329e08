"""Texture space against closed forms: each pixel of the board and of the drum, by numpy, from the stage alone."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from notabug.references.models.model import Model, models
from notabug.references.models.texture_space import BITS, welded
from notabug.references.predict import configured
from notabug.references.tracer.envelope import trace_picture
from notabug.scenes_usd.authoring.texture_space_seam import HEIGHT, RADIUS, TURNS
from notabug.scenes_usd.authoring.texture_space_wrap import HIGH, LOW, ROTATION, SCALE, TRANSLATION
from notabug.scenes_usd.authoring.texture_spaces import picture
from notabug.scenes_usd.reader import read_scene
from notabug.scenes_usd.scene import Mesh, Scene

WRAP, SEAM = "texture_space/wrap", "texture_space/seam"
SIZE = 24
Floats = npt.NDArray[np.float64]


def small(name: str, **variants: str) -> Scene:
    return replace(read_scene(name, variants), width=SIZE, height=SIZE)


def drawn(scene: Scene, *chosen: Model) -> Floats:
    return trace_picture(*configured(scene, chosen))


def named(scene: Scene, name: str, part: str = "") -> Model:
    return next(each for each in models(scene) if each.name == name and part in each.claim)


def rays(scene: Scene) -> tuple[Floats, Floats]:
    """The camera's eye (3,) and the directions (h, w, 3) through the centres of its pixels."""
    middle = (np.arange(SIZE) + 0.5) / SIZE
    x, y = np.meshgrid(2.0 * middle - 1.0, 1.0 - 2.0 * middle)
    local = np.stack([x * scene.camera.tan_x, y * scene.camera.tan_y, -np.ones_like(x)], axis=-1)
    return scene.camera.to_world[3, :3], local @ scene.camera.to_world[:3, :3]


def wrapped(index: int, size: int, wrap: str) -> int | None:
    if wrap == "repeat":
        return index - size * math.floor(index / size)
    if wrap == "clamp":
        return sorted((0, index, size - 1))[1]
    if wrap == "black":
        return index if index in range(size) else None
    there = index - 2 * size * math.floor(index / (2 * size))
    return there if there < size else 2 * size - 1 - there


def lookup(u: float, v: float, wraps: tuple[str, str], pixels: Floats, pair: Any = None) -> Floats:
    """Bilinear, with texel centres at halves; ``pair`` (place, size) -> (texel, texel, share) says it otherwise."""
    height, width = pixels.shape[:2]
    places = []
    for place, size, wrap in ((u * width, width, wraps[0]), ((1.0 - v) * height, height, wraps[1])):
        if pair is not None:
            places.append(pair(place, size))
            continue
        first = math.floor(place - 0.5)
        places.append((wrapped(first, size, wrap), wrapped(first + 1, size, wrap), place - 0.5 - first))
    (left, right, a), (top, bottom, b) = places
    found = np.zeros(3)
    for column, across in ((left, 1.0 - a), (right, a)):
        for row, down in ((top, 1.0 - b), (bottom, b)):
            if row is not None and column is not None:
                found += across * down * pixels[row, column]
    return found


def board(scene: Scene, colour: Any, moved: Any = lambda s, t: (s, t)) -> Floats:
    """The picture of the board: albedo ``colour(u, v)`` times E cos / pi, by the plane z = 0 from -1 to 1."""
    eye, directions = rays(scene)
    light = scene.lights[0]
    lit = np.array(light.intensity) * -light.direction[2] / math.pi
    made = np.zeros((SIZE, SIZE, 3))
    for row, column in np.ndindex(SIZE, SIZE):
        way = directions[row, column]
        x, y, _ = eye - way * (eye[2] / way[2])
        if abs(x) <= 1.0 and abs(y) <= 1.0:
            s, t = (LOW + (HIGH - LOW) * (each + 1.0) / 2.0 for each in (x, y))
            made[row, column] = colour(*moved(s, t)) * lit
    return made


TEXELS = picture() / 255.0
MODES = {
    "repeat": ("repeat", "repeat"),
    "mirror": ("mirror", "mirror"),
    "clamp": ("clamp", "clamp"),
    "black": ("black", "black"),
    "repeat_clamp": ("repeat", "clamp"),
}


def srgb(x: Floats) -> Floats:
    return np.where(x <= 0.04045, x / 12.92, ((x + 0.055) / 1.055) ** 2.4)


def encoded(x: Floats) -> Floats:
    return np.where(x <= 0.0031308, x * 12.92, 1.055 * x ** (1 / 2.4) - 0.055)


@pytest.mark.parametrize("wrap", MODES)
def test_each_wrap_mode_is_what_its_name_says(wrap: str) -> None:
    scene = small(WRAP, wrap=wrap)
    expected = board(scene, lambda u, v: lookup(u, v, MODES[wrap], TEXELS))
    assert np.abs(drawn(scene) - expected).max() < 1e-12
    assert expected.max() > 0.3


def test_an_srgb_texture_is_decoded_before_its_texels_are_mixed_and_after_them_where_a_renderer_does_so() -> None:
    scene = small(WRAP, space="sRGB")
    before = board(scene, lambda u, v: lookup(u, v, MODES["repeat"], srgb(TEXELS)))
    after = board(scene, lambda u, v: srgb(lookup(u, v, MODES["repeat"], TEXELS)))
    assert np.abs(drawn(scene) - before).max() < 1e-12
    assert np.abs(drawn(scene, named(scene, "decoded_after_filter")) - after).max() < 1e-9
    assert np.abs(before - after).max() > 0.1
    beside = replace(scene, textures=(*scene.textures, replace(scene.textures[0], colour_space="raw")))
    for other in (small(WRAP), beside):  # a raw texture, which nothing decodes, alone or beside it
        assert not [each for each in models(other) if each.name in ("decoded_after_filter", "texture_decoded_late")]


def turned(s: float, t: float, degrees: float = ROTATION) -> tuple[float, float]:
    angle = math.radians(degrees)
    return s * math.cos(angle) - t * math.sin(angle), s * math.sin(angle) + t * math.cos(angle)


def as_specified(s: float, t: float) -> tuple[float, float]:
    u, v = turned(s * SCALE[0], t * SCALE[1])
    return u + TRANSLATION[0], v + TRANSLATION[1]


def moved_first(s: float, t: float) -> tuple[float, float]:
    return turned((s + TRANSLATION[0]) * SCALE[0], (t + TRANSLATION[1]) * SCALE[1])


def turned_first(s: float, t: float) -> tuple[float, float]:
    u, v = turned(s, t)
    return u * SCALE[0] + TRANSLATION[0], v * SCALE[1] + TRANSLATION[1]


def clockwise(s: float, t: float) -> tuple[float, float]:
    u, v = turned(s * SCALE[0], t * SCALE[1], -ROTATION)
    return u + TRANSLATION[0], v + TRANSLATION[1]


@pytest.mark.parametrize(
    ("name", "part", "moved"),
    [
        ("", "", as_specified),
        ("uv_transform_order", "moved before", moved_first),
        ("uv_transform_order", "turned before", turned_first),
        ("uv_transform_turned", "", clockwise),
        ("uv_transform_ignored", "", lambda s, t: (s, t)),
    ],
)
def test_a_transform_of_coordinates_and_what_its_readers_get_wrong(name: str, part: str, moved: Any) -> None:
    """UsdTransform2d: in * scale * rotation + translation, from the numbers of the stage."""
    scene = small(WRAP, transform="all")
    expected = board(scene, lambda u, v: lookup(u, v, MODES["repeat"], TEXELS), moved)
    chosen = [named(scene, name, part)] if name else []
    assert np.abs(drawn(scene, *chosen) - expected).max() < 1e-5, "numbers of the file are float32"
    assert not [each for each in models(small(WRAP)) if each.name.startswith("uv_transform")]


def border_clamped(place: float, size: int) -> tuple[int, int, float]:
    place -= size * math.floor(place / size)
    first = math.floor(place - 0.5)
    return max(first, 0), min(first + 1, size - 1), place - 0.5 - first


def test_a_border_that_is_clamped_before_it_is_filtered() -> None:
    scene = small(WRAP)
    expected = board(scene, lambda u, v: lookup(u, v, ("", ""), TEXELS, border_clamped))
    found = drawn(scene, named(scene, "border_not_filtered"))
    assert np.abs(found - expected).max() < 1e-12
    assert 0.1 < (np.abs(found - drawn(scene)).max(axis=2) > 1e-9).mean() < 0.5, "half a texel at each border"
    for wrap in ("mirror", "clamp", "black"):  # where it does not repeat, nothing mixes with the other end
        assert not [each for each in models(small(WRAP, wrap=wrap)) if each.name.startswith("border")]


@pytest.mark.parametrize("bits", [BITS[0], BITS[-1]])
def test_weights_of_few_bits_are_bounded_by_those_rounded_down_and_up(bits: int) -> None:
    scene = small(WRAP)
    model = next(each for each in models(scene) if each.when == ("texture_bits", str(bits)))
    found = [drawn(scene, each) for each in model.values()]
    for up, made in enumerate(found):
        rounds = {0: math.floor, 1: math.ceil}

        def pair(place: float, size: int, up: int = up, rounds: Any = rounds) -> tuple[int, int, float]:
            first = math.floor(place - 0.5)
            share = rounds[up >> (size == len(TEXELS)) & 1]((place - 0.5 - first) * 2**bits) / 2**bits
            return first % size, (first + 1) % size, share

        assert np.abs(made - board(scene, lambda u, v, pair=pair: lookup(u, v, ("", ""), TEXELS, pair))).max() < 1e-12
    nearest = board(scene, lambda u, v: lookup(u, v, ("", ""), TEXELS, lambda x, n: rounded(x, n, bits)))
    assert (nearest > np.min(found, axis=0) - 1e-12).all()
    assert (nearest < np.max(found, axis=0) + 1e-12).all()


def rounded(place: float, size: int, bits: int) -> tuple[int, int, float]:
    """As hardware does: to the nearest."""
    first = math.floor(place - 0.5)
    return first % size, (first + 1) % size, round((place - 0.5 - first) * 2**bits) / 2**bits


def cut(place: float, size: int) -> tuple[int, int, float]:
    first = int(place - 0.5)  # C's cast, and Python's
    return first % size, (first + 1) % size, (place - 0.5) - math.floor(place - 0.5)


def test_negative_coordinates_that_lose_their_sign_their_value_or_their_floor() -> None:
    scene = small(WRAP)
    repeat = MODES["repeat"]
    for part, colour in (
        ("lose their sign", lambda u, v: lookup(abs(u), abs(v), repeat, TEXELS)),
        ("taken for 0", lambda u, v: lookup(max(u, 0.0), max(v, 0.0), repeat, TEXELS)),
        ("from the top", lambda u, v: lookup(u, v, repeat, TEXELS, cut)),
        ("from the bottom", lambda u, v: lookup(u, 1.0 - v, repeat, TEXELS[::-1], cut)),
    ):
        found = drawn(scene, named(scene, "negative_uv", part))
        assert np.abs(found - board(scene, colour)).max() < 1e-12, part
        assert (np.abs(found - drawn(scene)).max(axis=2) > 1e-3).mean() > 0.1
    texture = scene.textures[0]
    inside = replace(scene, objects=tuple(replace(each, uv=(each.uv + 1.5) / 4) for each in scene.meshes))
    assert not [each for each in models(inside) if each.name == "negative_uv"]
    mirrored = replace(scene, textures=(replace(texture, wrap_s="mirror", wrap_t="mirror"),))
    assert not [each for each in models(mirrored) if "lose their sign" in each.claim], "it is what mirroring means"


def test_wrong_wrap_modes_are_those_that_change_something() -> None:
    for wrap in MODES:
        scene = small(WRAP, wrap=wrap)
        found = [each for each in models(scene) if each.name == "texture_wrap"]
        assert len(found) == (5 if wrap == "repeat_clamp" else 3)
        pictures = [drawn(scene), *(drawn(scene, each) for each in found)]
        for k, one in enumerate(pictures):
            assert all(np.abs(one - other).max() > 0.05 for other in pictures[:k])
    exchanged = drawn(small(WRAP, wrap="repeat_clamp"), named(small(WRAP, wrap="repeat_clamp"), "texture_wrap", "exch"))
    expected = board(small(WRAP), lambda u, v: lookup(u, v, ("clamp", "repeat"), TEXELS))
    assert np.abs(exchanged - expected).max() < 1e-12


# --- the seam -----------------------------------------------------------------------------------------------------


def drum(scene: Scene, columns: int, coordinate: Any) -> Floats:
    """The picture of the drum: by the planes of its faces, whose coordinate u is ``coordinate(column, along)``."""
    eye, directions = rays(scene)
    to_light = -np.array(scene.lights[0].direction)
    made = np.zeros((SIZE, SIZE, 3))
    for column in range(columns):
        a, b = (math.tau * each / columns for each in (column, column + 1))
        begin, end = (np.array([math.sin(each), 0.0, math.cos(each)]) for each in (a, b))
        facet = begin + end
        if facet @ eye <= RADIUS * (begin @ facet):
            continue  # seen from behind
        for row, pixel in np.ndindex(SIZE, SIZE):
            way = directions[row, pixel]
            at = eye + way * ((RADIUS * begin @ facet - eye @ facet) / (way @ facet))
            along = (at - RADIUS * begin) @ (end - begin) / (RADIUS * ((end - begin) @ (end - begin)))
            if not (0.0 <= along <= 1.0 and abs(at[1]) <= HEIGHT / 2):
                continue
            normal = (1.0 - along) * begin + along * end
            lit = max(normal @ to_light / math.sqrt(normal @ normal), 0.0)
            u, v = coordinate(column, along), TURNS[1] * (at[1] / HEIGHT + 0.5)
            colour = lookup(u, v, MODES["repeat_clamp"], TEXELS)
            made[row, pixel] = colour * lit * np.array(scene.lights[0].intensity) / math.pi
    return made


@pytest.mark.parametrize("columns", [9, 27])
def test_a_seam_is_not_seen_and_a_welded_one_squeezes_the_picture_into_a_column(columns: int) -> None:
    scene = small(SEAM, columns=str(columns))
    right = drum(scene, columns, lambda column, along: TURNS[0] * (column + along) / columns)
    front = right.max(axis=2) > 0.0  # what is seen through the open ends is its inside
    assert np.abs(drawn(scene) - right)[front].max() < 1e-5, "the points of the file are float32"

    def first(column: int, along: float) -> float:
        begin, end = column, 0 if column == columns - 1 else column + 1  # at the seam's points the first face has u = 0
        return TURNS[0] * (begin + along * (end - begin)) / columns

    def last(column: int, along: float) -> float:
        begin = columns if column == 0 else column  # the last face has u = 2
        return TURNS[0] * (begin + along * (column + 1 - begin)) / columns

    for name, coordinate, which in (("first", first, columns - 1), ("last", last, 0)):
        (limitation,) = (each for each in models(scene) if each.name == "welded_seam" and each.when[1] == name)
        squeezed = drum(scene, columns, coordinate)
        assert np.abs(drawn(scene, limitation) - squeezed)[front].max() < 1e-5
        changed = np.abs(squeezed - right).max(axis=2) > 1e-3
        assert 0.2 * SIZE < changed.sum() < front.sum() / 2
        (mesh,) = welded(first=name == "first")(scene).meshes
        (before,) = scene.meshes
        moved = np.flatnonzero((mesh.uv != before.uv).any(axis=1)) // 4  # the faces, three rows of them
        assert set((moved % columns).tolist()) == {which}


def test_points_that_are_split_have_no_seam_to_weld() -> None:
    scene = small(SEAM)
    (mesh,) = scene.meshes
    assert isinstance(mesh, Mesh)
    split = replace(mesh, points=mesh.points[mesh.corners], corners=np.arange(len(mesh.corners), dtype=np.int32))
    names = {each.name for each in models(replace(scene, objects=(split,)))}
    assert {"welded_seam", "seam_welded"} & names == set()
    assert {"welded_seam", "seam_welded"} <= {each.name for each in models(scene)}
    assert "welded_seam" not in {each.name for each in models(small(WRAP))}
