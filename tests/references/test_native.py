"""The C++ extension: one result for any number of threads, each precision what it says, never older than its code."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
import sysconfig
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from notabug.references import _native, predict
from notabug.references.raster.picture import RasterOptions, raster_picture
from notabug.references.tracer.envelope import trace_envelope
from notabug.references.tracer.flatten import flatten
from notabug.references.tracer.options import Options
from notabug.scenes_usd.scene import Material, Scene

ROOT = Path(__file__).resolve().parents[2]
PRECISIONS = [np.float64, np.float32]
GLASS = Material("/Glass", (0.2,) * 3, specular=(0.3,) * 3, exponent=20.0, mirror=(0.2,) * 3, transmission=(0.5,) * 3)


@pytest.fixture
def scene(make: Any) -> Scene:
    """Every feature: quads, a texture, spheres, highlights, mirrors, glass, opacity."""
    objects = [make.rectangle(size=3.0), make.sphere((0.0, 0.0, 0.7), 0.5, 1), make.rectangle(0.0, 1.0)]
    lights = [make.point((1.0, 0.5, 2.0)), make.distant((0.2, 0.1, -1.0))]
    camera = make.camera((1, -3, 4), (0, 0, 0))
    materials = (Material("/White", (0.9,) * 3), GLASS)
    found: Scene = make.scene(objects, lights, camera, materials=materials, size=40, full=True)
    return found


@pytest.mark.parametrize("dtype", PRECISIONS)
@pytest.mark.parametrize("options", [Options(), Options(ties="another", resolution=1e-4, start="error_bound")])
def test_any_number_of_threads_gives_the_same(scene: Scene, options: Options, dtype: Any) -> None:
    one, *others = (trace_envelope(scene, options, dtype=dtype, threads=each).arrays() for each in (1, 2, 7))
    assert one["mean"].max() > 0
    assert one["edge"].any()
    for other in others:
        assert all(np.array_equal(one[name], other[name], equal_nan=True) for name in one)


@pytest.mark.parametrize("dtype", PRECISIONS)
def test_any_number_of_threads_rasterises_the_same(make: Any, dtype: Any) -> None:
    clear = Material("/Clear", (0.5,) * 3, opacity=0.5)
    objects = [make.rectangle(size=3.0), make.rectangle(1.0, 1.0, 1), make.rectangle(1.5, 0.5, 1)]
    scene = make.scene(
        objects, [make.point((0.5, 0.2, 2))], make.camera((1, -3, 4), (0, 0, 0)), materials=(GLASS_FREE, clear), size=96
    )
    options = RasterOptions(shadow_map=64, shadow_bias=1e-3)
    one, *others = (raster_picture(scene, options, samples=16, dtype=dtype, threads=each) for each in (1, 2, 7))
    assert one.max() > 0
    assert all(np.array_equal(one, other) for other in others)


GLASS_FREE = Material("/Grey", (0.6,) * 3, specular=(0.1,) * 3)


def test_the_precisions_are_two(scene: Scene) -> None:
    double, single = (trace_envelope(scene, dtype=each, refine=0) for each in PRECISIONS)
    apart = np.abs(double.point - single.point)
    same = (double.ids == single.ids) & ~double.edge
    assert 0 < np.median(apart[same]) < 1e-5


def test_the_module_is_built_from_the_sources_that_are_here() -> None:
    """Else `make setup` was not run since they changed, and every test here tests older code."""
    code = "import runpy, sys; sys.argv = ['setup.py', '--name']; print(runpy.run_path('setup.py')['source_hash']())"
    pytest.importorskip("pybind11")
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    assert done.stdout.split()[-1] == _native.SOURCES, "run `make setup`: the extension is older than its sources"
    assert _native.SOURCES in predict.SOURCE_HASH
    assert _native.COMPILER in predict.SOURCE_HASH


def _compiler() -> str:
    found = shutil.which("c++")
    if found is None:
        pytest.skip("needs c++")
    return found


@pytest.mark.parametrize("name", ["tracer32.cpp", "raster32.cpp"])
def test_float32_is_float32(name: str) -> None:
    """No float becomes a double without saying so: where it does, a cast says so."""
    words = [_compiler(), "-std=c++20", "-fsyntax-only", "-Wdouble-promotion", "-Werror", "-I."]
    done = subprocess.run([*words, name], cwd=ROOT / "references/native", capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_nothing_is_contracted() -> None:
    """No fused multiply and add, which round once instead of twice, and no vectors wider than every processor has."""
    dump = shutil.which("objdump")
    if dump is None:
        pytest.skip("needs objdump")
    module = Path(_native.__file__)
    done = subprocess.run([dump, "-d", "--no-show-raw-insn", str(module)], capture_output=True, text=True, check=True)
    assert re.search(r"\bmulsd\b|\bfmul\b", done.stdout)
    assert not re.findall(r"\b(?:vfn?m(?:add|sub)\w+|fn?m(?:add|sub)|fml[as]|v(?:mul|add)p[sd])\b", done.stdout)


def test_wrong_arrays_are_refused(scene: Scene) -> None:
    """A view of the wrong type or length would be read as something else, or beyond its end."""
    flat = flatten(scene)
    rays = np.zeros((1, 3)), np.ones((1, 3))
    _native.trace(flat, *rays)
    with pytest.raises(TypeError, match="origins: expected a contiguous array of float64"):
        _native.trace(flat, rays[0].astype(np.float32), rays[1])
    with pytest.raises(ValueError, match="object: expected"):
        _native.trace(flat._replace(object=flat.object[:-1]), *rays)
    with pytest.raises(TypeError, match="face: expected"):
        _native.trace(flat._replace(face=flat.face.astype(np.int64)), *rays)
    with pytest.raises(ValueError, match="unknown: sideways"):
        trace_envelope(scene, replace(Options(), silhouette="sideways"))  # type: ignore[arg-type]


def degenerate_scenes(make: Any) -> dict[str, Scene]:
    """Scenes that divide by zero somewhere: what they show does not matter, that they end does."""
    camera = make.camera((0.2, -3, 4), (0, 0, 0))
    lights = [make.point((0.5, 0.2, 2)), make.distant((0.1, 0.2, -1))]
    flat = [(0.0, 0, 0), (1, 0, 0), (2, 0, 0)]
    bowtie = [(-1.0, -1, 0), (1, 1, 0), (1, -1, 0), (-1, 1, 0)]
    point = [(0.0, 0, 0)] * 4
    up = [(0.0, 0, 1)] * 4
    nowhere = [(0.0, 0, 0)] * 4
    square = [(-1.0, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)]
    huge = [(-1e300, -1e300, 0), (1e300, -1e300, 0), (1e300, 1e300, 0)]
    uv = [(1e30, -1e30), (np.inf, 0), (0, np.nan), (1, 1)]
    many = make.mesh(np.tile(square[:3], (200, 1)), [(3 * i, 3 * i + 1, 3 * i + 2) for i in range(200)])
    found = {
        "a triangle without area": ([make.mesh(flat, [(0, 1, 2)])], lights),
        "a quad without area": ([make.mesh(point, [(0, 1, 2, 3)], normals=up)], lights),
        "a quad that crosses itself": ([make.mesh(bowtie, [(0, 1, 2, 3)], normals=up)], lights),
        "normals of length zero": ([make.mesh(square, [(0, 1, 2, 3)], normals=nowhere)], lights),
        "a light on the surface": ([make.rectangle()], [make.point((0, 0, 0)), make.point((0.2, -3, 4))]),
        "nothing": ([], lights),
        "no light": ([make.rectangle()], []),
        "one triangle two hundred times": ([many], lights),
        "points beyond float32": ([make.mesh(huge, [(0, 1, 2)])], lights),
        "uv that no integer holds": ([make.mesh(square, [(0, 1, 2, 3)], uv=uv)], lights),
        "a sphere of radius zero": ([make.sphere((0, 0, 0), 0.0), make.rectangle()], lights),
        "the eye on a sphere": ([make.sphere((0.2, -3, 4), 1.0), make.rectangle()], lights),
    }
    return {
        name: make.scene(objects, lit, camera, materials=(replace(GLASS, transmission=(0.3,) * 3),), size=12, full=full)
        for full in (False, True)
        for name, (objects, lit) in ((f"{name}, full" if full else name, each) for name, each in found.items())
        if objects or full
    }


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_degenerate_scenes_end(make: Any) -> None:
    """Run with sanitizers by `make sanitize`."""
    variants = [
        Options(),
        Options(gouraud=True, silhouette="black", start="error_bound", acne=-1, hit_error=1e-3),
        Options(ties="next", resolution=1e-2, near_resolution=1e-2, affine=True, refine=True, start="relative"),
    ]
    for scene in degenerate_scenes(make).values():
        for dtype in PRECISIONS:
            for options in variants:
                assert trace_envelope(scene, options, dtype=dtype, threads=2).ids.shape == (12, 12)
            meshes = tuple(each for each in scene.objects if each in scene.meshes)
            plain = tuple(replace(each, mirror=(0.0,) * 3, transmission=(0.0,) * 3) for each in scene.materials)
            drawn = replace(scene, objects=meshes, materials=plain)
            if meshes:
                options = RasterOptions(shadow_map=16, normals="gouraud")
                assert raster_picture(drawn, options, samples=4, dtype=dtype).shape == (12, 12, 3)


def test_the_module_has_its_name() -> None:
    assert Path(_native.__file__).name == f"_native{sysconfig.get_config_var('EXT_SUFFIX')}"
