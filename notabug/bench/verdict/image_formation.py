"""From the subsamples of a picture to what a renderer would write: pixel filters, noise, fireflies, encodings."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Literal

import numpy as np
import numpy.typing as npt
from scipy import sparse

from notabug.adapters.base import Declaration, Filter

Floats = npt.NDArray[np.float64]

SUBSAMPLES = 5  # a side of the pixel: odd, so that one lies at its centre, and none of the reference's 4 or 8 does
SPREAD = 0.2  # standard deviation of one sample over its mean: a light, or a lens, that is sampled
SEEDS = 4
SRGB_STEP = 2.4 / 1.055 / 255.0  # of an 8-bit value at white, in linear light
FEW = 100  # samples a pixel, up to which drawing each is faster than drawing how many fall where
FIREFLIES = 2e-5  # a sample
FIREFLY = 50.0  # times the brightest value of the picture


@dataclass(frozen=True, slots=True)
class Condition:
    """How a picture is taken: pixel filter, samples a pixel (0: no noise), encoding, fireflies."""

    name: str
    filter: Filter = "box"
    samples: int = 0
    encoding: Literal["linear", "srgb8", "half"] = "linear"
    fireflies: bool = False

    @property
    def radius(self) -> float:
        return {"point": 0.0, "box": 0.5, "tent": 1.0, "gaussian": 1.5}[self.filter]

    @property
    def seeds(self) -> int:
        return SEEDS if self.samples else 1

    def declaration(self) -> Declaration:
        """What a renderer that takes such pictures declares."""
        quantum, relative = {"linear": (2.0**-24, True), "srgb8": (SRGB_STEP, False), "half": (2.0**-11, True)}[
            self.encoding
        ]
        return Declaration(
            precision="float64",
            filter=self.filter,
            radius=self.radius,
            quantum=quantum,
            relative_quantum=relative,
            white=1.0 if self.encoding == "srgb8" else math.inf,
            noisy=bool(self.samples),
            samples=self.samples or (SUBSAMPLES**2 if self.filter != "point" else 1),
            silhouette="keep",
            opacity_shadow="attenuate",
            glass_shadow="opaque",
            total_reflection="transmission",
            texture_filter="bilinear",
        )


CONDITIONS = (
    Condition("point", filter="point"),
    Condition("box"),
    Condition("tent", filter="tent"),
    Condition("gaussian", filter="gaussian"),
    Condition("8-bit sRGB", encoding="srgb8"),
    Condition("half float", encoding="half"),
    *(Condition(f"{n} samples", samples=n) for n in (4, 16, 64, 256)),
    *(Condition(f"{n} samples, correlated", samples=n, filter="gaussian") for n in (16, 64)),
    Condition("16 samples, fireflies", samples=16, fireflies=True),
)
BY_NAME = {condition.name: condition for condition in CONDITIONS}


@lru_cache(maxsize=64)
def _gather(pixels: int, subsamples: int, name: str, radius: float) -> sparse.csr_array:
    """(pixels, pixels * subsamples) weights of a separable pixel filter, each row with the sum 1."""
    place = (np.arange(pixels * subsamples) + 0.5) / subsamples
    off = np.abs(place[None, :] - (np.arange(pixels)[:, None] + 0.5))
    if name == "gaussian":
        weight = np.maximum(np.exp(-2.0 * off**2) - math.exp(-2.0 * radius**2), 0.0)
    else:
        weight = np.maximum(1.0 - off, 0.0) if name == "tent" else (off < 0.5).astype(float)
    weight[off > radius] = 0.0
    return sparse.csr_array(weight / weight.sum(axis=1, keepdims=True))


def filtered(sub: Floats, condition: Condition) -> Floats:
    """The picture without noise (h, w, c) of subsamples (h * s, w * s, c)."""
    s = SUBSAMPLES
    if condition.filter == "point":
        return np.ascontiguousarray(sub[s // 2 :: s, s // 2 :: s])
    picture = sub
    for _ in range(2):  # down, then across
        pixels = picture.shape[0] // s
        weights = _gather(pixels, s, condition.filter, condition.radius)
        summed = weights @ picture.reshape(picture.shape[0], -1)
        picture = np.ascontiguousarray(summed.reshape(pixels, *picture.shape[1:]).swapaxes(0, 1))
    return picture


def _drawn(n: int, h: int, w: int, rng: np.random.Generator) -> Floats:
    """How many of the ``n`` samples of each pixel fall on each subsample (h SUBSAMPLES, w SUBSAMPLES)."""
    s = SUBSAMPLES
    places = s * s
    if n > FEW:
        drawn = rng.multinomial(n, np.full(places, 1.0 / places), size=h * w)
        return drawn.reshape(h, w, s, s).swapaxes(1, 2).reshape(h * s, w * s).astype(np.float64)
    within = np.add.outer(np.arange(s) * (w * s), np.arange(s)).ravel()
    first = np.add.outer(np.arange(h) * (s * w * s), np.arange(w) * s).ravel()
    place = within[rng.integers(places, size=(h * w, n), dtype=np.uint8)]
    place += first[:, None]
    return np.bincount(place.ravel(), minlength=h * w * places).reshape(h * s, w * s).astype(np.float64)


def _noisy(sub: Floats, condition: Condition, rng: np.random.Generator) -> Floats:
    """One seed: samples at random places of each pixel, each with a gamma-distributed factor of mean 1."""
    s, n = SUBSAMPLES, condition.samples
    h, w = sub.shape[0] // s, sub.shape[1] // s
    count = _drawn(n, h, w, rng)
    shape = 1.0 / SPREAD**2
    weight = np.zeros_like(count)
    hit = count > 0
    weight[hit] = rng.standard_gamma(count[hit] * shape) / shape  # the sum of ``count`` gammas is a gamma
    value = filtered(sub * weight[..., None], condition) / filtered(count[..., None], condition)
    if condition.fireflies:
        hits = rng.poisson(FIREFLIES * n, size=(h, w))
        value += (hits * FIREFLY / n * float(sub.max()))[..., None]
    return value


def shoot(subs: Sequence[Floats], condition: Condition, seed: int, count: int = 0) -> Iterator[Floats]:
    """The pictures (h, w, 3) of every seed, linear, before they are written; ``count`` instead of the usual seeds.

    Each seed has its own subsamples, or there is one of ``subs`` for all.
    """
    if not condition.samples:
        yield filtered(subs[0], condition)
        return
    for k in range(count or condition.seeds):
        yield _noisy(subs[k % len(subs)], condition, np.random.default_rng((seed, k)))


def written(picture: Floats, condition: Condition) -> npt.NDArray[np.float32]:
    """``picture`` as it comes back from the file, linear again."""
    if condition.encoding == "srgb8":
        from notabug.bench.verdict.gates import eight_bit
        from notabug.scenes_usd.srgb import decode_srgb

        return decode_srgb(eight_bit(picture))
    if condition.encoding == "half":
        with np.errstate(over="ignore"):  # what half cannot hold is infinite in the file, too
            return picture.astype(np.float16).astype(np.float32)
    return picture.astype(np.float32)


def variance(sub: Floats, condition: Condition) -> Floats:
    """The variance (h, w, 3) of the mean of all seeds, zero without noise; that of a box filter."""
    if not condition.samples:
        return np.zeros_like(filtered(sub, condition))
    box = Condition("box")
    mean, square = filtered(sub, box), filtered(sub * sub, box)
    return np.maximum(square * (1.0 + SPREAD**2) - mean * mean, 0.0) / (condition.samples * condition.seeds)
