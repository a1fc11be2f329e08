"""A run read back from its folder: ``run.json``, its results, and the files next to it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from notabug.record import SCHEMA, Result
from notabug.scenes_usd.errors import NotabugError


def load(out: Path) -> dict[str, Any]:
    """``run.json`` of the folder ``out``."""
    path = out / "run.json"
    try:
        document = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise NotabugError("cannot read the run", where=str(path), got=error.strerror or "", do="notabug run") from None
    except ValueError as error:
        raise NotabugError("not a run's record", where=str(path), got=str(error)) from None
    if not isinstance(document, dict) or document.get("schema") != SCHEMA:
        got = str(document.get("schema")) if isinstance(document, dict) else type(document).__name__
        raise NotabugError("not a run's record", where=str(path), expected=f"schema {SCHEMA}", got=got)
    return document


def results_of(document: dict[str, Any], out: Path) -> list[Result]:
    """The results that the ``document`` of the folder ``out`` holds."""
    found = document.get("results")
    if not isinstance(found, list):
        raise NotabugError("not a run's record", where=str(out / "run.json"), expected="a list of results")
    return [Result.from_dict(data) for data in found]


def inside(out: Path, name: str) -> Path:
    """A file of the run by its relative name; a record cannot make a reader open anything else."""
    path = (out / name).resolve()
    if not path.is_relative_to(out.resolve()):
        raise NotabugError("a picture outside of the run's folder is not shown", got=name)
    return path
