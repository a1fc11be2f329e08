"""why: the pixel is checked before anything is computed; a run's picture knows its scene; the best come first."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from notabug.adapters.base import Quality
from notabug.adapters.registry import adapter
from notabug.commands.why import parse_pixel
from notabug.metrics.verdict import Finding, Verdict
from notabug.metrics.why import ENOUGH, explain_pixel
from notabug.references.predict import preview
from notabug.results.of_run import origin
from notabug.results.record import Result
from notabug.runs.folders import write_json
from notabug.scenes_usd.errors import SelectionError
from notabug.scenes_usd.picture import read_picture, write_exr
from notabug.scenes_usd.reader import read_scene
from notabug.scenes_usd.writer import write_scene

X, Y = 18, 8  # a bright pixel of the small scene


@pytest.mark.parametrize("text", ["", "1", "1,", ",1", "a,b", "-1,2", "1,2,3", "1.5,2", "256,0", "0,128"])
def test_what_is_no_pixel_of_the_picture(text: str) -> None:
    with pytest.raises(SelectionError, match="--pixel"):
        parse_pixel(text, 256, 128)


def test_the_last_pixel() -> None:
    assert parse_pixel("255, 127", 256, 128) == (255, 127)


def test_a_wrong_pixel_is_a_usage_error(door: Any) -> None:
    write_exr(door.out.parent / "a.exr", np.zeros((4, 4, 3)))
    assert door("why", "a.exr", "--scene", "terminator/sphere", "--pixel", "4,0") == 2
    assert "below 4,4" in door.stderr


@pytest.fixture
def run_of_a_scene(tmp_path: Path) -> Path:
    """A run of a small scene by the in-house renderer, as ``run`` leaves it, and a picture with one wrong pixel."""
    scene = replace(read_scene("terminator/sphere", {"tessellation": "8x4"}), width=24, height=24)
    source = write_scene(scene, tmp_path / "small.usda")
    picture = np.array(preview(read_scene(source)), np.float32)
    assert picture[Y, X].min() > 0.3
    picture[Y, X] *= 0.5
    out = tmp_path / "run"
    folder = out / "own" / "small" / "default" / "inhouse"
    (folder / "renders").mkdir(parents=True)
    write_exr(folder / "renders" / "seed0.exr", picture)
    worst = np.zeros((24, 24, 1), np.float32)
    worst[Y, X] = 1.0
    write_exr(folder / "bug_map.exr", worst)
    name = folder.relative_to(out).as_posix()
    result = Result(
        "small", "", "inhouse", "1", Verdict("bug"), image=f"{name}/renders/seed0.exr", seeds=1,
        images={"bug_map": f"{name}/bug_map.exr"}, command=f"notabug run {source} -r inhouse",
    )  # fmt: skip
    write_json(out / "run.json", {"schema": 1, "results": [result.as_dict()]})
    return folder / "renders" / "seed0.exr"


def test_a_picture_of_a_run_knows_its_scene_and_its_worst_pixel(run_of_a_scene: Path, desk: Any) -> None:
    known = origin(run_of_a_scene)
    assert known is not None
    assert known.worst_pixel() == (X, Y)
    assert known.declaration() == adapter("inhouse").declaration(Quality(samples=0, seeds=(0,)))
    assert desk.say("why", str(run_of_a_scene)) == 0
    text = desk.capture.readouterr().out
    assert text.startswith(f"pixel ({X}, {Y}): found")
    assert desk.say("why", str(run_of_a_scene), "--pixel", "3,4", "--json") == 0
    assert json.loads(desk.capture.readouterr().out)["x"] == 3


def test_a_picture_of_no_run_needs_a_scene(desk: Any) -> None:
    path = desk.write("alone.exr", desk.right)
    assert desk.say("why", str(path), "--pixel", "1,1") == 2
    assert "--scene" in desk.capture.readouterr().err


def test_the_best_explanations_come_first_and_few(run_of_a_scene: Path) -> None:
    """Fits before misfits, then by how far off; five and the reference are shown unless all are asked for."""
    known = origin(run_of_a_scene)
    assert known is not None
    scene = read_scene(known.source, *known.choice)
    explained = explain_pixel(read_picture(run_of_a_scene).pixels, scene, known.declaration(), X, Y)
    ranked = explained.ranked()
    assert len(ranked) > 5
    fits = [each.fits for each in ranked]
    assert fits == sorted(fits, reverse=True)
    brief, whole = explained.as_text(5), explained.as_text()
    assert brief.count("\n5. ") == 1
    assert "\n6. " not in brief
    assert f"\n{len(ranked)}. " in whole
    assert len(brief.splitlines()) < 60
    assert f"not shown of this scene's models: {len(ranked) - 5} that change this pixel" in brief
    assert brief.endswith("; --verbose shows them all")
    assert "not shown" not in whole


@pytest.mark.parametrize(
    ("alpha", "told"),
    [
        (1.0, "shows 100% of what this model changes"),
        (0.25, "shows 25% of what"),
        (68.62, "shows 68.6 times what"),
        (-0.5, "shows -0.5 times what"),
        (1.001, "shows 100% of what"),
    ],
)
def test_how_much_of_a_model_the_picture_shows(run_of_a_scene: Path, alpha: float, told: str) -> None:
    known = origin(run_of_a_scene)
    assert known is not None
    scene = read_scene(known.source, *known.choice)
    explained = explain_pixel(read_picture(run_of_a_scene).pixels, scene, known.declaration(), X, Y, closest=1)
    first = replace(explained.ranked()[0], alpha=alpha)
    shown = replace(explained, predictions=(explained.predictions[0], first)).as_text()
    assert f"  the picture {told}" in shown


@pytest.mark.parametrize("place", [(X, Y), (X - 3, Y), (2, 2)])
def test_what_fits_is_among_the_few_that_are_looked_at_closely(run_of_a_scene: Path, place: tuple[int, int]) -> None:
    known = origin(run_of_a_scene)
    assert known is not None
    scene = read_scene(known.source, *known.choice)
    pixels = read_picture(run_of_a_scene).pixels
    whole = explain_pixel(pixels, scene, known.declaration(), *place)
    few = explain_pixel(pixels, scene, known.declaration(), *place, closest=24)
    if whole.predictions[0].fits:  # nothing is wrong there, and nothing is looked for
        assert few.predictions == whole.predictions[:1]
        return
    best = {each.name for each in whole.ranked() if each.fits}
    assert min(len(best), ENOUGH) <= len({each.name for each in few.ranked() if each.fits} & best)
    told = [each.name for each in few.predictions[1:]]
    assert sorted([*told, *few.others, *few.idle]) == sorted(each.name for each in whole.predictions[1:])


def test_of_many_that_fit_the_verdict_on_the_whole_picture_chooses(run_of_a_scene: Path, desk: Any) -> None:
    """One black pixel is explained by a missing object, light or face alike: what the judge found is told first."""
    known = origin(run_of_a_scene)
    assert known is not None
    scene = read_scene(known.source, *known.choice)
    pixels = np.array(read_picture(run_of_a_scene).pixels)
    pixels[Y, X] = 0.0
    whole = explain_pixel(pixels, scene, known.declaration(), X, Y)
    fitting = list(dict.fromkeys(each.name for each in whole.ranked() if each.fits))
    assert len(fitting) > ENOUGH

    def said(name: str) -> Verdict:
        claim = next(each.claim for each in whole.ranked() if each.name == name)
        return Verdict("bug", (Finding("bug", name, 1.0, (X, Y, X + 1, Y + 1), message=claim),))

    for name in (fitting[1], fitting[len(fitting) // 2], fitting[-1]):
        few = explain_pixel(pixels, scene, known.declaration(), X, Y, closest=24, verdict=said(name))
        assert few.ranked()[0].name == name
        assert few.as_text(5).count("so says the verdict on the whole picture") >= 1
    misfit = next(each.name for each in whole.ranked() if not each.fits)
    assert explain_pixel(pixels, scene, known.declaration(), X, Y, verdict=said(misfit)).ranked()[0].fits
    result = replace(known.result, verdict=said(fitting[-1]))
    write_json(known.out / "run.json", {"schema": 1, "results": [result.as_dict()]})
    write_exr(run_of_a_scene, pixels)
    assert desk.say("why", str(run_of_a_scene)) == 0
    assert f"\n1. {fitting[-1]}" in desk.capture.readouterr().out


def test_a_right_pixel_is_called_right(desk: Any) -> None:
    path = desk.write("right.exr", desk.right)
    assert desk.say("why", str(path), "--scene", str(desk.source), "--pixel", "20,18", "--filter", "box") == 0
    assert "nothing is wrong with this pixel" in desk.capture.readouterr().out
