"""The jobs of the bench: which there are, how each is kept, and what one does in a process of its own."""

from __future__ import annotations

import hashlib
import tempfile
from collections.abc import Iterable
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Literal, get_args

import notabug.adapters
import notabug.bench.generality
import notabug.metrics
import notabug.references
import notabug.scenes_usd
from notabug.adapters.base import RendererMissingError
from notabug.adapters.registry import adapter, adapters
from notabug.bench.generality.decks import traits
from notabug.bench.generality.draw import write_random_scene
from notabug.bench.generality.examine import QUALITIES, Record, controls, examine, guarded
from notabug.bench.generality.features.decks import features
from notabug.bench.generality.features.draw import write_export
from notabug.references.cache import cache_root, source_hash
from notabug.scenes_usd.errors import SelectionError
from notabug.scenes_usd.own import take_scene
from notabug.scenes_usd.reader import read_scene
from notabug.scenes_usd.scene import Scene

Part = Literal["scenes", "features", "meshes", "faults", "limitations", "exports"]


def as_parts(names: Iterable[str]) -> list[Part]:
    """``names`` as parts; raises SelectionError for one of another bench."""
    known: dict[str, Part] = {part: part for part in get_args(Part)}
    if unknown := [name for name in names if name not in known]:
        raise SelectionError("no part of generality", where="--part", expected=", ".join(known), got=unknown[0])
    return [known[name] for name in names]


EXPORT_SIDE = 72  # pixels along the longer side of an export: its own settings ask for a picture to look at
CONTROLLED = 10  # of so many exports one has controls: of unknown making all is tried, minutes of large meshes
RENDERERS = ("povray", "mitsuba")  # others by name


@dataclass(frozen=True, slots=True)
class Job:
    """Scene ``index`` of ``seed``, or of the meshes or exports the one called ``mesh``, by ``renderers``.

    ``side`` is the longer side of the picture in pixels, 0: as the scene has it.
    """

    part: Part
    seed: int
    index: int
    renderers: tuple[str, ...]
    naming: bool = True
    side: int = 0
    mesh: str = ""
    fault: str = ""

    def key(self) -> str:
        return hashlib.blake2b(repr(asdict(self)).encode(), digest_size=12).hexdigest()

    def setting(self) -> tuple[str, int, int, str]:
        """Jobs that share it are done by one process, one after the other: they share the scene's predictions."""
        return self.part, self.seed, self.index, self.mesh


def installed(wanted: tuple[str, ...]) -> tuple[str, ...]:
    """The renderers ``wanted``, which must be there, or of the usual ones those that are."""
    if wanted:
        for name in wanted:
            adapter(name).find()
        return wanted
    found = []
    for name in RENDERERS:
        try:
            adapters()[name].find()
        except (RendererMissingError, KeyError):
            continue
        found.append(name)
    return tuple(found)


def folder(who: tuple[str, ...] = ()) -> Path:
    """Where records are kept; another one for every version of our code and of the renderers ``who``."""
    sources = (notabug.bench.generality, notabug.scenes_usd, notabug.references, notabug.adapters, notabug.metrics)
    known = [source_hash(Path(source.__path__[0])) for source in sources]
    for name in who:
        found = adapter(name).find()
        known.append(f"{name} {found.version} {found.key}")
    state = hashlib.blake2b(" ".join(known).encode(), digest_size=12)
    return cache_root() / "bench" / f"generality-{state.hexdigest()}"


def expose(job: Job) -> list[Record]:
    """The records of ``job``: one for each picture that was judged."""
    with tempfile.TemporaryDirectory(prefix="notabug-") as scratch:
        if job.part in ("scenes", "features"):
            return _scene(job, Path(scratch))
        if job.part == "meshes":
            from notabug.bench.generality.meshes import expose_mesh

            return expose_mesh(job, Path(scratch))
        if job.part == "faults":
            from notabug.bench.generality.faults import expose_fault

            return expose_fault(job, Path(scratch))
        if job.part == "exports":
            from notabug.bench.generality.exports import expose_export

            return expose_export(job, Path(scratch))
        from notabug.bench.generality.limitations import expose_limitation

        return expose_limitation(job, Path(scratch))


def drawn(job: Job, within: Path) -> Scene:
    """The random scene of ``job``, written and read back."""
    if job.part == "features":
        scene = take_scene(write_export(job.seed, job.index, within)).scene
        return sized(scene, job.side or EXPORT_SIDE)
    return sized(read_scene(write_random_scene(job.seed, job.index, within)), job.side)


def quality_of(job: Job) -> str:
    """Of the qualities the one that the scene of ``job`` is drawn with."""
    return "default" if job.part == "features" else traits(job.seed, job.index).quality


def sized(scene: Scene, side: int) -> Scene:
    """``scene`` with the longer side of its picture ``side`` pixels; 0: as it is. Pixels stay square."""
    if not side:
        return scene
    scale = side / max(scene.width, scene.height)
    width, height = max(1, round(scene.width * scale)), max(1, round(scene.height * scale))
    camera = replace(scene.camera, tan_y=scene.camera.tan_x * height / width)
    return replace(scene, width=width, height=height, camera=camera)


def _scene(job: Job, within: Path) -> list[Record]:
    what = features(job.seed, job.index) if job.part == "features" else traits(job.seed, job.index)
    about: Record = {"part": job.part, "seed": job.seed, "index": job.index, "traits": what.words()}
    found: list[Scene] = []

    def read() -> Record:
        found.append(drawn(job, within))
        return {"word": "pass", "message": ""}

    reading = guarded(read)
    if not found:  # the reader refused what the bench drew inside the contract
        return [{**about, "renderer": "reader", **reading}]
    (scene,) = found
    quality = QUALITIES[quality_of(job)]
    made = [examine(scene, adapter(name), quality, naming=job.naming) for name in job.renderers]
    if job.part != "features" or job.index % CONTROLLED == 0:
        made += controls(scene, job.seed)
    return [{**about, "size": [scene.width, scene.height], **each} for each in made]
