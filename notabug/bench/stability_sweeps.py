"""The sweeps: which number goes which way, on which stage, and the well-conditioned scene of the same picture."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from notabug.bench import stability_scenes as stages
from notabug.bench import stability_theory as theory
from notabug.scenes_usd.scene import Scene


@dataclass(frozen=True, slots=True)
class Sweep:
    """One number that goes from ``first`` towards ``last`` by decades.

    Attributes
    ----------
    beyond : where a renderer that computes in double precision all through is followed to.
    scene : the stage under the number.
    truth : the number of a well-conditioned stage that gives the same picture.
    predicted : the onset by error analysis; 0 or infinity: never.
    """

    name: str
    title: str
    unit: str
    first: float
    last: float
    beyond: float
    scene: Callable[[float], Scene]
    truth: Callable[[float], float]
    predicted: theory.Prediction

    @property
    def rising(self) -> bool:
        return self.last > self.first

    def decades(self, *, double: bool = False) -> tuple[float, ...]:
        """``first`` and every power of ten after it up to ``last``, or ``beyond``.

        >>> SWEEPS["low_light"].decades()
        (45.0, 10.0, 1.0, 0.1, 0.01, 0.001, 0.0001)
        """
        end = self.beyond if double else self.last
        between = (float(f"1e{k}") for k in (range(-30, 31) if self.rising else range(30, -31, -1)))
        low, high = min(self.first, end), max(self.first, end)
        return (self.first, *(each for each in between if low <= each <= high and each != self.first))


def _same(value: float) -> float:
    return value


_ALL = (
    Sweep(
        "far_camera", "camera distance", "units", stages.DISTANCE, 1e8, 1e16,
        stages.far_camera, lambda value: min(value, 1e6), theory.far_camera,
    ),
    Sweep("offset", "offset of the world", "units", 1.0, 1e8, 1e16, stages.offset, lambda _: 0.0, theory.offset),
    Sweep("shrunk", "scale, smaller", "of its size", 1.0, 1e-6, 1e-6, stages.scaled, lambda _: 1.0, theory.shrunk),
    Sweep("grown", "scale, larger", "times its size", 1.0, 1e6, 1e6, stages.scaled, lambda _: 1.0, theory.grown),
    Sweep(
        "low_light", "elevation of the light", "degrees", 45.0, 1e-4, 1e-14,
        stages.low_light, lambda _: 45.0, theory.low_light,
    ),
    Sweep(
        "gap", "gap of near-coincident surfaces", "units", 1.0, 1e-9, 1e-17,
        stages.near_gap, lambda value: max(value, 1e-7), theory.gap,
    ),
    Sweep(
        "near_plane", "near plane", "units", 1.0, 1e-6, 1e-6,
        stages.near_plane, lambda _: 1.0, theory.near_plane,
    ),
    Sweep(
        "sliver", "facet aspect ratio", "to 1", 100.0, 1e8, 1e9,
        stages.slivers, lambda _: 100.0, theory.sliver,
    ),
    Sweep("exponent", "exponent of the highlight", "", 1.0, 1e5, 1e5, stages.highlight, _same, theory.exponent),
    Sweep(
        "uv_magnitude", "magnitude of uv", "repeats", 1.0, 1e6, 1e15,
        stages.texture_far_out, lambda _: 1.0, theory.uv_magnitude,
    ),
)  # fmt: skip

SWEEPS = {each.name: each for each in _ALL}
