"""Pictures and depths of a scene as a z-buffer draws them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
import numpy.typing as npt

from notabug.references import _native
from notabug.references.raster.shadow_map import ShadowMaps, shadow_maps
from notabug.references.tracer.flatten import Flat, flatten
from notabug.scenes_usd.errors import SceneError
from notabug.scenes_usd.scene import Camera, Mesh, Scene
from notabug.scenes_usd.triangulate import Diagonal, split_ngons

Floats = npt.NDArray[np.float64]
DepthFormat = Literal["exact", "fixed16", "fixed24", "float32", "reversed32"]


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
    shadow_normal_bias : by how much a point is moved along its normal before its shadow is looked up.
    """

    depth: DepthFormat = "fixed24"
    tie: Literal["less", "less_equal"] = "less"
    normals: Literal["phong", "gouraud", "flat"] = "phong"
    affine: bool = False
    silhouette: Literal["keep", "flip", "black"] = "keep"
    diagonal: Diagonal = "02"
    shadow_map: int = 0
    shadow_bias: float = 0.0
    shadow_normal_bias: float = 0.0


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
    view: npt.NDArray[np.floating]  # (14,) the camera as references/native/zbuffer.h has it
    maps: ShadowMaps | None


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
    setup = _prepare(scene, options, dtype)
    picture = np.zeros((scene.height, scene.width, 3))
    _native.raster(setup.flat, setup.order, setup.view, setup.maps, options, grid, picture, threads)
    return picture


def raster_depth(
    scene: Scene, options: RasterOptions = RasterOptions(), *, dtype: npt.DTypeLike = np.float64
) -> DepthBuffer:
    """The depth buffer of ``scene`` at the pixel centres: the nearest surface, transparent or not."""
    setup = _prepare(scene, options, dtype)
    shape = (scene.height, scene.width)
    depth = np.full(shape, -0.0 if options.depth == "reversed32" else 1.0)
    winner = np.full(shape, -1, np.int32)
    last = options.tie == "less_equal"
    parallel = scene.camera.orthographic
    _native.fill(setup.flat.points, setup.order, setup.view, parallel, options.depth, last, depth, winner)
    owner = setup.flat.object[setup.order][winner] if len(setup.order) else winner
    return DepthBuffer(np.abs(depth), np.where(winner < 0, np.int32(-1), owner))


def _prepare(scene: Scene, options: RasterOptions, dtype: npt.DTypeLike) -> _Setup:
    for shape in scene.objects:
        if not isinstance(shape, Mesh):
            raise SceneError("a rasteriser draws meshes, not analytic spheres", where=shape.path, do="tessellate it")
        material = scene.materials[shape.material]
        if any(material.mirror) or any(material.transmission):
            raise SceneError("a rasteriser sends no rays on: no mirrors and no glass", where=material.path)
    cut = tuple(split_ngons(mesh, options.diagonal) for mesh in scene.meshes)
    flat = flatten(replace(scene, objects=cut), dtype)
    order = np.argsort(flat.face, kind="stable").astype(np.int64, copy=False)
    cells, biases = options.shadow_map, (options.shadow_bias, options.shadow_normal_bias)
    maps = shadow_maps(flat, order, cells, *biases) if cells else None
    return _Setup(flat, order, _view(scene.camera, flat.camera).astype(flat.points.dtype), maps)


def _view(camera: Camera, packed: npt.NDArray[np.floating]) -> Floats:
    """The view of ``camera``, which is ``packed`` as in Flat; what it is shifted by moves its axes, or its eye."""
    eye, across, up, forward = packed[:12].astype(np.float64).reshape(4, 3)
    shift_x, shift_y = packed[14:16].astype(np.float64)
    if camera.orthographic:
        eye = eye + shift_x * across + shift_y * up
    across, up = across / (across @ across), up / (up @ up)
    if not camera.orthographic:
        across, up = across - shift_x * forward, up - shift_y * forward
    return np.concatenate([eye, across, up, forward, packed[12:14].astype(np.float64)])
