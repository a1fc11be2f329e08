"""Who takes part in the stability sweeps: each draws a scene at its pixel centres, on one thread."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np
import numpy.typing as npt

from notabug.adapters.base import Adapter, Declaration, Quality, RendererMissingError, UnsupportedError
from notabug.adapters.inhouse import InHouse
from notabug.adapters.registry import adapter
from notabug.adapters.zbuffer import ZBuffer
from notabug.bench.stability_theory import UNIT, Arithmetic
from notabug.scenes_usd.picture import read_picture
from notabug.scenes_usd.scene import Scene

Floats = npt.NDArray[np.floating]
Precision = Literal["float32", "float64"]
EPSILON = 1e-3  # of the tracers with a fixed one, in the scene's units: as POV-Ray's
QUALITY = Quality(samples=1, seeds=(0,), threads=1, timeout=120.0)


@dataclass(frozen=True, slots=True)
class Contestant:
    """A renderer, and what error analysis must know of it.

    ``draw`` gives (h, w, 3) of the pixel centres and may raise what adapters raise. ``double`` renderers compute and
    store in float64 all through, so their sweeps go further.
    """

    name: str
    version: str
    arithmetic: Arithmetic
    declaration: Declaration
    draw: Callable[[Scene], Floats]
    double: bool = False

    @property
    def casts_shadows(self) -> bool:
        return not self.arithmetic.depth_bits


def contestants() -> list[Contestant]:
    """The in-house renderers in both precisions, and the real ones that are installed.

    Panda3D is left out: between corners it interpolates colours, which is wrong at every number. So is LuxCore: one
    sample of a pixel is not at its centre.
    """
    from notabug import __version__

    found = [_tracer(each, __version__, rule) for each in ("float32", "float64") for rule in ("exact", "absolute")]
    found += [_rasteriser(each, __version__) for each in ("float32", "float64")]
    single, double = UNIT["float32"], UNIT["float64"]
    real = (
        # Shadow rays pass blockers nearer than 0.001 in the scene's own units; meshes are stored in float32.
        ("povray", Arithmetic(double, single, start=1e-3, barycentric=False)),
        # Rays start 1500 unit roundoffs times 1 + max |p| off the surface (mitsuba3,
        # include/mitsuba/render/interaction.h).
        ("mitsuba", Arithmetic(single, single, 1500 * single, 1500 * single, lifted=True, exact_highlight=True)),
        ("opengl", Arithmetic(single, single, depth_bits=24)),
        # Where shadow rays of these two start was not looked up; nothing is predicted of it.
        ("cycles", Arithmetic(single, single)),
        ("tachyon", Arithmetic(double, double)),
        *((name, Arithmetic(single, single, depth_bits=24)) for name in ("babylon", "filament", "threejs", "vtk")),
        ("pygfx", Arithmetic(single, single, depth_bits=24)),
    )
    for name, arithmetic in real:
        each = adapter(name)
        try:
            version = each.find().version
        except RendererMissingError:
            continue
        found.append(Contestant(name, version, arithmetic, each.declaration(QUALITY), _drawn_by(each)))
    return found


def _drawn_by(each: Adapter) -> Callable[[Scene], Floats]:
    def draw(scene: Scene) -> Floats:
        with tempfile.TemporaryDirectory(prefix="notabug-") as folder:
            _check_highlights(each, scene)
            (made,) = each.render(scene, Path(folder), QUALITY)
            return read_picture(made.image).pixels

    return draw


def _check_highlights(each: Adapter, scene: Scene) -> None:
    """Raise UnsupportedError for a highlight in a renderer that has another lobe: it would be wrong at every number."""
    declared = each.declaration(QUALITY)
    own = (declared.lobe, declared.normalised, declared.highlight) != ("authored", "no", "authored")
    if own and any(any(material.specular) for material in scene.materials):
        raise UnsupportedError("a highlight of a lobe that the renderer does not have", where=f"adapter {each.name!r}")


def _tracer(precision: Precision, version: str, rule: Literal["exact", "absolute"]) -> Contestant:
    """Our tracer: by its own rule, which leaves out the facet that a shadow ray starts on, or by a fixed epsilon."""
    from notabug.references.tracer.envelope import trace_picture
    from notabug.references.tracer.options import Options

    options = Options(shadows="facets", ties="nearest", start=rule, epsilon=EPSILON if rule == "absolute" else 0.0)

    def draw(scene: Scene) -> Floats:
        return trace_picture(scene, options, dtype=precision, threads=1)

    unit = UNIT[precision]
    if rule == "absolute":
        name, analysed = f"inhouse {precision}, epsilon {EPSILON:g}", Arithmetic(unit, unit, start=EPSILON)
    else:  # blockers count from 32 machine epsilons of the scene's size and the point's coordinates on
        name, analysed = f"inhouse {precision}", Arithmetic(unit, unit, start_relative=32 * 2 * unit * 3)
    declared = InHouse(precision=precision).declaration(QUALITY)
    return Contestant(name, version, analysed, declared, draw, double=precision == "float64")


def _rasteriser(precision: Precision, version: str) -> Contestant:
    from notabug.references.raster.picture import RasterOptions, raster_picture

    def draw(scene: Scene) -> Floats:
        return raster_picture(scene, RasterOptions(depth="fixed24"), dtype=precision, threads=1)

    unit = UNIT[precision]
    declared = replace(ZBuffer(precision=precision).declaration(QUALITY), precision=precision)
    return Contestant(f"zbuffer {precision}", version, Arithmetic(unit, unit, depth_bits=24), declared, draw)
