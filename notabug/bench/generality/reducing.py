"""Each bug of a renderer that was given nothing wrong, as a folder: the scene, the pictures, and a smaller scene."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path

from notabug.adapters.base import Quality, RendererError, UnsupportedError
from notabug.adapters.registry import adapter
from notabug.bench.generality.examine import QUALITIES, Record
from notabug.bench.generality.jobs import Job, drawn, quality_of
from notabug.bench.generality.summary import CONTROLS, sentence
from notabug.metrics.judge import judge
from notabug.results.wording import triple
from notabug.runs.folders import folder_name, write_text
from notabug.runs.shrinking import Examiner, Shown, bug, reduced, size
from notabug.scenes_usd.errors import NotabugError
from notabug.scenes_usd.picture import read_picture, write_exr
from notabug.scenes_usd.scene import Scene
from notabug.scenes_usd.writer import write_scene

Note = Callable[[str], None]


class QuickExaminer(Examiner):
    """An examiner that looks for any bug and gives it no name, which would take most of the time."""

    def show(self, scene: Scene) -> Shown:
        self.tried += 1
        with tempfile.TemporaryDirectory(prefix="notabug-") as scratch:
            made = self.adapter.render(scene, Path(scratch), self.quality)
            pictures = [read_picture(each.image).pixels for each in made]
        judged = judge(pictures, scene, self.declaration, perceive=False, naming=False)
        return Shown(scene, judged.verdict, judged.mean, judged.nearest, made[0].samples)


REDUCED = ("scenes", "features", "meshes")


def write_bugs(records: Sequence[Record], out: Path, note: Note, seconds: float) -> list[Path]:
    """A folder in ``out`` for each bug among ``records`` that should not be there, shrunk for ``seconds`` at most."""
    made = []
    for record in records:
        if record["word"] != "bug" or record["renderer"] in CONTROLS or record["part"] not in REDUCED:
            continue
        name = record.get("mesh") or f"{record['seed']}-{record['index']:04}"
        path = out / folder_name(f"{name}-{record['renderer']}")
        try:
            _write(record, path, note, seconds)
            made.append(path)
        except (RendererError, UnsupportedError, NotabugError, ValueError, ArithmeticError) as error:
            note(f"not reduced: {sentence(record)}: {error}")
    return made


def _write(record: Record, out: Path, note: Note, seconds: float) -> None:
    scene, quality = _scene(record, out)
    examiner = QuickExaminer(adapter(record["renderer"]), quality)
    first = examiner.show(scene)
    _pictures(first, out)
    text = f"{sentence(record)}\n\n`whole`: {size(scene)}.\n"
    if bug(first.verdict):
        small = shrunk(scene, examiner, seconds, note)
        again = examiner.show(small)
        write_scene(small, out / "scene.usda")
        _pictures(again, out, "small-")
        x, y = again.pixel
        values = " ".join(
            f"{name} {triple(each[y, x])}" for name, each in (("expected", again.expected), ("found", again.found))
        )
        text += f"`scene.usda`: {size(small)}, after {examiner.tried} pictures; at pixel ({x}, {y}): {values}\n"
    write_text(out / "README.md", text)
    note(f"{size(scene)} in {out}")


def shrunk(scene: Scene, examiner: Examiner, seconds: float, note: Note) -> Scene:
    """``scene`` as small as delta debugging makes it in ``seconds``, while there is any bug."""
    holds, end = examiner.is_same(""), time.monotonic() + seconds

    def in_time(candidate: Scene) -> bool:
        return time.monotonic() < end and holds(candidate)

    return reduced(scene, in_time, note)


def _scene(record: Record, out: Path) -> tuple[Scene, Quality]:
    if record["part"] == "meshes":
        from notabug.bench.generality.meshes import mesh_scene

        return mesh_scene(record["mesh"], out / "whole", record["size"]), QUALITIES["default"]
    job = Job(record["part"], record["seed"], record["index"], (record["renderer"],), side=max(record["size"]))
    return drawn(job, out / "whole"), QUALITIES[quality_of(job)]


def _pictures(shown: Shown, out: Path, prefix: str = "") -> None:
    write_exr(out / f"{prefix}found.exr", shown.found)
    write_exr(out / f"{prefix}expected.exr", shown.expected)
