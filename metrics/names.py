"""Step 8 of docs/judge.md, the name: which of two is the better one: the one that leaves less and excuses less."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

from notabug.metrics.explain import Explanation
from notabug.metrics.policy import POLICY


@dataclass(frozen=True, slots=True, eq=False)
class Name:
    """What a bug is called, why, and the share of the bug leg that the name leaves (0: it explains everything).

    ``fitted`` is the explanation by that fault and the limitations beside it, None where nothing is beside it. A name
    for what is wrong with the ``whole`` picture is no model of a fault. ``preview_misfit`` is that of quick pictures.
    ``numbers`` are those of the verdict that the name knows better than a fit of the whole picture: a shift, a gain.
    ``misfit`` is the mean |residual| in units of tolerance and noise: it tells names apart that leave no bug leg. A
    fault that may take one of several values at each pixel has ``freedom``, and of two such the less free one is told.
    One that may show ``anything`` is told where no other is left. Its strength was fitted along ``axes``;
    ``strengths`` are the numbers of which the fault, or the cause in the whole picture, is made again. One that
    ``moves`` the whole picture says two numbers for all of it; a ``rare`` one is told after others that look alike.
    """

    name: str
    message: str
    remains: float
    misfit: float = math.inf
    fitted: Explanation | None = None
    freedom: float = 0.0
    anything: bool = False
    whole: bool = False
    preview_misfit: float = math.inf
    numbers: Mapping[str, float] = field(default_factory=dict)
    axes: int = 1
    strengths: tuple[float, ...] = ()
    moves: bool = False
    rare: bool = False

    @property
    def laden(self) -> int:
        """How many limitations and conventions are needed beside the name."""
        return 0 if self.fitted is None else sum(bool(alpha.any()) for alpha in self.fitted.alphas.values())

    @property
    def further(self) -> int:
        """How many numbers were fitted after the first: axes of a fault, or a shift's."""
        return max(0, self.axes - 1, len(self.numbers) - 1)

    @property
    def burden(self) -> int:
        """How many limitations are beside the name, and further numbers in it."""
        return self.laden + self.further

    def is_exact(self, exact: float) -> bool:
        """Whether it leaves no bug leg, and no more misfit than ``exact``."""
        return self.remains == 0.0 and self.misfit < exact

    @property
    def fits(self) -> bool:
        """Whether it leaves nothing, and says what must be seen."""
        return self.remains <= POLICY.names.nothing and not self.anything

    def prune_bound(self, exact: float) -> float:
        """From which ``preview_misfit`` on no other fault need be fitted after this one."""
        if not self.fits:
            return math.inf
        if self.laden:  # another one that looks alike may need no limitation
            return self.preview_misfit * POLICY.names.worse + POLICY.names.exact
        return self.preview_misfit * (1.0 if self.is_exact(exact) else POLICY.names.worse)


UNNAMED = Name("unexplained", "no known coding error gives this picture", 1.0)


def best_of(best: Name | None, names: Iterable[Name], exact: float, *, noisy: bool) -> Name | None:
    """The best of ``names`` and the ``best`` so far; those after one that leaves ``exact``ly nothing are not tried."""
    for name in names:
        if name.remains < POLICY.names.remains and (best is None or better(name, best, exact, noisy=noisy)):
            best = name
            if best.is_exact(exact):
                break
    return best


def better(each: Name, best: Name, exact: float, *, noisy: bool) -> bool:
    """Whether ``each`` is better than ``best``.

    Misfits of noisy pictures that are as near as ``exact`` are alike. So are those of all pictures that are rounding,
    unless one is half of the other: a light that is missing and one that lights nothing where it stands show the same.
    """
    if each.anything != best.anything:  # what may show anything always fits: whatever else leaves nothing says more
        fixed = best if each.anything else each
        return (fixed is each) == (fixed.remains <= POLICY.names.nothing)
    if (each.moves or best.moves) and bool(each.freedom) != bool(best.freedom):
        return each.moves  # two numbers for the whole picture excuse less than a choice at every pixel
    if noisy and bool(each.freedom) != bool(best.freedom):  # nor is there anything to choose where only noise is left
        fixed = best if each.freedom else each
        if fixed.remains <= POLICY.names.nothing and fixed.misfit < POLICY.names.noise:
            return fixed is each
    if each.freedom and best.freedom:
        return _excuses(each) < _excuses(best)
    if max(each.remains, best.remains) <= POLICY.names.nothing:
        if each.burden != best.burden:
            # a misfit below ``exact`` leaves nothing to be explained: there the fewest limitations and axes decide
            burden = POLICY.names.laden ** (each.burden - best.burden)
            return max(each.misfit, POLICY.names.exact) * burden < POLICY.names.better * max(
                best.misfit, POLICY.names.exact
            )
        alike = exact if noisy else 0.0
        share = 0.5 if max(each.misfit, best.misfit) < POLICY.names.rounded * exact else 1.0 - POLICY.names.better
        if abs(each.misfit - best.misfit) <= max(alike, share * best.misfit):
            return each.preview_misfit < POLICY.names.better * best.preview_misfit
    return each.misfit * POLICY.names.laden ** (each.further - best.further) < POLICY.names.better * best.misfit


def _excuses(name: Name) -> tuple[float, float]:
    """What a name that may choose at each pixel leaves, and how much it could excuse; a rare one must leave less."""
    rare = name.rare and name.remains > POLICY.names.nothing / POLICY.names.rarely
    return max(name.remains, POLICY.names.nothing) + (name.remains if rare else 0.0), name.freedom
