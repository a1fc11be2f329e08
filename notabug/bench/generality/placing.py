"""Where things stand: transforms as points that are baked, as a stack of operations under a parent, as one matrix."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from notabug.bench.generality.shapes import Floats
from notabug.scenes_usd.authoring.usda import quote, vector
from notabug.scenes_usd.transform import rotation

DIGITS = 12  # decimals of a matrix: what is below differs with the machine's mathematics library


@dataclass(frozen=True, slots=True, eq=False)
class Place:
    """A transform as it is authored, each part in its own op; row vectors: point * scale * shear * turn, + where.

    ``turn`` is in degrees about x, then y, then z; ``shear`` (3, 3); ``spin`` is about y, of the parent.
    """

    where: tuple[float, float, float]
    spin: float
    turn: tuple[float, float, float]
    shear: Floats
    scale: tuple[float, float, float]

    @property
    def matrix(self) -> Floats:
        """(4, 4) local to world, row vectors."""
        linear = np.diag(self.scale) @ self.shear
        for axis, degrees in zip(np.eye(3), self.turn, strict=True):
            linear = linear @ rotation((float(axis[0]), float(axis[1]), float(axis[2])), degrees)[:3, :3]
        made = np.eye(4)
        made[:3, :3] = linear @ rotation((0.0, 1.0, 0.0), self.spin)[:3, :3]
        made[3, :3] = self.where
        return made

    def parent(self) -> str:
        """Lines of the parent's ops."""
        return (
            f"double3 xformOp:translate = {vector(self.where)}\n"
            f"float xformOp:rotateY = {vector([self.spin])[1:-1]}\n"
            'uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateY"]'
        )

    def own(self) -> str:
        """Lines of the ops of the prim itself, below its parent."""
        ops = {"float3 xformOp:rotateXYZ": vector(self.turn), "matrix4d xformOp:transform:shear": rows(self.shear)}
        ops["float3 xformOp:scale"] = vector(self.scale)
        if np.array_equal(self.shear, np.eye(3)):
            del ops["matrix4d xformOp:transform:shear"]
        order = ", ".join(quote(name.split()[1]) for name in ops)
        return "\n".join([*(f"{name} = {text}" for name, text in ops.items()), ordered(order)])

    def whole(self) -> str:
        """Lines of one matrix op that says it all."""
        return matrix_op(self.matrix)


def matrix_op(matrix: Floats) -> str:
    """Lines of one op with ``matrix`` (4, 4)."""
    return f"matrix4d xformOp:transform = {rows(matrix)}\n{ordered(quote('xformOp:transform'))}"


def ordered(names: str) -> str:
    return f"uniform token[] xformOpOrder = [{names}]"


def rows(matrix: Floats) -> str:
    """A matrix as USD writes it, (3, 3) filled up to (4, 4)."""
    full = np.eye(4)
    full[: len(matrix), : len(matrix)] = matrix
    lines = (", ".join(repr(float(round(x, DIGITS)) + 0.0) for x in row) for row in full.tolist())
    return f"( {', '.join(f'({line})' for line in lines)} )"


def placed(rng: np.random.Generator, kind: str, where: Floats, size: float) -> Place:
    """A random place about ``where``; ``size`` is the scale, and ``kind`` says what the transform does besides."""
    scale = np.full(3, size)
    shear = np.eye(3)
    if kind in ("uneven", "shear"):
        scale = size * rng.uniform(0.55, 1.3, 3)
    if kind == "shear":
        k = int(rng.integers(3))
        shear[k, (k + 1) % 3] = rng.uniform(-0.6, 0.6)
        shear[k, (k + 2) % 3] = rng.uniform(-0.3, 0.3)
    if kind == "mirror":
        scale = scale * np.where(np.arange(3) == int(rng.integers(3)), -1.0, 1.0)
    x, y, z = (round(float(each), 6) for each in where)
    turn = [round(float(each), 4) for each in rng.uniform(-180.0, 180.0, 3)]
    return Place(
        where=(x, y, z),
        spin=round(float(rng.uniform(-180.0, 180.0)), 4),
        turn=(turn[0], turn[1], turn[2]),
        shear=np.round(shear, 6),
        scale=(round(float(scale[0]), 6), round(float(scale[1]), 6), round(float(scale[2]), 6)),
    )
