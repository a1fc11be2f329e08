"""Attribute values of one prim, checked: present, still, finite, in range. A failed check names prim and attribute."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from pxr import Usd, UsdGeom

from notabug.scenes_usd.errors import SceneError
from notabug.scenes_usd.scene import Floats, Ints

TIME = Usd.TimeCode.EarliestTime()  # a lone time sample, as some exporters write, counts as a plain value

Colour = tuple[float, float, float]


def fault(prim: Usd.Prim, attribute: str, what: str, *, expected: str = "", got: str = "", do: str = "") -> SceneError:
    """The error about ``attribute`` of ``prim`` ("" for the prim as a whole)."""
    where = f"{prim.GetPath()}.{attribute}" if attribute else str(prim.GetPath())
    return SceneError(what, where=where, expected=expected, got=got, do=do)


def value(prim: Usd.Prim, name: str, fallback: Any = None) -> Any:
    """The attribute ``name``, or what the schema says it is where nobody authored it, or ``fallback``."""
    attribute = prim.GetAttribute(name)
    if not attribute:
        return fallback
    if attribute.ValueMightBeTimeVarying():
        raise fault(prim, name, "the value is animated", expected="one value", do="export a single frame")
    found = attribute.Get(TIME)
    return fallback if found is None else found


def number(prim: Usd.Prim, name: str, fallback: float, *, low: float = -math.inf, high: float = math.inf) -> float:
    """A finite number in [low, high]."""
    return check_number(prim, name, value(prim, name, fallback), low=low, high=high)


def check_number(prim: Usd.Prim, name: str, found: Any, *, low: float = -math.inf, high: float = math.inf) -> float:
    """``found`` as a finite float in [low, high]."""
    if not isinstance(found, int | float) or isinstance(found, bool):
        raise fault(prim, name, "not a number", got=repr(found))
    if not math.isfinite(found) or not low <= found <= high:
        raise fault(prim, name, "out of range", expected=_range(low, high), got=repr(found))
    return float(found)


def check_colour(prim: Usd.Prim, name: str, found: Any, *, high: float = 1.0) -> Colour:
    """``found`` as three finite floats in [0, high]."""
    try:
        r, g, b = (float(each) for each in found)
    except (TypeError, ValueError):
        raise fault(prim, name, "not a colour", expected="three numbers", got=repr(found)) from None
    if not all(math.isfinite(each) and 0.0 <= each <= high for each in (r, g, b)):
        raise fault(prim, name, "colour out of range", expected=_range(0.0, high), got=repr((r, g, b)))
    return r, g, b


def vectors(prim: Usd.Prim, name: str, found: Any, width: int) -> Floats:
    """``found`` as a finite (n, width) array; the error says which row is not finite."""
    array = np.asarray([] if found is None else found, np.float64)
    if array.size == 0:
        array = array.reshape(0, width)
    if array.ndim != 2 or array.shape[1] != width:
        raise fault(prim, name, "wrong type", expected=f"an array of {width}-vectors", got=f"shape {array.shape}")
    bad = np.flatnonzero(~np.isfinite(array).all(axis=1))
    if bad.size:
        raise fault(prim, name, f"element {bad[0]} is not finite", got=str(tuple(array[bad[0]].tolist())))
    return array


def integers(found: Any) -> Ints:
    """``found`` as a (n,) array."""
    return np.asarray([] if found is None else found, np.int32).reshape(-1)


def world_matrix(prim: Usd.Prim) -> Floats:
    """The local-to-world matrix (4, 4), row vectors; refused where animated, not finite, projective or singular."""
    node = prim
    while node and not node.IsPseudoRoot():
        form = UsdGeom.Xformable(node)
        if form and form.TransformMightBeTimeVarying():
            raise fault(node, "xformOpOrder", "the transform is animated", do="export a single frame")
        node = node.GetParent()
    matrix: Floats = np.array(UsdGeom.XformCache(TIME).GetLocalToWorldTransform(prim), np.float64)
    if not np.isfinite(matrix).all():
        raise fault(prim, "xformOpOrder", "the transform to world space is not finite", got=str(matrix.tolist()))
    if not np.array_equal(matrix[:, 3], (0.0, 0.0, 0.0, 1.0)):
        raise fault(prim, "xformOpOrder", "the transform to world space is projective", expected="an affine one")
    linear = matrix[:3, :3]
    lengths = np.linalg.norm(linear, axis=1)
    if not lengths.all() or abs(np.linalg.det(linear / lengths[:, None])) < 1e-9:
        raise fault(
            prim,
            "xformOpOrder",
            "the transform to world space is singular",
            got=str(linear.tolist()),
            do="scale by > 0",
        )
    return matrix


def _range(low: float, high: float) -> str:
    if math.isinf(low) and math.isinf(high):
        return "a finite number"
    return f"at least {low:g}" if math.isinf(high) else f"{low:g} to {high:g}"
