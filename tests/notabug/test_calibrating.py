"""The calibrate command: what it prints, what it remembers, what it refuses."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from notabug.adapters.base import Found, Quality, Render
from notabug.adapters.zbuffer import ZBuffer
from notabug.calibrating import calibrate, command
from notabug.scenes_usd.picture import read_picture, write_exr
from notabug.scenes_usd.scene import Scene

CALLS: list[str] = []


@dataclass(frozen=True, slots=True)
class Flawed(ZBuffer):
    """The rasteriser with its picture multiplied by ``gain``."""

    name: str = "flawed"
    gain: float = 1.0

    def render(self, scene: Scene, out: Path, quality: Quality) -> tuple[Render, ...]:
        CALLS.append(scene.id)
        (made,) = ZBuffer.render(self, scene, out, quality)
        write_exr(made.image, np.asarray(read_picture(made.image).pixels * self.gain))
        return (made,)


@pytest.fixture(autouse=True)
def _fresh(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr("notabug.calibrating.cache_root", lambda: tmp_path / "cache")
    CALLS.clear()


def test_a_fine_renderer_is_remembered_by_its_version() -> None:
    adapter, found = Flawed(), Found("1", "here")
    first = calibrate(adapter, found, Quality())
    assert first.fine
    assert not first.sentence
    assert first.reading["repeats"] is True
    drawn = len(CALLS)
    assert calibrate(adapter, found, Quality()) == replace(first, cached=True)
    assert len(CALLS) == drawn
    calibrate(adapter, Found("2", "here"), Quality())
    calibrate(adapter, Found("1", "here", key="other settings"), Quality())
    calibrate(adapter, found, Quality(), fresh=True)
    assert len(CALLS) == 4 * drawn


def test_a_flawed_one_is_told_what_to_change() -> None:
    found = calibrate(Flawed(gain=float(np.pi)), Found("1", "here"), Quality())
    assert not found.fine
    assert "a 1/pi is missing" in found.sentence


def test_the_command_prints_and_its_code_tells(capsys: pytest.CaptureFixture[str]) -> None:
    assert command(["zbuffer"], 0, 60.0, fresh=False, as_json=False) == 0
    assert "calibrated" in capsys.readouterr().out
    assert command(["zbuffer"], 0, 60.0, fresh=False, as_json=True) == 0
    (said,) = json.loads(capsys.readouterr().out)["calibration"]
    assert (said["renderer"], said["fine"], said["cached"]) == ("zbuffer", True, True)


def test_a_renderer_that_cannot_draw_the_card_draws_the_plain_one(monkeypatch: Any) -> None:
    bare = Flawed()
    few = bare.capabilities - {"texture", "uv"}
    monkeypatch.setattr(Flawed, "capabilities", property(lambda self: few))
    assert calibrate(bare, Found("1", "here"), Quality()).card.startswith("calibration/plain_card")
    monkeypatch.setattr(Flawed, "capabilities", property(lambda self: frozenset({"sphere"})))
    none = calibrate(bare, Found("3", "here"), Quality())
    assert not none.fine
    assert "none of the cards" in none.sentence
