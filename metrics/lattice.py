"""Step 8 of docs/judge.md, the name: the pixels, evenly spread, by which faults are ranked.

A large picture tells no better than a small one which faults look like it. So only a lattice of its pixels is looked
at.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
import numpy.typing as npt

from notabug.metrics.policy import POLICY
from notabug.metrics.quick import Preview
from notabug.references.models.model import Model

Floats = npt.NDArray[np.floating]
Scalar = TypeVar("Scalar", bound=np.generic)


@dataclass(frozen=True, slots=True)
class Lattice:
    """Every ``step``-th pixel of every ``step``-th row of pictures of ``height`` x ``width``."""

    height: int
    width: int
    step: int

    def of(self, values: npt.NDArray[Scalar]) -> npt.NDArray[Scalar]:
        """Those of ``values`` (h, w, ...) that lie on the lattice, (rows, columns, ...)."""
        return values[self.step // 2 :: self.step, self.step // 2 :: self.step]

    def preview(self, preview: Preview, chosen: tuple[Model, ...]) -> Floats:
        """The quick picture of ``chosen`` on the lattice, (rows, columns, 3)."""
        if self.step == 1:
            return preview(chosen)
        at = self.of(np.arange(self.height * self.width).reshape(self.height, self.width))
        return preview(chosen, np.ascontiguousarray(at.ravel())).reshape(*at.shape, 3)

    def blocks(self, steps: tuple[int, ...]) -> tuple[int, ...]:
        """The sizes of blocks on the lattice that are ``steps`` pixels wide, or single points, each size once."""
        return tuple(dict.fromkeys(max(1, step // self.step) for step in steps))


def lattice(height: int, width: int) -> Lattice:
    """The lattice with the fewest points of a picture of that size, but `lattice.side` squared of them, or all."""
    return Lattice(height, width, max(1, int(math.sqrt(height * width) / POLICY.lattice.side)))
