"""Few wrong pixels: what last bits make at edges passes, and nothing else does, however small."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from scipy import ndimage

from notabug.adapters.base import Declaration
from notabug.metrics.admissible import admissible
from notabug.metrics.excused import crowded, excused, most
from notabug.metrics.image_filters import widened
from notabug.metrics.policy import POLICY
from notabug.references.predict import predict
from notabug.references.tracer.envelope import SEEN, Envelope
from notabug.scenes_usd.scene import Mesh, Scene

BUDGET = POLICY.excused.budget
PAIR = POLICY.excused.pair
RATE = POLICY.excused.rate
SURE = POLICY.excused.sure

Floats = npt.NDArray[np.floating]

POINT = Declaration("float64", "point", 0.0, 2.0**-24, relative_quantum=True, noisy=False, silhouette="keep")
BOX = replace(POINT, filter="box", radius=0.5, samples=25)
SHADOWS = ("acne/grazing_plane", "terminator/sphere", "visibility/standing")
SIZE = 64


def _small(studio: Any, name: str) -> Scene:
    return replace(studio.scene(name), width=SIZE, height=SIZE)


def _grown(start: tuple[int, int], count: int, within: npt.NDArray[np.bool_]) -> npt.NDArray[np.bool_]:
    """``count`` pixels that touch, ``within`` a mask, from ``start`` on; all of them where there are fewer."""
    found = np.zeros_like(within)
    found[start] = True
    while found.sum() < count:
        more = np.flatnonzero(ndimage.binary_dilation(found) & within & ~found)
        if not more.size:
            break
        found.ravel()[more[: count - int(found.sum())]] = True
    return found


def _shaded(envelope: Envelope) -> npt.NDArray[np.bool_]:
    """Where a light is blocked, and all of the pixel is dark."""
    return (envelope.ids > SEEN) & (envelope.hi.max(axis=2) <= 1e-6)


@pytest.mark.parametrize("count", [4, 6, 8, 12])
@pytest.mark.parametrize("name", ["acne/grazing_plane", "terminator/bowl", "terminator/sphere"])
def test_a_lost_piece_of_shadow_is_a_bug_however_small(studio: Any, name: str, count: int) -> None:
    """Eight pixels of it, all beside its edge, were once excused."""
    scene = _small(studio, name)
    envelope = predict(scene)
    dark = _shaded(envelope)
    lit = (envelope.ids <= SEEN) & (envelope.lo.max(axis=2) > 0)
    beside = np.argwhere(dark & widened(lit, 2))
    assert len(beside) >= 4
    y, x = (int(each) for each in beside[len(beside) // 2])
    lost = _grown((y, x), count, dark & widened(lit, 3))
    shine = envelope.point[lit].mean(axis=0)
    assert studio.verdict([envelope.point], scene, POINT, naming=False).word == "pass"
    assert studio.verdict([envelope.mean], scene, BOX, naming=False).word == "pass"
    assert lost.sum() >= 3
    for picture, declaration in ((envelope.point, POINT), (envelope.mean, BOX)):
        wrong = np.where(lost[..., None], shine, picture)
        assert studio.verdict([wrong], scene, declaration, naming=False).word == "bug"


@pytest.mark.parametrize("name", ["terminator/sphere", "terminator/bowl", "terminator/spacing"])
@pytest.mark.sweep_except("terminator/sphere", "terminator/bowl")
def test_a_missing_triangle_is_a_bug(studio: Any, name: str) -> None:
    """One that covers a few pixels, of a mesh of hundreds."""
    scene = _small(studio, name).as_intended()
    envelope = predict(scene)
    at, mesh = max(
        ((i, each) for i, each in enumerate(scene.objects) if isinstance(each, Mesh)), key=lambda e: len(e[1].counts)
    )
    told = 0
    for face in range(0, len(mesh.counts), max(1, len(mesh.counts) // 24)):
        holed = replace(scene, objects=(*scene.objects[:at], _without(mesh, face), *scene.objects[at + 1 :]))
        picture = predict(holed).point
        changed = (np.abs(picture - envelope.point) > 0.02).any(axis=2)
        if 3 <= changed.sum() <= 30 and crowded(changed).any():
            told += 1
            assert studio.verdict([picture], scene, POINT, naming=False).word == "bug", (face, int(changed.sum()))
    assert told >= 2


def _without(mesh: Mesh, face: int) -> Mesh:
    first = int(mesh.counts[:face].sum())
    corners = np.delete(np.arange(len(mesh.corners)), slice(first, first + int(mesh.counts[face])))
    return replace(
        mesh,
        counts=np.delete(mesh.counts, face),
        corners=mesh.corners[corners],
        normals=None if mesh.normals is None else mesh.normals[corners],
        uv=None if mesh.uv is None else mesh.uv[corners],
    )


@pytest.mark.parametrize("declaration", [POINT, BOX], ids=["point", "box"])
@pytest.mark.parametrize("name", SHADOWS)
@pytest.mark.sweep_except("acne/grazing_plane-point", "terminator/sphere-box", "visibility/standing-point")
def test_fireflies_are_a_bug_wherever_they_are(studio: Any, name: str, declaration: Declaration) -> None:
    """Eight single pixels off the edges, or three beside them, brighter than anything around."""
    scene = _small(studio, name)
    envelope = predict(scene)
    right = envelope.point if declaration is POINT else envelope.mean
    edge = admissible(envelope, declaration).edge
    rng = np.random.default_rng(11)
    for count, places in ((8, ~widened(edge, 3)), (1, ~widened(edge, 3)), (3, edge)):
        picture = right.copy().reshape(-1, 3)
        picture[rng.choice(np.flatnonzero(places), count, replace=False)] = 3.0 * right.max()
        assert studio.verdict([picture.reshape(right.shape)], scene, declaration, naming=False).word == "bug"


@pytest.mark.parametrize("declaration", [POINT, BOX], ids=["point", "box"])
@pytest.mark.parametrize("tilt", [0.0, 0.1, 0.3])
def test_a_thin_wire_that_is_gone_is_a_bug(studio: Any, tilt: float, declaration: Declaration) -> None:
    """Half as wide as a pixel: at pixel centres it is a dotted line, else a faint one."""
    plain = _small(studio, "acne/grazing_plane")
    camera = plain.camera
    middle = camera.to_world[3, :3] - 5.0 * camera.to_world[2, :3]
    across, up = camera.to_world[0, :3], camera.to_world[1, :3]
    middle = middle + 5.0 * camera.tan_y / SIZE * up  # through the centres of a row of pixels
    along = (across + tilt * up) / np.hypot(1.0, tilt)
    beside = (up - tilt * across) / np.hypot(1.0, tilt)
    wide = 0.9 * 5.0 * camera.tan_x / SIZE  # .9 of half a pixel to either side
    points = np.array([middle + a * 1.2 * along + b * wide * beside for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))])
    mesh = Mesh("/Wire", points, np.array([4]), np.array([0, 1, 2, 3]), 0)
    scene = replace(plain, objects=(*plain.objects, mesh))
    lit, dark = predict(scene), predict(plain)
    for envelope, word in ((lit, "pass"), (dark, "bug")):
        picture = envelope.point if declaration is POINT else envelope.mean
        assert studio.verdict([picture], scene, declaration, naming=False).word == word


def test_what_real_renderers_do_at_silhouettes_passes(studio: Any) -> None:
    """Three of some 360 pixels along edges are black, as POV-Ray has them, each by itself; touching they are a bug."""
    scene = _small(studio, "terminator/sphere")
    envelope = predict(scene)
    to = admissible(envelope, POINT)
    places = np.argwhere(to.edge & (envelope.lo.min(axis=2) > 0.05))
    scattered = places[:: len(places) // 3][:3]
    picture = envelope.point.copy()
    picture[tuple(scattered.T)] = 0.0
    assert studio.verdict([picture], scene, POINT, naming=False).word == "pass"
    y, x = places[len(places) // 2]
    touching = envelope.point.copy()
    touching[y, x - 1 : x + 2] = 0.0
    assert studio.verdict([touching], scene, POINT, naming=False).word == "bug"
    many = envelope.point.copy()
    many[tuple(places[:: len(places) // (BUDGET + 4)].T)] = 0.0
    assert studio.verdict([many], scene, POINT, naming=False).word == "bug"


# --- the chance model ------------------------------------------------------------------------------------------------


def test_chance_makes_as_few_as_the_formulas_say() -> None:
    """4,000 pictures of 400 pixels along edges, each wrong with RATE: 4 N RATE^2 pairs, 20 N RATE^3 groups of three."""
    rng, side, pictures = np.random.default_rng(1), 20, 4000
    wrong = rng.random((pictures, side, side)) < RATE
    touching = np.zeros((3, 3, 3))
    touching[1] = 1
    labels, _ = ndimage.label(wrong, touching)
    sizes = np.bincount(labels.ravel())[1:]
    pairs, groups = 4 * 400 * RATE**2 * pictures, 20 * 400 * RATE**3 * pictures
    assert 0.5 * pairs < (sizes == PAIR).sum() < 1.5 * pairs
    assert (sizes > PAIR).sum() < groups + 4 * np.sqrt(groups)
    assert (wrong.sum(axis=(1, 2)) > most(400)).mean() < 3 * SURE


def test_the_budget_grows_with_the_edges_up_to_its_end() -> None:
    found = [most(edges) for edges in (0, 10, 100, 300, 1000, 3000, 100_000)]
    assert found == sorted(found)
    assert found[0] == 0
    assert found[-1] == BUDGET


def test_only_single_usual_pixels_beside_edges_are_excused() -> None:
    value = np.full((32, 32, 3), 0.5)
    edge = np.zeros((32, 32), np.bool_)
    edge[:, 15:17] = True
    none = np.zeros((32, 32))
    envelope = Envelope(
        value, value, np.zeros_like(value), value, value, none.astype(np.int64), edge, none, none, none > 0, 0.0 * value
    )
    to = admissible(envelope, POINT)
    for places, shown, right in (
        ([(4, 15)], 0.0, True),
        ([(4, 15), (5, 16)], 0.0, True),
        ([(4, 15), (5, 16), (6, 15)], 0.0, False),
        ([(4, 15), (20, 16)], 0.0, True),
        ([(4, 15)], 0.9, False),  # brighter than anything around
        ([(4, 25)], 0.0, False),  # off the edge
    ):
        picture, wrong = value.copy(), np.zeros_like(edge)
        for place in places:
            picture[place], wrong[place] = shown, True
        assert excused(wrong, picture, to).sum() == (len(places) if right else 0), places
    averaged = replace(to, stray=2 / 25)
    wrong = np.zeros_like(edge)
    wrong[4, 15] = True
    for off, right in ((0.03, True), (0.2, False)):
        assert excused(wrong, np.where(wrong[..., None], value - off, value), averaged).any() == right
