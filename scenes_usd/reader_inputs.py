"""The inputs of a shader prim: constants, through interfaces, and what they are connected to."""

from __future__ import annotations

import math
from typing import Any

from pxr import Usd, UsdShade

from notabug.scenes_usd.opinion import Opinion
from notabug.scenes_usd.reader_primvar import Primvars, reads_value
from notabug.scenes_usd.reader_values import Colour, check_colour, check_number, fault, read, where
from notabug.scenes_usd.reading import note, recovered, refuse

PREVIEW = "UsdPreviewSurface"


class Inputs:
    """The inputs of a shader that are authored, by name.

    One that is not ``known`` is refused, or with ``lenient`` left out and noted: exporters write inputs of their own on
    a UsdPreviewSurface, and no renderer looks at them. A primvar reader reads those of ``primvars``.
    """

    def __init__(
        self, shader: UsdShade.Shader, known: set[str], *, lenient: bool = False, primvars: Primvars | None = None
    ) -> None:
        self.prim = shader.GetPrim()
        self._primvars = primvars
        self._authored = {str(each.GetBaseName()): each for each in shader.GetInputs()}
        for name in self._authored:
            if name in known:
                continue
            if lenient:
                note("not read", where(self.prim, f"inputs:{name}"), f"an input that {PREVIEW} does not have")
                continue
            expected = f"one of {', '.join(sorted(known))}"
            refuse(fault(self.prim, f"inputs:{name}", "unknown input", expected=expected))

    def source(self, name: str) -> Usd.Attribute | None:
        """The attribute that gives the input its value, through connections and interfaces; None where nothing does."""
        given = self._authored.get(name)
        sources = UsdShade.Utils.GetValueProducingAttributes(given) if given else []
        if len(sources) > 1:
            raise fault(self.prim, f"inputs:{name}", f"{len(sources)} connections", expected="one")
        return sources[0] if sources else None

    def shaded(self, name: str) -> Usd.Attribute | None:
        """The output of another shader that gives the input its value; None where none does."""
        source = self.source(name)
        return source if source is not None and _is_output(source) and not self._reads_primvar(source) else None

    def authored(self, name: str) -> bool:
        """Whether somebody gave the input a value or a connection."""
        given = self._authored.get(name)
        return given is not None and (given.HasConnectedSource() or given.GetAttr().HasAuthoredValue())

    def constant(self, name: str, fallback: Any, mends: tuple[Opinion, ...] = ()) -> Any:
        """The value of an input that must not be connected to a shader."""
        source = self.source(name)
        if source is None:
            if name in self._authored and self._authored[name].HasConnectedSource():
                raise fault(self.prim, f"inputs:{name}", "connected to something that has no value")
            return fallback
        if self._primvars is not None and self._reads_primvar(source):
            return self._primvars.value(UsdShade.Shader(source.GetPrim()))
        if _is_output(source):
            raise fault(
                self.prim,
                f"inputs:{name}",
                "may not be textured",
                got=str(source.GetPath()),
                do="use a constant",
                mends=mends,
            )
        found = read(self.prim, f"inputs:{name}", source)
        return fallback if found is None else found

    def _reads_primvar(self, source: Usd.Attribute) -> bool:
        """Whether the output ``source`` is what a reader of numbers or colours finds on the surface's own prim."""
        return self._primvars is not None and _is_output(source) and reads_value(source.GetPrim())

    def number(self, name: str, *, low: float, high: float = math.inf) -> float:
        return recovered(
            lambda: check_number(self.prim, f"inputs:{name}", self.constant(name, 1.0), low=low, high=high), 1.0
        )

    def colour(self, name: str, *, high: float = 1.0) -> Colour:
        black = (0.0, 0.0, 0.0)
        return recovered(
            lambda: check_colour(self.prim, f"inputs:{name}", self.constant(name, black), high=high), black
        )


def _is_output(source: Usd.Attribute) -> bool:
    return bool(UsdShade.Utils.GetType(source.GetName()) == UsdShade.AttributeType.Output)
