"""The bench of memory draws pictures that are judged differently, and tells the most that its process took."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest

from notabug.bench.memory import BLOT, PICTURES, SCENES, WAYS, drawn


@pytest.mark.parametrize("way", WAYS)
def test_pictures_are_what_they_are_called(way: str) -> None:
    right = np.random.default_rng(1).random((24, 32, 3))
    picture = drawn(right, way)
    assert picture.shape == right.shape
    changed = (picture != right).any(axis=2).sum()
    assert changed == {"right": 0, "with a blot": BLOT**2}.get(way, right[..., 0].size)
    assert not np.shares_memory(picture, right) or way != "with a blot"


def test_every_scene_is_judged_in_every_way() -> None:
    assert len(SCENES) * len(WAYS) == PICTURES


CODE = """
import subprocess, sys
from notabug.bench.memory import peak
before = peak()
held = b"x" * (64 << 20)
child = [sys.executable, "-c", "from notabug.bench.memory import peak; print(peak())"]
print(before, peak(), subprocess.run(child, check=True, capture_output=True, text=True).stdout)
"""


def test_the_peak_is_that_of_the_process_itself_and_only_grows() -> None:
    """Started by a process that holds much, a child that holds little tells little."""
    done = subprocess.run([sys.executable, "-c", CODE], check=True, capture_output=True, text=True)
    before, holding, child = (int(word) for word in done.stdout.split())
    assert before > 20 << 20
    assert holding - before > 48 << 20
    assert child < before + (32 << 20)
