"""reduce: shrink a scene while a renderer's picture of it stays the same bug, down to what a bug report needs."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import TypeVar

import numpy as np
import numpy.typing as npt

from notabug.adapters.base import Adapter, Declaration, Quality, RendererError, UnsupportedError
from notabug.bench.metamorphic_relations import keep_faces
from notabug.metrics.judge import judge
from notabug.metrics.verdict import Verdict
from notabug.scenes_usd.errors import NotabugError
from notabug.scenes_usd.picture import read_picture
from notabug.scenes_usd.scene import Material, Mesh, Preview, Scene
from notabug.scenes_usd.temporary import temporary_folder

Pixels = npt.NDArray[np.floating]
Holds = Callable[[Scene], bool]
Thing = TypeVar("Thing")
Note = Callable[[str], None]

LEAST_SIDE = 16
SIMPLE = 0.5  # a colour that says nothing of its own


@dataclass(frozen=True, slots=True, eq=False)
class Shown:
    """A scene with a renderer's picture of it and what the judge says."""

    scene: Scene
    verdict: Verdict
    found: Pixels
    expected: Pixels
    samples: int

    @property
    def pixel(self) -> tuple[int, int]:
        """(x, y) of the pixel that is farthest off, away from the picture's rim where there is a choice."""
        off = np.nan_to_num(np.abs(self.found - self.expected).max(axis=2), nan=np.inf)
        y, x = divmod(int(off.argmax()), off.shape[1])
        return x, y


class Examiner:
    """Draws scenes with one renderer and judges them; knows what bug it is looking for."""

    def __init__(self, adapter: Adapter, quality: Quality) -> None:
        self.adapter, self.quality, self.tried = adapter, quality, 0

    @property
    def declaration(self) -> Declaration:
        return self.adapter.declaration(self.quality)

    def show(self, scene: Scene) -> Shown:
        self.tried += 1
        with temporary_folder() as folder:
            made = self.adapter.render(scene, folder, self.quality)
            pictures = [read_picture(each.image).pixels for each in made]
        judged = judge(pictures, scene, self.declaration, perceive=False)
        return Shown(scene, judged.verdict, judged.mean, judged.nearest, made[0].samples)

    def is_same(self, name: str) -> Holds:
        """Whether a scene still shows a bug called ``name``, or any where it is ""; one that cannot be drawn or judged
        does not."""

        def holds(scene: Scene) -> bool:
            try:
                found = bug(self.show(scene).verdict)
                return found == name if name else bool(found)
            except (RendererError, UnsupportedError, NotabugError, ValueError, ArithmeticError):
                return False

        return holds


def bug(verdict: Verdict) -> str:
    """The name of the verdict's bug, or ""."""
    return (
        next((finding.name for finding in verdict.findings if finding.kind == "bug"), "")
        if verdict.word == "bug"
        else ""
    )


def reduced(scene: Scene, holds: Holds, note: Note = lambda _: None) -> Scene:
    """The smallest scene that delta debugging finds for which ``holds`` still does; it must hold for ``scene``.

    First fewer pixels, which makes every later step cheaper; then fewer objects, lights and faces, plainer materials,
    and fewer pixels again, until nothing more can go. With few pixels a bug may need more of the scene than with all of
    them: so what is left is tried once more with all.
    """
    parts = (_objects, _lights, _intent, _faces, _looks)
    small = _less(scene, holds, note, (_resolution, *parts))
    large = replace(small, width=scene.width, height=scene.height)
    if large.digest() != small.digest() and holds(large):
        small = _less(_less(large, holds, note, parts), holds, note, (_resolution,))
    return _tidy(small)


def _less(scene: Scene, holds: Holds, note: Note, steps: Sequence[Callable[[Scene, Holds], Scene]]) -> Scene:
    """``scene`` after ``steps``, over and over until none takes anything away."""
    before = ""
    while before != scene.digest():
        before = scene.digest()
        for step in steps:
            smaller = step(scene, holds)
            if smaller is not scene:
                note(f"{step.__name__.strip('_')}: {size(smaller)}")
                scene = smaller
    return scene


def size(scene: Scene) -> str:
    faces = sum(len(mesh.counts) for mesh in scene.meshes)
    spheres = sum(1 for _ in scene.spheres)
    counted = ((len(scene.objects), "object"), (faces, "face"), (spheres, "sphere"), (len(scene.lights), "light"))
    said = ", ".join(f"{n} {word}{'s' * (n != 1)}" for n, word in counted if n)
    return f"{said}, {scene.width} x {scene.height} pixels"


def minimal(items: Sequence[Thing], holds: Callable[[Sequence[Thing]], bool]) -> list[Thing]:
    """A part of ``items`` for which ``holds`` and from which no single item can go (ddmin, Zeller 2002).

    >>> minimal(range(100), lambda kept: 7 in kept and 42 in kept)
    [7, 42]
    """
    kept, parts = list(items), 2
    while len(kept) > 1:
        width = -(-len(kept) // parts)
        for start in range(0, len(kept), width):
            rest = kept[:start] + kept[start + width :]
            if rest and holds(rest):
                kept, parts = rest, max(parts - 1, 2)
                break
        else:
            if width == 1:
                break
            parts = min(len(kept), 2 * parts)
    return kept


def _resolution(scene: Scene, holds: Holds) -> Scene:
    while min(scene.width, scene.height) >= 2 * LEAST_SIDE:
        smaller = replace(scene, width=scene.width // 2, height=scene.height // 2)
        if not holds(smaller):
            break
        scene = smaller
    return scene


def _objects(scene: Scene, holds: Holds) -> Scene:
    kept = minimal(scene.objects, lambda some: holds(replace(scene, objects=tuple(some))))
    return scene if len(kept) == len(scene.objects) else replace(scene, objects=tuple(kept))


def _lights(scene: Scene, holds: Holds) -> Scene:
    kept = minimal(scene.lights, lambda some: holds(replace(scene, lights=tuple(some))))
    return scene if len(kept) == len(scene.lights) else replace(scene, lights=tuple(kept))


def _intent(scene: Scene, holds: Holds) -> Scene:
    if scene.intent is None:
        return scene
    plain = replace(scene, intent=None)
    return plain if holds(plain) else scene


def _faces(scene: Scene, holds: Holds) -> Scene:
    for index, each in enumerate(scene.objects):
        if not isinstance(each, Mesh) or len(each.counts) < 2:
            continue

        only = partial(_with_faces, scene, index, each)
        kept = minimal(range(len(each.counts)), lambda faces, only=only: holds(only(faces)))  # type: ignore[misc]
        if len(kept) < len(each.counts):
            scene = only(kept)
    return scene


def _with_faces(scene: Scene, index: int, mesh: Mesh, faces: Sequence[int]) -> Scene:
    mask = np.zeros(len(mesh.counts), bool)
    mask[list(faces)] = True
    return _with_object(scene, index, keep_faces(mesh, mask))


def _with_object(scene: Scene, index: int, mesh: Mesh) -> Scene:
    return replace(scene, objects=(*scene.objects[:index], mesh, *scene.objects[index + 1 :]))


def _looks(scene: Scene, holds: Holds) -> Scene:
    """Materials without what the bug does not need, one property at a time; meshes without normals and uv."""
    for index in sorted({shape.material for shape in scene.objects}):
        for plain in _plainer(scene.materials[index]):
            materials = (*scene.materials[:index], plain(scene.materials[index]), *scene.materials[index + 1 :])
            smaller = replace(scene, materials=materials)
            if smaller.digest() != scene.digest() and holds(smaller):
                scene = smaller
    for index, each in enumerate(scene.objects):
        if isinstance(each, Mesh) and each.normals is not None:
            smaller = _with_object(scene, index, replace(each, normals=None))
            scene = smaller if holds(smaller) else scene
    return scene


def _plainer(material: Material) -> Iterator[Callable[[Material], Material]]:
    black, grey = (0.0, 0.0, 0.0), (SIMPLE, SIMPLE, SIMPLE)
    if material.texture >= 0:
        yield lambda each: replace(each, texture=-1, diffuse=grey)
    if material.preview is not None:
        yield lambda each: replace(each, preview=None)
        if material.preview != Preview():
            yield lambda each: replace(each, preview=Preview())
    for name in ("specular", "mirror", "transmission"):
        if any(getattr(material, name)):
            yield lambda each, name=name: replace(each, **{name: black})  # type: ignore[misc]
    if material.opacity_map >= 0:
        yield lambda each: replace(each, opacity_map=-1, cutoff=0.0)
        if material.cutoff:
            yield lambda each: replace(each, cutoff=0.0)
    if material.opacity < 1.0:
        yield lambda each: replace(each, opacity=1.0)
        yield lambda each: replace(each, opacity=SIMPLE)
    if any(material.diffuse) and material.diffuse != grey:
        yield lambda each: replace(each, diffuse=grey)


def _tidy(scene: Scene) -> Scene:
    """Without materials, textures and coordinates that nothing uses."""
    used = sorted({shape.material for shape in scene.objects})
    shown = sorted(scene.shown_textures)
    materials = tuple(scene.materials[k].renumbered(shown) for k in used)
    objects = []
    for shape in scene.objects:
        moved = replace(shape, material=used.index(shape.material))
        if isinstance(moved, Mesh) and not materials[moved.material].textures:
            moved = replace(moved, uv=None)
        objects.append(moved)
    card = replace(scene.card, requires=frozenset(), intent=scene.card.intent if scene.intent is not None else "")
    return replace(
        scene,
        objects=tuple(objects),
        materials=materials,
        textures=tuple(scene.textures[k] for k in shown),
        card=card,
    )
