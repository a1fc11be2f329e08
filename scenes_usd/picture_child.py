"""Pictures that are much work, or of formats whose work is not known, are read in a child with limits.

``python -P -m notabug.scenes_usd.picture_child REQUEST`` reads what the JSON file REQUEST asks for, and beside it
writes the answer: ``answer.json``, a Picture's or a Header's fields or the parts of an error, and the
arrays as files of their own.
"""

from __future__ import annotations

import contextlib
import json
import os
import signal
import subprocess
import sys
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

import numpy as np

from notabug.scenes_usd.landlock import confine, programs
from notabug.scenes_usd.picture_header import PictureError
from notabug.scenes_usd.temporary import end_with, temporary_folder

SECONDS = 20  # of processor time
MEMORY = 2 << 30  # bytes of address space, beside what the program itself maps
_PROGRAM = 2 << 30  # bytes that Python and the libraries map, most of them never used
_ARRAYS = ("pixels", "alpha")  # of a picture, each in a file of its own
_PARTS = ("what", "where", "expected", "got", "do")


def read_by_child(path: Path, layer: str, srgb: bool, header: bool, with_alpha: bool = False) -> dict[str, Any]:
    """The fields of the Picture, or Header, in the file at ``path``; raises PictureError."""
    with temporary_folder() as folder:
        request = {"path": str(path.resolve()), "layer": layer, "srgb": srgb, "header": header, "where": str(path)}
        request |= {"parent": os.getpid(), "with_alpha": with_alpha}
        (folder / "request.json").write_text(json.dumps(request), encoding="utf-8")
        command = [sys.executable, "-P", "-m", "notabug.scenes_usd.picture_child", str(folder / "request.json")]
        ended = subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, check=False)
        if ended.returncode:
            slow = ended.returncode == -getattr(signal, "SIGXCPU", 0)
            raise PictureError(
                "reading this file ends its reader",
                where=str(path),
                expected=f"{SECONDS} s of processor time and {MEMORY >> 30} GiB to be enough",
                got=f"stopped after {SECONDS} s" if slow else f"exit state {ended.returncode}",
                do="write the picture anew, as EXR without other data",
            )
        answer: dict[str, Any] = json.loads((folder / "answer.json").read_text(encoding="utf-8"))
        if "error" in answer:
            parts = dict(zip(_PARTS, answer["error"], strict=True))
            raise PictureError(parts.pop("what"), **parts)
        if not header:
            for name in _ARRAYS:
                file = folder / f"{name}.npy"
                answer[name] = np.load(file, allow_pickle=False) if file.is_file() else None
        return answer


def main(request: Path) -> None:
    from notabug.scenes_usd.picture import read_header_here, read_picture_here

    asked = json.loads(request.read_text(encoding="utf-8"))
    path = Path(asked["path"])
    end_with(asked["parent"])
    with contextlib.suppress(ImportError, ValueError):  # not everywhere
        import resource

        import OpenImageIO  # noqa: F401 - before the limits, for it starts threads

        resource.setrlimit(resource.RLIMIT_CPU, (SECONDS, SECONDS + 1))
        resource.setrlimit(resource.RLIMIT_AS, (MEMORY + _PROGRAM, MEMORY + _PROGRAM))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    confine(programs() | {path}, [request.parent])
    answer: dict[str, Any]
    try:
        if asked["header"]:
            answer = asdict(read_header_here(path, asked["layer"]))
        else:
            how = {name: asked[name] for name in ("layer", "srgb", "with_alpha")}
            picture = read_picture_here(path, **how)
            for name in _ARRAYS:
                if getattr(picture, name) is not None:
                    np.save(request.parent / f"{name}.npy", getattr(picture, name))
            answer = {each.name: getattr(picture, each.name) for each in fields(picture) if each.name not in _ARRAYS}
            answer["lossy"] = None if picture.lossy is None else asdict(picture.lossy)
            answer["metadata"] = dict(picture.metadata)
    except PictureError as error:
        error.where = error.where.replace(asked["path"], asked["where"])
        answer = {"error": [getattr(error, part) for part in _PARTS]}
    (request.parent / "answer.json").write_text(json.dumps(answer), encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
