"""What LLVM makes of the kernels: float32 stays float32, and nothing is contracted or reassociated."""

from __future__ import annotations

import re
from typing import Any

import numba
import numpy as np
import pytest

from notabug.references.tracer import bvh, render
from notabug.references.tracer.envelope import Options
from notabug.references.tracer.flatten import flatten
from notabug.scenes_usd.scene import Material


@pytest.fixture(scope="module")
def assembly(make: Any) -> str:
    """LLVM's final code of ``radiance`` in float32 with every feature, all that it calls included.

    Compiled afresh with the kernels' own switches: what comes from the disk cache has no text.
    """
    light = make.point((0, 0, 4))
    shiny = Material("/Shiny", (0.2,) * 3, specular=(0.1,) * 3)
    scene = make.scene([make.rectangle()], [light], make.camera((0, 0, 4), (0, 0, 0)), materials=(shiny,), full=True)
    flat = flatten(scene, np.float32)
    assert None not in (flat.quads, flat.textures, flat.spheres, flat.lobes, flat.secondary)
    switches = {
        k: v for k, v in render.radiance.targetoptions.items() if k in ("nogil", "error_model", "fastmath", "_nrt")
    }
    fresh = numba.njit(**switches)(render.radiance.py_func)
    o, d = np.zeros(3, np.float32), np.array((0, 0, -1), np.float32)
    stack, rays = np.empty(bvh.STACK, np.int32), np.empty((render.PENDING, 12), np.float32)
    features = (flat.quads, flat.textures, flat.spheres, flat.lobes, flat.secondary)
    switches_and_numbers = (Options().encoded(), Options().numbers(), np.float32(0.01))
    fresh(flat, *features, *switches_and_numbers, *o, *d, np.float32(0.1), np.float32(100), stack, rays)
    (text,) = fresh.inspect_llvm().values()
    return str(text)


def test_float32_is_float32(assembly: str) -> None:
    """No arithmetic in double precision, but for the rounding of a normal and a light's share to the id they enter."""
    double = re.findall(r"= f(?:mul|add|sub|div|rem)[a-z ]* double .*", assembly)
    assert all(each.endswith(("5.120000e+02", "1.000000e+03")) for each in double), double
    assert not re.findall(r"double @llvm\.(?!rint)\w+|@(?:sqrt|pow|floor)\(", assembly)
    assert len(re.findall(r"= fmul float", assembly)) > 100


def test_nothing_is_contracted_or_reassociated(assembly: str) -> None:
    flags = r"\b(?:fast|nnan|ninf|nsz|arcp|contract|afn|reassoc)\b"
    assert not re.findall(rf"= f(?:mul|add|sub|div|rem|neg|cmp) {flags}.*", assembly)
    assert "llvm.fma" not in assembly
    assert "llvm.fmuladd" not in assembly


def test_no_references_are_counted(assembly: str) -> None:
    """Counting them took 60 % of the time of a picture of spheres."""
    assert "NRT_incref" not in assembly
    assert "NRT_decref" not in assembly
