"""Faults of lights, which any scene with a light can show."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np

from notabug.references.models.geometry import UP_AXES
from notabug.references.models.model import Edit, Model, in_strengths
from notabug.scenes_usd.emitters import turned
from notabug.scenes_usd.scene import Floats, Light, Scene

GAIN = 1.05
FAR = ("distant", "sun")  # lights that have a direction and no place
_USD = "UsdLux: intensity, exposure and normalize"


def models(scene: Scene) -> Iterator[Model]:
    """Models of a scene with lights."""
    if not scene.lights:
        return
    yield in_strengths(
        lambda strength: replace(
            _fault(
                "light_gain",
                f"every light is {strength:.4g} times as bright",
                _every(lambda each: brighter(each, strength)),
            ),
            number="gain",
        ),
        GAIN,
        neutral=1.0,
    )
    for channel, name in enumerate(("red", "green", "blue")):
        yield in_strengths(
            lambda strength, channel=channel, name=name: _fault(  # type: ignore[misc]
                "light_colour", f"{name} light is {strength:.3g} times as bright", _every(_tinted(channel, strength))
            ),
            GAIN,
            neutral=1.0,
        )
    jointly = _moved_jointly(scene)
    for index, light in enumerate(scene.lights):
        for axis in range(3 if light.kind != "dome" else 0):
            model = in_strengths(
                lambda strength, index=index, axis=axis, light=light: _fault(  # type: ignore[misc]
                    "light_moved",
                    f"{light.path} is off along {'xyz'[axis]} by {strength:.3g} of its distance",
                    _one(index, moved(scene, axis, strength)),
                ),
                0.02,
            )
            alone = all(each.kind != "dome" for each in scene.lights)
            yield replace(model, jointly=jointly, axes=3 * len(scene.lights)) if alone else model
        if len(scene.lights) > 1:
            yield _fault("light_missing", f"{light.path} is missing", _dropped(index))
    kinds = sorted({each.kind for each in scene.lights} - {"dome"})  # whose directions are all alike
    turns: list[tuple[str, str]] = [(kind, "directions" if kind in FAR else "positions") for kind in kinds]
    for kind, what in turns:
        yield _fault("light_negated", f"the {what} of {kind} lights have the wrong sign", _every(_negated(kind)))
    if len(turns) > 1:
        turns.append(("", "positions and directions"))
    for kind, what in turns:
        for turn, how in UP_AXES:
            claim = f"the {what} of {kind or 'all'} lights have y and z exchanged{how}"
            yield _fault("light_up_axis", claim, _every(_turned(kind, turn)))
    if any(each.kind == "point" for each in scene.lights):
        for falloff, what in (("linear", "the distance"), ("none", "nothing")):
            yield Model(
                name=f"falloff_{falloff}",
                kind="fault",
                claim=f"the light of a point is divided by {what}, not by the squared distance",
                cites="UsdLux: inverse square",
                options={"falloff": falloff},
            )
        yield Model(
            name="shadow_ray_unbounded",
            kind="fault",
            claim="shadow rays go on behind the light",
            cites="Whitted 1980, section 2",
            options={"shadow_rays": "unbounded"},
        )
    yield Model(
        name="shadow_ray_culled",
        kind="fault",
        claim="shadow rays pass through faces that they meet from behind",
        cites="Whitted 1980, section 2",
        options={"shadow_rays": "culled"},
    )


def _fault(name: str, claim: str, edit: Edit) -> Model:
    return Model(name=name, kind="fault", claim=claim, cites=_USD, edit=edit)


def _every(change: Callable[[Light], Light]) -> Edit:
    return lambda scene: replace(scene, lights=tuple(change(each) for each in scene.lights))


def _one(index: int, change: Callable[[Light], Light]) -> Edit:
    return lambda scene: replace(
        scene, lights=tuple(change(each) if i == index else each for i, each in enumerate(scene.lights))
    )


def _dropped(index: int) -> Edit:
    return lambda scene: replace(scene, lights=scene.lights[:index] + scene.lights[index + 1 :])


def brighter(light: Light, factor: float) -> Light:
    """``light`` with ``factor`` times its intensity."""
    r, g, b = light.intensity
    return replace(light, intensity=(r * factor, g * factor, b * factor))


def _tinted(channel: int, factor: float) -> Callable[[Light], Light]:
    def change(light: Light) -> Light:
        r, g, b = (each * (factor if k == channel else 1.0) for k, each in enumerate(light.intensity))
        return replace(light, intensity=(r, g, b))

    return change


def _moved_jointly(scene: Scene) -> Callable[[Floats], Model]:
    """All lights moved at once, each by three of the shares (3 * lights,)."""

    def at(shares: Floats) -> Model:
        steps = shares.reshape(-1, 3)
        told = [
            f"{light.path} is off by ({step[0]:.3g}, {step[1]:.3g}, {step[2]:.3g}) of its distance"
            for light, step in zip(scene.lights, steps, strict=True)
            if step.any()
        ]

        def edit(under: Scene) -> Scene:
            changed = (moved_by(scene, step)(light) for light, step in zip(under.lights, steps, strict=True))
            return replace(under, lights=tuple(changed))

        return _fault("light_moved", "; ".join(told), edit)

    return at


def moved(scene: Scene, axis: int, share: float) -> Callable[[Light], Light]:
    """As ``moved_by``, along one axis."""
    return moved_by(scene, np.eye(3)[axis] * share)


def moved_by(scene: Scene, step: Floats) -> Callable[[Light], Light]:
    """A light moved by ``step`` (3,) times its distance from the middle of what it lights (distant: turned)."""
    points = [each.points.mean(axis=0) for each in scene.meshes] + [each.to_world[3, :3] for each in scene.spheres]
    middle = np.mean(points, axis=0) if points else np.zeros(3)

    def change(light: Light) -> Light:
        if light.kind == "dome":
            return light
        if light.kind in FAR:
            direction = np.array(light.direction) - step
            return replace(light, direction=_tuple(direction / np.linalg.norm(direction)))
        position = np.array(light.position)
        return replace(light, position=_tuple(position + step * np.linalg.norm(position - middle)))

    return change


def _negated(kind: str) -> Callable[[Light], Light]:
    def change(light: Light) -> Light:
        if light.kind != kind:
            return light
        return replace(light, position=_tuple(-np.array(light.position)), direction=_tuple(-np.array(light.direction)))

    return change


def _turned(kind: str, turn: Floats) -> Callable[[Light], Light]:
    """Lights of that ``kind``, or all, placed by row vectors times ``turn``."""

    def change(light: Light) -> Light:
        if kind not in ("", light.kind):
            return light
        position, direction = np.array(light.position) @ turn, np.array(light.direction) @ turn
        if light.emitter is not None:
            light = turned(light, turn)
        return replace(light, position=_tuple(position), direction=_tuple(direction))

    return change


def _tuple(values: object) -> tuple[float, float, float]:
    x, y, z = np.asarray(values, float)
    return float(x), float(y), float(z)
