"""What a run's record holds: its results, and the files next to it."""

from __future__ import annotations

from pathlib import Path

from notabug.results.document import RunDocument
from notabug.results.record import Result
from notabug.scenes_usd.errors import NotabugError


def results_of(document: RunDocument) -> list[Result]:
    """The results that the ``document``, as ``notabug.results.record.load`` gives it, holds."""
    return [Result.from_dict(data) for data in document["results"]]


def inside(out: Path, name: str) -> Path:
    """A file of the run by its relative name; a record cannot make a reader open anything else."""
    path = (out / name).resolve()
    if not path.is_relative_to(out.resolve()):
        raise NotabugError("a picture outside of the run's folder is not shown", got=name)
    return path
