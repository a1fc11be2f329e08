"""probe: one camera ray, told term by term: what is seen, with which normal and uv, and what each light adds."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from notabug.references.tracer.bvh import STACK
from notabug.references.tracer.envelope import Options
from notabug.references.tracer.flatten import Flat, flatten
from notabug.references.tracer.render import TRANSPARENT
from notabug.references.tracer.shade import albedo, corner_weights, highlight, screen_weights
from notabug.references.tracer.traverse import closest, closest_sphere, transmittance
from notabug.scenes_usd.scene import Scene

Vector = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class LightTerms:
    """One light's part at the point seen; radiances are (r, g, b)."""

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
    stack = np.empty(STACK, np.int32)
    c = flat.camera
    d = (2 * x / scene.width - 1) * c[3:6] + (1 - 2 * y / scene.height) * c[6:9] + c[9:12]
    scale = float(np.linalg.norm(d))
    d = d / scale
    arrays = (flat.bounds, flat.child, flat.size, flat.points, flat.face)
    i, t, b0, b1, b2 = closest(*arrays, *c[:3], *d, c[12] * scale, c[13] * scale, -1, stack)
    ball = -1
    if flat.spheres is not None:
        ball, ts = closest_sphere(flat.spheres, *c[:3], *d, c[12] * scale, t, -1)
        if ball >= 0:
            i, t = -1, ts
    if i < 0 and ball < 0:
        return Probe()
    at = c[:3] + t * d
    owner, facet, normal, uv, face = _surface(flat, options, i, ball, at, b0, b1, b2)
    side = 1.0 if facet @ -d >= 0 else -1.0
    facet, normal = facet * side, normal * side
    if normal @ -d < 0 and options.silhouette.startswith("flip"):
        normal = -normal
    material = flat.material[owner]
    colour = tuple(float(v) for v in albedo(flat, flat.textures, material, *uv, int(options.texels == "nearest")))
    painted = options.silhouette != "black" or normal @ -d >= 0
    terms = tuple(
        _light(flat, scene, options, k, at, d, facet, normal, i, ball, side, int(material), colour, stack)
        for k in range(len(flat.light) if painted else 0)
    )
    return Probe(
        path=scene.objects[owner].path,
        face=face,
        position=_plain(at),
        depth=float(t * (d @ c[9:12])),
        normal=_plain(normal),
        facet_normal=_plain(facet),
        view_cosine=float(normal @ -d),
        uv=(float(uv[0]), float(uv[1])),
        albedo=colour,
        lights=terms,
    )


def _plain(vector: Any) -> tuple[float, ...]:
    return tuple(float(v) for v in vector)


def _surface(
    flat: Flat, options: Options, i: int, ball: int, at: Vector, b0: float, b1: float, b2: float
) -> tuple[int, Vector, Vector, tuple[float, float], int]:
    """The object, facet normal, shading normal (both outward), uv and face of a hit."""
    if i < 0:
        assert flat.spheres is not None
        m = flat.spheres.to_local[ball].reshape(3, 4)
        outward = m[:, :3].T @ (m[:, :3] @ at + m[:, 3])
        outward = outward / np.linalg.norm(outward)
        return int(flat.spheres.object[ball]), outward, outward, (0.0, 0.0), -1
    p = flat.points[i].reshape(3, 3)
    facet = np.cross(p[1] - p[0], p[2] - p[0])
    facet = facet / np.linalg.norm(facet)
    found = corner_weights(flat, flat.quads, i, b0, b1, b2, *at)
    corners, weights = list(found[:4]), np.array(found[4:])
    normal = facet
    if flat.sagitta[i] >= 0:
        normal = weights @ flat.normal[corners]
        if options.normals == "unit":
            normal = normal / np.linalg.norm(normal)
    if options.affine:
        weights = np.array([*screen_weights(flat, i, b0, b1, b2), 0.0])
    u, v = weights @ flat.uv[corners]
    return int(flat.object[i]), facet, normal, (float(u), float(v)), int(flat.face[i])


def _light(
    flat: Flat, scene: Scene, options: Options, k: int, at: Vector, d: Vector, facet: Vector, normal: Vector,
    triangle: int, ball: int, side: float, material: int, colour: tuple[float, ...], stack: npt.NDArray[np.int32],
) -> LightTerms:  # fmt: skip
    light = flat.light[k]
    if light[0] == 0:
        to = light[1:4] - at
        distance = float(np.linalg.norm(to))
        to, falloff = to / distance, {"square": distance**-2, "linear": 1.0 / distance, "none": 1.0}[options.falloff]
    else:
        to, distance, falloff = -light[1:4], math.inf, 1.0
    cosine = float(normal @ to)
    start = 32 * np.finfo(float).eps * float(flat.radius + np.abs(at).sum())
    end = math.inf if options.shadow_rays == "unbounded" else distance
    share, spared, blocker, blocked_at = 1.0, False, "", math.inf
    leaves = ball if facet @ to > 0 else -1
    if options.shadows != "none" and cosine > 0:
        share, spared = transmittance(
            flat, flat.spheres, flat.secondary, *at, *to, start, end, triangle, leaves, True,
            int(options.shadows == "forgiving"), side, cosine, options.encoded()[TRANSPARENT],
            options.shadow_rays == "culled", options.shadow_gap, options.gap_loses == "objects", stack,
        )  # fmt: skip
        arrays = (flat.bounds, flat.child, flat.size, flat.points, flat.face)
        face = flat.face[triangle] if triangle >= 0 else -1
        i, blocked_at, *_ = closest(*arrays, *at, *to, start, end, face, stack)
        blocker = scene.objects[flat.object[i]].path if i >= 0 else ""
        if flat.spheres is not None:
            j, ts = closest_sphere(flat.spheres, *at, *to, start, blocked_at, leaves)
            if j >= 0:
                blocker, blocked_at = scene.objects[flat.spheres.object[j]].path, ts
    e = light[4:7] * falloff
    lit = share * max(cosine, 0.0) / math.pi
    raw = 0.0 if not options.raw_vectors else distance if light[0] == 0 else 1.0
    shine = float(highlight(flat.lobes, material, *normal, *to, *-d, raw)) if cosine > 0 or options.uncut else 0.0
    tint = flat.lobes.specular[material, :3] if flat.lobes is not None else np.zeros(3)
    return LightTerms(
        path=scene.lights[k].path,
        distance=distance,
        geometric_cosine=float(facet @ to),
        cosine=cosine,
        irradiance=_rgb(e),
        share=float(share) if cosine > 0 else 0.0,
        spared=bool(spared),
        blocker=blocker,
        blocked_at=float(blocked_at),
        diffuse=_rgb(e * lit * np.array(colour)),
        specular=_rgb(e * tint * (share * shine / math.pi)),
    )


def _rgb(values: Any) -> tuple[float, float, float]:
    r, g, b = (float(v) for v in values)
    return r, g, b
