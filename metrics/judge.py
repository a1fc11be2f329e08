"""judge: from pictures and predictions to a Judgement. The procedure's steps live beside it, one a file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from notabug.adapters.base import Declaration
from notabug.metrics.verdict import Verdict
from notabug.scenes_usd.scene import Scene

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Judgement:
    """A verdict with the pictures it was drawn from; every picture is (h, w, 3) linear, every map (h, w).

    ``mean`` is the mean of the seeds, ``reference`` what the intended model gives, ``nearest`` the nearest admissible
    picture P(I). ``limitation_map`` and ``bug_map`` are FLIP (0..1) of the two legs, or zeros where a leg is empty.
    ``models`` maps the name of each limitation that was considered to its picture.
    """

    verdict: Verdict
    mean: Floats
    reference: Floats
    nearest: Floats
    limitation_map: Floats
    bug_map: Floats
    models: dict[str, Floats] = field(default_factory=dict)


def judge(
    pictures: Sequence[npt.NDArray[np.floating]],
    scene: Scene,
    declaration: Declaration,
    *,
    perceive: bool = True,
    tolerance: float = 0.004,
) -> Judgement:
    """Judge ``pictures`` (independent seeds of one renderer, each (h, w, 3) linear) of ``scene``.

    ``perceive`` measures FLIP on the legs that are not empty; without it the legs hold only pixel counts.
    """
    raise NotImplementedError
