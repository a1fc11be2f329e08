"""bench efficiency: error over time for each renderer and scene, with its floor, its slope and its efficiency.

Renderers are timed in turn (A B A B), so that ratios hold on a noisy machine; each repetition has another seed.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field, replace

import numpy as np
import numpy.typing as npt

from notabug.adapters.base import Adapter, Declaration, Quality, RendererError, UnsupportedError
from notabug.bench.efficiency_cost import Cost, render
from notabug.bench.efficiency_error import MEASURES, Floor, errors, floor, relmse
from notabug.references.tracer.envelope import Envelope, trace_envelope
from notabug.references.tracer.options import Options
from notabug.scenes_usd.scene import Scene

Floats = npt.NDArray[np.floating]
Note = Callable[[str], None]
_REFERENCE = Options()
_FACETS = Options(shadows="facets")  # what every tracer here does: the facets of a smooth mesh shadow it
TARGET = 1e-3  # relMSE: the time to get there is tabulated


@dataclass(frozen=True, slots=True, eq=False)
class Setting:
    """One place of a knob: what is drawn, by whom and how well. ``value`` is the knob's number."""

    value: float
    adapter: Adapter
    scene: Scene
    samples: int


@dataclass(frozen=True, slots=True, eq=False)
class Line:
    """One renderer's knob on one scene: a line in the plot. ``theory`` is the expected slope of the rms error."""

    scene: str
    renderer: str
    knob: str
    settings: tuple[Setting, ...]
    theory: float | None
    theory_source: str = ""


@dataclass(frozen=True, slots=True)
class Place:
    """A setting measured: medians over the repetitions, and the smallest and largest as ``spread``."""

    value: float
    wall: float
    wall_net: float
    cpu: float
    cpu_net: float
    memory: float
    errors: dict[str, float]
    spread: dict[str, tuple[float, float]]
    sampling: float  # relMSE against the picture that the renderer's limitations leave: only samples are missing
    variance: float | None  # mean over pixels of the variance between repetitions; None for deterministic renderers
    efficiency: float | None  # 1 / (variance * processor seconds without start)


@dataclass(frozen=True, slots=True)
class Result:
    """A line measured.

    ``slope`` is d log(rms error) / d log(knob), for samples of the error that samples remove. ``bias`` is the relMSE
    that they do not: that of the limitations. ``time_to_target`` is in processor seconds without start, which a busy
    machine disturbs least.
    """

    scene: str
    renderer: str
    knob: str
    places: tuple[Place, ...]
    slope: float | None
    theory: float | None
    theory_source: str
    bias: float
    floor: Floor | None
    time_to_target: float | None
    front: tuple[float, ...] = ()  # the values of the knob that lie on the scene's Pareto front
    message: str = ""

    def as_dict(self) -> dict[str, object]:
        return asdict(self)


@dataclass(slots=True)
class _Trials:
    costs: list[Cost] = field(default_factory=list)
    nets: list[Cost] = field(default_factory=list)
    found: list[dict[str, float]] = field(default_factory=list)
    pictures: list[Floats] = field(default_factory=list)
    sampling: list[float] = field(default_factory=list)


def measure(lines: Sequence[Line], repeats: int, note: Note = lambda _: None) -> list[Result]:
    """All lines of one scene and knob, renderers in turn."""
    truths: dict[str, Envelope] = {}
    trials = {(i, j): _Trials() for i, line in enumerate(lines) for j in range(len(line.settings))}
    failed: dict[int, str] = {}
    for i, line in enumerate(lines):  # what is compiled once and kept on disk is no renderer's cost
        try:
            _start(line.settings[0], 0)
        except (RendererError, UnsupportedError) as error:
            failed[i] = error.what
            note(f"{line.scene}, {line.renderer}: {error.what}")
    for repeat in range(repeats):
        starts: dict[int, Cost] = {}
        for j in range(max(len(line.settings) for line in lines)):
            for i, line in enumerate(lines):
                if j >= len(line.settings) or i in failed:
                    continue
                setting = line.settings[j]
                try:
                    if i not in starts:
                        starts[i] = _start(setting, repeat)
                    cost, picture = render(setting.adapter, setting.scene, _quality(setting.samples, repeat))
                except (RendererError, UnsupportedError) as error:
                    failed[i] = error.what
                    note(f"{line.scene}, {line.renderer}: {error.what}")
                    continue
                made = trials[i, j]
                made.costs.append(cost)
                made.nets.append(cost.without(starts[i]))
                made.pictures.append(picture)
                of = _truth(setting.scene, truths)
                made.found.append(errors(picture, of.point if setting.samples == 1 else of.mean))
                limited = _truth(setting.scene, truths, _FACETS)
                made.sampling.append(relmse(picture, limited.point if setting.samples == 1 else limited.mean))
                note(f"{line.scene}, {line.renderer}, {line.knob} {setting.value:g}: {cost.wall:.2f} s")
    results = [
        _result(line, [trials[i, j] for j in range(len(line.settings))], failed.get(i, ""), truths)
        for i, line in enumerate(lines)
    ]
    return _with_fronts(results)


def _quality(samples: int, repeat: int) -> Quality:
    return Quality(samples=samples, seeds=(repeat,), threads=1, timeout=300.0)


def _start(setting: Setting, repeat: int) -> Cost:
    """The cost of almost nothing: the same scene at 16 pixels, the fewest of Blender, and the fewest samples."""
    height = max(4, round(4 * setting.scene.height / setting.scene.width))
    tiny = replace(
        setting.scene, width=max(4, round(height * setting.scene.width / setting.scene.height)), height=height
    )
    return render(setting.adapter, tiny, _quality(min(4, setting.samples), repeat))[0]


def _truth(scene: Scene, known: dict[str, Envelope], options: Options = _REFERENCE) -> Envelope:
    key = f"{scene.digest()} {options}"
    if key not in known:
        known[key] = trace_envelope(scene.as_intended(), options, grid=8, refine=32)
    return known[key]


def _result(line: Line, trials: Sequence[_Trials], message: str, truths: dict[str, Envelope]) -> Result:
    pairs = zip(line.settings, trials, strict=True)
    places = tuple(_place(setting, each) for setting, each in pairs if each.costs)
    samples = line.knob == "samples"
    found = None if message or not places or not samples else _floor(line.settings[0], truths)
    wanted = [place.sampling if samples else place.errors["relmse"] for place in places]
    reference, limited = (_truth(line.settings[-1].scene, truths, each).mean for each in (_REFERENCE, _FACETS))
    return Result(
        scene=line.scene,
        renderer=line.renderer,
        knob=line.knob,
        places=places,
        slope=slope([each.value for each in places], [math.sqrt(each) for each in wanted]),
        theory=line.theory,
        theory_source=line.theory_source,
        bias=relmse(limited, reference) if samples else 0.0,
        floor=found,
        time_to_target=time_to(places, TARGET),
        message=message,
    )


def _floor(setting: Setting, truths: dict[str, Envelope]) -> Floor | None:
    quality = _quality(1, 0)
    declared: Declaration = setting.adapter.declaration(quality)
    try:
        _, picture = render(setting.adapter, setting.scene, quality)
    except (RendererError, UnsupportedError):
        return None
    shiny = (material.exponent for material in setting.scene.materials if any(material.specular))
    return floor(picture, _truth(setting.scene, truths), declared, max(shiny, default=1.0))


def _place(setting: Setting, made: _Trials) -> Place:
    noisy = setting.adapter.declaration(_quality(setting.samples, 0)).noisy and len(made.pictures) > 1
    variance = float(np.var(made.pictures, axis=0, ddof=1).mean()) if noisy else None
    cpu = float(np.median([net.cpu for net in made.nets]))
    return Place(
        value=setting.value,
        wall=float(np.median([cost.wall for cost in made.costs])),
        wall_net=float(np.median([net.wall for net in made.nets])),
        cpu=float(np.median([cost.cpu for cost in made.costs])),
        cpu_net=cpu,
        memory=max(cost.memory for cost in made.costs),
        errors={name: float(np.median([each[name] for each in made.found])) for name in MEASURES},
        spread={
            "wall": _span([cost.wall for cost in made.costs]),
            "wall_net": _span([net.wall for net in made.nets]),
            **{name: _span([each[name] for each in made.found]) for name in MEASURES},
        },
        sampling=float(np.median(made.sampling)),
        variance=variance,
        efficiency=1.0 / (variance * cpu) if variance and cpu > 0.0 else None,
    )


def _span(values: Sequence[float]) -> tuple[float, float]:
    return min(values), max(values)


def slope(x: Sequence[float], y: Sequence[float]) -> float | None:
    """The least-squares slope of log y over log x; None for fewer than 3 usable points.

    >>> slope([1, 4, 16], [1.0, 0.5, 0.25])
    -0.5
    """
    usable = [(math.log(a), math.log(b)) for a, b in zip(x, y, strict=True) if a > 0.0 and b > 0.0]
    if len(usable) < 3:
        return None
    u, v = np.array(usable).T
    u, v = u - u.mean(), v - v.mean()
    gradient = float((u * v).sum()) / float((u * u).sum())
    return round(gradient, 6)


def time_to(places: Sequence[Place], target: float) -> float | None:
    """Processor seconds without start until relMSE is ``target``, by a power law between places; None if never."""
    last: Place | None = None
    for each in sorted(places, key=lambda place: place.cpu_net):
        error = each.errors["relmse"]
        if error <= target:
            if last is None or last.errors["relmse"] <= error or last.cpu_net <= 0.0 or error <= 0.0:
                return each.cpu_net
            share = math.log(last.errors["relmse"] / target) / math.log(last.errors["relmse"] / error)
            return last.cpu_net * math.exp(share * math.log(each.cpu_net / last.cpu_net))
        last = each
    return None


def _with_fronts(results: Sequence[Result]) -> list[Result]:
    """Mark the places that no other place of the same scene beats in both time and error."""
    every = [(place.cpu_net, place.errors["relmse"]) for result in results for place in result.places]

    def on_front(place: Place) -> bool:
        time, error = place.cpu_net, place.errors["relmse"]
        return not any(t <= time and e <= error and (t, e) != (time, error) for t, e in every)

    return [replace(result, front=tuple(p.value for p in result.places if on_front(p))) for result in results]
