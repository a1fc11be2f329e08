"""Pictures and depths of a scene as a z-buffer draws them."""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from notabug.references.raster import colour as colours
from notabug.references.raster import fill as kernels
from notabug.references.raster.shadow_map import ShadowMaps, shadow_maps
from notabug.references.tracer.flatten import Flat, flatten
from notabug.scenes_usd.errors import SceneError
from notabug.scenes_usd.scene import Mesh, Scene
from notabug.scenes_usd.triangulate import Diagonal, split_ngons

Floats = npt.NDArray[np.float64]
DepthFormat = Literal["exact", "fixed16", "fixed24", "float32", "reversed32"]
_BAND = 1 << 17  # samples drawn at once, by one thread
_LAYERS = 256  # transparent surfaces behind each other; a deeper scene is drawn without the rest


@dataclass(frozen=True, slots=True)
class RasterOptions:
    """The rasteriser's switches.

    Attributes
    ----------
    depth : format of the depth buffer: fixed point of 16 or 24 bits, float32, float32 with near at 1 and far at 0, or
        float64 (``exact``).
    tie : of equal depths the first drawn wins (``less``) or the last (``less_equal``); scene order is drawing order.
    normals : ``phong`` interpolates normals, ``gouraud`` the light computed at the corners, ``flat`` takes the facet's.
    affine : uv, and the light of ``gouraud``, are interpolated in screen space, without perspective.
    silhouette : an interpolated normal that faces away from the viewer is kept, flipped, or painted black.
    diagonal : how n-gons are cut into triangles.
    shadow_map : cells along an edge of each shadow map; 0: nothing casts a shadow.
    shadow_bias : what a surface must be farther from the light than its map says, in the scene's unit of length.
    """

    depth: DepthFormat = "fixed24"
    tie: Literal["less", "less_equal"] = "less"
    normals: Literal["phong", "gouraud", "flat"] = "phong"
    affine: bool = False
    silhouette: Literal["keep", "flip", "black"] = "keep"
    diagonal: Diagonal = "02"
    shadow_map: int = 0
    shadow_bias: float = 0.0

    def encoded(self) -> npt.NDArray[np.int64]:
        """The switches in the order of the columns in colour.py."""
        return np.array(
            [
                ("phong", "gouraud", "flat").index(self.normals),
                ("keep", "flip", "black").index(self.silhouette),
                int(self.affine),
            ]
        )

    def form(self) -> tuple[int, float]:
        """The format's code in fill.py, and the largest value of a fixed-point one."""
        if self.depth.startswith("fixed"):
            return kernels.FIXED, 2.0 ** int(self.depth[5:]) - 1.0
        codes = {"exact": kernels.EXACT, "float32": kernels.FLOAT, "reversed32": kernels.REVERSED}
        return codes[self.depth], 0.0


@dataclass(frozen=True, slots=True, eq=False)
class DepthBuffer:
    """What a depth buffer holds at the pixel centres.

    Attributes
    ----------
    depth : (h, w) the stored value in [0, 1]: 0 at the near plane and 1 at the far one, reversed z the other way.
    object : (h, w) index into ``Scene.objects`` of what is seen, -1 for the background.
    """

    depth: Floats
    object: npt.NDArray[np.int32]


@dataclass(frozen=True, slots=True, eq=False)
class _Setup:
    flat: Flat
    order: npt.NDArray[np.int64]
    maps: ShadowMaps | None
    options: RasterOptions
    size: tuple[int, int]  # of the window, in samples


class _Layer:
    """The arrays that one pass fills."""

    def __init__(self, setup: _Setup, rows: int) -> None:
        shape = (rows, setup.size[0])
        clear = -0.0 if setup.options.depth == "reversed32" else 1.0
        self.depth = np.full(shape, clear)
        self.winner = np.full(shape, -1, np.int32)
        self.weights = np.zeros((2, *shape, 3), setup.flat.points.dtype)

    def fill(self, setup: _Setup, top: int, behind: _Layer | None) -> None:
        form, steps = setup.options.form()
        camera = setup.flat.camera.astype(np.float64)
        for axis in (slice(3, 6), slice(6, 9)):
            camera[axis] /= camera[axis] @ camera[axis]
        kernels.fill(
            setup.flat.points, setup.order, camera.astype(setup.flat.points.dtype), False, form, steps,
            setup.options.tie == "less_equal", setup.size, top,
            None if behind is None else (behind.depth, behind.winner),
            self.depth, self.winner, self.weights[0], self.weights[1],
        )  # fmt: skip


def raster_picture(
    scene: Scene,
    options: RasterOptions = RasterOptions(),
    *,
    samples: int = 1,
    dtype: npt.DTypeLike = np.float64,
    threads: int = 0,
) -> Floats:
    """The picture (h, w, 3) of ``scene``: pixel centres for one sample, else the mean of a regular grid.

    ``samples`` must be a square. Transparent surfaces are composited in the order of their depths (depth peeling).
    """
    grid = round(samples**0.5)
    if grid < 1 or grid * grid != samples:
        raise ValueError(f"samples must be a square, not {samples}")
    setup = _prepare(scene, options, grid, dtype)
    picture = np.zeros((scene.height, scene.width, 3))

    def work(band: tuple[int, int]) -> None:
        first, last = band
        drawn = _draw(setup, first * grid, (last - first) * grid)
        cells = drawn.reshape(last - first, grid, scene.width, grid, 3)
        picture[first:last] = cells.astype(np.float64).mean(axis=(1, 3))

    height = max(1, _BAND // (scene.width * grid * grid))
    bands = [(first, min(first + height, scene.height)) for first in range(0, scene.height, height)]
    with ThreadPoolExecutor(threads or os.cpu_count() or 1) as pool:
        list(pool.map(work, bands))
    return picture


def raster_depth(
    scene: Scene, options: RasterOptions = RasterOptions(), *, dtype: npt.DTypeLike = np.float64
) -> DepthBuffer:
    """The depth buffer of ``scene`` at the pixel centres: the nearest surface, transparent or not."""
    setup = _prepare(scene, options, 1, dtype)
    layer = _Layer(setup, scene.height)
    layer.fill(setup, 0, None)
    owner = setup.flat.object[setup.order][layer.winner] if len(setup.order) else layer.winner
    return DepthBuffer(np.abs(layer.depth), np.where(layer.winner < 0, np.int32(-1), owner))


def _prepare(scene: Scene, options: RasterOptions, grid: int, dtype: npt.DTypeLike) -> _Setup:
    for each in scene.objects:
        if not isinstance(each, Mesh):
            raise SceneError("a rasteriser draws meshes, not analytic spheres", where=each.path, do="tessellate it")
        material = scene.materials[each.material]
        if any(material.mirror) or any(material.transmission):
            raise SceneError("a rasteriser sends no rays on: no mirrors and no glass", where=material.path)
    cut = tuple(split_ngons(each, options.diagonal) for each in scene.meshes)
    flat = flatten(replace(scene, objects=cut), dtype)
    order = np.argsort(flat.face, kind="stable")
    maps = shadow_maps(flat, order, options.shadow_map, options.shadow_bias) if options.shadow_map else None
    return _Setup(flat, order, maps, options, (scene.width * grid, scene.height * grid))


def _draw(setup: _Setup, top: int, rows: int) -> npt.NDArray[Any]:
    """The samples (rows, width, 3) from the row ``top`` on, layer by layer from the front."""
    flat = setup.flat
    into = np.zeros((rows, setup.size[0], 3), flat.points.dtype)
    rest = np.ones(into.shape[:2], flat.points.dtype)
    behind = None
    for _ in range(_LAYERS):
        layer = _Layer(setup, rows)
        layer.fill(setup, top, behind)
        if not colours.colour(
            flat, flat.lobes, flat.textures, flat.secondary, setup.maps, setup.options.encoded(), setup.order,
            layer.winner, layer.weights[0], layer.weights[1], rest, into,
        ):  # fmt: skip
            break
        behind = layer
    return into
