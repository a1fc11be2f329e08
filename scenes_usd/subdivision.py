"""One step of Catmull-Clark's or Loop's scheme as a matrix, with boundary, creases and corners as OpenSubdiv has them.

A step is linear in the vertices: the points of the finer mesh are ``step.weights @ points``. The same holds for values
that meet at seams of their own, such as texture coordinates: they are a mesh of their own, with the same faces.

Sources: Catmull and Clark, "Recursively generated B-spline surfaces on arbitrary topological meshes" (1978); Loop,
"Smooth subdivision surfaces based on triangles" (1987); DeRose, Kass, Truong, "Subdivision surfaces in character
animation" (1998) for semi-sharp creases; the rules of OpenSubdiv's documentation for what these leave open.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import scipy.sparse as sp

from notabug.scenes_usd.scene import Floats
from notabug.scenes_usd.schemes import Scheme

Places = npt.NDArray[np.int64]
Weights = Any  # scipy.sparse.csr_array, which has no types to check

SHARPEST = 10.0  # OpenSubdiv: a crease as sharp as this never gets smooth


@dataclass(frozen=True, slots=True, eq=False)
class Net:
    """A control mesh: its connections and how sharp they are.

    Attributes
    ----------
    counts : (f,) corners of each face.
    corners : (c,) the vertex of each corner.
    vertices : how many there are.
    sharp : (c,) sharpness of the edge from each corner to the next of its face; both faces of an edge say the same.
    pointed : (vertices,) sharpness of each vertex.
    """

    counts: Places
    corners: Places
    vertices: int
    sharp: Floats
    pointed: Floats

    @property
    def first(self) -> Places:
        """The first corner (f,) of each face."""
        return np.cumsum(self.counts) - self.counts

    @property
    def face(self) -> Places:
        """The face (c,) of each corner."""
        return np.repeat(np.arange(len(self.counts)), self.counts)

    @property
    def following(self) -> Places:
        """The corner (c,) after each in its face."""
        after = np.arange(1, len(self.corners) + 1)
        after[self.first + self.counts - 1] = self.first
        return after


@dataclass(frozen=True, slots=True, eq=False)
class Edges:
    """The edges of a net: ``ends`` (e, 2), ``of`` (c,) the edge of each corner, ``faces`` (e,) at each, ``sharp``."""

    ends: Places
    of: Places
    faces: Places
    sharp: Floats


@dataclass(frozen=True, slots=True, eq=False)
class Step:
    """The finer ``net``, its vertices by the coarser ones (``weights``), and the coarser face (f',) of each face."""

    net: Net
    weights: Weights
    parent: Places


def edges_of(net: Net) -> Edges:
    """The edges of ``net``; a sharpness that only one of an edge's faces knows holds for both."""
    a, b = net.corners, net.corners[net.following]
    low, high = np.minimum(a, b), np.maximum(a, b)
    keys, of = np.unique(low * np.int64(net.vertices) + high, return_inverse=True)
    ends = np.stack([keys // net.vertices, keys % net.vertices], axis=1)
    sharp = np.zeros(len(keys))
    np.maximum.at(sharp, of, net.sharp)
    return Edges(ends, of.astype(np.int64), np.bincount(of, minlength=len(keys)), sharp)


def with_boundary(net: Net, *, corners: bool) -> Net:
    """``net`` with its boundary as a crease, and with ``corners`` a sharp vertex wherever a single face has one."""
    edges = edges_of(net)
    sharp = np.where(edges.faces[edges.of] != 2, np.inf, net.sharp)
    pointed = net.pointed.copy()
    if corners:
        faces = np.bincount(net.corners, minlength=net.vertices)
        border = np.zeros(net.vertices, bool)
        border[edges.ends[edges.faces != 2].ravel()] = True
        pointed[border & (faces == 1)] = np.inf
    return Net(net.counts, net.corners, net.vertices, sharp, pointed)


def matrix_of(rows: Places, columns: Places, values: Floats | float, shape: tuple[int, int]) -> Weights:
    return sp.csr_array((np.broadcast_to(np.asarray(values, np.float64), rows.shape), (rows, columns)), shape=shape)


def scaled(scale: Floats, matrix: Weights) -> Weights:
    return sp.csr_array(sp.diags_array(scale) @ matrix)


@dataclass(frozen=True, slots=True, eq=False)
class Rules:
    """How much (v,) of each vertex' rule is smooth, and the matrix of what is not: creases and corners."""

    smooth: Floats
    rest: Weights


def rules_of(net: Net, edges: Edges, crease: float, *, limit: bool = False) -> Rules:
    """The rule of each vertex: smooth up to one sharp edge, crease with two, corner from three on or when pointed.

    A crease takes ``crease`` of each of its two neighbours. A vertex whose rule changes as its edges get blunter takes
    both in the share that OpenSubdiv gives them: the mean of what is left of the sharpness. In the ``limit`` what is
    sharp stays so.
    """
    n = net.vertices
    now = edges.sharp
    later = now if limit else _blunter(now)
    pointed_now, pointed_later = net.pointed, net.pointed if limit else _blunter(net.pointed)
    kind_now, kind_later = (
        kinds_of(n, edges.ends, sharp, pointed) for sharp, pointed in ((now, pointed_now), (later, pointed_later))
    )
    ends = edges.ends.ravel()
    fading = np.repeat((now > 0) & (later <= 0), 2)
    total = np.bincount(ends, weights=np.where(fading, np.repeat(np.where(now > 0, now, 0.0), 2), 0.0), minlength=n)
    count = np.bincount(ends, weights=fading.astype(float), minlength=n)
    blunt = (pointed_now > 0) & (pointed_later <= 0)
    total, count = total + np.where(blunt, pointed_now, 0.0), count + blunt
    share = np.clip(total / np.maximum(count, 1), 0.0, 1.0)  # of the rule now
    share = np.where(kind_now == kind_later, 1.0, np.where(kind_now == 0, 1.0, share))
    rest = sp.csr_array((n, n))
    smooth = np.zeros(n)
    for kind, part, sharp in ((kind_now, share, now), (kind_later, 1.0 - share, later)):
        smooth += np.where(kind == 0, part, 0.0)
        on = sharp > 0
        a, b = edges.ends[on, 0], edges.ends[on, 1]
        beside = matrix_of(np.concatenate([a, b]), np.concatenate([b, a]), 1.0, (n, n))
        along = np.where(kind == 1, part, 0.0)
        own = (1.0 - 2.0 * crease) * along + np.where(kind == 2, part, 0.0)
        rest = rest + scaled(crease * along, beside) + sp.diags_array(own)
    return Rules(smooth, sp.csr_array(rest))


def _blunter(sharp: Floats) -> Floats:
    return np.where(sharp >= SHARPEST, np.inf, np.maximum(sharp - 1.0, 0.0))


def kinds_of(n: int, ends: Places, sharp: Floats, pointed: Floats) -> Places:
    """The rule of each vertex: 0 smooth, 1 crease, 2 corner."""
    count = np.bincount(ends[sharp > 0].ravel(), minlength=n)
    return np.where((pointed > 0) | (count > 2), 2, np.where(count == 2, 1, 0))


def refine(net: Net, scheme: Scheme, *, linear: bool = False) -> Step:
    """One step of ``scheme``; ``linear`` keeps vertices and halves edges, as varying values have it."""
    if scheme == "loop":
        return _refine_triangles(net, linear=linear)
    return _refine_quads(net, linear=linear or scheme == "bilinear")


def _refine_quads(net: Net, *, linear: bool) -> Step:
    """Every face of n corners becomes n quads. New vertices: the old ones, then the edges', then the faces'."""
    edges = edges_of(net)
    v, e, f = net.vertices, len(edges.ends), len(net.counts)
    middle = matrix_of(net.face, net.corners, 1.0 / net.counts[net.face], (f, v))
    halves = matrix_of(np.repeat(np.arange(e), 2), edges.ends.ravel(), 0.5, (e, v))
    if linear:
        weights = sp.vstack([sp.eye_array(v), halves, middle], format="csr")
    else:
        sharp = np.where(edges.faces == 2, np.clip(edges.sharp, 0.0, 1.0), 1.0)
        beside = matrix_of(edges.of, net.face, 1.0, (e, f))
        smooth = sp.csr_array(0.5 * halves + 0.25 * (beside @ middle))
        edge = scaled(sharp, halves) + scaled(1.0 - sharp, smooth)
        weights = sp.vstack([_old_quads(net, edges, middle), edge, middle], format="csr")
    before = np.arange(len(net.corners)) - 1
    before[net.first] = net.first + net.counts - 1
    corners = np.stack([net.corners, v + edges.of, v + e + net.face, v + edges.of[before]], axis=1)
    outer = _blunter(edges.sharp[edges.of])
    sharp_corners = np.stack([outer, np.zeros_like(outer), np.zeros_like(outer), outer[before]], axis=1)
    pointed = np.concatenate([_blunter(net.pointed), np.zeros(e + f)])
    made = Net(np.full(len(net.corners), 4), corners.ravel(), v + e + f, sharp_corners.ravel(), pointed)
    return Step(made, sp.csr_array(weights), net.face)


def _old_quads(net: Net, edges: Edges, middle: Weights) -> Weights:
    """Catmull and Clark's rule for the old vertices: (n - 2) / n, and 1 / n^2 of each neighbour and of each face."""
    v = net.vertices
    ends = edges.ends
    n = np.maximum(np.bincount(ends.ravel(), minlength=v), 1).astype(float)
    beside = matrix_of(ends.ravel(), ends[:, ::-1].ravel(), 1.0, (v, v))
    around = matrix_of(net.corners, net.face, 1.0, (v, len(net.counts)))
    rules = rules_of(net, edges, 1.0 / 8.0)
    smooth = sp.diags_array((n - 2.0) / n) + scaled(1.0 / n**2, sp.csr_array(beside + around @ middle))
    return sp.csr_array(scaled(rules.smooth, sp.csr_array(smooth)) + rules.rest)


def loop_beta(n: Floats) -> Floats:
    """Loop's weight of each of ``n`` neighbours; 1 / 16 for six."""
    return np.asarray((5.0 / 8.0 - (3.0 / 8.0 + np.cos(2.0 * np.pi / n) / 4.0) ** 2) / n)


def _refine_triangles(net: Net, *, linear: bool) -> Step:
    """Every triangle becomes four. New vertices: the old ones, then the edges'."""
    edges = edges_of(net)
    v, e = net.vertices, len(edges.ends)
    halves = matrix_of(np.repeat(np.arange(e), 2), edges.ends.ravel(), 0.5, (e, v))
    if linear:
        weights = sp.vstack([sp.eye_array(v), halves], format="csr")
    else:
        sharp = np.where(edges.faces == 2, np.clip(edges.sharp, 0.0, 1.0), 1.0)
        opposite = net.corners[net.following][net.following]
        beside = matrix_of(edges.of, opposite, 1.0 / 8.0, (e, v))
        edge = scaled(sharp, halves) + scaled(1.0 - sharp, sp.csr_array(0.75 * halves + beside))
        ends = edges.ends
        n = np.maximum(np.bincount(ends.ravel(), minlength=v), 1).astype(float)
        around = matrix_of(ends.ravel(), ends[:, ::-1].ravel(), 1.0, (v, v))
        beta = loop_beta(n)
        rules = rules_of(net, edges, 1.0 / 8.0)
        smooth = sp.csr_array(sp.diags_array(1.0 - n * beta) + scaled(beta, around))
        weights = sp.vstack([scaled(rules.smooth, smooth) + rules.rest, edge], format="csr")
    a = net.corners.reshape(-1, 3)
    m = v + edges.of.reshape(-1, 3)  # the middles of 01, 12, 20
    corners = np.stack(
        [a[:, 0], m[:, 0], m[:, 2], m[:, 0], a[:, 1], m[:, 1], m[:, 2], m[:, 1], a[:, 2], m[:, 0], m[:, 1], m[:, 2]], 1
    )
    s = _blunter(edges.sharp[edges.of]).reshape(-1, 3)
    zero = np.zeros(len(s))
    sharp_corners = np.stack(
        [s[:, 0], zero, s[:, 2], s[:, 0], s[:, 1], zero, zero, s[:, 1], s[:, 2], zero, zero, zero], axis=1
    )
    pointed = np.concatenate([_blunter(net.pointed), np.zeros(e)])
    made = Net(np.full(4 * len(a), 3), corners.ravel(), v + e, sharp_corners.ravel(), pointed)
    return Step(made, sp.csr_array(weights), np.repeat(np.arange(len(a)), 4))
