"""bench metamorphic: which relations between pictures a renderer breaks, without any reference."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np
import numpy.typing as npt

from notabug.adapters.base import Adapter, Quality, RendererError, UnsupportedError
from notabug.bench.metamorphic_relations import RELATIONS, Relation
from notabug.metrics.image_filters import widened
from notabug.references.tracer.envelope import Envelope, trace_envelope
from notabug.references.tracer.options import Options
from notabug.scenes_usd.reader import read_scene
from notabug.scenes_usd.scene import Scene

Floats = npt.NDArray[np.floating]
Bools = npt.NDArray[np.bool_]
Draw = Callable[[Scene], Floats]

SCENES = ("terminator/sphere", "phong/lobes", "separation/t_highlight", "mirror/corner", "texture/uneven_quad")
SIDE = 64
EXACT = 1e-12  # of the brightest pixel: what a float64 renderer may differ by
ROUNDED = 1e-4  # a float32 one: a few roundings, which a highlight multiplies by its exponent
FEW = 2e-3  # of the pixels at edges and terminators: so many may fall to another side


@dataclass(frozen=True, slots=True)
class Check:
    """One relation, one scene, one renderer.

    ``largest`` difference away from edges and terminators, over the picture's maximum; ``pixels`` there differ by more
    than ``allowed``, ``edge_pixels`` of ``edges`` at edges do. ``place`` (x, y) is where the largest one is.
    """

    relation: str
    claim: str
    scene: str
    renderer: str
    allowed: float
    largest: float = 0.0
    pixels: int = 0
    edge_pixels: int = 0
    edges: int = 0
    place: tuple[int, int] = (0, 0)
    message: str = ""  # why it could not be checked

    @property
    def broken(self) -> bool:
        return not self.message and (self.pixels > 0 or self.edge_pixels > max(2, FEW * SIDE * SIDE))

    def as_dict(self) -> dict[str, object]:
        return asdict(self) | {"broken": self.broken}


def drawn_by(adapter: Adapter) -> Draw:
    """The pixel centres as ``adapter`` draws them, deterministic and on one thread."""
    from notabug.scenes_usd.picture import read_picture

    quality = Quality(samples=1, seeds=(0,), threads=1, timeout=120.0)

    def draw(scene: Scene) -> Floats:
        with tempfile.TemporaryDirectory(prefix="notabug-") as folder:
            (made,) = adapter.render(scene, Path(folder), quality)
            return read_picture(made.image).pixels.astype(np.float64)

    return draw


def in_house(precision: npt.DTypeLike = np.float64) -> Draw:
    """Our own tracer's picture, not rounded to a file's float32."""
    from notabug.references.tracer.envelope import trace_picture

    options = Options(shadows="facets", ties="nearest")
    return lambda scene: trace_picture(replace(scene, intent=None), options, dtype=precision, threads=1)


def check(relation: Relation, scene: Scene, renderer: str, draw: Draw, allowed: float) -> Check | None:
    """Whether ``relation`` holds; None where the scene has nothing that it acts on."""
    other = relation.second(scene)
    if other is None:
        return None
    blank = Check(relation.name, relation.claim, scene.id, renderer, allowed)
    try:
        a, b = draw(relation.first(scene)), draw(other)
    except UnsupportedError as error:
        return replace(blank, message=error.what)
    except RendererError as error:
        return replace(blank, message=f"failed: {error.what}")
    edge = delicate(scene)
    peak = float(max(np.abs(a).max(), 1e-30))
    difference = np.abs(a - b).max(axis=2) / peak
    off = ~(difference <= allowed)  # NaN too
    smooth = np.where(edge, 0.0, np.nan_to_num(difference, nan=np.inf))
    y, x = divmod(int(smooth.argmax()), scene.width)
    return replace(
        blank,
        largest=float(smooth.max()),
        pixels=int((off & ~edge).sum()),
        edge_pixels=int((off & edge).sum()),
        edges=int(edge.sum()),
        place=(x, y),
    )


def delicate(scene: Scene) -> Bools:
    """(h, w) pixels at edges and terminators, where the last bit decides what is seen: within one pixel of a change."""
    made: Envelope = trace_envelope(replace(scene, intent=None), Options(shadows="facets"), grid=2, refine=0, threads=1)
    ids = made.ids
    found = made.edge.copy()
    found[:, 1:] |= ids[:, 1:] != ids[:, :-1]
    found[1:] |= ids[1:] != ids[:-1]
    return widened(found, 1)


def stages(names: Sequence[str] = SCENES, side: int = SIDE) -> list[Scene]:
    """The scenes on which relations are checked, ``side`` pixels wide."""
    scenes = [read_scene(name) for name in names]
    return [replace(scene, width=side, height=round(side * scene.height / scene.width)) for scene in scenes]


def measure(
    scenes: Sequence[Scene],
    renderers: Sequence[tuple[str, Draw, float]],
    note: Callable[[str], None] = lambda _: None,
    relations: Sequence[Relation] = RELATIONS,
) -> list[Check]:
    """Every relation on every scene by every renderer (name, how it draws, what it may differ by)."""
    found = []
    for name, draw, allowed in renderers:
        for scene in scenes:
            for relation in relations:
                made = check(relation, scene, name, draw, allowed)
                if made is not None:
                    found.append(made)
                    note(sentence(made))
    return found


def sentence(made: Check) -> str:
    head = f"{made.renderer}, {made.scene}, {made.relation}"
    if made.message:
        return f"{head}: not checked, {made.message}"
    if not made.broken:
        return f"{head}: holds, {made.largest:.1e} at most, {made.edge_pixels} of {made.edges} edge pixels differ"
    x, y = made.place
    return (
        f"{head}: BROKEN, {made.pixels} pixels differ by up to {made.largest:.1e} of the brightest, at {x}, {y}, "
        f"and {made.edge_pixels} of {made.edges} edge pixels"
    )
