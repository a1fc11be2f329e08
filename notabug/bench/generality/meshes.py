"""The second part: real meshes, each wrapped in a scene, by every renderer."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from notabug.adapters.base import UnsupportedError
from notabug.adapters.registry import adapter
from notabug.bench.generality.decks import BENT_QUADS, generator
from notabug.bench.generality.examine import QUALITIES, Record, controls, examine, guarded
from notabug.bench.generality.jobs import Job
from notabug.bench.generality.looks import picture
from notabug.bench.generality.mesh_store import SOURCES, NotFetchedError, fetched, source
from notabug.meshes.files import read_mesh_file
from notabug.meshes.scene import scene_from_mesh
from notabug.scenes_usd.authoring.png import png
from notabug.scenes_usd.reader import read_scene
from notabug.scenes_usd.scene import Scene, Texture
from notabug.scenes_usd.writer import write_scene

MOST = 6000  # faces: the judge's predictions of more take minutes
SIDE = 64  # pixels


def mesh_names() -> tuple[str, ...]:
    return tuple(each.name for each in SOURCES)


def mesh_scene(name: str, folder: Path, size: Sequence[int] = (SIDE, SIDE)) -> Scene:
    """The mesh called ``name`` in a scene, written to ``folder`` and read back; with a texture where it has uv."""
    wanted = source(name)
    mesh = read_mesh_file(fetched(wanted))
    if len(mesh.counts) > MOST:
        raise UnsupportedError(
            "too large for this bench", where=name, expected=f"{MOST} faces", got=str(len(mesh.counts))
        )
    index = mesh_names().index(name)
    rng = generator(0, index)
    folder.mkdir(parents=True, exist_ok=True)
    texture = None
    if mesh.uv is not None:
        pixels = picture(rng)
        file = folder / "picture.png"
        file.write_bytes(png(pixels))
        texture = Texture(file, np.ascontiguousarray(pixels / 255.0))
    azimuth, elevation = float(rng.uniform(0.0, 360.0)), float(rng.uniform(10.0, 50.0))
    width, height = size
    made = scene_from_mesh(
        mesh,
        texture=texture,
        size=(width, height),
        azimuth=azimuth,
        elevation=elevation,
        up=wanted.up,
        bent=BENT_QUADS,
    )
    file = write_scene(made, folder / f"mesh-{index:02}.usda", up=wanted.up)
    return read_scene(file)


def expose_mesh(job: Job, within: Path) -> list[Record]:
    """The records of one mesh. A mesh that does not come, or is too large, is ``unsupported`` with the reason."""
    side = job.side or SIDE
    about: Record = {"part": "meshes", "seed": job.seed, "index": job.index, "mesh": job.mesh, "size": [side, side]}
    found: list[Scene] = []

    def read() -> Record:
        try:
            found.append(mesh_scene(job.mesh, within, (side, side)))
        except NotFetchedError as error:
            return {"word": "unsupported", "message": " ".join(str(error).split())}
        return {"word": "pass", "message": ""}

    reading = guarded(read)
    if not found:
        return [{**about, "renderer": "reader", **reading}]
    made = [examine(found[0], adapter(name), QUALITIES["default"], naming=job.naming) for name in job.renderers]
    return [{**about, **each} for each in (*made, *controls(found[0], job.index))]
