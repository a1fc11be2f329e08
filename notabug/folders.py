"""Where a job's files go: names from scenes, variants and renderers become folder names that stay inside the run."""

from __future__ import annotations

import hashlib
import json
import os
import re
from pathlib import Path
from typing import Any

_UNSAFE = re.compile(r"[^A-Za-z0-9_.,=+-]")
_LONGEST = 80  # characters of one folder name: with its hash well below the 255 bytes that file systems allow


def folder_name(text: str) -> str:
    """``text`` as the name of one folder: never empty, hidden, ``..`` or with a separator; unequal texts stay unequal.

    >>> folder_name("tessellation=24x12"), folder_name("")
    ('tessellation=24x12', 'default')
    """
    if not text:
        return "default"
    safe = _UNSAFE.sub("_", text)[:_LONGEST].lstrip(".-") or "_"
    if safe == text:
        return safe
    return f"{safe}-{hashlib.blake2b(text.encode('utf-8', 'surrogatepass'), digest_size=4).hexdigest()}"


def job_folder(out: Path, scene: str, variant: str, renderer: str) -> Path:
    """``out/<class>/<scene>/<variant>/<renderer>``; a scene from outside the corpus has the class ``own``."""
    group, _, name = scene.partition("/")
    if not name:
        group, name = "own", scene
    return out.joinpath(*(folder_name(part) for part in (group, name, variant, renderer)))


def write_json(path: Path, document: Any) -> None:
    """Write ``document`` to ``path`` atomically: a reader sees the old file or the new one, never half of it."""
    write_text(path, json.dumps(document, indent=1, ensure_ascii=False, allow_nan=False) + "\n")


def write_text(path: Path, text: str) -> None:
    partial = path.with_name(f".{path.name}.{os.getpid()}.partial")
    partial.write_text(text, encoding="utf-8", errors="backslashreplace")
    partial.replace(path)
