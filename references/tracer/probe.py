"""probe: one camera ray, told term by term: what is seen, with which normal and uv, and what each light adds.

The code that draws tells it (references/native/probe.h).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from notabug.references import _native
from notabug.references.tracer.flatten import Flat, flatten
from notabug.references.tracer.options import Options
from notabug.scenes_usd.scene import Scene


@dataclass(frozen=True, slots=True)
class LightTerms:
    """One light's part at the point seen; radiances are (r, g, b).

    Where the corners of a triangle are lit instead, all but the blocker are their means, weighted as the colours are.
    """

    path: str
    distance: float
    geometric_cosine: float  # N.L with the facet's own normal
    cosine: float  # N'.L with the normal that shades
    irradiance: tuple[float, float, float]  # at normal incidence
    share: float  # of the light that gets through
    spared: bool  # facets of its own mesh stood in the way and were forgiven
    blocker: str  # prim path of the first thing in the way, or ""
    blocked_at: float  # its distance
    diffuse: tuple[float, float, float]
    specular: tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Probe:
    """What one model computes along one ray, before secondary rays are added. ``path`` is "" where the ray leaves."""

    path: str = ""
    face: int = -1
    position: tuple[float, ...] = ()
    depth: float = math.inf  # along the camera's axis
    normal: tuple[float, ...] = ()
    facet_normal: tuple[float, ...] = ()
    view_cosine: float = 0.0  # N'.V
    uv: tuple[float, float] = (0.0, 0.0)
    albedo: tuple[float, ...] = (0.0, 0.0, 0.0)
    lights: tuple[LightTerms, ...] = ()


def probe(scene: Scene, options: Options, x: float, y: float, flat: Flat | None = None) -> Probe:
    """Follow the camera ray through raster position (x, y) of ``scene`` (pixel centres at +0.5) under ``options``.

    ``flat`` is ``flatten(scene)``, for those who probe many pixels.
    """
    flat = flatten(scene) if flat is None else flat
    told = _native.probe(flat, options.for_scene(scene), scene.width, scene.height, x, y)
    if told is None:
        return Probe()
    owner, lights = told.pop("object"), told.pop("lights")
    paths = [shape.path for shape in scene.objects]
    terms = []
    for light, each in zip(scene.lights, lights, strict=False):  # none where the surface is painted black
        blocker = each.pop("blocker")
        terms.append(LightTerms(path=light.path, blocker=paths[blocker] if blocker >= 0 else "", **each))
    return Probe(path=paths[owner], lights=tuple(terms), **told)
