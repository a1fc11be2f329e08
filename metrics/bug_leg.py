"""Step 8 of docs/judge.md, the name: the bug leg that is to be named, and how much of it a fault may explain."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from notabug.metrics.admissible import Admissible, residual
from notabug.metrics.causes import Cause
from notabug.metrics.channels import largest
from notabug.metrics.explain import Explanation
from notabug.metrics.image_filters import Bools
from notabug.metrics.lattice import Lattice
from notabug.metrics.noise import Measured
from notabug.metrics.policy import POLICY
from notabug.metrics.quick import Predict, Preview, choices
from notabug.metrics.sets import habits
from notabug.metrics.significance import Significance
from notabug.references.models.model import Model

Floats = npt.NDArray[np.floating]


@dataclass(frozen=True, slots=True, eq=False)
class Bug:
    """A bug to be named: the picture, what is found in it without faults, and what a residual is worth (h, w, 3)."""

    measured: Measured
    found: Explanation
    limitations: Sequence[Model]
    predict: Predict
    preview: Preview
    scale: Floats
    look: Lattice

    @property
    def together(self) -> tuple[Model, ...]:
        """All choices that a renderer has at once, where a fault has hidden some of them but not all; else none."""
        some, every = set(choices(self.found.models)), habits(self.limitations)
        return every if some and some < set(every) else ()

    def misfit(self, to: Admissible) -> float:
        """Mean |residual| in units of tolerance and noise."""
        return float((np.abs(residual(self.measured.mean, to)) / self.scale).mean())

    def remains(self, left: Significance, *, still: bool) -> float:
        """The share of the bug leg that ``left`` is; of one without pixels whether it is ``still`` there, 0 or 1."""
        if not self.found.significance.triggers:  # only a gain or a shift: no pixel, so no leg, to be explained
            return float(still)
        return left.excess / max(self.found.significance.excess, 1e-30)

    def preview_misfit(self, value: Floats) -> float:
        """Mean |deviation| from ``value`` (h, w, 3), as ``misfit_on_lattice``."""
        return self.misfit_on_lattice(self.look.of(value))

    def misfit_on_lattice(self, value: Floats) -> float:
        """Mean |deviation| from ``value`` off the edges, in units of tolerance and noise, large ones cut off."""
        off = np.minimum(
            np.abs(self.look.of(self.measured.mean) - value) / self.look.of(self.scale), POLICY.likely.clip
        )
        smooth = ~self.look.of(self.predict(()).edge)
        return float(off[smooth].mean() if smooth.any() else off.mean())

    def likeness(self, fault: Model) -> float:
        """The misfit of what the quick pictures say that ``fault`` makes of the reference or of ``found``."""
        return min(self.misfit_on_lattice(with_fault) for _, with_fault in self._beside(fault))

    def is_farther(self, base: Admissible, cause: Cause) -> bool:
        """Whether what ``cause`` makes of ``base`` is farther from the picture than ``base``, as the lattice tells."""
        if cause.of_values is None:
            return False
        value = self.look.of(base.value)
        return self.misfit_on_lattice(cause.of_values(value)) > POLICY.bug_leg.farther * self.misfit_on_lattice(value)

    def told(self) -> Bools:
        """The wrong pixels (rows, columns), on the lattice, of which quick pictures tell; none where they are few.

        What lies at edges, and between the centres of pixels, they do not tell.
        """
        picture, reference = self.measured.mean, self.predict(())
        wrong = self.found.significance.pixels
        unseen = largest(np.abs(self.preview(()) - reference.value))
        told = wrong & ~reference.edge & (unseen < POLICY.bug_leg.told * largest(np.abs(picture - reference.value)))
        at = self.look.of(told)
        enough = (
            np.count_nonzero(told) >= POLICY.quick.least_told * np.count_nonzero(wrong)
            and np.count_nonzero(at) >= POLICY.bug_leg.few_told
        )
        return at if enough else np.zeros_like(at)

    def is_hopeless(self, fault: Model, at: Bools) -> bool:
        """Whether quick pictures say that ``fault`` leaves most of the wrong pixels ``at``, whatever is beside it.

        What it leaves is counted in pixels, and in what they are off. A fault that some parts of the scene may have and
        others not leaves the least that it can. ``at`` are the pixels ``told``; where there are none, nothing is said.
        """
        if not at.any():
            return False
        picture = self.look.of(self.measured.mean)[at]
        for without, with_fault in self._beside(fault):
            start, end = without[at], with_fault[at]
            moved = end - start
            if fault.rule == "any":
                nearest = np.where(moved != 0, picture, start)
            elif fault.local or fault.rule != "choice":
                share = np.clip((picture - start) * moved / np.where(moved != 0, moved * moved, 1.0), 0.0, 1.0)
                nearest = start + share * moved
            else:
                nearest = end
            was, left = (largest(np.abs(picture - value)) for value in (start, nearest))
            of_pixels = np.minimum(left / np.maximum(was, 1e-30), 1.0).mean()
            if of_pixels < POLICY.bug_leg.hope or np.minimum(left, was).sum() < POLICY.bug_leg.hope * was.sum():
                return False
        return True

    def _beside(self, fault: Model) -> Iterator[tuple[Floats, Floats]]:
        """Quick pictures without and with ``fault``: on the reference, and on choices that may be beside it."""
        for beside in dict.fromkeys(((), choices(self.found.models), self.together)):
            value = self.look.of(self.predict(beside).value)
            moved = self.look.preview(self.preview, (*beside, fault)) - self.look.preview(self.preview, beside)
            yield value, value + moved
