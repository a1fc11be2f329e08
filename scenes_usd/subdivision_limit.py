"""The limit surface at the vertices of a net of quads or triangles: places and normals by their closed forms.

Sources: Halstead, Kass, DeRose, "Efficient, fair interpolation using Catmull-Clark surfaces" (1993); Loop (1987);
Hoppe et al., "Piecewise smooth surface reconstruction" (1994); Biermann, Levin, Zorin, "Piecewise smooth subdivision
surfaces with normal control" (2000) for the tangent across a crease.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import scipy.sparse as sp

from notabug.scenes_usd.scene import Floats
from notabug.scenes_usd.subdivision import (
    Edges,
    Net,
    Places,
    Weights,
    edges_of,
    kinds_of,
    loop_beta,
    matrix_of,
    rules_of,
    scaled,
)

Bools = npt.NDArray[np.bool_]


def limit_weights(net: Net) -> Weights:
    """The places of the vertices on the limit surface, by the vertices (v, v) of a net of quads or of triangles."""
    edges = edges_of(net)
    v, ends = net.vertices, edges.ends
    n = np.maximum(np.bincount(ends.ravel(), minlength=v), 1).astype(float)
    beside = matrix_of(ends.ravel(), ends[:, ::-1].ravel(), 1.0, (v, v))
    rules = rules_of(net, edges, 1.0 / 6.0, limit=True)
    if _has_quads(net):
        opposite = net.corners[net.following[net.following]]
        across = matrix_of(net.corners, opposite, 1.0, (v, v))
        smooth = sp.diags_array(n / (n + 5.0)) + scaled(1.0 / (n * (n + 5.0)), sp.csr_array(4.0 * beside + across))
    else:
        chi = 1.0 / (n + 3.0 / (8.0 * loop_beta(n)))
        smooth = sp.diags_array(1.0 - n * chi) + scaled(chi, beside)
    return sp.csr_array(scaled(rules.smooth, sp.csr_array(smooth)) + rules.rest)


def limit_normals(net: Net, points: Floats) -> Floats:
    """The unit normals (c, 3) of the limit surface at the corners of ``net`` with the vertices ``points`` (v, 3).

    At a crease each side has its own; at a corner each face. Where the surface has none, the face's own is taken.
    """
    edges = edges_of(net)
    kinds = kinds_of(net.vertices, edges.ends, edges.sharp, net.pointed)
    kinds = np.where((kinds == 0) & _on_border(net, edges), 2, kinds)
    place, size, home = _rings(net, edges, kinds)
    a, b = net.corners[net.following], net.corners[_before(net)]
    own = points[net.corners]
    towards, last = points[a], points[b]
    flat = np.cross(towards - own, last - own)
    across = points[net.corners[net.following[net.following]]]
    quads = _has_quads(net)
    one, two = np.zeros((len(net.corners), 3)), np.zeros((len(net.corners), 3))
    smooth, crease = kinds[net.corners] == 0, kinds[net.corners] == 1
    for chosen, tangents in ((smooth, _smooth_tangents), (crease, _crease_tangents)):
        for into, part in zip((one, two), tangents(quads, place, size, own, towards, last, across), strict=True):
            np.add.at(into, home[chosen], part[chosen])
    normal = np.where((smooth | crease)[:, None], np.cross(one[home], two[home]), flat)
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    size_of = np.linalg.norm(one[home], axis=1, keepdims=True) * np.linalg.norm(two[home], axis=1, keepdims=True)
    none = (length <= 1e-9 * size_of) & (smooth | crease)[:, None]
    normal = np.where(none, flat, normal)
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    face = np.add.reduceat(np.cross(own, towards), net.first)[net.face]  # twice the area along the face's normal
    normal = np.where(length > 0.0, normal / np.where(length > 0.0, length, 1.0), 0.0)
    reversed_ = (normal * face).sum(axis=1) < 0.0
    normal[crease & reversed_] *= -1.0
    lost = np.linalg.norm(normal, axis=1) == 0.0
    rescue = np.linalg.norm(face, axis=1)
    normal[lost] = np.where(
        rescue[lost, None] > 0.0, face[lost] / np.maximum(rescue[lost, None], 1e-300), [0.0, 0.0, 1]
    )
    return normal


def _has_quads(net: Net) -> bool:
    return bool(net.counts[0] == 4)


def _before(net: Net) -> Places:
    before = np.arange(len(net.corners)) - 1
    before[net.first] = net.first + net.counts - 1
    return before


def _on_border(net: Net, edges: Edges) -> Bools:
    border = np.zeros(net.vertices, bool)
    border[edges.ends[edges.faces != 2].ravel()] = True
    return border


def _rings(net: Net, edges: Edges, kinds: Places) -> tuple[Places, Places, Places]:
    """Of each corner (c,): its number in the ring of faces round its vertex, counter-clockwise, how many the ring has,
    and the corner with which the ring begins. Round a crease a ring goes from one sharp edge to the next."""
    total = len(net.corners)
    before = _before(net)
    leaving = net.corners * np.int64(net.vertices) + net.corners[net.following]
    wanted = net.corners * np.int64(net.vertices) + net.corners[before]
    order = np.argsort(leaving, kind="stable")
    found = np.searchsorted(leaving[order], wanted)
    found = np.minimum(found, total - 1)
    after = order[found]
    after = np.where(leaving[after] == wanted, after, -1)  # the face on the other side of the edge that comes last
    sharp = (edges.sharp > 0)[edges.of] & (kinds[net.corners] == 1)
    after = np.where((edges.sharp > 0)[edges.of[before]] & (kinds[net.corners] == 1), -1, after)
    first = np.full(net.vertices, total, np.int64)
    np.minimum.at(first, net.corners, np.arange(total))
    begins = np.where(kinds[net.corners] == 1, sharp, first[net.corners] == np.arange(total))
    place, home = np.zeros(total, np.int64), np.arange(total)
    at = np.flatnonzero(begins)
    root = at.copy()
    number = 0
    while len(at) and number <= total:
        place[at], home[at] = number, root
        on = after[at]
        keep = (on >= 0) & (on != root)
        at, root = on[keep], root[keep]
        number += 1
    size = np.bincount(home, minlength=total)[home]
    return place, size, home


def _smooth_tangents(
    quads: bool, place: Places, size: Places, own: Floats, towards: Floats, last: Floats, across: Floats
) -> tuple[Floats, Floats]:
    """What each corner adds to the two tangents of a smooth vertex."""
    del own, last
    turn = 2.0 * np.pi / size
    parts = []
    for wave in (np.cos, np.sin):
        here, beyond = wave(turn * place)[:, None], wave(turn * (place + 1))[:, None]
        if quads:
            edge = 1.0 + np.cos(turn) + np.cos(turn / 2.0) * np.sqrt(2.0 * (9.0 + np.cos(turn)))
            parts.append(edge[:, None] * here * towards + (here + beyond) * across)
        else:
            parts.append(here * towards)
    return parts[0], parts[1]


def _crease_tangents(
    quads: bool, place: Places, size: Places, own: Floats, towards: Floats, last: Floats, across: Floats
) -> tuple[Floats, Floats]:
    """What each corner adds to the tangent along a crease and to the one across it, on its side."""
    begins, ends = (place == 0)[:, None], (place == size - 1)[:, None]
    along = np.where(begins, towards, 0.0) - np.where(ends, last, 0.0)
    angle = np.pi / size
    cos, sin = np.cos(angle)[:, None], np.sin(angle)[:, None]
    here = np.sin(angle * place)[:, None]
    beyond = np.sin(angle * (place + 1))[:, None]
    tips = np.where(begins, towards, 0.0) + np.where(ends, last, 0.0)
    if not quads:
        inner = np.where(begins, 0.0, towards)
        many = (2.0 - 2.0 * cos) * here * inner - sin * tips
        regular = inner - 0.5 * tips - np.where(begins, own, 0.0)
        two = inner - np.where(begins, own, 0.0)
        one = tips - 2.0 * own
        faces = size[:, None]
        return along, np.select([faces == 1, faces == 2, faces == 3], [one, two, regular], many)
    single = (size == 1)[:, None]
    ratio = (cos + 1.0) / np.where(single, 1.0, sin)
    wide = np.where(begins, 4.0 * ratio * (cos - 1.0) * own, 0.0)
    wide = wide - ratio * (1.0 + 2.0 * cos) * tips + np.where(begins, 0.0, 4.0 * here * towards)
    wide = wide + (here + beyond) * across
    return along, np.where(single, tips - 2.0 * own, wide)
