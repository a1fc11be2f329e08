"""Step 8: the name of a bug: the cause or fault that leaves the shortest bug leg, else ``unexplained``."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from notabug.metrics.admissible import residual
from notabug.metrics.causes import causes
from notabug.metrics.explain import Explanation, Predict, fit
from notabug.metrics.noise import Measured
from notabug.metrics.significance import significance
from notabug.references.models.model import Model

REMAINS = 0.15  # a name may leave this much of the bug leg: right ones leave .08, a gamma in the place of an albedo .18
SAME = 0.97  # correlation from which two pictures show the same scene
HELPS = 0.9  # a fault that leaves more of the bug leg has no part in it
NOTHING = 0.02  # what a name leaves where two renderers see different surfaces at an edge
OTHER = 0.7  # and below which they do not

Others = Callable[[], Iterable[tuple[str, npt.NDArray[np.floating]]]]
"""References of other scenes of the same size: (name, (h, w, 3))."""


@dataclass(frozen=True, slots=True)
class Name:
    """What a bug is called, why, and the length of the bug leg that the name leaves (0: it explains everything)."""

    name: str
    message: str
    remains: float
    freedom: float = 0.0


def name_bug(
    measured: Measured,
    found: Explanation,
    faults: Sequence[Model],
    limitations: Sequence[Model],
    predict: Predict,
    others: Others = tuple,
) -> Name:
    """Name the bug in ``measured``, of which ``found`` is the best explanation by ``limitations`` alone.

    Each fault is tried by itself, with each limitation, and with the set that ``found`` has.
    """
    length = max(found.significance.excess, 1e-30)
    tried: list[Name] = []
    reference = predict(())
    for target in {id(each): each for each in (reference, found.target)}.values():
        for cause in causes(measured, target):
            left = significance(residual(measured.mean, cause.target), measured, cause.target)
            tried.append(Name(cause.name, cause.message, left.excess / length))
    open_faults = list(faults)
    for models in dict.fromkeys(((), found.models, *((each,) for each in limitations))):
        helpful = []
        for fault in open_faults:
            fitted = fit(measured, models, predict, (fault,))
            tried.append(Name(fault.name, fault.claim, fitted.significance.excess / length, fitted.freedom))
            if tried[-1].remains < HELPS:
                helpful.append(fault)
        if min((each.remains for each in tried), default=1.0) < NOTHING:
            break
        if not models:  # a fault that explains nothing by itself explains nothing beside a limitation
            open_faults = helpful
    # of names that leave next to nothing, the one that could have explained the least else
    best = min(tried, key=lambda each: (max(each.remains, NOTHING), each.freedom), default=None)
    if best is not None and best.remains < REMAINS:
        return best
    if _alike(measured.mean, reference.value) < OTHER:
        likeness, name = max(((_alike(measured.mean, each), name) for name, each in others()), default=(0.0, ""))
        if likeness > SAME:
            return Name("wrong_scene", f"this is a picture of {name}", 0.0)
    return Name("unexplained", "no model of a fault leaves this picture", 1.0)


def _alike(a: npt.NDArray[np.floating], b: npt.NDArray[np.floating]) -> float:
    """The correlation of two pictures, 0 where sizes differ or one is constant."""
    if a.shape != b.shape or np.ptp(a) == 0 or np.ptp(b) == 0:
        return 0.0
    return float(np.corrcoef(a.ravel(), b.ravel())[0, 1])
