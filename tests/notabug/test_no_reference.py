"""A reference that is not finite is an error of every command, exit 4, never a verdict; and no warning is heard."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from notabug.exit_codes import ExitCode
from notabug.metrics.verdict import Verdict
from notabug.results.gate import NO_REFERENCE, code_of
from notabug.results.record import Result
from notabug.scenes_usd.picture import write_exr
from notabug.scenes_usd.scene import Camera, Card, Light, Material, Mesh, Scene
from notabug.scenes_usd.writer import write_scene

SIZE = 32
TOO_BRIGHT = 1e29  # squares of what it lights are beyond float32, so the variance in a pixel is infinite
POINTS = np.array([(-1.0, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0), (0, 0.5, 0.2), (0.5, 0.5, 0.2)])
FACES = {
    "sound": [[0, 1, 2, 3]],
    "pinched": [[0, 0, 1, 2], [1, 2, 2, 3]],
    "needles": [[0, 1, 2, 3], [4, 4, 5], [4, 5, 4, 5], [0, 1, 0]],
    "bent": [[0, 1, 4, 3], [1, 2, 3, 5]],
    "crossed": [[0, 2, 1, 3]],
}


def scene_of(faces: list[list[int]], intensity: float = 30.0) -> Scene:
    corners = np.array([corner for face in faces for corner in face], np.int32)
    counts = np.array([len(face) for face in faces], np.int32)
    place = np.eye(4)
    place[3, 2] = 4.0
    up = np.tile((0.0, 0.0, 1.0), (len(corners), 1))
    return Scene(
        "x", Path("x.usda"), {}, Card("terminator", "Faces."), Camera("/Scene/Camera", place, 0.4, 0.4, 0.1, 100.0),
        SIZE, SIZE, (Mesh("/Scene/Mesh", POINTS, counts, corners, 0, up),),
        (Light("/Scene/Light", "point", (intensity,) * 3, (1.0, 2.0, 3.0)),), (Material("/Scene/Looks/M", (0.5,) * 3),),
    )  # fmt: skip


@pytest.fixture
def scenes(tmp_path: Path) -> dict[str, Path]:
    """Files of each of FACES, of one whose reference is infinite, ``wrong``, and of two pictures."""
    found = {name: write_scene(scene_of(faces), tmp_path / f"{name}.usda") for name, faces in FACES.items()}
    found["wrong"] = write_scene(scene_of(FACES["sound"], TOO_BRIGHT), tmp_path / "wrong.usda")
    noise = np.random.default_rng(0).random((SIZE, SIZE, 3)).astype(np.float32)
    for name, pixels in (("black", np.zeros_like(noise)), ("noise", noise)):
        found[f"{name}.exr"] = tmp_path / f"{name}.exr"
        write_exr(found[f"{name}.exr"], pixels)
    return found


def notabug(*words: object, at: Path) -> subprocess.CompletedProcess[str]:
    """The command, with every warning of Python an error."""
    command = [sys.executable, "-W", "error", "-W", "ignore::DeprecationWarning", "-m", "notabug", *map(str, words)]
    environment = {**os.environ, "NO_COLOR": "1", "COLUMNS": "400"}
    return subprocess.run(command, capture_output=True, text=True, cwd=at, env=environment, check=False, timeout=600)


@pytest.mark.parametrize("picture", ["black", "noise"])
@pytest.mark.sweep_except("black")
def test_judge_and_why_refuse(picture: str, scenes: dict[str, Path], tmp_path: Path) -> None:
    for words in (["judge"], ["why", "--pixel", "3,4"]):
        done = notabug(words[0], scenes[f"{picture}.exr"], "--scene", scenes["wrong"], *words[1:], at=tmp_path)
        assert done.returncode == ExitCode.REFERENCE, done.stderr
        assert "the reference is not finite" in done.stderr
        assert "pixels, the first at (" in done.stderr
        assert "pass" not in done.stdout


def test_run_says_error_for_that_scene_and_goes_on(scenes: dict[str, Path], tmp_path: Path) -> None:
    done = notabug("run", scenes["wrong"], scenes["sound"], "-r", "inhouse", "--json", at=tmp_path)
    results = {each["scene"]: each for each in json.loads(done.stdout)["results"]}
    assert results["sound"]["verdict"] in ("pass", "limitation"), done.stderr
    assert results["wrong"]["verdict"] == "error"
    assert results["wrong"]["triggers"] == [NO_REFERENCE]
    assert "the reference is not finite" in results["wrong"]["message"]
    assert done.returncode == ExitCode.REFERENCE


@pytest.mark.parametrize("picture", ["black", "noise"])
@pytest.mark.parametrize("faces", FACES)
@pytest.mark.sweep_except("sound-black", "pinched-noise", "needles-noise", "bent-black", "crossed-noise")
def test_black_and_noise_are_bugs_and_no_warning_is_heard(
    faces: str, picture: str, scenes: dict[str, Path], tmp_path: Path
) -> None:
    done = notabug("judge", scenes[f"{picture}.exr"], "--scene", scenes[faces], at=tmp_path)
    assert done.returncode == ExitCode.BUG, done.stdout + done.stderr
    assert "Warning" not in done.stderr


def test_which_code_wins() -> None:
    def result(word: Any, *triggers: str) -> Result:
        return Result("s", "", "r", "1", Verdict(word, triggers=triggers), fails=True)

    missing, broken, bug = result("error", NO_REFERENCE), result("error"), result("bug", "pixels")
    assert code_of([missing]) is ExitCode.REFERENCE
    assert code_of([missing, broken]) is ExitCode.RENDERER
    assert code_of([missing, broken, bug]) is ExitCode.BUG
    assert code_of([replace(missing, fails=False)]) is ExitCode.OK


def test_the_corpus_command(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    """build and verify name the scene and go on with the next."""
    from notabug.commands import references as corpus
    from notabug.references import store

    true = store.trace_envelope(scene_of(FACES["sound"]))
    asked = []

    def wrong(scene: Scene, *_: Any, **__: Any) -> Any:
        asked.append(scene.id)
        pixels = np.full((scene.height, scene.width, 3), np.nan)
        return replace(true, mean=pixels)

    monkeypatch.setattr(store, "trace_envelope", wrong)
    sources = ["calibration/plain_card", "calibration/card"]
    for deed in ("build", "verify"):
        asked.clear()
        assert corpus.command(deed, sources, []) is ExitCode.REFERENCE
        assert len(set(asked)) == 2
        assert capsys.readouterr().err.count("the reference is not finite") == len(asked)
