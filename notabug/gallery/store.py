"""The site's files: pictures named after their contents, as scripts, for a page from disk may load nothing else."""

from __future__ import annotations

import base64
import hashlib
import json
import tempfile
from pathlib import Path

import numpy as np
import numpy.typing as npt

from notabug.report.pictures import Bytes, tone_map
from notabug.runs.folders import write_text
from notabug.runs.own_folder import claim, keep_list, listed, sweep
from notabug.scenes_usd.errors import NotabugError
from notabug.scenes_usd.picture import write_exr

KIND = "gallery"
Floats = npt.NDArray[np.floating]


class Store:
    """Writes pictures and records below ``out``; the same contents are written once.

    A file's name is the hash of what is in it, so nothing that a run says can choose where anything is written.
    """

    def __init__(self, out: Path) -> None:
        claim(out, KIND)
        self.out = out
        self.written: set[Path] = set()
        self._there = listed(out)  # what earlier galleries wrote
        for folder in ("data", "thumbs"):
            (out / folder).mkdir(parents=True, exist_ok=True)

    def picture(self, pixels: Floats) -> str:
        """Keep (h, w, c) as a half-float EXR; the name under which pages load it. Infinities stay, NaN stays."""
        with np.errstate(over="ignore"):
            halves = np.asarray(pixels, np.float32).astype(np.float16)
        name = _hash(str(halves.shape).encode() + np.ascontiguousarray(halves).tobytes())
        target = self.out / "data" / f"{name}.js"
        if target not in self.written:
            with tempfile.TemporaryDirectory() as folder:
                path = Path(folder) / "picture.exr"
                write_exr(path, halves.astype(np.float32), half=True, metadata={"DateTime": "1970:01:01 00:00:00"})
                encoded = base64.b64encode(path.read_bytes()).decode("ascii")
            self._write(target, f'notabug.deliver("{name}","{encoded}");\n')
        return name

    def record(self, document: object) -> str:
        """Keep a JSON document; the name under which pages load it."""
        text = json.dumps(document, allow_nan=False, separators=(",", ":"))
        name = _hash(text.encode())
        self._write(self.out / "data" / f"{name}.js", f'notabug.deliver("{name}",{text});\n')
        return name

    def thumb(self, pixels: Floats, side: int = 256, white: float = 1.0) -> str:
        """Keep a small picture of (h, w, 3) linear radiance; its address from a page of the site."""
        small = shrink(pixels, side)
        shown = tone_map(small, white)
        name = _hash(str(shown.shape).encode() + shown.tobytes())
        target = self.out / "thumbs" / f"{name}.webp"
        if target not in self.written:
            _write_webp(target, shown)
            self.written.add(target)
        return f"thumbs/{name}.webp"

    def text(self, name: str, text: str) -> None:
        """Keep a page or an asset under its own name."""
        path = self.out / name
        path.parent.mkdir(parents=True, exist_ok=True)
        self._write(path, text)

    def sweep(self) -> None:
        """Remove what an earlier gallery in this folder left behind, and nothing else."""
        sweep(self.out, self._there - self._names())
        keep_list(self.out, KIND, self._names())

    def stop(self) -> None:
        """Remember what was written until now: the gallery is not finished."""
        keep_list(self.out, KIND, self._there | self._names())

    def _names(self) -> frozenset[str]:
        return frozenset(path.relative_to(self.out).as_posix() for path in self.written)

    def _write(self, path: Path, text: str) -> None:
        if path not in self.written:
            write_text(path, text)
            self.written.add(path)


def shrink(pixels: Floats, side: int) -> Floats:
    """(h, w, 3) by a whole factor, so that neither side exceeds ``side``; the mean of each block, of linear values."""
    step = max(1, -(-max(pixels.shape[:2]) // side))
    if step == 1:
        return pixels
    height, width = (length // step * step for length in pixels.shape[:2])
    blocks = pixels[:height, :width].reshape(height // step, step, width // step, step, -1)
    return np.asarray(blocks.mean(axis=(1, 3)))


def _hash(content: bytes) -> str:
    return hashlib.blake2b(content, digest_size=8).hexdigest()


def _write_webp(path: Path, pixels: Bytes) -> None:
    import OpenImageIO

    spec = OpenImageIO.ImageSpec(pixels.shape[1], pixels.shape[0], 3, OpenImageIO.UINT8)
    spec.attribute("compression", "webp:90")
    target = OpenImageIO.ImageOutput.create(str(path))
    if target is None or not target.open(str(path), spec) or not target.write_image(np.ascontiguousarray(pixels)):
        raise NotabugError("cannot write a small picture", where=str(path), got=OpenImageIO.geterror())
    target.close()
