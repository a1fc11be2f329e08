"""Whose a folder is: what a command writes goes into an empty folder or one that notabug made, never over other files.

A folder is notabug's where it holds NOTE, which says what made it and, for what is removed again, which files are its.
"""

from __future__ import annotations

import contextlib
import json
from collections.abc import Iterable
from pathlib import Path

from notabug.adapters.trees import remove
from notabug.scenes_usd.errors import FileError, NotabugError

NOTE = ".notabug.json"
_HIDDEN = "notabug."  # behind points: notes, locks and partial files, what notabug itself makes first
_RECORDS = {
    "run.json": "run",
    **{
        f"{name}.json": "bench"
        for name in ("verdict", "generality", "efficiency", "stability", "metamorphic", "faults")
    },
}
_HEAD = 4096  # bytes of a record that say that it is one


class ForeignFolderError(NotabugError):
    """A folder with files that notabug did not make."""


def check(out: Path, kind: str) -> bool:
    """Whether ``out`` is the folder of a ``kind`` ("run", "gallery" ...) already.

    Raises ForeignFolderError where it is another's; False where it is empty or not there, for anybody to take.
    """
    try:
        made = _made_by(out)
        if made == kind:
            return True
        if not out.exists():
            return False
        if not made and not any(_is_foreign(path) for path in out.iterdir()):
            return False
        made = _made_by(out)  # another process may have taken it meanwhile
        if made != kind:
            raise ForeignFolderError(
                f"the folder holds a {made} of notabug" if made else "the folder holds files that notabug did not make",
                where=str(out),
                expected=f"an empty folder, or one with a {kind}",
                do="choose another with --out",
            )
    except OSError as error:
        raise _unusable(error, out) from error
    return True


def _is_foreign(path: Path) -> bool:
    return not (path.name.startswith(".") and path.name.lstrip(".").startswith(_HIDDEN))


def claim(out: Path, kind: str) -> None:
    """Make ``out`` the folder of a ``kind``; raises ForeignFolderError where it is another's."""
    if check(out, kind) and (out / NOTE).is_file():
        return
    try:
        out.mkdir(parents=True, exist_ok=True)
        _write(out, kind, ())
    except OSError as error:
        raise _unusable(error, out) from error


def _unusable(error: OSError, out: Path) -> FileError:
    return FileError.of(error, where=str(out), do="choose a folder that can be written to with --out")


def listed(out: Path) -> frozenset[str]:
    """The files of ``out`` that notabug has made and may remove, as paths from there."""
    names = _note(out).get("files", [])
    return frozenset(each for each in names if isinstance(each, str)) if isinstance(names, list) else frozenset()


def keep_list(out: Path, kind: str, names: Iterable[str]) -> None:
    """Write down that the files ``names`` are ours."""
    _write(out, kind, names)


def sweep(out: Path, names: Iterable[str]) -> None:
    """Remove the files ``names`` of ``out``; none that lies elsewhere or behind a link."""
    for name in names:
        path = out / name
        parts = Path(name).parts
        above = [out.joinpath(*parts[:count]) for count in range(1, len(parts))]
        if not parts or Path(name).is_absolute() or ".." in parts or any(each.is_symlink() for each in above):
            continue
        if path.is_file() or path.is_symlink():
            with contextlib.suppress(OSError):
                remove(path)


def _made_by(out: Path) -> str:
    """The kind of thing that ``out`` holds, "" where notabug did not make it."""
    kind = _note(out).get("notabug", "")
    if kind and isinstance(kind, str):
        return kind
    for name, made in _RECORDS.items():  # what was copied without its note, or is older
        with contextlib.suppress(OSError), (out / name).open("rb") as record:
            if b'"tool": {\n  "name": "notabug"' in record.read(_HEAD):
                return made
    return ""


def _note(out: Path) -> dict[str, object]:
    try:
        found = json.loads((out / NOTE).read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        return {}
    return found if isinstance(found, dict) else {}


def _write(out: Path, kind: str, names: Iterable[str]) -> None:
    from notabug.runs.folders import write_json

    write_json(out / NOTE, {"notabug": kind, "files": sorted(names)})
