"""The PNGs of a run's pictures, drawn by threads while the run goes on, each once, named by their content."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from notabug.report.loading import inside
from notabug.report.pictures import Bytes, levels, png, tone_map
from notabug.report.rows import Shown
from notabug.results.record import Result
from notabug.results.wording import number
from notabug.scenes_usd.errors import NotabugError
from notabug.scenes_usd.picture import read_picture

FOLDER = "report_files"
LEGS = ("bug", "limitation")


@dataclass(frozen=True, slots=True)
class Drawn:
    """A PNG by its name; ``peak`` is where a difference is largest (x, y), ``scale`` how large: that is brightest."""

    name: str
    peak: tuple[int, int] | None = None
    scale: float | None = None


class Pictures:
    """The pictures of the run in ``out`` as the page shows them.

    Those of a finished result may be begun while the run goes on, where a processor is idle: compressing pictures lets
    others run. ``white`` is the radiance that is shown as white; the PNGs lie in ``folder``.
    """

    def __init__(self, out: Path, white: float = 1.0, folder: Path | None = None) -> None:
        self.folder = out / FOLDER if folder is None else folder
        self._out = out
        self._white = white
        self._drawn: dict[str, Future[Drawn]] = {}
        self._references: dict[tuple[str, str], str] = {}
        self._pool = ThreadPoolExecutor()

    def __enter__(self) -> Pictures:
        return self

    def __exit__(self, *_: object) -> None:
        self._pool.shutdown(cancel_futures=True)

    def begin(self, result: Result) -> None:
        """Draw what the page shows of ``result``, and of the first of its scene the reference."""
        images = result.images
        if "reference" in images:
            self._references.setdefault((result.scene, result.variant), images["reference"])
        for name in (result.image, images.get("nearest", ""), self._reference(result)):
            self._draw(name, self._picture)
        for leg in LEGS:
            self._draw(self._map(result, leg), self._heat)
        if self._unmapped(result):
            self._draw(_pair(result.image, self._reference(result)), self._difference)

    def of(self, result: Result) -> tuple[tuple[Shown, ...], tuple[Shown, ...]]:
        """The pictures that tell what is wrong, and the others, of a result that was begun."""
        main = [
            self._shown(result.image, "picture", boxed=True),
            self._shown(self._reference(result), "reference"),
        ]
        maps = {leg: name for leg in LEGS if (name := self._map(result, leg))}
        told = next(iter(maps), "")
        if told:
            main.append(self._shown(maps[told], "difference", ", FLIP"))
        elif self._unmapped(result):
            main.append(self._shown(_pair(result.image, self._reference(result)), "difference", ", radiance"))
        nearest = result.images.get("nearest", "")
        more = [self._shown(nearest, "nearest admissible")] if nearest and nearest != result.image else []
        more += [self._shown(name, f"{leg} leg", ", FLIP") for leg, name in maps.items() if leg != told]
        return tuple(main), tuple(more)

    def peak(self, result: Result) -> tuple[int, int] | None:
        """The pixel of ``result`` that is most wrong, where a picture shows it."""
        name = self._map(result, "bug") or (_pair(result.image, self._reference(result)) if result.image else "")
        future = self._drawn.get(name)
        try:
            return future.result().peak if future is not None else None
        except NotabugError:
            return None

    def _shown(self, name: str, title: str, unit: str = "", *, boxed: bool = False) -> Shown:
        if not name:
            return Shown(title, note="no picture")
        try:
            drawn = self._drawn[name].result()
        except NotabugError as error:
            return Shown(title, note=str(error))
        scale = f"{unit} up to {number(drawn.scale, 2)}" if drawn.scale is not None else ""
        return Shown(title + scale, drawn.name, boxed=boxed)

    def _reference(self, result: Result) -> str:
        return self._references.get((result.scene, result.variant), "")

    def _map(self, result: Result, leg: str) -> str:
        return result.images.get(f"{leg}_map", "") if result.verdict.legs[leg].pixels else ""

    def _unmapped(self, result: Result) -> bool:
        """A bug of which no map tells where, such as a gain: there the plain difference is shown."""
        there = bool(result.image and self._reference(result))
        return result.verdict.word == "bug" and there and not any(self._map(result, leg) for leg in LEGS)

    def _draw(self, name: str, how: Callable[[str], Drawn]) -> None:
        if name and name not in self._drawn:
            self._drawn[name] = self._pool.submit(how, name)

    def _picture(self, name: str) -> Drawn:
        return Drawn(self._write(tone_map(read_picture(inside(self._out, name)).pixels, self._white)))

    def _heat(self, name: str) -> Drawn:
        return self._scaled(read_picture(inside(self._out, name)).pixels[:, :, 0])

    def _difference(self, pair: str) -> Drawn:
        picture, reference = (read_picture(inside(self._out, name)).pixels for name in pair.split("\0"))
        if picture.shape != reference.shape:
            raise NotabugError("the picture has not the reference's size", got=f"{picture.shape[1]}x{picture.shape[0]}")
        return self._scaled(np.abs(picture - reference).max(axis=2))

    def _scaled(self, values: npt.NDArray[np.floating]) -> Drawn:
        """``values`` of a difference, (h, w), the largest brightest, so that a small one can be seen."""
        finite = np.where(np.isfinite(values), values, 0.0)
        scale = float(finite.max(initial=0.0))
        return Drawn(self._write(levels(finite / scale if scale else finite)), _peak(finite), scale)

    def _write(self, pixels: Bytes) -> str:
        """The name of the PNG of ``pixels``, which is written unless it is there: equal pictures are one file."""
        data = png(pixels)
        name = f"{hashlib.blake2b(data, digest_size=8).hexdigest()}.png"
        path = self.folder / name
        if not path.is_file():
            self.folder.mkdir(parents=True, exist_ok=True)
            part = path.with_suffix(f".{id(data)}.partial")
            part.write_bytes(data)
            part.replace(path)
        return name


def _pair(picture: str, reference: str) -> str:
    return f"{picture}\0{reference}"


def _peak(values: npt.NDArray[np.floating]) -> tuple[int, int] | None:
    if not values.any():
        return None
    y, x = np.unravel_index(int(np.argmax(values)), values.shape)
    return (int(x), int(y))
