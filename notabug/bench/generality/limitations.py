"""The fourth part: limitations and conventions switched on in random scenes, drawn as by another program."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

import numpy as np

from notabug.adapters.base import Declaration, Pixels
from notabug.bench.generality.decks import traits
from notabug.bench.generality.examine import Record, guarded, unknown_making, verdict_on
from notabug.bench.generality.faults import CONNECTED, TRIES, changed
from notabug.bench.generality.jobs import Job, drawn
from notabug.references.models.model import Model, models
from notabug.references.predict import configured
from notabug.references.tracer.envelope import trace_picture
from notabug.scenes_usd.scene import Scene, Texture

SUBSAMPLES = 4  # along a side of a pixel
BLOCK = 128  # texels that stand for one where the nearest is shown: the step between two is a 128th wide
NEAREST = "nearest texture"
ALWAYS = ("facet_self_shadow", "facet_self_reflection", "facet_self_refraction")  # what real renderers show anyway
ROUNDING = ("acne", "coincident_surfaces", "another_surface")  # of single samples: not to be drawn by subsamples

# What a shadow map's texels do: the tracer tells what they may do at most, and does not draw them.
MAPS = ("shadow_map_acne", "shadow_map_steps", "shadow_map_detached")


def limitation_jobs(count: int, seed: int, *, naming: bool, side: int) -> list[Job]:
    """A job for each of the first ``count`` scenes."""
    return [Job("limitations", seed, k, (), naming, side) for k in range(count)]


def choices(scene: Scene) -> dict[str, Model | None]:
    """The limitations and conventions that can be switched on in ``scene``, by name; None: by an edit of its own."""
    found: dict[str, Model | None] = {
        model.name: model
        for model in models(scene)
        if model.kind in ("limitation", "convention")
        and model.rule != "set"
        and model.name not in (*ROUNDING, *MAPS, *ALWAYS)
    }
    if scene.shown_textures:
        found[NEAREST] = None
    return found


def order(seed: int, index: int, names: Iterable[str]) -> list[str]:
    """``names`` in the order in which they are tried on scene ``index``, by hash."""
    return sorted(names, key=lambda name: hashlib.blake2b(f"{seed} {index} {name}".encode()).digest())


def expose_limitation(job: Job, within: Path) -> list[Record]:
    """The records of one scene with the first limitation that shows: as declared, and as a file of unknown making."""
    about: Record = {"part": "limitations", "seed": job.seed, "index": job.index}
    about |= {"traits": traits(job.seed, job.index).words()}
    read: list[Scene] = []

    def reading() -> Record:
        read.append(drawn(job, within))
        return {}

    failed = guarded(reading)
    if not read:
        return [{**about, "renderer": "reader", "limitation": "", "changed": 0, "shows": False, **failed}]
    (scene,) = read
    about |= {"size": [scene.width, scene.height]}
    found = choices(scene)
    if not found:
        return []
    bare = drawn_with(scene, "", None)
    for name in order(job.seed, job.index, found)[:TRIES]:
        picture = drawn_with(scene, name, found[name])
        pixels = changed([picture], [bare])
        if pixels >= CONNECTED:
            break
    model = found[name]
    ways = {"declared": declared(name, model)}
    if model is None or not model.strict:  # else it is a bug of a program that does not declare it
        ways["undeclared"] = replace(unknown_making(), filter="box", radius=0.5, samples=SUBSAMPLES**2)
    return [
        {
            **about,
            "changed": pixels,
            "shows": pixels >= CONNECTED,
            "renderer": title,
            "limitation": name,
            **guarded(lambda d=declaration: verdict_on([picture], scene, d, naming=job.naming)),  # type: ignore[misc]
        }
        for title, declaration in ways.items()
    ]


def drawn_with(scene: Scene, name: str, model: Model | None) -> Pixels:
    """``scene`` with the limitation, by regular subsamples under a box filter, as float32."""
    beside = [each for each in models(scene) if each.name in ALWAYS and each.name != name]
    changed, options = configured(scene, [*beside, *([] if model is None else [model])])
    if name == NEAREST:
        changed = replace(changed, textures=tuple(nearest(texture) for texture in changed.textures))
    large = replace(changed, width=scene.width * SUBSAMPLES, height=scene.height * SUBSAMPLES)
    picture = trace_picture(large, options, threads=1)
    boxes = picture.reshape(scene.height, SUBSAMPLES, scene.width, SUBSAMPLES, 3)
    return np.asarray(boxes.mean(axis=(1, 3)), np.float32)


def nearest(texture: Texture) -> Texture:
    """``texture`` with each texel as a block of equal ones, which a bilinear look-up shows nearly as the nearest."""
    return replace(texture, pixels=np.ascontiguousarray(np.kron(texture.pixels, np.ones((BLOCK, BLOCK, 1)))))


def declared(name: str, model: Model | None) -> Declaration:
    """What a program declares that has this limitation and otherwise keeps the contract."""
    base = Declaration(
        precision="float32",
        filter="box",
        radius=0.5,
        quantum=2.0**-24,
        relative_quantum=True,
        noisy=False,
        samples=SUBSAMPLES**2,
        silhouette="keep",
        opacity_shadow="attenuate",
        glass_shadow="opaque",
        total_reflection="transmission",
        glass_side="facet",
        texture_filter="nearest" if name == NEAREST else "bilinear",
    )
    if model is None:
        return base
    said = {field: value for field, value in model.conditions if field != "resolves"}
    if said.get("shadows") == "none" and model.options.get("shadows") != "none":
        said["shadows"] = "unknown"  # the picture's other shadows are cast
    return replace(base, **{field: type(getattr(base, field))(value) for field, value in said.items()})
