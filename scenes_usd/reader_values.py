"""Attribute values of one prim, checked: present, still, finite, in range. A failed check names prim and attribute."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from typing import Any, Literal, cast

import numpy as np
import numpy.typing as npt
from pxr import Sdf, Tf, Usd, UsdGeom

from notabug.scenes_usd.errors import SceneError
from notabug.scenes_usd.opinion import Opinion, Value
from notabug.scenes_usd.reading import frame, going_on, recovered
from notabug.scenes_usd.scene import Floats, Ints

TIME = Usd.TimeCode.EarliestTime()  # a lone time sample, as some exporters write, counts as a plain value
ROUNDED = 2.0**-20  # of a number or of 1: eight roundings of float32, in which most of USD's numbers are stored
AFFINE = 1e-9  # of a matrix's last column: products and inverses of doubles leave some 1e-16 a factor there
SINGULAR = 1e-9  # volume of a matrix's three directions, over that of three at right angles
ORTHOGONAL = 1e-5  # of a matrix's rows squared: many exporters write six digits, which leaves a few 1e-6
FARTHEST = 1e12  # of a coordinate in world space: a product of three, a determinant, is still a float32

_FREEZE = "choose a frame: notabug adapt SCENE --time CODE --out own.usda"
_FAR = "world space reaches too far"
_MISTYPED = "a value of the wrong type"
_INT32 = np.iinfo(np.int32)

Colour = tuple[float, float, float]
Plain = bool | float | tuple[float, ...]
"""The one value that the contract can say."""


def fault(
    prim: Usd.Prim,
    attribute: str,
    what: str,
    *,
    expected: str = "",
    got: str = "",
    do: str = "",
    mends: tuple[Opinion, ...] = (),
) -> SceneError:
    """The error about ``attribute`` of ``prim`` ("" for the prim as a whole)."""
    error = SceneError(what, where=where(prim, attribute), expected=expected, got=got, do=do)
    error.mends = mends
    return error


def where(prim: Usd.Prim, attribute: str = "") -> str:
    """How messages call ``attribute`` of ``prim``."""
    return f"{prim.GetPath()}.{attribute}" if attribute else str(prim.GetPath())


def opinion(prim: Usd.Prim, name: str, kind: str, value: Value, because: str = "") -> tuple[Opinion, ...]:
    """The opinion that ``name`` of ``prim`` is ``value``."""
    return (Opinion(str(prim.GetPath()), name, kind, value, because),)


Kind = Literal["flag", "number", "word", "asset", "numbers"]

_KINDS: dict[str, tuple[Callable[[Any], bool], str]] = {  # what each kind of value is in Python, and in words
    "flag": (lambda found: isinstance(found, bool), "true or false"),
    "number": (lambda found: isinstance(found, int | float) and not isinstance(found, bool), "a number"),
    "word": (lambda found: isinstance(found, str), "a word"),
    "asset": (lambda found: isinstance(found, Sdf.AssetPath), "the path of a file, as in @picture.png@"),
    "numbers": (lambda found: _as_numbers(found) is not None, "numbers in brackets, as in (1, 0.5, 0)"),
}
_SHOWN = 80  # characters of a wrong value in a message


@contextmanager
def blamed(prim: Usd.Prim, attribute: str) -> Iterator[None]:
    """Whatever OpenUSD refuses inside is the fault of ``attribute`` of ``prim``."""
    try:
        yield
    except Tf.ErrorException as error:
        reason = " ".join(str(error).split()).rsplit(" : ", 1)[-1]
        raise fault(prim, attribute, "OpenUSD refuses it", got=reason, do="try usdchecker") from error


def value(prim: Usd.Prim, name: str, kind: Kind, fallback: Any = None) -> Any:
    """The attribute ``name``, or what the schema says it is where nobody authored it, or ``fallback``."""
    return recovered(lambda: checked(prim, name, read(prim, name, prim.GetAttribute(name)), kind, fallback), fallback)


def read(prim: Usd.Prim, name: str, attribute: Usd.Attribute) -> Any:
    """The value of ``attribute``, whatever its type; None where it has none or is blocked.

    Every value of a stage is read here. ``prim`` and ``name`` are those a message names.
    """
    if not attribute:
        return None
    if not attribute.ValueMightBeTimeVarying():
        return attribute.Get(TIME)
    code = frame()
    if code is not None:
        return attribute.Get(code)
    first = attribute.Get(TIME)
    if any(not _alike(first, attribute.Get(sample)) for sample in attribute.GetTimeSamples()[1:]):
        raise fault(prim, name, "the value is animated", expected="one value", do=_FREEZE)
    return first


def _alike(a: object, b: object) -> bool:
    """Whether two values of one attribute are the same: samples of what stands still are written again and again."""
    same_value = a == b
    return bool(same_value) if not hasattr(same_value, "all") else bool(same_value.all())


def checked(prim: Usd.Prim, name: str, found: object, kind: Kind, fallback: Any = None) -> Any:
    """``found``, which must be of ``kind``, or ``fallback`` for None: USD does not hold authored values to a schema."""
    if found is None:
        return fallback
    fits, expected = _KINDS[kind]
    if not fits(found):
        raise fault(prim, name, _MISTYPED, expected=expected, got=shown(found))
    return _as_numbers(found) if kind == "numbers" else found


def number(prim: Usd.Prim, name: str, fallback: float, *, low: float = -math.inf, high: float = math.inf) -> float:
    """A finite number in [low, high]; ``fallback`` where a reading goes on after a fault."""
    found = value(prim, name, "number", fallback)
    return recovered(lambda: check_number(prim, name, found, low=low, high=high), fallback)


def check_number(prim: Usd.Prim, name: str, found: object, *, low: float = -math.inf, high: float = math.inf) -> float:
    """``found`` as a finite float in [low, high]; one that rounding has put beside the range is its end."""
    number: float = checked(prim, name, found, "number")
    if number is None or not math.isfinite(number) or not _within(number, low, high):
        raise fault(prim, name, "out of range", expected=_range(low, high), got=repr(found))
    return min(max(float(number), low), high)


def check_colour(prim: Usd.Prim, name: str, found: object, *, high: float = 1.0) -> Colour:
    """``found`` as three finite floats in [0, high], as ``check_number`` has it."""
    colour = checked(prim, name, found, "numbers")
    if colour is None or len(colour) != 3:
        raise fault(prim, name, "not a colour", expected="three numbers", got=shown(found))
    if not all(math.isfinite(each) and _within(each, 0.0, high) for each in colour):
        raise fault(prim, name, "colour out of range", expected=_range(0.0, high), got=repr(colour))
    r, g, b = (min(max(each, 0.0), high) for each in colour)
    return r, g, b


def vectors(prim: Usd.Prim, name: str, width: int) -> Floats:
    """The attribute ``name`` as a finite (n, width) array; the error says which row is not finite."""
    return vectors_of(prim, name, prim.GetAttribute(name), width)


def vectors_of(prim: Usd.Prim, name: str, attribute: Usd.Attribute, width: int) -> Floats:
    """As ``vectors`` has it, of an ``attribute`` that another prim may hold; plain numbers are vectors of one."""
    found = read(prim, name, attribute)
    array = _array(found)
    if width == 1 and array.ndim == 1:
        array = array[:, None]
    if array.size == 0 and array.ndim < 3:
        array = np.zeros((0, width))
    if array.dtype.kind not in "fiu" or array.ndim != 2 or array.shape[1] != width:
        raise fault(prim, name, _MISTYPED, expected=f"an array of {width}-vectors", got=shown(found))
    rows: Floats = array.astype(np.float64)
    bad = np.flatnonzero(~np.isfinite(rows).all(axis=1))
    if bad.size:
        raise fault(prim, name, f"element {bad[0]} is not finite", got=str(tuple(rows[bad[0]].tolist())))
    return rows


def integers(prim: Usd.Prim, name: str, attribute: Usd.Attribute | None = None) -> Ints:
    """The attribute ``name``, or ``attribute``, as a (n,) array; (0,) where it has no value."""
    found = read(prim, name, attribute or prim.GetAttribute(name))
    array = _array(found)
    if array.size == 0:
        return np.zeros(0, np.int32)
    if array.dtype.kind not in "iu" or array.ndim != 1:
        raise fault(prim, name, _MISTYPED, expected="an array of whole numbers", got=shown(found))
    if array.min() < _INT32.min or array.max() > _INT32.max:
        raise fault(prim, name, "out of range", expected="numbers of 32 bits", got=shown(found))
    return array.astype(np.int32)


def same(found: float, plain: float) -> bool:
    """Whether a number that was authored in float32, or computed, is ``plain``: what is rounded has a tolerance."""
    if math.isinf(plain):
        return found == plain
    return abs(found - plain) <= ROUNDED * max(1.0, abs(plain))


def check_plain(
    prim: Usd.Prim, name: str, found: object, plain: Plain, what: str, do: str = "", mends: tuple[Opinion, ...] = ()
) -> None:
    """Refuse ``found`` unless it is ``plain``, up to rounding, or None: the only value the contract can say."""
    if found is not None:
        with going_on():
            _check_plain(prim, name, found, plain, what, do, mends)


def _check_plain(
    prim: Usd.Prim, name: str, found: object, plain: Plain, what: str, do: str, mends: tuple[Opinion, ...]
) -> None:
    if isinstance(plain, bool):
        fits = checked(prim, name, found, "flag") is plain
    elif isinstance(plain, tuple):
        numbers: tuple[float, ...] = checked(prim, name, found, "numbers")
        pairs = zip(numbers, plain, strict=False)
        fits = len(numbers) == len(plain) and all(same(number, other) for number, other in pairs)
    else:
        fits = same(checked(prim, name, found, "number"), plain)
    if not fits:
        raise fault(prim, name, what, expected=str(plain), got=shown(found), do=do, mends=mends)


def _within(found: float, low: float, high: float) -> bool:
    return low <= found <= high or same(found, low) or same(found, high)


def shown(found: object) -> str:
    """A value in a message: long arrays by their beginning, numbers as they were authored in single precision.

    >>> shown(0.30000001192092896)
    '0.3'
    """
    numbers = _as_numbers(found) if type(found).__module__ == "pxr.Gf" else None
    text = f"({', '.join(map(shown, numbers))})" if numbers else " ".join(repr(found).split())
    if isinstance(found, float):
        with np.errstate(over="ignore"):  # single precision ends at 3e38
            single = np.float32(found)
        text = str(single) if float(single) == found else text
    return text if len(text) <= _SHOWN else f"{text[:_SHOWN]}..."


def _array(found: npt.ArrayLike | None) -> npt.NDArray[np.generic]:
    """``found`` as an array; one of objects where it is none of numbers."""
    try:
        return np.asarray([] if found is None else found)
    except (TypeError, ValueError):  # rows of several lengths
        return np.asarray(None)


def _as_numbers(found: object) -> tuple[float, ...] | None:
    """A vector of USD as floats, or None where it is something else."""
    if isinstance(found, str):
        return None
    try:
        return tuple(float(number) for number in cast(Iterable[float], found))
    except (TypeError, ValueError):
        return None


def world_matrix(prim: Usd.Prim) -> Floats:
    """The local-to-world matrix (4, 4), row vectors; refused where animated, not finite, projective or singular."""
    code = frame()
    at = TIME if code is None else Usd.TimeCode(code)
    node = prim
    while node and not node.IsPseudoRoot():
        form = UsdGeom.Xformable(node)
        with blamed(node, "xformOpOrder"):
            if form and code is None and form.TransformMightBeTimeVarying() and _moves(form):
                raise fault(node, "xformOpOrder", "the transform is animated", do=_FREEZE)
            if form:
                form.GetLocalTransformation(at)
        node = node.GetParent()
    with blamed(prim, "xformOpOrder"):
        matrix: Floats = np.array(UsdGeom.XformCache(at).GetLocalToWorldTransform(prim), np.float64)
    if not np.isfinite(matrix).all():
        raise fault(prim, "xformOpOrder", "the transform to world space is not finite", got=str(matrix.tolist()))
    if np.abs(matrix).max() > FARTHEST:
        raise fault(prim, "xformOpOrder", _FAR, expected=f"at most {FARTHEST:g}", got=f"{np.abs(matrix).max():g}")
    if np.abs(matrix[:, 3] - (0.0, 0.0, 0.0, 1.0)).max() > AFFINE:
        raise fault(
            prim,
            "xformOpOrder",
            "the transform to world space is projective",
            expected="an affine one, whose last column is (0, 0, 0, 1)",
            got=str(tuple(matrix[:, 3].tolist())),
        )
    matrix[:, 3] = 0.0, 0.0, 0.0, 1.0
    linear = matrix[:3, :3]
    lengths = np.linalg.norm(linear, axis=1)
    if not lengths.min() > 0.0 or abs(np.linalg.det(linear / lengths[:, None])) < SINGULAR:
        raise fault(
            prim,
            "xformOpOrder",
            "the transform to world space is singular",
            got=str(linear.tolist()),
            do="scale by > 0",
        )
    return matrix


def _moves(form: UsdGeom.Xformable) -> bool:
    """Whether the samples of a transform differ."""
    first = form.GetLocalTransformation(TIME)
    return any(form.GetLocalTransformation(sample) != first for sample in form.GetTimeSamples())


def check_reach(prim: Usd.Prim, name: str, points: Floats) -> None:
    """Raise SceneError where ``points`` (p, 3), in world space, lie farther out than renderers can say."""
    farthest = float(np.abs(points).max(initial=0.0))
    if farthest > FARTHEST:
        raise fault(prim, name, _FAR, expected=f"at most {FARTHEST:g}", got=f"{farthest:g}")


def turns_over(linear: Floats) -> bool:
    """Whether a regular matrix (3, 3) mirrors, however small or large it is."""
    return bool(np.linalg.det(linear / np.linalg.norm(linear, axis=1, keepdims=True)) < 0)


def _range(low: float, high: float) -> str:
    if math.isinf(low) and math.isinf(high):
        return "a finite number"
    return f"at least {low:g}" if math.isinf(high) else f"{low:g} to {high:g}"
