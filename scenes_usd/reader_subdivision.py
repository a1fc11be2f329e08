"""A subdivision surface to faces on its limit, refined by its scheme's rules to within a tenth of a pixel.

The vertices of the finest net are moved to the limit surface and get its normals, so what is left is the sagitta of
edges and faces. It falls to a quarter with each step; after a step it is measured against the limit points in the
middle of the coarser net's edges and faces.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from pxr import Usd

from notabug.scenes_usd.primvar import Values
from notabug.scenes_usd.reader_values import fault, integers, opinion, value, vectors_of, where
from notabug.scenes_usd.reading import note, refuse, view
from notabug.scenes_usd.scene import Floats
from notabug.scenes_usd.schemes import TOLERANCE, Scheme
from notabug.scenes_usd.subdivision import SHARPEST, Net, Places, Step, edges_of, refine, with_boundary
from notabug.scenes_usd.subdivision_limit import Bools, limit_normals, limit_weights

MOST_FACES = 1 << 18  # of one refined mesh
_MOST_STEPS = 8
_SHRINKS = 3.0  # at least by so much the distance falls with a step; in the limit by 4

_BOUNDARIES = ("none", "edgeOnly", "edgeAndCorner")
_SEAMS = ("none", "cornersOnly", "cornersPlus1", "cornersPlus2", "boundaries", "all")


@dataclass(frozen=True, slots=True, eq=False)
class Limit:
    """What is drawn of a subdivision surface; ``parent`` is the control mesh's face (f,) of each face."""

    points: Floats
    counts: Places
    corners: Places
    normals: Floats | None
    values: dict[str, Floats]  # per corner (c, k)
    parent: Places


def control_net(prim: Usd.Prim, scheme: Scheme, counts: Places, corners: Places, vertices: int) -> Net:
    """The control mesh of ``prim`` with its creases, corners and boundary; Loop's must be of triangles."""
    if scheme == "loop" and (counts != 3).any():
        bad = int(np.flatnonzero(counts != 3)[0])
        raise fault(
            prim,
            "subdivisionScheme",
            "Loop's scheme is one of triangles",
            expected="faces of 3 corners",
            got=f"{counts[bad]} corners in face {bad}",
            mends=opinion(prim, "subdivisionScheme", "token", "catmullClark"),
        )
    if scheme == "catmullClark" and value(prim, "triangleSubdivisionRule", "word", "catmullClark") == "smooth":
        mends = opinion(prim, "triangleSubdivisionRule", "token", "catmullClark")
        refuse(fault(prim, "triangleSubdivisionRule", "not supported", expected="catmullClark", mends=mends))
    net = Net(counts, corners, vertices, _creases(prim, counts, corners, vertices), _corners(prim, vertices))
    boundary = value(prim, "interpolateBoundary", "word", "edgeAndCorner")
    if boundary not in _BOUNDARIES:
        expected = ", ".join(_BOUNDARIES)
        raise fault(prim, "interpolateBoundary", "unknown rule", expected=expected, got=str(boundary))
    if boundary == "none":
        return net
    return with_boundary(net, corners=boundary == "edgeAndCorner")


def _creases(prim: Usd.Prim, counts: Places, corners: Places, vertices: int) -> Floats:
    """The sharpness (c,) of the edge from each corner to the next."""
    sharp = np.zeros(len(corners))
    lengths, chain = integers(prim, "creaseLengths"), integers(prim, "creaseIndices").astype(np.int64)
    strength = _sharpnesses(prim, "creaseSharpnesses")
    if not len(lengths):
        return sharp
    per_edge = int(lengths.sum() - len(lengths))
    if lengths.min() < 2 or lengths.sum() != len(chain) or len(strength) not in (len(lengths), per_edge):
        raise fault(
            prim,
            "creaseLengths",
            "does not match creaseIndices and creaseSharpnesses",
            expected=f"{lengths.sum()} indices; {len(lengths)} or {per_edge} sharpnesses",
            got=f"{len(chain)} and {len(strength)}",
        )
    _check_indices(prim, "creaseIndices", chain, vertices)
    inner = np.ones(len(chain), bool)
    inner[np.cumsum(lengths) - 1] = False
    a, b = chain[inner], chain[np.flatnonzero(inner) + 1]
    along = np.repeat(strength, lengths - 1) if len(strength) == len(lengths) else strength
    key = np.minimum(a, b) * vertices + np.maximum(a, b)
    order = np.argsort(key)
    net = Net(counts, corners, vertices, sharp, np.zeros(vertices))
    c, d = corners, corners[net.following]
    mine = np.minimum(c, d) * np.int64(vertices) + np.maximum(c, d)
    at = np.minimum(np.searchsorted(key[order], mine), len(key) - 1)
    hit = key[order][at] == mine
    return np.where(hit, along[order][at], sharp)


def _corners(prim: Usd.Prim, vertices: int) -> Floats:
    """The sharpness of each vertex."""
    pointed = np.zeros(vertices)
    at, strength = integers(prim, "cornerIndices"), _sharpnesses(prim, "cornerSharpnesses")
    if len(at) != len(strength):
        expected, got = str(len(at)), str(len(strength))
        raise fault(prim, "cornerSharpnesses", "does not match cornerIndices", expected=expected, got=got)
    _check_indices(prim, "cornerIndices", at.astype(np.int64), vertices)
    pointed[at] = strength
    return pointed


def _sharpnesses(prim: Usd.Prim, name: str) -> Floats:
    found = vectors_of(prim, name, prim.GetAttribute(name), 1)[:, 0] if prim.GetAttribute(name) else np.zeros(0)
    return np.where(found >= SHARPEST, np.inf, np.maximum(found, 0.0))


def _check_indices(prim: Usd.Prim, name: str, found: Places, vertices: int) -> None:
    outside = np.flatnonzero((found < 0) | (found >= vertices))
    if outside.size:
        got = str(found[outside[0]])
        raise fault(prim, name, f"element {outside[0]} is out of range", expected=f"0 to {vertices - 1}", got=got)


def on_limit(
    prim: Usd.Prim,
    scheme: Scheme,
    net: Net,
    points: Floats,
    values: dict[str, Values],
    pixel: Callable[[Floats], Floats],
    hidden: Places,
) -> Limit:
    """The limit surface of ``net``. ``pixel`` gives the local size of a pixel at local places; ``hidden`` are holes."""
    steps, finest, error, drawn = _steps(scheme, net, points, pixel)
    if error > TOLERANCE:
        what = f"the limit surface by {len(steps[-1].net.counts)} faces, up to {error:.2g} pixel off it"
        note("approximated", where(prim, "subdivisionScheme"), what)
    last = steps[-1].net
    parent = np.arange(len(net.counts))
    for step in steps:
        parent = parent[step.parent]
    normals = limit_normals(last, finest) if scheme != "bilinear" else None
    spread = {name: _values(prim, scheme, net, steps, found, parent) for name, found in values.items()}
    kept = ~np.isin(parent, hidden)
    if value(prim, "interpolateBoundary", "word", "edgeAndCorner") == "none":
        kept &= ~_at_border(net)[parent]
    corner = np.repeat(kept, last.counts)
    return Limit(
        points=drawn,
        counts=last.counts[kept],
        corners=last.corners[corner],
        normals=None if normals is None else normals[corner],
        values={name: found[corner] for name, found in spread.items()},
        parent=parent[kept],
    )


def _at_border(net: Net) -> Bools:
    """The faces (f,) that have a vertex on the boundary."""
    edges = edges_of(net)
    border = np.zeros(net.vertices, bool)
    border[edges.ends[edges.faces != 2].ravel()] = True
    return np.logical_or.reduceat(border[net.corners], net.first)


def _steps(
    scheme: Scheme, net: Net, points: Floats, pixel: Callable[[Floats], Floats]
) -> tuple[list[Step], Floats, float, Floats]:
    """The steps that are needed, the finest net's points, how far it is from the limit in pixels, and its limit."""
    steps: list[Step] = []
    error = np.inf
    blunt = float(np.where(np.isfinite(net.sharp), net.sharp, 0.0).max(initial=0.0))
    blunt = max(blunt, float(np.where(np.isfinite(net.pointed), net.pointed, 0.0).max(initial=0.0)))
    limit = points
    while True:
        coarse = steps[-1].net if steps else net
        step = refine(coarse, scheme)
        points = step.weights @ points
        steps.append(step)
        limit = points if scheme == "bilinear" else limit_weights(step.net) @ points
        off = _off(scheme, coarse, limit) / np.maximum(pixel(limit[coarse.vertices :]), 1e-300)
        error = float(off.max(initial=0.0)) / _SHRINKS
        settled = len(steps) >= blunt
        if (error <= TOLERANCE and settled) or len(steps) == _MOST_STEPS or view().quick:
            return steps, points, error, limit
        if 4 * len(step.net.counts) > MOST_FACES:
            return steps, points, error, limit


def _off(scheme: Scheme, coarse: Net, limit: Floats) -> Floats:
    """How far the limit points in the middle of the coarser net's edges and faces are from these."""
    edges = edges_of(coarse)
    v, e = coarse.vertices, len(edges.ends)
    chord = np.linalg.norm(limit[v : v + e] - limit[edges.ends].mean(axis=1), axis=1)
    if scheme == "loop":
        return np.asarray(chord)
    middles = limit[v + e :]
    if not (coarse.counts == 4).all():
        sums = np.add.reduceat(limit[coarse.corners], coarse.first) / coarse.counts[:, None]
        return np.concatenate([chord, np.linalg.norm(middles - sums, axis=1)])
    quad = limit[coarse.corners].reshape(-1, 4, 3)
    halves = [np.linalg.norm(middles - (quad[:, k] + quad[:, k + 2]) / 2.0, axis=1) for k in (0, 1)]
    return np.concatenate([chord, np.maximum(*halves)])


def _values(prim: Usd.Prim, scheme: Scheme, net: Net, steps: list[Step], found: Values, parent: Places) -> Floats:
    """A primvar per corner of the finest net, by the rules of its interpolation."""
    last = steps[-1].net
    values = found.values
    if found.interpolation == "constant":
        return np.repeat(values, len(last.corners), axis=0)
    if found.interpolation == "uniform":
        return np.repeat(values[parent], last.counts, axis=0)
    if found.interpolation == "faceVarying":
        seams = value(prim, "faceVaryingLinearInterpolation", "word", "cornersPlus1")
        if seams not in _SEAMS:
            expected = ", ".join(_SEAMS)
            raise fault(prim, "faceVaryingLinearInterpolation", "unknown rule", expected=expected, got=str(seams))
        own = _seamed(net, found.at, len(values), seams)
        linear = seams == "all"
    else:
        own, linear = net, found.interpolation == "varying"
    for _ in steps:
        step = refine(own, scheme, linear=linear)
        own, values = step.net, step.weights @ values
    if not linear and scheme != "bilinear":
        values = limit_weights(own) @ values
    return np.asarray(values[own.corners])


def _seamed(net: Net, at: Places, count: int, seams: str) -> Net:
    """The mesh of a primvar's values: its seams are its boundary, and ``seams`` says which of them are sharp."""
    own = Net(net.counts, at, count, net.sharp, np.zeros(count))
    pointed = np.full(count, -np.inf)
    np.maximum.at(pointed, at, net.pointed[net.corners])
    own = Net(own.counts, at, count, own.sharp, np.maximum(pointed, 0.0))
    own = with_boundary(own, corners=seams != "none")
    edges = edges_of(own)
    border = np.zeros(count, bool)
    border[edges.ends[edges.faces != 2].ravel()] = True
    sharp = own.pointed.copy()
    if seams == "boundaries":
        sharp[border] = np.inf
    elif seams in ("cornersPlus1", "cornersPlus2"):
        pairs = np.unique(np.stack([net.corners, at], axis=1), axis=0)  # which values meet at each vertex
        meeting = np.bincount(pairs[:, 0], minlength=net.vertices)
        ends = np.bincount(edges.ends[edges.faces != 2].ravel(), minlength=count)
        dart = np.zeros(count, bool)
        dart[at] = (meeting[net.corners] == 1) & (ends[at] > 0) & _inside(net)[net.corners]
        many = meeting[net.corners] > 2
        sharp[at[many]] = np.inf
        if seams == "cornersPlus2":
            sharp[dart] = np.inf
            two = meeting[net.corners] == 2
            faces = np.bincount(at, minlength=count)
            around = np.bincount(net.corners, minlength=net.vertices)
            concave = two & (2 * faces[at] > around[net.corners] + 1)
            sharp[at[concave]] = np.inf
    return Net(own.counts, own.corners, count, own.sharp, sharp)


def _inside(net: Net) -> Bools:
    """The vertices (v,) that are not on the boundary."""
    edges = edges_of(net)
    inside = np.ones(net.vertices, bool)
    inside[edges.ends[edges.faces != 2].ravel()] = False
    return inside
