"""Step 3 of docs/judge.md, what is admitted: how far a reasonable epsilon lights the edges of shadows.

This is admitted beyond what subsamples may miss.

Renderers keep a ray from meeting the surface that it starts on by an epsilon. The largest reasonable one is half a
pixel's footprint: beyond it shadows visibly come off what throws them. It acts in two ways, both of which only light
what should be dark:

- Hits nearer than epsilon are passed over, so shadows begin that far from what throws them. The picture with the
  largest reasonable epsilon is predicted, and anything between it and the exact one is admitted.
- A start that is raised off the surface by epsilon sees what a point of the surface sees that is epsilon / tan(the
  light's elevation over the surface) further from the light: the tip of a shadow retreats by so much, its sides do not.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from notabug.metrics.channels import pixels, put
from notabug.metrics.policy import POLICY
from notabug.references.models.acne import width_of_view
from notabug.references.models.model import Model, edit_materials
from notabug.references.predict import predict, preview
from notabug.references.tracer.envelope import SEEN, Envelope
from notabug.references.viewing import centre_rays, projected
from notabug.scenes_usd.scene import Light, Material, Scene

Floats = npt.NDArray[np.floating]

_WHITE = Material("", (1.0, 1.0, 1.0))
_CITES = "Haines 1989, in Glassner, An Introduction to Ray Tracing"


def leeway(scene: Scene, exact: Envelope) -> Floats:
    """By how much (h, w, 3) the edges of shadows in ``scene``, whose reference is ``exact``, may be lit."""
    length = POLICY.leeway.half * width_of_view(scene) / scene.width
    passing = Model(
        name="epsilon",
        kind="limitation",
        claim=f"rays pass over what they meet within {length:.3g}",
        cites=_CITES,
        options={"start": "absolute", "epsilon": length},
    )
    most: Floats = np.maximum(predict(scene, (passing,)).mean, exact.mean).astype(np.float64)
    place, normal, depth = _surface(scene)
    for light in scene.lights:
        most = _raised(scene, exact, most, _moved(scene, light, place, normal, depth))
    return np.asarray(most - exact.mean)


def _raised(scene: Scene, exact: Envelope, most: Floats, moved: Floats) -> Floats:
    """The largest (h, w, 3) of ``most`` and what ``exact`` shows on the way by ``moved`` (h, w, 2) pixels from here."""
    moved = moved.reshape(-1, 2)
    far = np.hypot(moved[:, 0], moved[:, 1])
    along = moved / np.maximum(far, 1e-30)[:, None]
    for way in np.arange(POLICY.leeway.step, POLICY.leeway.far + POLICY.leeway.step / 2, POLICY.leeway.step):
        at = np.flatnonzero(far > way - POLICY.leeway.step)  # the others have arrived
        y, x = np.divmod(at, scene.width)
        part = np.minimum(way, far[at])[:, None] * along[at]
        shown = _between(exact, at, x + part[:, 0], y + part[:, 1])
        most = put(most, at, np.maximum(pixels(most, at), shown))
    return most


def _between(exact: Envelope, at: npt.NDArray[np.intp], x: Floats, y: Floats) -> Floats:
    """The mean (n, 3) at the places (x, y), each (n,), where all around shows the surface of the pixels ``at`` (n,)."""
    h, w = exact.ids.shape
    seen = exact.ids.ravel() & SEEN
    left, upper = np.floor(x).astype(int), np.floor(y).astype(int)
    value, same = np.zeros((at.size, 3)), np.ones(at.size, np.bool_)
    for row in (upper, upper + 1):
        for column in (left, left + 1):
            beside = np.clip(row, 0, h - 1) * w + np.clip(column, 0, w - 1)
            weight = (1.0 - np.abs(row - y)) * (1.0 - np.abs(column - x))
            value += weight[:, None] * pixels(exact.mean, beside)
            same &= (weight <= 0.0) | (seen[beside] == seen[at])
    return np.where(same[:, None], value, 0.0)


def _moved(scene: Scene, light: Light, place: Floats, normal: Floats, depth: Floats) -> Floats:
    """By how many pixels (h, w, 2), right and down, what the light meets moves with a start that is raised."""
    if light.kind == "dome":
        return np.zeros((*place.shape[:2], 2))
    if light.kind in ("distant", "sun"):
        to = np.broadcast_to(-np.asarray(light.direction, np.float64), place.shape)
    else:
        to = np.asarray(light.position, np.float64) - place
        to = to / np.maximum(np.linalg.norm(to, axis=2), 1e-30)[..., None]
    cosine = (to * normal).sum(axis=2)
    epsilon = POLICY.leeway.half * 2.0 * scene.camera.tan_x / scene.width * scene.camera.spans(depth)
    height = POLICY.leeway.small * epsilon / np.maximum(cosine, 1e-9)
    shown, _ = projected(scene, place + height[..., None] * (cosine[..., None] * normal - to))
    moved = (shown - projected(scene, place)[0]) / POLICY.leeway.small
    good = (cosine > 0) & (depth > 0) & np.isfinite(moved).all(axis=2)
    return np.where(good[..., None], moved, 0.0)


def _surface(scene: Scene) -> tuple[Floats, Floats, Floats]:
    """Place (h, w, 3), unit normal (h, w, 3) and depth (h, w) of what is seen at pixel centres; 0 where nothing is."""
    eye = scene.camera.to_world[3, :3]
    torch = Light("/torch", "point", (np.pi,) * 3, position=tuple(eye))
    even, falling = (_white(scene, (torch,), falloff)[..., 0] for falloff in ("none", "linear"))
    distance = np.where(falling > 0, even / np.maximum(falling, 1e-30), 0.0)
    start, rays = centre_rays(scene)  # a start is the eye, or lies beside it, square to the ray
    forward = np.sqrt(np.maximum(np.square(distance) - np.square(start - eye).sum(axis=2), 0.0))
    depth = forward / np.linalg.norm(rays, axis=2)
    normal = _facing(scene, 1.0) - _facing(scene, -1.0)
    normal = normal / np.maximum(np.linalg.norm(normal, axis=2), 1e-30)[..., None]
    return start + depth[..., None] * rays, normal, depth


def _facing(scene: Scene, sign: float) -> Floats:
    """What (h, w, 3) the normals have of +x, +y and +z, or with a ``sign`` of -1 of -x, -y and -z: else 0.

    One light shines from each of the three, red, green and blue.
    """
    suns = []
    for axis in range(3):
        red, green, blue = (np.pi * float(axis == each) for each in range(3))
        x, y, z = (-sign * float(axis == each) for each in range(3))
        suns.append(Light(f"/sun{axis}", "distant", (red, green, blue), direction=(x, y, z)))
    return _white(scene, tuple(suns), "none")


def _white(scene: Scene, lights: tuple[Light, ...], falloff: str) -> Floats:
    """The lights' intensity over pi times N.L (h, w, 3) of white surfaces under ``lights`` alone, without shadows."""

    def alone(scene: Scene) -> Scene:
        return replace(edit_materials(scene, lambda each: replace(_WHITE, path=each.path)), lights=lights)

    options = {"shadows": "none", "falloff": falloff}
    shown = Model(name="white", kind="limitation", claim="", cites=_CITES, edit=alone, options=options)
    return np.asarray(preview(scene, (shown,)), np.float64)
