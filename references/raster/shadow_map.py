"""Shadow maps: the distance to what each light sees first, drawn by the same z-buffer (Williams 1978)."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from notabug.references import _native
from notabug.references.tracer.flatten import Flat

Array = npt.NDArray[Any]
_NEAR = 1e-4  # of a point light's reach: what is nearer casts no shadow
_MARGIN = 1.001  # of the extent that a distant light's map covers
# Forward and up of a cube map's six faces.
_FACES = np.array(
    [
        [[1, 0, 0], [0, 1, 0]],
        [[-1, 0, 0], [0, 1, 0]],
        [[0, 1, 0], [0, 0, 1]],
        [[0, -1, 0], [0, 0, 1]],
        [[0, 0, 1], [0, 1, 0]],
        [[0, 0, -1], [0, 1, 0]],
    ],
    np.float64,
)


class ShadowMaps(NamedTuple):
    """The maps of all lights: six faces of a cube for a point light, one parallel view for a distant one."""

    first: Array  # (lights + 1,) first map of each light
    frame: Array  # (m, 14) the view, as in references/native/zbuffer.h
    parallel: Array  # (m,)
    depth: Array  # (m, n, n) distance along the view's axis, inf where the light sees nothing
    bias: Any  # in the scene's unit of length, a scalar of the arrays' precision
    normal_bias: Any  # the same


def shadow_maps(flat: Flat, order: Array, cells: int, bias: float, normal_bias: float = 0.0) -> ShadowMaps:
    """Maps of ``cells`` x ``cells`` for every light of ``flat``; all surfaces cast shadows, transparent ones too."""
    points = flat.points.reshape(-1, 3).astype(np.float64)
    views: list[Array] = []
    parallel: list[bool] = []
    first = [0]
    for light in flat.light.astype(np.float64):
        if light[0] == 0:
            reach = float(np.linalg.norm(points - light[1:4], axis=1).max(initial=1e-30)) * _MARGIN
            views += [_view(light[1:4], forward, up, 1.0, 1.0, _NEAR * reach, reach) for forward, up in _FACES]
        else:
            views.append(_beam(points, light[1:4]))
        parallel += [bool(light[0])] * (len(views) - first[-1])
        first.append(len(views))
    frame = np.array(views).reshape(-1, 14).astype(flat.points.dtype)
    depth = np.full((len(views), cells, cells), np.inf)
    winner = np.empty((cells, cells), np.int32)
    for each in range(len(views)):
        _native.fill(flat.points, order, frame[each], parallel[each], "distance", False, depth[each], winner)
    real = flat.points.dtype.type
    first_of, parallel_of = np.array(first, np.int64), np.array(parallel, np.bool_)
    return ShadowMaps(first_of, frame, parallel_of, depth.astype(real), real(bias), real(normal_bias))


def _view(eye: Array, forward: Array, up: Array, half_x: float, half_y: float, near: float, far: float) -> Array:
    x = np.cross(forward, up)
    return np.concatenate([eye, x / half_x, np.cross(x, forward) / half_y, forward, [near, far]])


def _beam(points: Array, direction: Array) -> Array:
    """The parallel view along ``direction`` that holds all ``points``."""
    forward = direction / np.linalg.norm(direction)
    axis = np.eye(3)[np.argmin(np.abs(forward))]
    up = np.cross(np.cross(forward, axis), forward)
    up /= np.linalg.norm(up)
    x = np.cross(forward, up)
    centre = (points.min(axis=0, initial=np.inf) + points.max(axis=0, initial=-np.inf)) / 2.0 if len(points) else axis
    local = (points - centre) @ np.stack([x, up, forward], axis=1)
    half = np.maximum(np.abs(local).max(axis=0, initial=0.0) * _MARGIN, 1e-30)
    return _view(centre, forward, up, half[0], half[1], -half[2], half[2])
