"""``python -m notabug.bench.memory [PICTURES]``: the most memory that one process takes which judges so many pictures.

Scenes take turns, and so do a right picture, one that is moved, one that is turned over, and one with a blot that no
fault explains, for which the judge looks at everything that it knows.
"""

from __future__ import annotations

import platform
import re
import sys
from itertools import cycle, islice, product
from pathlib import Path

import numpy as np
import psutil

from notabug.adapters.base import Quality
from notabug.adapters.inhouse import InHouse
from notabug.metrics.judge import Floats, judge
from notabug.references.predict import predict
from notabug.scenes_usd.reader import read_scene

SCENES = (
    "terminator/sphere",
    "mirror/corner",
    "texture/perspective_floor",
    "terminator/spacing",
    "visibility/standing",
    "acne/sphere",
    "phong/floor_lobes",
    "texture/uneven_quad",
)
WAYS = ("right", "moved", "turned over", "with a blot")
PICTURES = 32  # each scene in each way
BLOT = 4  # pixels along its side


def drawn(right: Floats, way: str) -> Floats:
    """A picture (h, w, 3) of the scene that looks ``right`` so, drawn in that way."""
    if way == "moved":
        return np.roll(right, 1, axis=1)
    if way == "turned over":
        return right[::-1]
    picture = right.copy()
    if way == "with a blot":
        lit = np.argwhere(right.min(axis=2) > 0.1 * right.max())
        y, x = lit[len(lit) // 2] if len(lit) else (0, 0)
        picture[y : y + BLOT, x : x + BLOT] *= 1.4
    return picture


def judged(pictures: int) -> list[str]:
    """The verdicts on so many pictures."""
    declaration = InHouse().declaration(Quality(samples=1))
    words: list[str] = []
    for way, name in islice(cycle(product(WAYS, SCENES)), pictures):
        scene = read_scene(name)
        words.append(judge([drawn(predict(scene).point, way)], scene, declaration, perceive=False).verdict.word)
    return words


def peak() -> int:
    """The most bytes of memory that this process has taken until now.

    Linux's getrusage tells that of the process which started this one, where it is more.
    """
    if platform.system() == "Windows":
        return int(psutil.Process().memory_info().peak_wset)
    if platform.system() == "Linux":
        told = Path("/proc/self/status").read_text("ascii")
        return int(re.search(r"^VmHWM:\s+(\d+) kB$", told, re.MULTILINE)[1]) << 10  # type: ignore[index]
    import resource

    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


if __name__ == "__main__":
    judged(int(sys.argv[1]) if len(sys.argv) > 1 else PICTURES)
    print(peak())
