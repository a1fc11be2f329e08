"""UsdPrimvarReader shaders of numbers and colours: what the prim that a material is bound to says of itself."""

from __future__ import annotations

import numpy as np
from pxr import Usd, UsdGeom, UsdShade

from notabug.scenes_usd.reader_values import fault, opinion, vectors_of
from notabug.scenes_usd.scene import Floats

_WIDTHS = {"float": 1, "float3": 3, "vector": 3, "normal": 3, "point": 3}
_READER = "UsdPrimvarReader_"


def reads_value(shader: Usd.Prim) -> bool:
    """Whether ``shader`` reads a primvar that an input may take: texture coordinates are read by textures."""
    name = str(UsdShade.Shader(shader).GetShaderId())
    return name.startswith(_READER) and name.removeprefix(_READER) in _WIDTHS


class Primvars:
    """The primvars of one prim; ``asked`` says whether its material looked at any."""

    def __init__(self, prim: Usd.Prim) -> None:
        self._prim = prim.GetParent() if prim.IsA(UsdGeom.Subset) else prim
        self.asked = False

    def value(self, reader: UsdShade.Shader) -> float | tuple[float, ...]:
        """What ``reader`` finds: a number or a triple, its fallback where the prim has no such primvar.

        Raises SceneError where the primvar varies over the surface, or where the reader says no name.
        """
        self.asked = True
        width = _WIDTHS[str(reader.GetShaderId()).removeprefix(_READER)]
        name = str(_constant(reader, "varname") or "")
        if not name:
            raise fault(reader.GetPrim(), "inputs:varname", "no name", expected="the name of a primvar")
        found = one_value(self._prim, f"primvars:{name}", width)
        if found is not None:
            return float(found[0, 0]) if width == 1 else tuple(found[0].tolist())
        fallback = _constant(reader, "fallback")
        said = np.zeros(width) if fallback is None else np.asarray(fallback, np.float64).reshape(-1)[:width]
        return float(said[0]) if width == 1 else tuple(said.tolist())


def one_value(prim: Usd.Prim, name: str, width: int) -> Floats | None:
    """The one value (1, ``width``) of the primvar ``name`` of ``prim``, its own or inherited, or None without one.

    Raises SceneError where it varies over the surface.
    """
    primvar = UsdGeom.PrimvarsAPI(prim).FindPrimvarWithInheritance(name.removeprefix("primvars:"))
    if not primvar or not primvar.HasValue():
        return None
    attribute = primvar.GetAttr()
    if not attribute.GetTypeName().isArray:  # a constant need not be a list
        return np.asarray(attribute.Get(), np.float64).reshape(1, -1)[:, :width]
    values = vectors_of(prim, name, attribute, width)
    if not len(values):
        return None
    if np.ptp(values, axis=0).max() > 0.0:
        mean = values.mean(axis=0)
        kind = "color3f[]" if width == 3 else "float[]"
        mends = opinion(prim, name, kind, [tuple(mean.tolist()) if width == 3 else float(mean[0])], "one for all")
        raise fault(
            prim,
            name,
            "varies over the surface, which no material of the contract does",
            expected="one value",
            got=f"{len(values)} values",
            mends=mends,
        )
    return values[:1]


def _constant(reader: UsdShade.Shader, name: str) -> object:
    """The value of the reader's input ``name``, its own or through an interface; None where there is none."""
    given = reader.GetInput(name)
    sources = UsdShade.Utils.GetValueProducingAttributes(given) if given else []
    found: object = sources[0].Get() if sources else None
    return found
