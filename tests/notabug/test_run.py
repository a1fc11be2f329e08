"""run: what is kept, what fails alone, what calibration stops, and what run.json holds."""

from __future__ import annotations

import json
import math
from typing import Any

import pytest

from notabug.adapters.base import RendererError, UnsupportedError
from notabug.metrics.verdict import Finding, Leg, Verdict
from notabug.results.record import Result

BUG = Verdict("bug", (Finding("bug", "flat_normals", 40.0, (1, 2, 30, 40), z=math.inf),), message="flat normals")
SCENES = ("calibration/card", "terminator/sphere", "texture/uneven_quad")


def record(door: Any) -> dict[str, Any]:
    document: dict[str, Any] = json.loads((door.out / "run.json").read_text())
    return document


def words(door: Any) -> dict[str, str]:
    return {each["scene"]: each["verdict"] for each in record(door)["results"]}


def test_every_scene_by_default_and_the_card_is_drawn_once_and_first(door: Any) -> None:
    assert door.run() == 0
    assert set(words(door)) >= set(SCENES)
    assert door.grey.drawn[0] == "calibration/card"
    assert len(door.grey.drawn) == len(set(door.grey.drawn)) == len(record(door)["results"])


def test_run_json_has_the_keys_of_schema_1(door: Any) -> None:
    door.judge.verdicts["terminator/sphere"] = BUG
    door.run("terminator/sphere")
    document = record(door)
    assert document["schema"] == 1
    assert document["finished"] is True
    assert {"name", "version", "libraries"} <= document["tool"].keys()
    (result,) = document["results"]
    assert result.keys() >= {
        *(
            "scene",
            "variant",
            "renderer",
            "renderer_version",
            "verdict",
            "findings",
            "legs",
            "samples",
            "seconds",
            "image",
        ),
        *("message", "triggers", "numbers", "command", "expected"),
    }
    assert result["findings"][0].keys() >= {"kind", "name", "area_px", "jnd", "z", "region"}
    assert result["findings"][0]["region"] == [1, 2, 30, 40]
    assert result["findings"][0]["z"] is None  # infinity is not JSON
    assert result["seconds"].keys() >= {"render", "judge"}
    assert result["legs"].keys() == {"limitation", "bug"}
    assert (door.out / result["image"]).is_file()
    assert all((door.out / each).is_file() for each in result["images"].values())
    assert result["variant"] == "tessellation=24x12"
    again = f"{door.out}-again"  # beside the run that it belongs to, whose results stay
    assert result["command"] == f"notabug run terminator/sphere -r grey --variant tessellation=24x12 --out {again}"
    assert not list(door.out.rglob("*.partial*"))


def test_a_result_round_trips() -> None:
    verdict = Verdict(
        "bug", BUG.findings, {"limitation": Leg(), "bug": Leg(3, 0.1)}, ("pixels",), "why", {"gain": 1.01}
    )
    result = Result(
        "a/b", "s=1", "grey", "1", verdict, 4, 2, {"render": 1.0, "judge": 0.5}, "x.exr", {"nearest": "y.exr"}
    )
    there = json.loads(json.dumps(result.as_dict(), allow_nan=False))
    back = Result.from_dict(there)
    assert back.as_dict() == there
    assert math.isnan(back.verdict.findings[0].z)
    assert back.verdict.legs == verdict.legs


def test_a_second_run_draws_and_judges_nothing(door: Any) -> None:
    door.run("terminator", "texture")
    drawn, judged = len(door.grey.drawn), len(door.judge.judged)
    first = record(door)["results"]
    assert door.run("terminator", "texture") == 0
    assert (len(door.grey.drawn), len(door.judge.judged)) == (drawn, judged)
    assert record(door)["results"] == first


@pytest.mark.parametrize("change", ["version", "samples", "seeds", "no-resume", "lost"])
def test_a_changed_input_is_drawn_again(door: Any, change: str) -> None:
    door.run("terminator/sphere")
    extra: list[str] = []
    if change == "version":
        door.grey.version = "2.0"
    elif change == "lost":
        for path in door.out.rglob("*.exr"):
            path.unlink()
    else:
        extra = {"samples": ["--samples", "9"], "seeds": ["--seeds", "1"], "no-resume": ["--no-resume"]}[change]
    door.grey.drawn.clear()
    door.run("terminator/sphere", *extra)
    assert "terminator/sphere tessellation=24x12" in door.grey.drawn


def test_a_changed_judge_judges_again_without_drawing(door: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    door.run("terminator/sphere")
    door.grey.drawn.clear()
    door.judge.judged.clear()
    real = __import__("notabug.runs.job_files", fromlist=["fingerprint"]).fingerprint
    monkeypatch.setattr("notabug.runs.job_files.fingerprint", lambda *f: "new" if "metrics" in f else real(*f))
    door.run("terminator/sphere")
    assert door.grey.drawn == []
    assert "terminator/sphere" in door.judge.judged


def test_an_interrupted_run_is_readable_and_goes_on(door: Any) -> None:
    door.grey.mishaps["texture/uneven_quad"] = KeyboardInterrupt()
    assert door.run("terminator/sphere", "texture/uneven_quad") == 130
    assert "same command" in door.stderr
    assert words(door) == {"terminator/sphere": "pass"}
    assert record(door)["finished"] is False
    door.grey.mishaps.clear()
    door.grey.drawn.clear()
    assert door.run("terminator/sphere", "texture/uneven_quad") == 0
    assert door.grey.drawn == ["texture/uneven_quad split=quad"]
    assert words(door) == {"terminator/sphere": "pass", "texture/uneven_quad": "pass"}


@pytest.mark.parametrize(
    ("mishap", "word", "code"),
    [
        (UnsupportedError("no mirrors"), "unsupported", 0),
        (RendererError("it crashed"), "error", 3),
        (ZeroDivisionError("a defect"), "error", 3),
    ],
)
def test_a_job_fails_alone(door: Any, mishap: Exception, word: str, code: int) -> None:
    door.grey.mishaps["terminator/sphere"] = mishap
    assert door.run("terminator/sphere", "texture/uneven_quad") == code
    assert words(door) == {"terminator/sphere": word, "texture/uneven_quad": "pass"}
    assert str(mishap) in record(door)["results"][0]["message"]
    assert "Traceback" not in door.stderr


def test_an_error_is_tried_again(door: Any) -> None:
    door.grey.mishaps["terminator/sphere"] = RendererError("it crashed")
    assert door.run("terminator/sphere") == 3
    door.grey.mishaps.clear()
    assert door.run("terminator/sphere") == 0


def test_no_old_picture_passes_for_a_new_one(door: Any) -> None:
    door.run("terminator/sphere")
    door.grey.mishaps["terminator/sphere"] = RendererError("it crashed")
    assert door.run("terminator/sphere", "--no-resume") == 3
    assert record(door)["results"][0]["image"] == ""
    assert not list((door.out / "terminator").rglob("[0-9].exr"))


def test_a_renderer_that_fails_calibration_is_not_blamed_for_more(door: Any) -> None:
    upside_down = Finding("bug", "upside_down", 9.0, (0, 0, 9, 9), message="the picture is upside down")
    door.judge.verdicts["calibration/card"] = Verdict("bug", (upside_down,))
    assert door.run("terminator/sphere") == 3
    (result,) = record(door)["results"]
    assert result["verdict"] == "error"
    assert result["message"] == "calibration: the picture is upside down"
    assert door.grey.drawn == ["calibration/card"]
    assert record(door)["calibration"][0]["verdict"] == "bug"
    assert (door.stdout + door.stderr).count("the picture is upside down") == 1
    assert "notabug calibrate -r grey" in door.stdout


def test_a_renderers_own_bug_on_the_card_stops_nothing(door: Any) -> None:
    door.judge.verdicts["calibration/card"] = BUG
    assert door.run("terminator/sphere") == 0
    assert words(door) == {"terminator/sphere": "pass"}


def test_a_missing_renderer_is_named_once_and_left_out(door: Any) -> None:
    door.renderers["gone"] = type(door.grey)("gone", install="apt install gone", installed=False)
    assert door.run("terminator/sphere", "texture/uneven_quad") == 0
    assert door.stderr.count("gone: not installed") == 1
    assert record(door)["renderers"]["gone"] == {"missing": "apt install gone"}
    assert {each["renderer"] for each in record(door)["results"]} == {"grey"}


def test_a_required_renderer_must_be_there(door: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    door.renderers["gone"] = type(door.grey)("gone", install="apt install gone", installed=False)
    assert door.run("terminator/sphere", "--require", "gone") == 3
    assert "apt install gone" in door.stderr
    monkeypatch.setenv("NOTABUG_REQUIRE", "grey,gone")
    assert door.run("terminator/sphere") == 3
    monkeypatch.setenv("NOTABUG_REQUIRE", "grey")
    assert door.run("terminator/sphere") == 0


def test_no_renderer_at_all(door: Any) -> None:
    door.grey.installed = False
    assert door.run("terminator/sphere") == 5
    assert "notabug doctor" in door.stderr


def test_a_verdict_other_than_expected_is_shown(door: Any) -> None:
    assert door.run("terminator/sphere") == 0
    assert record(door)["results"][0]["expected"] == "limitation: facet_self_shadow"
    assert "expected limitation: facet_self_shadow" in door.stderr
    assert "1 pass (not expected)" in door.stdout
    named = Verdict("limitation", (Finding("limitation", "facet_self_shadow", 99.0, (0, 0, 9, 9)),))
    door.judge.verdicts["terminator/sphere"] = named
    door.run("terminator/sphere", "--no-resume")
    assert "not expected" not in door.stdout


def test_what_all_show_is_not_expected_of_a_renderer_that_cannot_draw_the_scene(door: Any) -> None:
    door.grey.mishaps["terminator/sphere"] = UnsupportedError("no normals")
    assert door.run("terminator/sphere") == 0
    assert record(door)["results"][0]["expected"] == record(door)["results"][0]["state"] == ""
    assert "not expected" not in door.stdout
    assert "new:" not in door.stdout


def test_a_renderer_without_textures_is_calibrated_by_the_plain_card(door: Any) -> None:
    door.grey.mishaps["calibration/card"] = UnsupportedError("no textures")
    assert door.run("calibration/card", "terminator/sphere") == 0
    assert words(door) == {"calibration/card": "unsupported", "terminator/sphere": "pass"}
    assert [each["scene"] for each in record(door)["calibration"]] == ["calibration/plain_card"]


def test_a_renderer_that_can_draw_no_card_is_not_judged(door: Any) -> None:
    for card in ("calibration/card", "calibration/plain_card"):
        door.grey.mishaps[card] = UnsupportedError("only spheres")
    assert door.run("terminator/sphere") == 3
    assert words(door) == {"terminator/sphere": "error"}
    assert "none of the cards (only spheres)" in record(door)["results"][0]["message"]


def test_a_renderer_that_fails_on_the_card_is_not_judged(door: Any) -> None:
    door.grey.mishaps["calibration/card"] = RendererError("it crashed")
    assert door.run("terminator/sphere") == 3
    assert record(door)["results"][0]["message"] == "calibration: the card could not be drawn (it crashed)"
    assert door.grey.drawn == ["calibration/card"]


def test_a_mended_calibration_is_taken_up(door: Any) -> None:
    """Although nothing that enters a key has changed: a card that speaks against an adapter is drawn again."""
    turned = Finding("bug", "upside_down", 9.0, (0, 0, 9, 9), message="it is upside down")
    door.judge.verdicts["calibration/card"] = Verdict("bug", (turned,), message="it is upside down")
    assert door.run("terminator/sphere") == 3
    assert "upside down" in door.stdout
    door.judge.verdicts.clear()
    door.grey.drawn.clear()
    assert door.run("terminator/sphere") == 0
    assert [each.split()[0] for each in door.grey.drawn] == ["calibration/card", "terminator/sphere"]
    door.grey.drawn.clear()
    assert door.run("terminator/sphere") == 0
    assert door.grey.drawn == []  # a card that passes is kept
