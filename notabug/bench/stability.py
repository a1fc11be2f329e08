"""bench stability: sweeps over decades, and for each renderer where it breaks and how, beside what theory says."""

from __future__ import annotations

import hashlib
import json
import math
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path

import numpy as np

from notabug.adapters.base import RendererError, UnsupportedError
from notabug.bench.stability_contestants import Contestant
from notabug.bench.stability_kinds import Truth, kinds, truth, wrong
from notabug.bench.stability_scenes import headlit
from notabug.bench.stability_sweeps import Sweep
from notabug.bench.stability_theory import SHARE
from notabug.runs.folders import write_json
from notabug.runs.provenance import fingerprint
from notabug.scenes_usd.scene import Scene

FINE = 2.0  # the onset is bisected to this factor
FOLLOWED = 2  # decades drawn beyond the onset, for the curve

Note = Callable[[str], None]


@dataclass(frozen=True, slots=True)
class Point:
    """One picture of a sweep. ``share`` of the pixels is wrong, None where the renderer cannot draw the scene;
    ``kinds`` counts them by kind where they are an onset."""

    value: float
    share: float | None
    kinds: dict[str, int] = field(default_factory=dict)
    seconds: float = 0.0
    message: str = ""

    @property
    def kind(self) -> str:
        """The most frequent kind of failure, or ""."""
        return max(self.kinds, key=lambda each: self.kinds[each], default="")


@dataclass(frozen=True, slots=True)
class Course:
    """A renderer's way along one sweep.

    ``onset`` is the first number at which more than SHARE of the pixels are wrong, to a factor of FINE; None: not
    within the sweep. ``predicted`` None: error analysis gives none within the sweep.
    """

    sweep: str
    renderer: str
    version: str
    points: tuple[Point, ...]
    onset: float | None
    kind: str
    predicted: float | None

    @property
    def decades_off(self) -> float | None:
        """Measured onset over the predicted one, in decades; None where either is missing."""
        if self.onset is None or self.predicted is None:
            return None
        return math.log10(self.onset / self.predicted)

    def as_dict(self) -> dict[str, object]:
        return asdict(self) | {"decades_off": self.decades_off}


class Bench:
    """Draws points, each once: finished ones stay in ``folder`` and are read again while the code is the same."""

    def __init__(self, folder: Path, *, resume: bool = True, side: int = 0) -> None:
        self.folder, self.resume, self.side = folder / "points", resume, side
        self.folder.mkdir(parents=True, exist_ok=True)
        self._code = fingerprint("scenes_usd", "references", "adapters", "bench")
        self._truths: dict[str, Truth] = {}
        self._lock = threading.Lock()

    def point(self, sweep: Sweep, contestant: Contestant, value: float) -> Point:
        scene = self._stage(sweep, contestant, value)
        key = "|".join([contestant.name, contestant.version, scene.digest(), self._code])
        path = self.folder / f"{hashlib.blake2b(key.encode(), digest_size=12).hexdigest()}.json"
        if self.resume and path.is_file():
            try:
                return Point(**json.loads(path.read_text("utf-8")))
            except (ValueError, TypeError):  # a damaged file: draw it again
                path.unlink()
        made = self._draw(sweep, contestant, value, scene)
        write_json(path, asdict(made))
        return made

    def _draw(self, sweep: Sweep, contestant: Contestant, value: float, scene: Scene) -> Point:
        start = time.perf_counter()
        of = self._truth(sweep, contestant, sweep.truth(value))
        try:
            with np.errstate(all="ignore"):
                picture = contestant.draw(scene)
                share = float(wrong(picture, of.lit, contestant.declaration).mean())
                found = {}
                if share > SHARE:
                    seen = contestant.draw(headlit(scene))
                    found = kinds(picture, seen, of, contestant.declaration)
        except UnsupportedError as error:
            return Point(value, None, message=str(error))
        except RendererError as error:
            return Point(value, 1.0, {"refused": scene.width * scene.height}, message=error.what)
        return Point(value, share, found, time.perf_counter() - start)

    def _stage(self, sweep: Sweep, contestant: Contestant, value: float) -> Scene:
        """The sweep's scene; a renderer without shadows gets it lit from the eye where shadows could fall."""
        scene = sweep.scene(value)
        if self.side:
            scene = replace(scene, width=self.side, height=self.side)
        return scene if contestant.casts_shadows or len(scene.objects) < 2 else headlit(scene)

    def _truth(self, sweep: Sweep, contestant: Contestant, value: float) -> Truth:
        scene = self._stage(sweep, contestant, value)
        with self._lock:
            key = scene.digest()
            if key not in self._truths:
                self._truths[key] = truth(scene)
            return self._truths[key]


def course(bench: Bench, sweep: Sweep, contestant: Contestant, *, quick: bool = False) -> Course:
    """Go along ``sweep`` by decades, find the onset and bisect it; ``quick`` takes every second decade only."""
    points: list[Point] = []
    broken = -1
    for number, value in enumerate(_values(sweep, contestant, quick)):
        made = bench.point(sweep, contestant, value)
        points.append(made)
        if made.share is None:
            break
        if broken < 0 and made.share > SHARE:
            broken = number
        if broken >= 0 and (quick or number >= broken + FOLLOWED):
            break
    onset, kind = None, ""
    if broken >= 0:
        last = points[broken]
        if broken and not quick:
            good = points[broken - 1].value
            while max(good / last.value, last.value / good) > FINE:
                made = bench.point(sweep, contestant, _between(good, last.value))
                points.append(made)
                if made.share is not None and made.share > SHARE:
                    last = made
                else:
                    good = made.value
        onset, kind = last.value, last.kind
    ordered = tuple(sorted(points, key=lambda point: point.value, reverse=not sweep.rising))
    return Course(sweep.name, contestant.name, contestant.version, ordered, onset, kind, _within(sweep, contestant))


def _values(sweep: Sweep, contestant: Contestant, quick: bool) -> Sequence[float]:
    every = sweep.decades(double=contestant.double)
    return every[::2] if quick else every


def _between(a: float, b: float) -> float:
    """The geometric middle, to three digits."""
    return float(f"{math.sqrt(a * b):.2e}")


def _within(sweep: Sweep, contestant: Contestant) -> float | None:
    """The predicted onset, where it lies within a decade of the sweep."""
    value = sweep.predicted(contestant.arithmetic)
    if not (0.0 < value < math.inf):
        return None
    end = sweep.beyond if contestant.double else sweep.last
    low, high = min(sweep.first, end), max(sweep.first, end)
    return value if low / 10.0 <= value <= high * 10.0 else None


def measure(
    bench: Bench,
    sweeps: Sequence[Sweep],
    entrants: Sequence[Contestant],
    note: Note = lambda _: None,
    *,
    quick: bool = False,
    workers: int = 2,
) -> list[Course]:
    """Every sweep of every contestant, ``workers`` at a time: no figure here is a time."""

    def work(job: tuple[Sweep, Contestant]) -> Course:
        made = course(bench, *job, quick=quick)
        note(sentence(made))
        return made

    jobs = [(sweep, entrant) for sweep in sweeps for entrant in entrants]
    with ThreadPoolExecutor(workers) as pool:
        return list(pool.map(work, jobs))


def sentence(made: Course) -> str:
    """What came of one course, in words."""
    if any(point.share is None for point in made.points):
        return f"{made.sweep}, {made.renderer}: cannot be drawn"
    expected = "theory expects none" if made.predicted is None else f"theory says {made.predicted:.1g}"
    if made.onset is None:
        worst = max((point.share or 0.0) for point in made.points)
        return f"{made.sweep}, {made.renderer}: right all the way ({worst:.1%} wrong at most; {expected})"
    return f"{made.sweep}, {made.renderer}: {made.kind} from {made.onset:.2g} on ({expected})"


def failures(courses: Sequence[Course]) -> Iterator[Course]:
    """Those that broke where theory has an onset more than a decade away, or none."""
    for each in courses:
        off = each.decades_off
        if each.onset is not None and (off is None or abs(off) > 1.0):
            yield each
