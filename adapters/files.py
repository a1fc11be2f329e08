"""Pictures that were rendered elsewhere: a folder of files, matched to scenes by name and judged like any renderer's.

The patterns of ``PATTERNS`` are tried in turn; the files that the first one with a match finds are independent seeds,
in the order of their names. The files are copied, so that a run keeps what it judged.
"""

from __future__ import annotations

import hashlib
import shutil
from collections.abc import Iterator
from dataclasses import dataclass
from glob import escape
from pathlib import Path

from notabug.adapters.base import Apart, Declaration, Found, Quality, Render, RendererMissingError, UnsupportedError
from notabug.adapters.declared import PIXELS
from notabug.adapters.process import failure
from notabug.adapters.requirements import check_supported
from notabug.adapters.spheres import as_given
from notabug.scenes_usd.picture import PictureError, read_header, read_picture, write_exr
from notabug.scenes_usd.scene import Scene

PATTERNS = ("{scene}/{variant}/*", "{scene}/{variant}.*", "{scene}.{variant}.*", "{scene}.*")
SUFFIXES = frozenset({".exr", ".png", ".pfm", ".tif", ".tiff", ".hdr"})


@dataclass(frozen=True, slots=True)
class Files:
    """The pictures in ``folder``; {scene} is ``class/scene``, {variant} ``set=name,set=name`` or ``default``.

    The last pattern, which names no variant, is only for scenes that are drawn as their file stands.
    """

    name: str
    folder: Path
    declared: Declaration
    capabilities: frozenset[str]
    not_together: tuple[Apart, ...] = ()
    pixels: str = "float"
    srgb: bool = False
    layer: str = ""  # the layer or part that is the picture, where files hold several
    version: str = ""
    install: str = "put the pictures there"
    key: str = ""
    taken_at_its_word: bool = True  # where there is no picture of the card

    def declaration(self, quality: Quality) -> Declaration:
        del quality
        return self.declared

    def find(self) -> Found:
        if not self.folder.is_dir():
            raise RendererMissingError("no such folder", where=f"adapter {self.name!r}", got=str(self.folder))
        state = hashlib.blake2b(self.key.encode(), digest_size=8)
        for path in sorted(self.folder.rglob("*")):  # a changed picture must not be judged by an older one's result
            if path.suffix in SUFFIXES:
                seen = path.stat()
                state.update(f"{path.relative_to(self.folder)} {seen.st_size} {seen.st_mtime_ns}".encode())
        return Found(self.version or "files", str(self.folder), key=state.hexdigest())

    def render(self, scene: Scene, out: Path, quality: Quality) -> tuple[Render, ...]:
        del quality
        scene = as_given(scene, self.declared)
        check_supported(self, scene)
        if scene.adapted == "scene":
            what = "its pictures show the scene as its file is, not as it is adapted in memory"
            do = "write the layer down with notabug adapt, draw that one and name it"
            raise UnsupportedError(what, where=f"adapter {self.name!r}", do=do)
        found = self._matches(scene)
        if not found:
            what = "no picture of this scene"
            do = f"render it to {self.folder}/{scene.id}/{scene.variant or 'default'}.exr"
            if scene.card.artifact_class == "calibration":  # without a card a folder is taken at its word
                raise UnsupportedError(what, where=f"adapter {self.name!r}", do=do)
            raise failure(what, where=self.name, do=f"{do}, or leave the scene out")
        return tuple(self._copy(path, out, seed) for seed, path in enumerate(found))

    def _matches(self, scene: Scene) -> list[Path]:
        for pattern in self._patterns(scene):
            found = sorted(path for path in self.folder.glob(pattern) if path.is_file() and path.suffix in SUFFIXES)
            if found:
                return found
        return []

    def _patterns(self, scene: Scene) -> Iterator[str]:
        from notabug.scenes_usd.catalogue import read_entry

        variant = escape(scene.variant or "default")
        for pattern in PATTERNS[:-1]:
            yield pattern.format(scene=escape(scene.id), variant=variant)
        if dict(read_entry(scene.path).defaults) == dict(scene.variants) and not scene.view.words:
            yield PATTERNS[-1].format(scene=escape(scene.id))

    def _copy(self, path: Path, out: Path, seed: int) -> Render:
        try:
            header = read_header(path, self.layer)
            if header.quantum > PIXELS[self.pixels].quantum:
                raise failure(f"{path.name} is coarser than the declared {self.pixels}", where=self.name)
            anew = self.srgb or bool(self.layer)
            kept = out / (f"seed{seed}.exr" if anew else f"seed{seed}{path.suffix}")
            if anew:
                write_exr(kept, read_picture(path, layer=self.layer, srgb=self.srgb).pixels)
            else:
                shutil.copyfile(path, kept)
        except PictureError as error:
            raise failure(str(error), where=self.name) from error
        return Render(kept, seed, 0, 0.0)
