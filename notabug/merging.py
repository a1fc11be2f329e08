"""The ``merge`` command: the runs of several machines, such as shards, become one run, pictures and all."""

from __future__ import annotations

import json
import shutil
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from notabug.exit_codes import ExitCode
from notabug.folders import sole_writer, write_json
from notabug.gate import code_of
from notabug.progress import console
from notabug.record import SCHEMA, Result
from notabug.report.loading import load
from notabug.report.page import draw
from notabug.scenes_usd.errors import NotabugError
from notabug.words import tally

Key = tuple[str, str, str]


class MergeError(NotabugError):
    """Runs that are not parts of one."""


def command(folders: Sequence[Path], out: Path, as_json: bool = False) -> ExitCode:
    """Make ``out`` of the runs in ``folders`` and say what they hold."""
    results = merge(folders, out)
    page = draw(out)
    if as_json:
        print(json.dumps(load(out), ensure_ascii=False, allow_nan=False))
        return code_of(results)
    console().print(tally(each.verdict.word for each in results), style="bold")
    console().print(f"{out / 'run.json'}\n{page}", markup=False, soft_wrap=True)
    return code_of(results)


def merge(folders: Sequence[Path], out: Path) -> list[Result]:
    """Write the run ``out``. Raises MergeError where two runs had other code, or other results for the same job."""
    if out.resolve() in {each.resolve() for each in folders}:
        raise MergeError("a run cannot be merged into itself", where=str(out), do="choose another --out")
    documents = [load(each) for each in folders]
    for folder, each in zip(folders, documents, strict=True):
        if not each["finished"]:
            raise MergeError("the run is not finished", where=str(folder), do="run it again: it goes on")
        if each["tool"]["models"] != documents[0]["tool"]["models"]:
            got = f"{each['tool']['models']} and {documents[0]['tool']['models']}"
            raise MergeError("judged by different models", where=str(folder), got=got, do="use one version of notabug")
    results, cards = _gathered(folders, documents, "results"), _gathered(folders, documents, "calibration")
    with sole_writer(out):
        for folder, result in [*results.values(), *cards.values()]:
            for name in {result.image, result.log, *result.images.values()} - {""}:
                _copy(folder, out, name)
        found = [result for _, result in results.values()]
        write_json(out / "run.json", _document(documents, found, [result for _, result in cards.values()]))
    return found


def _gathered(
    folders: Sequence[Path], documents: Sequence[dict[str, Any]], what: str
) -> dict[Key, tuple[Path, Result]]:
    """The results by job, with the folder that each is in, in the order of scenes, variants and renderers."""
    found: dict[Key, tuple[Path, Result]] = {}
    for folder, document in zip(folders, documents, strict=True):
        for each in (Result.from_dict(data) for data in document[what]):
            key = (each.scene, each.variant, each.renderer)
            there = found.setdefault(key, (folder, each))
            if what == "results" and (there[1].verdict.word, there[1].state) != (each.verdict.word, each.state):
                got = f"{there[1].verdict.word} in {there[0]}, {each.verdict.word} in {folder}"
                raise MergeError("two results for one job", where=" ".join(filter(None, key)), got=got)
    return dict(sorted(found.items()))


def _document(documents: Sequence[dict[str, Any]], results: list[Result], cards: list[Result]) -> dict[str, Any]:
    first = documents[0]
    met = {(each.renderer, each.scene, each.variant) for each in results}
    entries = [entry for each in documents for entry in each["gate"]["unused"]]
    unused = {(each["renderer"], each["scene"], each["variant"]): each for each in entries}
    renderers: dict[str, Any] = {}
    for each in documents:
        for name, found in each["renderers"].items():
            if "missing" in renderers.get(name, {"missing": ""}):
                renderers[name] = found
    return {
        "schema": SCHEMA,
        "tool": first["tool"],
        "command": first["command"],
        "finished": True,
        "seconds": {key: sum(each["seconds"][key] for each in documents) for key in ("total", "render", "outside")},
        "jobs": {"merged": [each["jobs"] for each in documents]},
        "gate": first["gate"] | {"unused": [each for key, each in sorted(unused.items()) if key not in met]},
        "renderers": renderers,
        "calibration": [each.as_dict() for each in cards],
        "results": [each.as_dict() for each in results],
    }


def _copy(folder: Path, out: Path, name: str) -> None:
    """Copy the file ``name`` of one run to the other; a record cannot make it read or write anything else."""
    source, target = (folder / name).resolve(), (out / name).resolve()
    if not source.is_relative_to(folder.resolve()) or not target.is_relative_to(out.resolve()):
        raise MergeError("a picture outside of the run's folder is not copied", where=str(folder), got=name)
    if source.is_file():
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(source, target)
