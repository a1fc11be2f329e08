"""The ``merge`` command: the runs of several machines, such as shards, become one run, pictures and all."""

from __future__ import annotations

import json
import shutil
from collections.abc import Sequence
from pathlib import Path
from typing import Literal

from notabug.adapters.trees import make
from notabug.exit_codes import ExitCode
from notabug.report.page import draw
from notabug.results.document import RendererSaid, RunDocument
from notabug.results.gate import code_of
from notabug.results.one_light import told_by_lights
from notabug.results.record import Result, load, run_document
from notabug.results.wording import tally
from notabug.runs.folders import sole_writer, write_json
from notabug.runs.progress import console
from notabug.scenes_usd.errors import NotabugError

Key = tuple[str, str, str]


SHOWN = 5  # of what is missing
MOST_SHARDS = 10_000


class MergeError(NotabugError):
    """Runs that are not parts of one."""


def command(folders: Sequence[Path], out: Path, partial: bool = False, as_json: bool = False) -> ExitCode:
    """Make ``out`` of the runs in ``folders`` and say what they hold."""
    results = merge(folders, out, partial=partial)
    page = draw(out)
    if as_json:
        print(json.dumps(load(out), ensure_ascii=False, allow_nan=False))
        return code_of(results)
    console().print(tally(result.verdict.word for result in results), style="bold")
    console().print(f"{out / 'run.json'}\n{page}", markup=False, soft_wrap=True)
    return code_of(results)


def merge(folders: Sequence[Path], out: Path, *, partial: bool = False) -> list[Result]:
    """Write the run ``out``. Raises MergeError where two runs had other code, or other results for the same job.

    Also where a run is not finished, or a shard or a picture is missing, unless a ``partial`` run is asked for: that
    one's record does not call itself finished.
    """
    if out.resolve() in {each.resolve() for each in folders}:
        raise MergeError("a run cannot be merged into itself", where=str(out), do="choose another --out")
    documents = [load(each) for each in folders]
    for folder, each in zip(folders, documents, strict=True):
        if each["tool"]["models"] != documents[0]["tool"]["models"]:
            got = f"{each['tool']['models']} and {documents[0]['tool']['models']}"
            raise MergeError("judged by different models", where=str(folder), got=got, do="use one version of notabug")
    results, cards = _gathered(folders, documents, "results"), _gathered(folders, documents, "calibration")
    there: dict[str, Path] = {}
    gaps = [*_unfinished(folders, documents), *_missing_shards(documents)]
    for folder, result in [*results.values(), *cards.values()]:
        for name in sorted({result.image, result.log, *result.images.values()} - {""}):
            source = _source(folder, out, name)
            if source.is_file():
                there[name] = source
            else:
                gaps.append(f"the picture {source}")
    if gaps and not partial:
        more = f", and {len(gaps) - SHOWN} more" if len(gaps) > SHOWN else ""
        raise MergeError(
            "the run would not be whole",
            where=str(out),
            got=f"missing: {', '.join(gaps[:SHOWN])}{more}",
            do="bring what is missing; or merge what there is with --partial",
        )
    with sole_writer(out):
        for name, source in there.items():
            make((out / name).parent, out)
            shutil.copyfile(source, out / name)
        found = told_by_lights([result for _, result in results.values()])
        document = _document(documents, found, [result for _, result in cards.values()])
        write_json(out / "run.json", {**document, "finished": not gaps, "partial": bool(gaps)})
    return found


def _unfinished(folders: Sequence[Path], documents: Sequence[RunDocument]) -> list[str]:
    """The runs that were stopped: the same command goes on where it did."""
    runs = zip(folders, documents, strict=True)
    return [f"the end of the run in {folder}" for folder, each in runs if not each["finished"]]


def _missing_shards(documents: Sequence[RunDocument]) -> list[str]:
    """The shards that none of the runs is, nor was merged from."""
    jobs = [document["jobs"] for document in documents]
    jobs += [part for job in jobs for part in job.get("merged", ())]
    there = {job.get("shard", "") for job in jobs} - {""}
    counts = {each.partition("/")[2] for each in there}
    if len(counts) > 1:
        raise MergeError("shards of different runs", got=", ".join(sorted(there)), expected="one number of shards")
    count = next(iter(counts), "")
    total = min(int(count), MOST_SHARDS) if count.isdecimal() else 0
    return [f"the shard {index}/{count}" for index in range(1, total + 1) if f"{index}/{count}" not in there]


def _gathered(
    folders: Sequence[Path], documents: Sequence[RunDocument], what: Literal["results", "calibration"]
) -> dict[Key, tuple[Path, Result]]:
    """The results by job, with the folder that each is in, in the order of scenes, variants and renderers."""
    found: dict[Key, tuple[Path, Result]] = {}
    for folder, document in zip(folders, documents, strict=True):
        for each in map(Result.from_dict, document["results"] if what == "results" else document["calibration"]):
            key = (each.scene, each.variant, each.renderer)
            there = found.setdefault(key, (folder, each))
            if what == "results" and (there[1].verdict.word, there[1].state) != (each.verdict.word, each.state):
                got = f"{there[1].verdict.word} in {there[0]}, {each.verdict.word} in {folder}"
                raise MergeError("two results for one job", where=" ".join(filter(None, key)), got=got)
    return dict(sorted(found.items()))


def _document(documents: Sequence[RunDocument], results: list[Result], cards: list[Result]) -> RunDocument:
    first = documents[0]
    met = {(result.renderer, result.scene, result.variant) for result in results}
    entries = [entry for each in documents for entry in each["gate"]["unused"]]
    unused = {(each["renderer"], each["scene"], each["variant"]): each for each in entries}
    renderers: dict[str, RendererSaid] = {}
    for document in documents:
        for name, found in document["renderers"].items():
            if "missing" in renderers.get(name, {"missing": ""}):
                renderers[name] = found
    return run_document(
        tool=first["tool"],
        command=first["command"],
        seconds={
            key: sum(document["seconds"].get(key, 0.0) for document in documents)
            for key in ("total", "render", "outside")
        },
        jobs={
            "merged": [part for document in documents for part in document["jobs"].get("merged", [document["jobs"]])]
        },
        gate={**first["gate"], "unused": [entry for key, entry in sorted(unused.items()) if key not in met]},
        renderers=renderers,
        calibration=cards,
        policy=first["policy"],
        results=results,
    )


def _source(folder: Path, out: Path, name: str) -> Path:
    """The file ``name`` of a run; a record cannot make ``merge`` read or write anything but a scene's pictures."""
    source, target = (folder / name).resolve(), (out / name).resolve()
    if not source.is_relative_to(folder.resolve()) or not target.is_relative_to(out.resolve()):
        raise MergeError("a picture outside of the run's folder is not copied", where=str(folder), got=name)
    if len(target.relative_to(out.resolve()).parts) < 2 or ".." in Path(name).parts or Path(name).suffix == ".json":
        raise MergeError("not a picture of a run", where=str(folder), got=name, expected="a file in a scene's folder")
    return source
