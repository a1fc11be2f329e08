"""Step 6 of docs/judge.md, what explains it: what a picture of a model must show, or the model explains nothing.

What a rule admits would excuse more than its algorithm does. A mixture has chance in it; a shadow map's stripes leave
half of a surface lit; dots differ from those around them; of surfaces that coincide another one is seen on enough of
what they share. Each of these is a structure, which a model names in ``shows``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
import numpy.typing as npt

from notabug.metrics.admissible import Admissible
from notabug.metrics.channels import largest, pixels
from notabug.metrics.image_filters import Bools
from notabug.metrics.policy import POLICY
from notabug.metrics.rules import Explained, Trial, share_of, support
from notabug.references.models.model import Model, Shows

Floats = npt.NDArray[np.floating]


class Structure(Protocol):
    """What a picture must show of a model."""

    def beside(self, trial: Trial, /) -> tuple[Admissible, ...]:
        """Further values that a sample may take, besides the model's own."""

    def shown(self, trial: Trial, found: Explained, /) -> bool:
        """Whether the picture shows it, where ``found`` is what the model's rule admits."""


@dataclass(frozen=True, slots=True)
class Anything:
    """Nothing is asked of the picture."""

    def beside(self, _trial: Trial, /) -> tuple[Admissible, ...]:
        return ()

    def shown(self, _trial: Trial, _found: Explained, /) -> bool:
        return True


@dataclass(frozen=True, slots=True)
class Chance(Anything):
    """A mixture: one value nearly everywhere is a choice, and none at all is no mixture.

    Where the picture deviates it must do so by a mean share of ``least`` or more.
    """

    least: float = POLICY.rules.mean_alpha

    def shown(self, trial: Trial, found: Explained, /) -> bool:
        return _mixed(trial, found, self.least)


@dataclass(frozen=True, slots=True)
class Stripes(Anything):
    """About half of what they may act on lies between them; their mean scatters as that of blocks of many pixels."""

    def shown(self, _trial: Trial, found: Explained, /) -> bool:
        _, alpha, within, _ = found
        scatter = POLICY.rules.striped_scatter / float(np.sqrt(max(1.0, float(within.sum()))))
        return not within.any() or float(alpha[within].mean()) <= POLICY.rules.most_striped + scatter


@dataclass(frozen=True, slots=True)
class Crossing:
    """Surfaces that coincide: which one is seen changes by pixel, on enough of what they share to the last bits.

    There one sees the first or another; what lies on the straight way between them may be rare in each pixel.
    """

    def beside(self, trial: Trial, /) -> tuple[Admissible, ...]:
        """Where a choice has another surface win, the first may win as well."""
        without = _without(trial)
        return (trial.shown(without),) if without != trial.chosen else ()

    def shown(self, trial: Trial, found: Explained, /) -> bool:
        first = trial.predict(_without(trial))
        assert trial.model.sure is not None, f"{trial.model.name} does not say where it surely crosses"
        another = trial.predict((*trial.chosen, replace(trial.model, options=trial.model.sure, others=())))
        surely = support(first, another)
        off = trial.off(surely)
        rare = _between(trial, (another, first), off) > POLICY.rules.most_between
        few = surely.any() and np.count_nonzero(off) < POLICY.rules.least_fought * np.count_nonzero(surely)
        # a depth buffer that holds nearly all depths alike shows one surface but for dots
        if few and not (trial.base.share_is_point and rare and _by_themselves(off)):
            return False
        return _mixed(trial, found, POLICY.rules.mean_fought if rare else POLICY.rules.mean_alpha)


def _by_themselves(off: Bools) -> bool:
    """Whether most of the pixels ``off`` (h, w) have no other of them near."""
    from scipy import ndimage

    numbers = POLICY.rules
    around = ndimage.uniform_filter(off.astype(np.float64), numbers.around, mode="constant") * numbers.around**2
    return bool(off.any()) and float((around[off] < numbers.alone).mean()) >= numbers.least_alone


@dataclass(frozen=True, slots=True)
class Wide(Anything):
    """Few wrong pixels are no wrong rule: it touches ``least`` of its support or more."""

    least: float = POLICY.rules.least_touched

    def shown(self, trial: Trial, found: Explained, /) -> bool:
        _, _, within, _ = found
        return not within.any() or float(trial.off(within).sum()) >= self.least * float(within.sum())


@dataclass(frozen=True, slots=True)
class Dots(Anything):
    """Shares that differ from those around them, each by itself; a half-dark band, a blot and another light are none.

    In a mean over many samples dots are small deviations, but still deviations; in blots neighbours deviate alike, and
    under another light half of all pixels do as those around them. There is chance in them, but it may be faint.
    """

    def shown(self, trial: Trial, found: Explained, /) -> bool:
        return _mixed(trial, found, 0.0) and _dotted(trial, found)


@dataclass(frozen=True, slots=True)
class DotsEverywhere(Anything):
    """Dots in much of what a fault acts on: at pixel centres there may be few, but in means over samples there are not.

    Of what may show anything there are many at the centres too.
    """

    def shown(self, trial: Trial, found: Explained, /) -> bool:
        few = trial.base.share_is_point and trial.model.rule != "any"
        return _dotted(trial, found) and (few or Wide(POLICY.rules.least_dotted).shown(trial, found))


STRUCTURES: Mapping[Shows, Structure] = {
    "anything": Anything(),
    "chance": Chance(),
    "stripes": Stripes(),
    "crossing": Crossing(),
    "dots": Dots(),
    "dots_everywhere": DotsEverywhere(),
    "wide": Wide(),
}


def _mixed(trial: Trial, found: Explained, least: float) -> bool:
    """Whether ``found`` is a mixture, and its mean share where the picture deviates is ``least`` or more."""
    _, alpha, within, _ = found
    off = trial.off(within)
    mixed = not within.any() or POLICY.rules.least_mixed <= float(alpha[within].mean()) <= POLICY.rules.most_mixed
    return mixed and not (off.any() and float(alpha[off].mean()) < least)


def _without(trial: Trial) -> tuple[Model, ...]:
    """The choices of ``trial`` that leave the surface which its model lets another one win over."""
    switches = (trial.model.sure or {}).keys()
    return tuple(other for other in trial.chosen if other.options.keys().isdisjoint(switches))


def _between(trial: Trial, values: Sequence[Admissible], off: Bools) -> float:
    """The share of the pixels ``off`` (h, w) that lie on the straight way from the base to one of ``values``."""
    at = np.flatnonzero(off)
    if not at.size:
        return 0.0
    measured, base = trial.measured, trial.base
    start = pixels(base.value, at)
    slack = pixels(base.tau, at) + POLICY.rules.noise * np.sqrt(pixels(measured.variance, at))
    away = pixels(measured.mean, at) - start
    found = np.zeros(at.size, np.bool_)
    for value in values:
        v = pixels(value.value, at) - start
        found |= largest(np.abs(away - share_of(away, v)[:, None] * v) - slack) <= 0
    return float(found.mean())


def _dotted(trial: Trial, found: Explained) -> bool:
    """Whether shares alpha differ from those around them; a rule that knows none has the relative deviation for it."""
    from scipy import ndimage

    measured, base = trial.measured, trial.base
    numbers = POLICY.rules
    _, alpha, within, _ = found
    if trial.model.rule == "any":  # its alpha is 0 or 1
        bright = np.maximum(largest(np.abs(base.value)), largest(base.tau))
        alpha = np.where(within, np.minimum(largest(np.abs(measured.mean - base.value)) / bright, 1.0), 0.0)
    count = np.maximum(ndimage.uniform_filter(within.astype(np.float64), numbers.around, mode="constant"), 1e-9)
    around = ndimage.uniform_filter(alpha * within, numbers.around, mode="constant") / count
    # a dot with less than two pixels of the support around it differs from what is around it by all of its share
    around[count < numbers.alone / numbers.around**2] = 0.0
    off = np.where(within, alpha - around, 0.0)
    power = float((off**2).sum())
    dots = np.abs(off[trial.off(within)])
    rough = not dots.size or float(np.median(dots)) > numbers.least_grain
    if not rough or power <= numbers.least_grain**2 * float((within & (alpha > 0)).sum()):
        return False
    alike = 0.5 * float((off[:, 1:] * off[:, :-1]).sum() + (off[1:] * off[:-1]).sum())
    return alike <= (numbers.most_alike + (numbers.widened if base.widened else 0.0)) * power
