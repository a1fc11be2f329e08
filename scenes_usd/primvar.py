"""A primvar as it is authored: which value each corner of a mesh has."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from notabug.scenes_usd.scene import Floats

Places = npt.NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class Values:
    """A primvar's ``values`` (n, k): the one of each face corner is ``values[at]``, (c,), by its ``interpolation``."""

    values: Floats
    at: Places
    interpolation: str
