"""The calibrate command: what it prints, what it remembers, what it refuses."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
import numpy.typing as npt
import pytest

from notabug.adapters.base import Adapter, Found, Quality, Render
from notabug.adapters.inhouse import InHouse
from notabug.adapters.zbuffer import ZBuffer
from notabug.commands.calibrate import Calibrated, calibrate, command
from notabug.metrics.calibration import Reading
from notabug.metrics.verdict import Finding, Verdict
from notabug.references.models.camera import pixel_shift
from notabug.references.models.model import models
from notabug.runs.calibration import as_judged
from notabug.runs.first_card import calibrate as calibrate_in_run
from notabug.runs.plan import Plan, Silent
from notabug.scenes_usd.picture import read_picture, write_exr
from notabug.scenes_usd.scene import Scene

CALLS: list[str] = []


Fault = Callable[[Scene], Scene]
Film = Callable[[npt.NDArray[np.float32]], npt.NDArray[np.float32]]


def unchanged(scene: Scene) -> Scene:
    return scene


def as_it_is(picture: npt.NDArray[np.float32]) -> npt.NDArray[np.float32]:
    return picture


@dataclass(frozen=True, slots=True)
class Flawed(ZBuffer):
    """The rasteriser with its picture multiplied by ``gain``, of a scene with a ``fault``, under a ``film``."""

    name: str = "flawed"
    gain: float = 1.0
    fault: Fault = unchanged
    film: Film = as_it_is

    def render(self, scene: Scene, out: Path, quality: Quality) -> tuple[Render, ...]:
        CALLS.append(scene.id)
        (made,) = ZBuffer.render(self, self.fault(scene), out, quality)
        write_exr(made.image, np.asarray(self.film(read_picture(made.image).pixels * self.gain)))
        return (made,)


def edited(name: str) -> Fault:
    """The edit of the fault of that name, where the scene can have it."""

    def edit(scene: Scene) -> Scene:
        return next((each.edit(scene) for each in models(scene) if each.name == name), scene)

    return edit


@dataclass(frozen=True, slots=True)
class HalfOff(InHouse):
    """The ray tracer with its rays beside the centres of pixels, through their corners where nothing else is said."""

    right: float = 0.5
    down: float = 0.5

    def render(self, scene: Scene, out: Path, quality: Quality) -> tuple[Render, ...]:
        moved = pixel_shift(scene.width, scene.height, self.right, self.down).edit(scene)
        return InHouse.render(self, moved, out, quality)


def dots(picture: npt.NDArray[np.float32]) -> npt.NDArray[np.float32]:
    return picture * (np.random.default_rng(1).random(picture.shape[:2]) > 0.5)[..., None]


PROMISED: dict[str, tuple[Adapter, str]] = {
    "upside down": (Flawed(film=lambda a: a[::-1]), "upside down"),
    "half a pixel": (HalfOff(), "shifted by (+0.50, +0.50)"),
    "v downwards": (Flawed(fault=edited("flipped_v")), "v of the texture runs downwards"),
    "u and v": (Flawed(fault=edited("swapped_uv")), "u and v of the texture"),
    "one colour": (Flawed(film=lambda a: np.full_like(a, 0.3)), "of one colour"),
    "not the card": (
        Flawed(film=lambda a: np.random.default_rng(0).random(a.shape).astype(np.float32)),
        "not one of the card",
    ),
}


@pytest.mark.parametrize("promise", PROMISED)
@pytest.mark.sweep_except("upside down", "half a pixel", "v downwards", "one colour")
def test_calibrate_and_run_refuse_for_the_same_cause(promise: str, tmp_path: Path) -> None:
    adapter, says = PROMISED[promise]
    found, quality = Found("1", "here"), Quality(samples=1)
    asked = calibrate(adapter, found, quality)
    assert not asked.fine
    assert says in asked.sentence
    plan = Plan((), {"flawed": (adapter, found)}, tmp_path / "out", quality)
    refused = calibrate_in_run(plan, Silent(), "flawed").refused
    assert says in refused
    if promise == "v downwards":
        assert "upside down" not in refused


@pytest.mark.parametrize(("right", "down"), [(0.5, 0.5), (-0.5, 0.0), (0.0, 0.5)])
@pytest.mark.sweep_except("0.5-0.5")
def test_the_numbers_of_a_refused_card_are_those_of_its_sentence(right: float, down: float) -> None:
    """With one sample a pixel the card's edges do not tell the shift, and the judge's predictions do."""
    asked = calibrate(HalfOff(right=right, down=down), Found("1", "here"), Quality(samples=1))
    assert not asked.fine
    assert f"({right:+.2f}, {down:+.2f})" in asked.sentence
    assert asked.reading["shift"] == pytest.approx([right, down], abs=0.06)


@pytest.mark.parametrize("light", ["distant_light", "point_light"])
@pytest.mark.parametrize(("right", "down"), [(0.5, 0.5), (-0.5, 0.0), (0.5, -0.5)])
@pytest.mark.sweep_except("0.5-0.5-distant_light", "0.5-0.5-point_light")
def test_a_shift_of_the_card_without_a_texture_is_seen(right: float, down: float, light: str) -> None:
    """Its squares are flat, so that what is wrong lies in lines of one pixel, between those of the lattice."""
    other = {"distant_light", "point_light"} - {light}
    few = InHouse().capabilities - {"texture", "uv"} - other
    asked = calibrate(HalfOff(right=right, down=down, capabilities=few), Found("1", "here"), Quality(samples=1))
    assert asked.card.startswith("calibration/plain_card")
    assert light.removesuffix("_light") in asked.card
    assert not asked.fine
    assert f"({right:+.2f}, {down:+.2f})" in asked.sentence


@pytest.mark.parametrize(
    ("name", "kind", "causes", "shift", "gain"),
    [
        ("pixel_shift", "bug", (), (0.25, -0.5), 1.0),
        ("light_gain", "bug", (), (0.0, 0.0), 1.02),
        ("light_gain", "limitation", (), (0.0, 0.0), 1.0),  # which accuses nobody
        ("pixel_shift", "bug", ("pixel_shift",), (0.25, -0.5), 1.0),  # what both find, the judge tells more exactly
        ("pixel_shift", "bug", ("upside_down",), (0.0, 0.0), 1.0),  # what was read accuses
        ("field_of_view", "bug", (), (0.0, 0.0), 1.0),
    ],
)
def test_the_judge_s_numbers_are_told_where_its_finding_accuses(
    name: str, kind: Literal["limitation", "bug"], causes: tuple[str, ...], shift: tuple[float, float], gain: float
) -> None:
    found = Finding(kind, name, 1.0, (0, 0, 1, 1))
    verdict = Verdict("bug", findings=(found,), numbers={"shift_x": 0.25, "shift_y": -0.5, "gain": 1.02})
    told = as_judged(Reading(causes=causes), verdict)
    assert (told.shift, told.gain) == (shift, gain)


def test_acne_on_the_card_is_a_bug_and_no_blur(tmp_path: Path) -> None:
    """Nothing stands between the renderer and the card, so it is judged; but there is no tick."""
    adapter, found = Flawed(film=dots), Found("1", "here")
    asked = calibrate(adapter, found, Quality())
    assert asked.fine
    assert "the card shows a bug" in asked.sentence
    assert "blurred" not in asked.sentence
    assert calibrate_in_run(Plan((), {"flawed": (adapter, found)}, tmp_path / "out"), Silent(), "flawed").refused == ""


@pytest.fixture(autouse=True)
def _fresh(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr("notabug.commands.calibrate.cache_root", lambda: tmp_path / "cache")
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


@pytest.mark.parametrize(
    ("fine", "verdict", "code"),
    [(True, "pass", 0), (True, "limitation", 0), (True, "bug", 1), (False, "bug", 3), (False, "error", 3)],
)
def test_a_bug_on_the_card_ends_in_the_code_of_a_bug(
    monkeypatch: pytest.MonkeyPatch, fine: bool, verdict: str, code: int
) -> None:
    """Whether or not anything stands between the renderer and its card."""
    made = Calibrated("zbuffer", "1", fine, "" if code == 0 else "why", "the card", verdict)
    monkeypatch.setattr("notabug.commands.calibrate.calibrate", lambda *_, **__: made)
    assert command(["zbuffer"], 0, 60.0, fresh=False, as_json=True) == code


def test_a_renderer_that_cannot_draw_the_card_draws_the_plain_one(monkeypatch: Any) -> None:
    bare = Flawed()
    few = bare.capabilities - {"texture", "uv"}
    monkeypatch.setattr(Flawed, "capabilities", property(lambda self: few))
    assert calibrate(bare, Found("1", "here"), Quality()).card.startswith("calibration/plain_card")
    monkeypatch.setattr(Flawed, "capabilities", property(lambda self: frozenset({"sphere"})))
    none = calibrate(bare, Found("3", "here"), Quality())
    assert not none.fine
    assert "none of the cards" in none.sentence
