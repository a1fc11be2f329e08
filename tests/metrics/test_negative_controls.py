"""Pictures that anybody would reject: none passes, and the message says why; beside them, pictures that must pass."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from notabug.adapters.base import Quality
from notabug.adapters.inhouse import InHouse
from notabug.cli import main
from notabug.exit_codes import ExitCode
from notabug.metrics.causes import encoded
from notabug.runs.judge_files import judge_pictures
from notabug.scenes_usd.picture import PictureError, write_exr
from notabug.scenes_usd.reader import read_scene
from notabug.scenes_usd.scene import Scene
from notabug.scenes_usd.writer import write_scene

Floats = npt.NDArray[np.floating]

SCENES = ("terminator/sphere", "texture/uneven_quad")
OTHER = {"terminator/sphere": "texture/uneven_quad", "texture/uneven_quad": "terminator/sphere"}
LIMITATION = {"terminator/sphere": ["facet_self_shadow"], "texture/uneven_quad": []}
CENTRES = Quality(samples=1)
SIDE = 96  # pixels: a seventh of the area of the corpus's own pictures, and the same to be seen in it
ROW = (np.arange(SIDE) == 9)[:, None, None]


def _poisoned(picture: Floats, where: Any) -> Floats:
    picture = picture.copy()
    picture[where] = np.nan
    return picture


def _moved(picture: Floats, right: int, down: int) -> Floats:
    """``picture`` moved by whole pixels; what comes in repeats the border."""
    h, w = picture.shape[:2]
    padded = np.pad(picture, ((1, 1), (1, 1), (0, 0)), mode="edge")
    return padded[1 - down : 1 - down + h, 1 - right : 1 - right + w]


# name -> (change of a right picture, name of the finding, words of the message, {0} for the number of pixels)
TAMPERED: dict[str, tuple[Callable[[Floats], Floats], str, str]] = {
    "all_nan": (lambda p: np.full_like(p, np.nan), "non_finite", "{0} of {0} pixels are NaN"),
    "one_nan": (lambda p: _poisoned(p, (17, 40, 1)), "non_finite", "1 of {0} pixels are NaN or infinite"),
    "one_infinite": (lambda p: np.where(ROW, np.inf, p), "non_finite", "infinite"),
    "negative": (lambda p: np.where(ROW, -0.1, p), "negative", "negative"),
    "black": (np.zeros_like, "black", "black"),
    "upside_down": (lambda p: p[::-1], "upside_down", "upside down"),
    "mirrored": (lambda p: p[:, ::-1], "mirrored", "mirrored"),
    "rotated": (lambda p: p[::-1, ::-1], "rotated", "180 degrees"),
    "shift_right": (lambda p: _moved(p, 1, 0), "pixel_shift", "shifted by (+1.00, +0.00)"),
    "shift_left": (lambda p: _moved(p, -1, 0), "pixel_shift", "shifted by (-1.00, +0.00)"),
    "shift_down": (lambda p: _moved(p, 0, 1), "pixel_shift", "shifted by (+0.00, +1.00)"),
    "shift_up": (lambda p: _moved(p, 0, -1), "pixel_shift", "shifted by (+0.00, -1.00)"),
    "half_size": (lambda p: p[::2, ::2], "wrong_size", "scaled by 0.5"),
}  # fmt: skip


@pytest.fixture(scope="module", params=SCENES)
def name(request: pytest.FixtureRequest) -> str:
    """The corpus's scene that is judged."""
    return str(request.param)


@pytest.fixture(scope="module")
def scene(name: str, studio: Any, tmp_path_factory: pytest.TempPathFactory) -> Scene:
    """The same scene, small, in a file of its own, for the command line."""
    small = replace(studio.scene(name), width=SIDE, height=SIDE)
    return read_scene(str(write_scene(small, tmp_path_factory.mktemp("small") / "scene.usda")))


@pytest.fixture(scope="module")
def drawn(scene: Any, studio: Any) -> Floats:
    """A right picture: with its limitation, at pixel centres."""
    return studio.draw(InHouse(), scene, CENTRES)[0]


def _word(scene: Scene) -> str:
    """What the command line calls the scene: its id in the corpus, or its file."""
    return scene.id if "/" in scene.id else str(scene.path)


@pytest.fixture
def judge_file(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Callable[..., Any]:
    """``notabug judge --json``: (exit code, the result or None, standard error)."""

    def run(path: Path, scene: Any, *words: str) -> tuple[int, Any, str]:
        options = ["--filter", "point", "--precision", "float64", "--json", *words]
        monkeypatch.setattr(sys, "argv", ["notabug", "judge", str(path), "--scene", _word(scene), *options])
        with pytest.raises(SystemExit) as stop:
            main()
        out, err = capsys.readouterr()
        return int(stop.value.code or 0), json.loads(out)["results"][0] if out else None, err

    return run


@pytest.mark.parametrize("filter_name", ["point", "box"])
def test_the_reference_itself_passes(studio: Any, scene: Any, filter_name: str) -> None:
    envelope, declaration = studio.predicted(scene), getattr(studio, filter_name)
    verdict = studio.verdict([envelope.point if filter_name == "point" else envelope.mean], scene, declaration)
    assert (verdict.word, verdict.findings, verdict.triggers) == ("pass", (), ())


def test_a_right_picture_shows_its_limitation(studio: Any, name: str, scene: Any, drawn: Floats) -> None:
    verdict = studio.verdict([drawn], scene, studio.point)
    assert [each.name for each in verdict.findings] == LIMITATION[name]
    assert verdict.word == ("limitation" if verdict.findings else "pass")


def test_a_right_picture_on_the_command_line(
    name: str, scene: Any, drawn: Floats, tmp_path: Path, judge_file: Callable[..., Any]
) -> None:
    write_exr(tmp_path / "right.exr", drawn)
    code, result, _ = judge_file(tmp_path / "right.exr", scene)
    assert code == ExitCode.OK
    assert [each["name"] for each in result["findings"]] == LIMITATION[name]


@pytest.mark.parametrize("diagonal", ["02", "13"])
def test_a_file_of_unknown_making_may_cut_its_quads(
    studio: Any, diagonal: str, tmp_path: Path, judge_file: Callable[..., Any]
) -> None:
    scene = studio.scene("texture/uneven_quad")
    write_exr(tmp_path / "cut.exr", studio.predicted(scene, f"quad_split_{diagonal}").point)
    code, result, _ = judge_file(tmp_path / "cut.exr", scene)
    assert (code, result["verdict"]) == (ExitCode.OK, "limitation")
    assert [each["name"] for each in result["findings"]] == [f"quad_split_{diagonal}"]


@pytest.mark.parametrize("tampering", TAMPERED)
@pytest.mark.sweep_except(
    "terminator/sphere-negative",
    "texture/uneven_quad-all_nan",
    "texture/uneven_quad-one_nan",
    "texture/uneven_quad-one_infinite",
    "texture/uneven_quad-black",
    "texture/uneven_quad-upside_down",
    "texture/uneven_quad-mirrored",
    "texture/uneven_quad-rotated",
    "texture/uneven_quad-shift_right",
    "texture/uneven_quad-shift_left",
    "texture/uneven_quad-shift_down",
    "texture/uneven_quad-shift_up",
    "texture/uneven_quad-half_size",
)
def test_a_tampered_picture_is_a_bug(
    scene: Any, drawn: Floats, tampering: str, tmp_path: Path, judge_file: Callable[..., Any]
) -> None:
    change, finding, words = TAMPERED[tampering]
    write_exr(tmp_path / "tampered.exr", change(drawn))
    code, result, _ = judge_file(tmp_path / "tampered.exr", scene)
    assert (code, result["verdict"], result["findings"][0]["name"]) == (ExitCode.BUG, "bug", finding)
    assert words.format(drawn[..., 0].size) in result["message"]


@pytest.mark.parametrize(
    "tampering", ["one_nan", "black", "upside_down", "mirrored", "shift_right", "shift_up", "half_size"]
)
@pytest.mark.sweep_except(
    "terminator/sphere-one_nan",
    "terminator/sphere-upside_down",
    "terminator/sphere-shift_up",
    "texture/uneven_quad-black",
    "texture/uneven_quad-mirrored",
    "texture/uneven_quad-shift_right",
    "texture/uneven_quad-half_size",
)
def test_an_unknown_filter_excuses_none_of_it(
    studio: Any, name: str, scene: Any, drawn: Floats, tampering: str, tmp_path: Path, judge_file: Callable[..., Any]
) -> None:
    """Without options the filter may be anything up to two pixels wide, and a shift of a small texture stays open."""
    change, _, words = TAMPERED[tampering]
    if name == "texture/uneven_quad":
        scene = studio.scene(name)
        drawn = studio.draw(InHouse(), scene, CENTRES)[0]
    write_exr(tmp_path / "tampered.exr", change(drawn))
    code, result, _ = judge_file(tmp_path / "tampered.exr", scene, "--filter", "unknown", "--precision", "float32")
    assert (code, result["verdict"]) == (ExitCode.BUG, "bug")
    assert words.format(drawn[..., 0].size) in result["message"]


def test_a_nan_in_one_seed_of_four(studio: Any, scene: Any, drawn: Floats) -> None:
    verdict = studio.verdict([drawn, drawn, _poisoned(drawn, (3, 4, 0)), drawn], scene, studio.point)
    assert verdict.word == "bug"
    assert "the first at (4, 3)" in verdict.message


@pytest.mark.sweep_except("texture/uneven_quad")
def test_the_picture_of_another_scene(studio: Any, name: str, tmp_path: Path, judge_file: Callable[..., Any]) -> None:
    """In the size of the stored references, which it is held against."""
    other = studio.draw(InHouse(), studio.scene(OTHER[name]), CENTRES)[0]
    write_exr(tmp_path / "other.exr", other)
    code, result, _ = judge_file(tmp_path / "other.exr", studio.scene(name))
    assert (code, result["verdict"], result["findings"][0]["name"]) == (ExitCode.BUG, "bug", "wrong_scene")
    assert result["message"] == f"this is a picture of {OTHER[name]}"


def test_an_srgb_png_declared_linear(
    studio: Any, name: str, scene: Any, drawn: Floats, tmp_path: Path, judge_file: Callable[..., Any]
) -> None:
    _write_png(tmp_path / "display.png", encoded(drawn))
    code, result, _ = judge_file(tmp_path / "display.png", scene)
    assert (code, result["verdict"], result["findings"][0]["name"]) == (ExitCode.BUG, "bug", "srgb_encoded")
    assert "sRGB" in result["message"]
    assert "--encoding srgb" in result["message"]
    code, result, _ = judge_file(tmp_path / "display.png", scene, "--encoding", "srgb")
    assert code == ExitCode.OK, result["message"]
    assert [each["name"] for each in result["findings"]] == LIMITATION[name]


def _write_png(path: Path, pixels: Floats) -> None:
    import OpenImageIO

    data = np.ascontiguousarray(np.round(np.clip(pixels, 0, 1) * 255).astype(np.uint8))
    target = OpenImageIO.ImageOutput.create(str(path))
    assert target.open(str(path), OpenImageIO.ImageSpec(data.shape[1], data.shape[0], 3, OpenImageIO.UINT8))
    assert target.write_image(data)
    assert target.close()


def _truncated(path: Path, picture: Floats) -> None:
    write_exr(path, picture)
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])


def _headless(path: Path, picture: Floats) -> None:
    write_exr(path, picture)
    path.write_bytes(path.read_bytes()[:40])


UNREADABLE: dict[str, tuple[Callable[[Path, Floats], Any], str]] = {
    "truncated": (_truncated, "truncated"),
    "headless": (_headless, "not a picture"),
    "text": (lambda path, _: path.write_text("P6 was a good format\n" * 50), "not a picture"),
    "empty": (lambda path, _: path.touch(), "empty"),
    "missing": (lambda path, _: None, "no such file"),
    "folder": (lambda path, _: path.mkdir(), "no such file"),
}


@pytest.mark.parametrize("damage", UNREADABLE)
def test_an_unreadable_file_is_an_error_that_names_it(
    studio: Any, scene: Any, drawn: Floats, damage: str, tmp_path: Path, judge_file: Callable[..., Any]
) -> None:
    make, words = UNREADABLE[damage]
    path = tmp_path / "picture.exr"
    make(path, drawn)
    with pytest.raises(PictureError, match=words):
        judge_pictures([path], scene, studio.point, None)
    code, result, err = judge_file(path, scene)
    assert (code, result) == (ExitCode.USAGE, None)
    assert words in err
    assert str(path) in err
    assert len(err.strip().splitlines()) == 1
