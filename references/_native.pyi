"""What references/native/bindings.cpp gives Python. Arrays are contiguous and of the types that Flat says."""

from typing import Any

import numpy as np
import numpy.typing as npt

from notabug.references.raster.picture import RasterOptions
from notabug.references.raster.shadow_map import ShadowMaps
from notabug.references.tracer.flatten import Flat
from notabug.references.tracer.options import Options

Array = npt.NDArray[Any]
Floats = npt.NDArray[np.float64]

SOURCES: str  # a hash of the sources that the module was built from
COMPILER: str
STACK: int

def build(
    lo: Floats, hi: Floats
) -> tuple[Floats, npt.NDArray[np.int32], npt.NDArray[np.int32], npt.NDArray[np.int64]]: ...
def widen(
    bounds: Floats, child: npt.NDArray[np.int32], count: npt.NDArray[np.int32]
) -> tuple[npt.NDArray[np.int32], npt.NDArray[np.int32], Floats]: ...
def render(
    flat: Flat,
    options: Options,
    width: int,
    height: int,
    pixels: npt.NDArray[np.int64],
    grid: int,
    samples: int,
    seed: int,
    into: Any,
    threads: int,
    directions: int = 1,
) -> None: ...
def trace(flat: Flat, origins: Array, directions: Array, threads: int = 0) -> tuple[Array, Array, Array]: ...
def occluded(
    flat: Flat, origins: Array, directions: Array, distances: Array, threads: int = 0
) -> npt.NDArray[np.bool_]: ...
def probe(flat: Flat, options: Options, width: int, height: int, x: float, y: float) -> dict[str, Any] | None: ...
def fill(
    points: Array,
    order: npt.NDArray[np.int64],
    view: Array,
    parallel: bool,
    form: str,
    last: bool,
    depth: Floats,
    winner: npt.NDArray[np.int32],
) -> None: ...
def raster(
    flat: Flat,
    order: npt.NDArray[np.int64],
    view: Array,
    maps: ShadowMaps | None,
    options: RasterOptions,
    grid: int,
    picture: Floats,
    threads: int,
) -> None: ...
def main_axis(direction: Array) -> int: ...
def ray_triangle(origin: Array, direction: Array, corners: Array) -> tuple[float, float, float, float]: ...
def ray_sphere(origin: Array, direction: Array, radius: float) -> tuple[float, float]: ...
def inverse_bilinear(point: Array, quad: Array) -> tuple[float, float]: ...
