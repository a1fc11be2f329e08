"""Envelope: what a model admits at each pixel; made by the ray tracer from the subsamples of the pixel's footprint."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

import numpy as np
import numpy.typing as npt

from notabug.references import _native
from notabug.references.tracer.emitters import CENTRE_DIRECTIONS, DIRECTIONS
from notabug.references.tracer.flatten import Flat, flatten
from notabug.references.tracer.options import Options
from notabug.references.tracer.precision import CORNER, MOST, SLANTED, around, asked, bends, steps
from notabug.scenes_usd.scene import Scene

Floats = npt.NDArray[np.float64]
Bools = npt.NDArray[np.bool_]

SEEN = (1 << 40) - 1  # the bits of an id that say what is seen
GRID, REFINE = 4, 8  # subsamples along each side of a pixel, and of one whose footprint is mixed
AROUND = 4  # pixels: a filter's radius and what falls between the centres of pixels
SAME = 1e-6  # relative difference of two colours that rounding makes: ten units in the last place of float32


@dataclass(frozen=True, slots=True, eq=False)
class Envelope:
    """Admissible values of every pixel.

    Attributes
    ----------
    point : (h, w, 3) the value at the pixel's centre.
    mean, variance : (h, w, 3) over the pixel's footprint; the variance is that of one random sample.
    lo, hi : (h, w, 3) smallest and largest value in the footprint.
    ids : (h, w) what is seen at the centre: object, and above the bits ``SEEN`` the lights that are blocked there.
    edge, cast : (h, w) the id changes inside the pixel; between two samples of it only the lights do: a shadow's edge.
    spared, spared_point : (h, w) share of the footprint, and of the centre (0 or 1), whose light the facets of its own
        mesh would block.
    bound : (h, w, 3) by how much ``mean`` may be off, as its samples tell: less than precision.asked, or more samples
        were too many; 0 where none was asked for.
    """

    point: Floats
    mean: Floats
    variance: Floats
    lo: Floats
    hi: Floats
    ids: npt.NDArray[np.int64]
    edge: Bools
    spared: Floats
    spared_point: Floats
    cast: Bools
    bound: Floats

    def arrays(self) -> dict[str, npt.NDArray[np.generic]]:
        return {each.name: getattr(self, each.name) for each in fields(self)}


class _Buffers:
    """What ``_native.render`` fills, for one pass over a picture."""

    def __init__(self, height: int, width: int) -> None:
        self.mean = np.zeros((height, width, 3))
        self.variance = np.zeros((height, width, 3))
        self.lo = np.zeros((height, width, 3))
        self.hi = np.zeros((height, width, 3))
        self.error = np.zeros((height, width, 3))
        self.ids = np.zeros((height, width), np.int64)
        self.mixed = np.zeros((height, width), np.uint8)
        self.spared = np.zeros((height, width))


def _pass(
    flat: Flat,
    scene: Scene,
    options: Options,
    pixels: npt.NDArray[np.int64],
    into: _Buffers,
    *,
    grid: int = 0,
    samples: int = 1,
    seed: int = 0,
    threads: int = 0,
    directions: int = 0,
) -> None:
    """Render ``pixels`` with all threads; every pixel is computed alike whatever their number."""
    directions = directions or (CENTRE_DIRECTIONS if grid == 1 else DIRECTIONS)
    how = grid, samples, seed
    _native.render(flat, options.for_scene(scene), scene.width, scene.height, pixels, *how, into, threads, directions)


def lattice(samples: int) -> int:
    """The generator g of the points ((s + 1/2) / n, (g s mod n + 1/2) / n) of a pixel, s = 0 .. n - 1, n a power of 2.

    Of n columns and n rows each holds one point, so an edge along the pixel's border is off by one point, where a
    regular grid is off by a row: the root mean square error is .005 of its step for n = 64, a grid's .037. Over all
    directions the worst is .016, a grid's .037. For what is smooth a grid is better: .0023 against .0062 of waves of
    three radians a pixel. g is the odd number next to (sqrt 2 - 1) n. Sloan and Joe 1994, "Lattice Methods for Multiple
    Integration".
    """
    return 2 * round((math.sqrt(2.0) - 1.0) * samples / 2.0 - 0.5) + 1


def changes(ids: npt.NDArray[np.int64], *, cast: bool = False) -> Bools:
    """Pixels (h, w) whose id differs from one of their four neighbours'; ``cast``: only in the lights."""
    found = np.zeros(ids.shape, np.bool_)
    across, down = ids[:, 1:] != ids[:, :-1], ids[1:] != ids[:-1]
    if cast:
        seen = ids & SEEN
        across, down = across & (seen[:, 1:] == seen[:, :-1]), down & (seen[1:] == seen[:-1])
    found[:, 1:] |= across
    found[:, :-1] |= across
    found[1:] |= down
    found[:-1] |= down
    return found


def trace_envelope(
    scene: Scene,
    options: Options = Options(),
    *,
    grid: int = GRID,
    refine: int = REFINE,
    most: int = REFINE * REFINE,
    dtype: npt.DTypeLike = np.float64,
    threads: int = 0,
) -> Envelope:
    """The envelope of ``scene`` as it stands (apply ``as_intended`` first for the reference of a scene with intent).

    Every pixel gets its centre and ``grid`` x ``grid`` regular subsamples; where ids differ inside the pixel or towards
    a neighbour, a lattice of ``refine`` x ``refine`` (0: no refinement). With ``most`` beyond that, a pixel whose
    estimated error is more than what precision.asked gets lattices of four times as many samples, up to ``most``, and a
    bound.
    """
    flat = flatten(scene, dtype)
    centre = _Buffers(scene.height, scene.width)
    _pass(flat, scene, options, np.arange(scene.width * scene.height), centre, grid=1, threads=threads)
    everywhere = np.ones(centre.ids.shape, np.bool_)
    return _footprints(flat, scene, options, centre, everywhere, grid=grid, refine=refine, most=most, threads=threads)


def trace_changes(
    scene: Scene, options: Options, base: Envelope, also: Bools | None = None, fine: Bools | None = None
) -> Envelope:
    """The envelope of ``scene`` where the centre of a pixel within AROUND differs from that of ``base``; else ``base``.

    What is traced is to the last bit what ``trace_envelope`` gives, the rest up to SAME. What a change of a scene does
    only between the centres of pixels, farther than AROUND from any centre that it changes, is seen only at the pixels
    ``also`` (h, w). The pixels ``fine`` (h, w) are traced as exactly as references are, and have a bound.
    """
    flat = flatten(scene)
    centre = _Buffers(scene.height, scene.width)
    _pass(flat, scene, options, np.arange(scene.width * scene.height), centre, grid=1)
    alike = np.abs(centre.mean - base.point) <= SAME * np.abs(centre.mean)  # never true of what is not finite
    changed = ~alike.all(axis=2) | (centre.ids != base.ids) | (centre.spared != base.spared_point)
    at = _around(changed, AROUND)
    if also is not None:
        at |= also
    if fine is not None:
        at &= ~fine
    found = _joined(base, _footprints(flat, scene, options, centre, at), at)
    if fine is None:
        return found
    return _joined(found, _footprints(flat, scene, options, centre, fine, most=MOST, strict=True), fine)


def _joined(base: Envelope, new: Envelope, at: Bools) -> Envelope:
    """``new`` at the pixels ``at`` (h, w), ``base`` elsewhere."""
    known = base.arrays()
    return Envelope(
        **{
            name: np.where(at if values.ndim == 2 else at[..., None], values, known[name])
            for name, values in new.arrays().items()
        }
    )


def _around(mask: Bools, reach: int) -> Bools:
    """``mask`` (h, w) and what is within ``reach`` pixels of it, along and across."""
    for axis in (0, 1):
        wide = mask
        for away in range(1, reach + 1):
            first, last = (slice(None),) * axis + (slice(away, None),), (slice(None),) * axis + (slice(None, -away),)
            wide = wide.copy()
            wide[first] |= mask[last]
            wide[last] |= mask[first]
        mask = wide
    return mask


def _footprints(
    flat: Flat,
    scene: Scene,
    options: Options,
    centre: _Buffers,
    at: Bools,
    *,
    grid: int = GRID,
    refine: int = REFINE,
    most: int = REFINE * REFINE,
    strict: bool = False,
    threads: int = 0,
) -> Envelope:
    """The envelope of the pixels ``at`` (h, w), whose ``centre``s are traced already; elsewhere it says nothing."""
    fine = _Buffers(scene.height, scene.width)
    # for a bound their neighbours tell what lies between
    known = _around(at, 1) if most > refine * refine and not at.all() else at
    _pass(flat, scene, options, np.flatnonzero(known), fine, grid=grid, threads=threads)
    if refine > grid:
        how = {"grid": grid, "refine": refine, "most": most, "threads": threads}
        _refine(flat, scene, options, centre, fine, at, known, strict=strict, **how)
    return Envelope(
        point=centre.mean,
        mean=fine.mean,
        variance=fine.variance,
        lo=np.minimum(fine.lo, centre.mean),
        hi=np.maximum(fine.hi, centre.mean),
        ids=centre.ids,
        edge=fine.mixed > 0,
        spared=fine.spared,
        spared_point=centre.spared,
        cast=(fine.mixed & 2) > 0,
        bound=fine.error,
    )


def _refine(
    flat: Flat,
    scene: Scene,
    options: Options,
    centre: _Buffers,
    fine: _Buffers,
    at: Bools,
    known: Bools,
    *,
    grid: int,
    refine: int,
    most: int,
    strict: bool,
    threads: int,
) -> None:
    """Trace those of the pixels ``at`` (h, w) again whose mean in ``fine`` is not exact enough, and tell its bound.

    ``fine`` holds ``grid`` x ``grid`` samples of the pixels ``known``. A step towards a neighbour may lie in a pixel,
    unseen, by half of a row of samples. Where that is an edge of what is seen, most verdicts admit as much, and unless
    they are ``strict`` no more samples are taken for it: it is in the bound alone. What most edges keep to decides how
    many samples are taken, what all of them keep to is the bound.
    """
    mixed = (fine.mixed > 0) | changes(centre.ids)
    samples = refine * refine
    if most <= samples:  # all that is predicted for a verdict is sampled alike: a difference is the models', not theirs
        pixels = np.flatnonzero(at & mixed)
        _pass(flat, scene, options, pixels, fine, grid=-lattice(samples), samples=samples, threads=threads)
        fine.error[:] = 0.0
        return
    edge = fine.mixed > 0 if strict else _around(mixed, 1)
    step, span = steps(fine.lo, fine.hi, known, grid), around(fine.lo, fine.hi)
    unseen = np.where(edge[..., None], span, step)
    peak = float(centre.mean.max(initial=0.0))

    def inexact(samples_unseen: Floats) -> Bools:
        error = np.where(edge[..., None], fine.error, np.maximum(fine.error, samples_unseen))
        return np.asarray((error > asked(fine.mean, span, edge, peak)).any(axis=2))

    missed = unseen / (2.0 * grid) + np.where(edge[..., None], 0.0, bends(fine.mean, known, grid))
    most_missed = missed
    wanted = mixed | inexact(missed)
    while (at & wanted).any():
        pixels = np.flatnonzero(at & wanted)
        _pass(flat, scene, options, pixels, fine, grid=-lattice(samples), samples=samples, threads=threads)
        missed = np.where(wanted[..., None], CORNER / samples * unseen, missed)
        most_missed = np.where(wanted[..., None], SLANTED / math.sqrt(samples) * unseen, most_missed)
        if samples >= most:
            break
        samples, wanted = 4 * samples, wanted & inexact(missed)
    np.maximum(fine.error, most_missed, out=fine.error)


def trace_samples(
    scene: Scene, options: Options, at: npt.NDArray[np.intp], samples: int, threads: int = 0
) -> tuple[Floats, Floats]:
    """The means of a lattice of ``samples`` over the pixels ``at`` (n,), and their estimated errors, both (n, 3)."""
    into = _Buffers(scene.height, scene.width)
    grid = -lattice(samples)
    _pass(flatten(scene), scene, options, at, into, grid=grid, samples=samples, threads=threads)
    return into.mean.reshape(-1, 3)[at], into.error.reshape(-1, 3)[at]


def trace_picture(
    scene: Scene,
    options: Options = Options(),
    *,
    samples: int = 1,
    seed: int = 0,
    dtype: npt.DTypeLike = np.float64,
    threads: int = 0,
    at: npt.NDArray[np.intp] | None = None,
    directions: int = 0,
) -> Floats:
    """A picture (h, w, 3) as a renderer draws it: pixel centres for one sample, else box-filtered random ones.

    Only the pixels numbered ``at`` (n,) are drawn where they are given, and the others left black. To each light with
    a size go ``directions`` from each sample; 0: as many as for references.
    """
    into = _Buffers(scene.height, scene.width)
    every = np.arange(scene.width * scene.height) if at is None else np.ascontiguousarray(at)
    grid = 1 if samples == 1 else 0
    how = {"grid": grid, "samples": samples, "seed": seed, "threads": threads, "directions": directions}
    _pass(flatten(scene, dtype), scene, options, every, into, **how)
    return into.mean
