"""Which picture of a scene is meant: --camera, --time, --purpose and --variant, wherever a scene is named."""

from __future__ import annotations

import json
import shlex
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from notabug.commands.accept import command as accept
from notabug.metrics.verdict import Finding, Verdict
from notabug.references.predict import preview
from notabug.report.next_steps import accept_command
from notabug.results.of_run import found
from notabug.results.record import Result
from notabug.scenes_usd.errors import SelectionError
from notabug.scenes_usd.picture import write_exr
from notabug.scenes_usd.reader import read_scene
from notabug.scenes_usd.scene import Scene, Sphere
from notabug.scenes_usd.view import View, as_text, from_text, options_for, read_variant_word

SIDE = 24
SHOT = """#usda 1.0
(
    defaultPrim = "Scene"
    startTimeCode = 1
    endTimeCode = 24
)
def Xform "Scene" (
    variants = { string light = "day" }
    prepend variantSets = "light"
)
{
    def Camera "Front"
    {
        float2 clippingRange = (0.1, 100)
        float horizontalAperture = 20
        float verticalAperture = 20
        float focalLength = 40
        double3 xformOp:translate = (0, 0, 8)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
    def Camera "Side"
    {
        float2 clippingRange = (0.1, 100)
        float horizontalAperture = 20
        float verticalAperture = 20
        float focalLength = 40
        double3 xformOp:translate = (0.5, 0, 9)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
    def Xform "Car" (
        variants = { string paint = "red" }
        prepend variantSets = "paint"
    )
    {
        variantSet "paint" = {
            "red" {
                over "Ball"
                {
                    color3f[] primvars:displayColor = [(0.8, 0.1, 0.1)]
                }
            }
            "blue" {
                over "Ball"
                {
                    color3f[] primvars:displayColor = [(0.1, 0.1, 0.8)]
                }
            }
        }
        def Sphere "Ball"
        {
            double radius = 1
            double3 xformOp:translate.timeSamples = { 1: (0, 0, 0), 24: (1, 0, 0) }
            uniform token[] xformOpOrder = ["xformOp:translate"]
        }
        def Sphere "Rough"
        {
            uniform token purpose = "proxy"
        }
    }
    variantSet "light" = {
        "day" {
            over "Light"
            {
                float inputs:intensity = 60
            }
        }
        "dusk" {
            over "Light"
            {
                float inputs:intensity = 10
            }
        }
    }
    def SphereLight "Light"
    {
        bool inputs:normalize = 1
        bool treatAsPoint = 1
        double3 xformOp:translate = (3, 4, 5)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
}
def Scope "Render"
{
    def RenderSettings "Settings"
    {
        rel camera = </Scene/Front>
        uniform int2 resolution = (24, 24)
    }
}
"""
FRAME = ("--time", "1")


@pytest.fixture
def shot(tmp_path: Path) -> Path:
    path = tmp_path / "shot.usda"
    path.write_text(SHOT, "utf-8")
    return path


def blue(scene: Scene) -> bool:
    return scene.materials[scene.objects[0].material].diffuse == pytest.approx((0.1, 0.1, 0.8))


def test_a_choice_is_written_down_and_read_again() -> None:
    variants = {"light": "dusk", "/Scene/Car{paint}": "blue"}
    view = View("/Scene/Side", 12.5, frozenset({"default", "proxy", "guide"}))
    text = as_text(variants, view)
    assert from_text(text) == (variants, view)
    words = list(options_for(text))
    assert words[:4] == ["--variant", "/Scene/Car{paint=blue}", "--variant", "light=dusk"]
    assert words[4:] == ["--camera", "/Scene/Side", "--time", "12.5", "--purpose", "proxy", "--purpose", "guide"]
    assert from_text("") == ({}, View())


@pytest.mark.parametrize(
    "word", ["light", "light=", "=day", "/Scene/Car{paint}", "/Scene/Car{paint=}", "/A=b", "a{b=c}"]
)
def test_what_is_no_variant(word: str) -> None:
    with pytest.raises(SelectionError, match="SET=NAME"):
        read_variant_word(word)


@pytest.mark.parametrize("text", ["--time=soon", "--purpose=toast", "--time=nan"])
def test_a_record_that_says_nonsense_is_refused(text: str) -> None:
    with pytest.raises(SelectionError):
        from_text(text)


def test_each_option_reads_another_picture(shot: Path) -> None:
    base = read_scene(shot, {}, View(time=1.0))
    assert base.camera.path == "/Scene/Front"
    assert read_scene(shot, {}, View("/Scene/Side", 1.0)).camera.path == "/Scene/Side"
    moved = read_scene(shot, {}, View(time=24.0)).objects[0]
    assert isinstance(moved, Sphere)
    assert moved.to_world[3, 0] == 1.0
    both = read_scene(shot, {}, View(time=1.0, purposes=frozenset({"default", "proxy"})))
    assert [each.path for each in both.objects] == ["/Scene/Car/Ball", "/Scene/Car/Rough"]
    assert not blue(base)
    assert blue(read_scene(shot, {"/Scene/Car{paint}": "blue"}, View(time=1.0)))
    dusk = read_scene(shot, {"light": "dusk"}, View(time=1.0))
    assert dusk.lights[0].intensity[0] < base.lights[0].intensity[0]


WRONG = (
    (("--camera", "/Scene/Top"), "/Scene/Front, /Scene/Side"),
    (("--camera", "not a path"), "/Scene/Front, /Scene/Side"),
    (("--time", "30"), "1 to 24"),
    (("--time", "inf"), "a number"),
    (("--purpose", "toast"), "default, render, proxy, guide"),
    (("--variant", "light=noon"), "day, dusk"),
    (("--variant", "sky=blue"), "light=day|dusk, /Scene/Car{paint=blue|red}"),
    (("--variant", "/Scene/Car{paint=green}"), "blue, red"),
    (("--variant", "/Scene/Car{wheels=big}"), "/Scene/Car{paint=blue|red}"),
    (("--variant", "/Scene/Bus{paint=red}"), "/Scene/Car{paint=blue|red}"),
    (("--variant", "/Scene/Car{paint}"), "/Prim{SET=NAME}"),
)


COMMANDS = ("run", "judge", "check", "adapt", "why", "reduce", "export")
CASES = [("run", words) for words, _ in WRONG] + [
    (command, WRONG[at][0]) for command in COMMANDS[1:] for at in (0, 2, 7)
]


@pytest.mark.parametrize(("command", "words"), CASES, ids=lambda part: "".join(part))
def test_a_wrong_value_is_one_error_that_lists_what_there_is(
    command: str, words: tuple[str, ...], door: Any, shot: Path
) -> None:
    picture = door.out.parent / "picture.exr"
    write_exr(picture, np.zeros((SIDE, SIDE, 3)))
    of_scene = ["--scene", str(shot)]
    asked = {
        "run": ["run", str(shot)],
        "judge": ["judge", str(picture), *of_scene],
        "check": ["check", str(shot)],
        "adapt": ["adapt", str(shot), "--out", str(shot.with_name("own.usda"))],
        "why": ["why", str(picture), *of_scene, "--pixel", "1,1"],
        "reduce": ["reduce", str(shot), "-r", "grey"],
        "export": ["export", str(shot), "--to", "json", "--out", str(door.out)],
    }[command]
    frame = () if words[0] == "--time" else FRAME
    assert door(*asked, *words, *frame) == 2
    assert dict(WRONG)[words] in " ".join(door.stderr.split())
    assert door.stderr.count("notabug: ") == 1
    assert not door.grey.drawn


PICTURES = (
    FRAME,
    ("--camera", "/Scene/Side", *FRAME),
    ("--variant", "/Scene/Car{paint=blue}", "--purpose", "proxy", "--time", "24"),
)


def test_each_picture_has_its_own_results_and_is_kept(door: Any, shot: Path) -> None:
    folders = set()
    for words in PICTURES:
        door.grey.drawn.clear()
        assert door.run(str(shot), *words) == 0, door.stderr
        assert [name for name in door.grey.drawn if name.startswith("shot")]
        document = json.loads((door.out / "run.json").read_text("utf-8"))
        (result,) = document["results"]
        known = found(door.out / result["image"])
        expected = read_scene(known.source, *known.choice)
        assert expected.view.time is not None
        assert expected.variant == result["variant"]
        folders.add(Path(result["image"]).parents[1])
        said = shlex.split(result["command"])
        assert set(words) <= set(said), "the command that makes it again"
        door.grey.drawn.clear()
        aside = said.index("--out")  # the command draws beside the run, not over it
        assert door("run", "--out", str(door.out), *said[2:aside], *said[aside + 2 :]) == 0
        assert [name for name in door.grey.drawn if name.startswith("shot")] == []
    assert len(folders) == len(PICTURES)


def test_all_variants_of_another_prim(door: Any, shot: Path) -> None:
    assert door.run(str(shot), *FRAME, "--variant", "/Scene/Car{paint=all}") == 0
    drawn = [name for name in door.grey.drawn if name.startswith("shot")]
    assert drawn == [f"shot /Scene/Car{{paint={name}}},light=day,--time=1" for name in ("blue", "red")]


def test_a_scene_of_the_corpus_takes_a_view_too(door: Any) -> None:
    assert door.run("terminator/sphere", "--camera", "/Scene/Camera") == 0
    assert "terminator/sphere tessellation=24x12,--camera=/Scene/Camera" in door.grey.drawn
    assert door.run("terminator/sphere", "--camera", "/Scene/Other") == 2
    assert "/Scene/Camera" in door.stderr


def test_a_judged_picture_is_held_against_the_view(shot: Path, desk: Any, tmp_path: Path) -> None:
    """The picture of one camera is a pass under that camera only, and why reads the same scene again."""
    view = View("/Scene/Side", 24.0)
    picture = tmp_path / "side.exr"
    write_exr(picture, preview(read_scene(shot, {"/Scene/Car{paint}": "blue"}, view)))
    words = ["--variant", "/Scene/Car{paint=blue}", "--time", "24", "--filter", "point"]
    out = tmp_path / "judged"
    asked = ["judge", str(picture), "--scene", str(shot), *words]
    assert desk.say(*asked, "--camera", "/Scene/Side", "--out", str(out)) == 0, desk.stdout
    assert desk.say(*asked, "--camera", "/Scene/Front") == 1
    result = json.loads((out / "run.json").read_text("utf-8"))["results"][0]
    known = found(out / result["image"])
    assert read_scene(known.source, *known.choice).camera.path == "/Scene/Side"
    assert desk.say("why", str(out / result["image"]), "--pixel", "12,12", "--json") == 0


def test_accept_names_one_picture_of_several(shot: Path, door: Any, tmp_path: Path) -> None:
    door.patch.delenv("CI", raising=False)
    door.judge.verdicts["shot"] = Verdict("bug", (Finding("bug", "shadow_missing", 9.0, (0, 0, 9, 9)),))
    folders = []
    for camera in ("/Scene/Front", "/Scene/Side"):
        folders.append(tmp_path / camera.rpartition("/")[2])
        assert door("run", str(shot), *FRAME, "--camera", camera, "--out", str(folders[-1])) == 1
    assert door("merge", *map(str, folders), "--out", str(door.out)) == 1, door.stderr
    results = [Result.from_dict(each) for each in json.loads((door.out / "run.json").read_text("utf-8"))["results"]]
    assert len({each.variant for each in results}) == 2
    words = shlex.split(accept_command(results[1], door.out))
    assert words[words.index("--camera") + 1] in results[1].variant
    asked = {"scene": "shot", "renderer": "grey", "variants": [], "because": "so", "link": "", "expires": ""}
    known = {"band": 0.1, "out": door.out, "path": tmp_path / "expect.toml"}
    with pytest.raises(SelectionError, match="2 variants"):
        accept(**asked, **known)  # type: ignore[arg-type]
    assert accept(**asked, **known, view=View("/Scene/Side")) == 0  # type: ignore[arg-type]
    assert results[1].variant in known["path"].read_text("utf-8")  # type: ignore[attr-defined]
