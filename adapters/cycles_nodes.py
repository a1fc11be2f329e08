"""Arithmetic as Blender's shader nodes, for the process that Cycles runs in; bpy is the caller's.

A value is a constant of three numbers, or the output of a node. What constants alone say is computed at once.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from typing import TypeAlias

    from bpy.types import Light, Material, Node, NodeSocket, World

    Constant: TypeAlias = tuple[float, float, float]
    Value: TypeAlias = Constant | NodeSocket

ZERO, ONE = (0.0, 0.0, 0.0), (1.0, 1.0, 1.0)


class Graph:
    """The node tree of a material, a light or a world, empty at first."""

    def __init__(self, owner: Material | Light | World) -> None:
        if owner.node_tree is None:
            owner.use_nodes = True
        self.tree = owner.node_tree
        self.tree.nodes.clear()

    def node(self, kind: str) -> Node:
        return self.tree.nodes.new(f"ShaderNode{kind}")

    def put(self, value: Value, socket: NodeSocket) -> None:
        """Give ``socket`` the ``value``: a number takes the first of the three, a colour its alpha besides."""
        if not isinstance(value, tuple):
            self.tree.links.new(value, socket)
        elif socket.type == "VALUE":
            socket.default_value = value[0]
        else:
            socket.default_value = (*value, 1.0) if socket.type == "RGBA" else value

    def of_node(self, kind: str, output: str) -> NodeSocket:
        """The ``output`` of a new node without inputs."""
        return self.node(kind).outputs[output]

    def attribute(self, name: str) -> NodeSocket:
        """The vector that the mesh has under ``name``."""
        node = self.node("Attribute")
        node.attribute_name = name
        return node.outputs["Vector"]

    def vector(self, operation: str, *values: Value) -> NodeSocket:
        """A vector operation of Blender, by its name: of a dot product the number."""
        node = self.node("VectorMath")
        node.operation = operation
        for value, socket in zip(values, node.inputs, strict=False):
            self.put(value, socket)
        return node.outputs["Value" if operation == "DOT_PRODUCT" else "Vector"]

    def number(self, operation: str, *values: Value) -> NodeSocket:
        """An operation on numbers, by its name."""
        node = self.node("Math")
        node.operation = operation
        for value, socket in zip(values, node.inputs, strict=False):
            self.put(value, socket)
        return node.outputs[0]

    def add(self, one: Value, other: Value) -> Value:
        if isinstance(one, tuple) and isinstance(other, tuple):
            return one[0] + other[0], one[1] + other[1], one[2] + other[2]
        return self.vector("ADD", one, other)

    def times(self, one: Value, other: Value) -> Value:
        if isinstance(one, tuple) and isinstance(other, tuple):
            return one[0] * other[0], one[1] * other[1], one[2] * other[2]
        if ZERO in (one, other):
            return ZERO
        return one if other == ONE else other if one == ONE else self.vector("MULTIPLY", one, other)

    def less(self, one: Value, other: Value) -> Value:
        """``one`` less ``other``."""
        return self.add(one, self.times(other, (-1.0, -1.0, -1.0)))

    def mixed(self, one: Value, other: Value, share: Value) -> Value:
        """``one``, towards ``other`` by ``share``."""
        return self.add(one, self.times(self.less(other, one), share))

    def unit(self, vector: Value) -> NodeSocket:
        return self.vector("NORMALIZE", vector)

    def schlick(self, V: Value, L: Value) -> NodeSocket:
        """(1 - V.H)^5, the transition of Schlick's Fresnel, for unit vectors to the viewer and to the light.

        H halves the angle between them, so V.H is the root of (1 + V.L) / 2.
        """
        half = self.number("MULTIPLY_ADD", self.vector("DOT_PRODUCT", V, L), (0.5, 0.0, 0.0), (0.5, 0.0, 0.0))
        cosine = self.number("SQRT", self.number("MAXIMUM", half, ZERO))
        off = self.number("MAXIMUM", self.number("SUBTRACT", ONE, cosine), ZERO)
        twice = self.number("MULTIPLY", off, off)
        return self.number("MULTIPLY", self.number("MULTIPLY", twice, twice), off)
