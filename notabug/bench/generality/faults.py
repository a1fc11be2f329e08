"""The third part: faults injected into POV-Ray's scene text and Mitsuba's job, on random scenes of this bench."""

from __future__ import annotations

import hashlib
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy import ndimage

from notabug.adapters.base import Adapter, Pixels, Quality
from notabug.adapters.mitsuba import Mitsuba
from notabug.adapters.povray import PovRay
from notabug.adapters.registry import adapter
from notabug.bench.generality.decks import traits
from notabug.bench.generality.examine import QUALITIES, Record, guarded, pictures_by, verdict_on
from notabug.bench.generality.jobs import Job, drawn
from notabug.bench.generality.mitsuba_faults import MITSUBA_FAULTS, JobFault
from notabug.bench.generality.povray_faults import POVRAY_FAULTS, TextFault
from notabug.scenes_usd.scene import Scene

CONNECTED = 12  # pixels side by side that a fault must change to count
CHANGE = 0.05  # share of a pixel's value by which it must change it
DARK = 0.02  # of the brightest pixel: what is darker counts as if it were so bright
TRIES = 8  # faults that are tried on a scene until one shows


def fault_jobs(count: int, seed: int, who: tuple[str, ...], *, naming: bool, side: int) -> list[Job]:
    """A job for each of the first ``count`` scenes: one fault, by one of the renderers in turn."""
    able = [name for name in who if name in ("povray", "mitsuba")]
    if not able:
        return []
    return [Job("faults", seed, k, (able[k % len(able)],), naming, side) for k in range(count)]


def kinds(name: str) -> dict[str, TextFault | JobFault]:
    """Every fault of the renderer ``name``."""
    return dict(POVRAY_FAULTS if name == "povray" else MITSUBA_FAULTS)


def with_fault(who: Adapter, fault: TextFault | JobFault) -> Adapter:
    """``who`` with ``fault``."""
    if isinstance(who, PovRay) and isinstance(fault, TextFault):
        return replace(who, edit=fault.edit)
    if isinstance(who, Mitsuba) and isinstance(fault, JobFault):
        return replace(who, edit=fault.edit)
    raise TypeError(f"{who.name} and {type(fault).__name__} do not fit")


def order(seed: int, index: int, name: str) -> list[str]:
    """The faults of the renderer ``name`` in the order in which they are tried on a scene: each is first in turn."""
    names = sorted(kinds(name), key=lambda kind: hashlib.blake2b(f"{seed} {kind}".encode()).digest())
    turn = index // 2 % len(names)  # of two renderers each has every other scene
    return names[turn:] + names[:turn]


def changed(pictures: list[Pixels], right: list[Pixels]) -> int:
    """The pixels of the largest connected part that the fault changed by more than ``CHANGE``."""
    found, clean = (np.mean(each, axis=0, dtype=np.float64) for each in (pictures, right))
    base = np.maximum(np.abs(clean), DARK * float(clean.max()))
    off = (np.abs(found - clean) > CHANGE * base).any(axis=2)
    labels, count = ndimage.label(off)
    return int(ndimage.sum_labels(off, labels, np.arange(1, count + 1)).max()) if count else 0


def expose_fault(job: Job, within: Path) -> list[Record]:
    """The record of the first fault that shows on the scene of ``job``; one that says so where none does."""
    what = traits(job.seed, job.index)
    about: Record = {"part": "faults", "seed": job.seed, "index": job.index, "traits": what.words()}
    about |= {"renderer": job.renderers[0]}
    who, quality = adapter(job.renderers[0]), QUALITIES[what.quality]
    tried: dict[str, Any] = {}

    def work() -> Record:
        scene = drawn(job, within)
        about["size"] = [scene.width, scene.height]
        right = pictures_by(who, scene, quality)
        for name in [job.fault] if job.fault else order(job.seed, job.index, who.name)[:TRIES]:
            fault = kinds(who.name)[name]
            if isinstance(fault, TextFault) and not fault.suits(scene):
                continue
            pictures = pictures_by(with_fault(who, fault), scene, quality)
            pixels = changed(pictures, right)
            tried.update(fault=name, right=list(fault.right), changed=pixels, shows=pixels >= CONNECTED)
            if tried["shows"]:
                return _judged(pictures, scene, who, quality, job.naming)
        return {"word": "unsupported", "message": "none of the faults that were tried shows on this scene"}

    made = guarded(work)  # which also tells the picture's size
    return [{**about, **tried, "named": job.naming, **made}]


def _judged(pictures: list[Pixels], scene: Scene, who: Adapter, quality: Quality, naming: bool) -> Record:
    return verdict_on(pictures, scene, who.declaration(quality), naming=naming)
