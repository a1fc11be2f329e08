"""Values of a layer: as the Sdf type of an attribute holds them, and as a line of text shows them."""

from __future__ import annotations

import numpy as np
from pxr import Gf, Sdf, Vt

from notabug.scenes_usd.opinion import BLOCKED, Opinion, Value


def typed(kind: str, value: Value) -> object:
    """``value`` as the Sdf type called ``kind`` holds it."""
    if kind == "asset":
        return Sdf.AssetPath(value)
    if not isinstance(value, tuple | list):
        return value
    if kind == "matrix4d":
        return Gf.Matrix4d(*value)
    if kind == "token[]":
        return Vt.TokenArray(value)
    if kind in ("color3f", "normal3f"):
        return Gf.Vec3f(*value)
    if kind == "color3f[]":
        return Vt.Vec3fArray([Gf.Vec3f(*row) for row in value if isinstance(row, tuple)])
    if kind == "float[]":
        return Vt.FloatArray(value)
    if kind == "float4[]":
        return Vt.Vec4fArray(value)
    return value


def shown_value(value: object) -> str:
    """A value in a line: numbers in few digits."""
    if isinstance(value, bool) or not isinstance(value, int | float | tuple | Gf.Vec3f):
        text = str(value).strip("@") if isinstance(value, Sdf.AssetPath) else str(value)
        text = text or "empty"
        return text if len(text) <= 60 else f"{text[:57]}..."
    if isinstance(value, int | float):
        return f"{value:g}"
    return f"({', '.join(part if isinstance(part, str) else f'{part:g}' for part in value)})"


def says_already(layer: Sdf.Layer, opinion: Opinion) -> bool:
    """Whether ``layer`` says ``opinion`` already: several faults of one prim may be mended by the same one."""
    spec = layer.GetAttributeAtPath(Sdf.Path(opinion.path).AppendProperty(opinion.name))
    if spec is None or opinion.type in ("preview", "rel"):
        return False
    if opinion.type == BLOCKED:
        return isinstance(spec.default, Sdf.ValueBlock)
    return spec.HasDefaultValue() and bool(np.all(spec.default == typed(opinion.type, opinion.value)))
