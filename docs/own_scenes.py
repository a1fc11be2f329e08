"""Writes the feature files of docs/own-scenes.md, which docs/own_features.py lists, and the table of what reads.

``python docs/own_scenes.py DIR`` writes the files to DIR and prints the table.
"""

from __future__ import annotations

import struct
import sys
import zlib
from pathlib import Path

from own_features import FEATURES, State

from notabug.scenes_usd.adapted import adapt
from notabug.scenes_usd.reader_stage import survey_stage
from notabug.scenes_usd.view import View

WORDS = {"read": "as it is", "adapted": "after `notabug adapt`", "refused": "no"}


def png(pixels: bytes, width: int, height: int, *, alpha: bool = False) -> bytes:
    """An 8-bit RGB picture, or RGBA."""
    stride = (4 if alpha else 3) * width
    rows = b"".join(b"\0" + pixels[y * stride : (y + 1) * stride] for y in range(height))

    def chunk(name: bytes, body: bytes) -> bytes:
        return struct.pack(">I", len(body)) + name + body + struct.pack(">I", zlib.crc32(name + body))

    header = chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 6 if alpha else 2, 0, 0, 0))
    return b"\x89PNG\r\n\x1a\n" + header + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b"")


def write(folder: Path) -> dict[str, Path]:
    """Every feature's file in ``folder``, by the feature's name."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "picture.png").write_bytes(png(bytes(range(40, 88)), 4, 4))
    (folder / "leaf.png").write_bytes(png(bytes(range(10, 250, 15)), 2, 2, alpha=True))
    files = {}
    for number, feature in enumerate(FEATURES, 1):
        for name, text in feature.files.items():
            (folder / name).write_text(text, "utf-8")
        files[feature.name] = folder / f"{number:02}.usda"
        files[feature.name].write_text(feature.text, "utf-8")
    return files


def state_of(path: Path) -> State:
    """Whether the scene at ``path`` reads as it is, or once it is adapted."""
    if survey_stage(path, path.stem, {}).scene is not None:
        return "read"
    made = adapt(path, path.with_name(f"own-{path.name}"), {}, View())
    return "adapted" if made.survey.scene is not None else "refused"


def table() -> list[str]:
    """The table of docs/own-scenes.md."""
    lines = ["| | feature | is judged |", "|---|---|---|"]
    return [*lines, *(f"| {each.group} | {each.name} | {WORDS[each.state]} |" for each in FEATURES)]


if __name__ == "__main__":
    for name_, path_ in write(Path(sys.argv[1])).items():
        found_ = state_of(path_)
        expected_ = next(each.state for each in FEATURES if each.name == name_)
        print(f"{'' if found_ == expected_ else '!! '}{path_.name}  {found_:8} {name_}")
