"""The job that the renderer was called for, and how it draws and writes; misdeeds register themselves by ``deed``."""

from __future__ import annotations

import array
import json
import os
import shutil
import sys
from collections.abc import Callable, Iterable

MIB = 1 << 20

scene, image, pictures = sys.argv[1:4]
with open(scene, encoding="utf-8") as file:
    said = json.load(file)
name, width, height = said["scene"].replace("/", "-"), said["width"], said["height"]
grey = [0.25] * (3 * width * height)
own = os.path.dirname(os.path.abspath(image))  # the folder of the picture alone
renders = os.path.dirname(os.getcwd())  # the folder above the one in which it works
job = os.path.dirname(renders)

Deed = Callable[[], None]
DEEDS: dict[str, Deed] = {}


def deed(does: Deed) -> Deed:
    """Have ``does`` done for scenes of its name."""
    DEEDS[does.__name__] = does
    return does


def leave(kind: str, pid: int) -> None:
    with open(f"{pictures}/{kind}-{pid}.pid", "w", encoding="utf-8") as note:
        note.write(name)


def write(values: Iterable[float], size: tuple[int, int] | None = None, channels: int = 3, cut: int = 0) -> None:
    wide, high = size or (width, height)
    data = f"{'PF' if channels == 3 else 'Pf'}\n{wide} {high}\n-1.0\n".encode() + array.array("f", values).tobytes()
    put(data[: len(data) - cut])


def put(data: bytes, path: str = "") -> None:
    with open(path or image, "wb") as out:
        out.write(data)


def draw() -> None:
    shutil.copyfile(f"{pictures}/{name}.pfm", image)
