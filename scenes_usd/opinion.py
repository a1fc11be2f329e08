"""An opinion of a layer over a scene: one attribute of one prim that says something the contract can say."""

from __future__ import annotations

from dataclasses import dataclass

Value = bool | int | float | str | tuple[float, ...] | tuple[str, ...] | list[float | tuple[float, ...]]
"""What an attribute can be told to be."""


BLOCKED = "block"  # the type of an opinion that an attribute has no value
LEFT_OUT = "notabug:leftOut"  # key of the custom data of a prim that adapt leaves out; its value says why


@dataclass(frozen=True, slots=True)
class Opinion:
    """The attribute ``name`` of the prim at ``path`` is to be ``value``, of the Sdf type called ``type``.

    Connections of the attribute go. ``because`` says what the original had, for the person who reads the layer.
    """

    path: str
    name: str
    type: str
    value: Value
    because: str = ""
