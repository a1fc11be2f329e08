"""Each structure is shown by the patterns that have it, and by no others: of one surface, lit or dark at each pixel."""

from __future__ import annotations

from typing import get_args

import numpy as np
import numpy.typing as npt
import pytest

from notabug.metrics.admissible import Admissible
from notabug.metrics.noise import Measured
from notabug.metrics.rules import RULES, Trial
from notabug.metrics.structure import STRUCTURES
from notabug.references.models.model import Model, Shows

SIDE = 32
ROWS, COLUMNS = np.indices((SIDE, SIDE))
PATTERNS: dict[str, npt.NDArray[np.bool_]] = {
    "nothing": np.zeros((SIDE, SIDE), np.bool_),
    "all": np.ones((SIDE, SIDE), np.bool_),
    "dots": np.random.default_rng(1).uniform(size=(SIDE, SIDE)) < 0.4,
    "few dots": (ROWS % 8 == 3) & (COLUMNS % 8 == 3),
    "blot": (ROWS - 16) ** 2 + (COLUMNS - 16) ** 2 < 100,
    "half": ROWS < SIDE // 2,
    "stripes": COLUMNS % 8 < 4,
    "wide stripes": COLUMNS % 8 < 7,
}
SHOWN = {  # which patterns have a structure, of those that are a mixture of two values
    "chance": {"dots", "few dots", "blot", "half", "stripes", "wide stripes"},
    "dots": {"dots", "few dots"},
    "dots_everywhere": {"dots"},
    "stripes": {"nothing", "dots", "few dots", "blot", "half", "stripes"},
    "wide": {"all", "dots", "blot", "half", "stripes", "wide stripes"},
    "anything": set(PATTERNS),
}


def level(value: float) -> Admissible:
    picture = np.full((SIDE, SIDE, 3), value)
    none = np.zeros((SIDE, SIDE), np.bool_)
    return Admissible(picture, picture, picture, np.full_like(picture, 0.01), none, np.ones((SIDE, SIDE)))


def trial(dark: npt.NDArray[np.bool_], shows: Shows) -> Trial:
    """A picture that is 0 where it is ``dark`` and .5 elsewhere, and a model of a surface that may be 0."""
    model = Model("some", "limitation", "", "", rule="set", shows=shows)
    mean = np.where(dark[..., None], 0.0, np.full((SIDE, SIDE, 3), 0.5))
    measured = Measured(mean, np.zeros_like(mean), np.inf, 1.0, 1)
    return Trial(measured, level(0.5), model, (), (), lambda chosen: level(0.0 if chosen else 0.5))


@pytest.mark.parametrize("shows", SHOWN)
@pytest.mark.parametrize("pattern", PATTERNS)
def test_a_structure_is_shown_by_the_patterns_that_have_it(pattern: str, shows: Shows) -> None:
    tried = trial(PATTERNS[pattern], shows)
    found = RULES["set"](tried.measured, tried.base, *tried.values())
    assert STRUCTURES[shows].shown(tried, found) == (pattern in SHOWN[shows])


def test_every_word_that_a_model_may_say_is_a_structure() -> None:
    words = {*SHOWN, "crossing"}  # the last has its tests in test_near_faults.py
    assert set(STRUCTURES) == words
    assert set(get_args(Shows)) == words


@pytest.mark.parametrize(("side", "shown"), [(8, True), (SIDE, False)])
def test_stripes_may_leave_more_in_shadow_where_few_pixels_tell(side: int, shown: bool) -> None:
    """Seven eighths of 64 pixels are chance, and of 1,024 they are none."""
    tried = trial(PATTERNS["wide stripes"], "stripes")
    within = np.maximum(ROWS, COLUMNS) < side
    alpha = np.where(within & PATTERNS["wide stripes"], 1.0, 0.0)
    assert STRUCTURES["stripes"].shown(tried, (tried.base, alpha, within, 0.0)) == shown
