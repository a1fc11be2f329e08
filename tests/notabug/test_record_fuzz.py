"""run.json and result.json of unknown making: a result, or a clear error; hostile names stay inside the run."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from notabug.metrics.verdict import Finding, Leg, Verdict
from notabug.report.page import draw
from notabug.results.record import RecordError, Result
from notabug.scenes_usd.errors import NotabugError

FINDING = Finding("bug", "flat_normals", 4.0, (0, 0, 2, 2), message="why")
GOOD = Result(
    "a/b", "s=1", "grey", "1", Verdict("bug", (FINDING,), {"limitation": Leg(), "bug": Leg(3, 0.1)})
).as_dict()
VALUES = st.recursive(
    st.none()
    | st.booleans()
    | st.integers(-9, 9)
    | st.floats(allow_nan=False, allow_infinity=False)
    | st.text(max_size=9),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner, max_size=3),
    max_leaves=4,
)


def damaged(data: st.DataObject) -> dict[str, Any]:
    """A good result with one to three of its values, at any depth, replaced or lost."""
    document: dict[str, Any] = json.loads(json.dumps(GOOD))
    for _ in range(data.draw(st.integers(1, 3))):
        place: Any = document
        while True:
            keys = list(place) if isinstance(place, dict) else list(range(len(place)))
            key = data.draw(st.sampled_from(keys))
            if isinstance(place[key], dict | list) and place[key] and data.draw(st.booleans()):
                place = place[key]
                continue
            if isinstance(place, dict) and data.draw(st.booleans()) and len(place) > 1:
                del place[key]
            else:
                place[key] = data.draw(VALUES)
            break
    return document


@settings(max_examples=300, deadline=None)
@given(data=st.data())
def test_a_damaged_result_is_a_result_or_a_clear_error(data: st.DataObject) -> None:
    document = damaged(data)
    try:
        back = Result.from_dict(document)
    except RecordError:
        return
    json.dumps(back.as_dict(), allow_nan=False)


@settings(max_examples=30, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_a_damaged_run_is_drawn_or_refused(data: st.DataObject, tmp_path: Path) -> None:
    document = {"schema": 1, "tool": {}, "command": [], "seconds": {}, "renderers": {}, "calibration": []}
    document["results"] = [GOOD, damaged(data)]
    (tmp_path / "run.json").write_text(json.dumps(document))
    try:
        draw(tmp_path)
    except NotabugError:
        return
    assert "<script>alert" not in (tmp_path / "report.html").read_text()


@pytest.mark.parametrize("name", ['a"b', "<script>alert(1)</script>", "..usda", "new\nline", "$(touch x)", "-r"])
def test_a_scene_of_any_name_is_run_inside_the_folder(door: Any, tmp_path: Path, name: str) -> None:
    from notabug.scenes_usd.reader import find

    folder = tmp_path / "scenes"
    folder.mkdir()
    path = folder / f"{name.replace('/', '_')}.usda"
    path.write_text(find("calibration/plain_card").read_text())
    assert door.run(str(path)) == 0
    assert {each.name for each in tmp_path.iterdir()} <= {"scenes", "out"}
    assert {each.name for each in folder.iterdir()} == {path.name}
    page = (door.out / "report.html").read_text()
    assert "<script>alert" not in page
    (result,) = json.loads((door.out / "run.json").read_text())["results"]
    assert result["scene"] == path.stem


WHOLE = {
    "schema": 1,
    "tool": {"name": "notabug", "version": "1", "models": "m", "code": "c", "python": "3", "platform": "p"},
    "command": ["notabug", "run"],
    "finished": True,
    "seconds": {"total": 1.0, "render": 0.5, "outside": 0.5},
    "jobs": {"executor": "this process", "at_once": 1, "threads": 0, "shard": ""},
    "gate": {"file": "", "fail_on": "any", "models": "m", "unused": []},
    "renderers": {"grey": {"version": "1", "where": "/x"}, "gone": {"missing": "apt install gone"}},
    "calibration": [GOOD],
    "results": [GOOD],
}
TOO_BIG = 10**400
DAMAGE: dict[str, Any] = {
    "a command that is no word": ("command", ["notabug", 7]),
    "a command that is a text": ("command", "notabug"),
    "a number beyond any": ("seconds", {"total": TOO_BIG}),
    "no gate's entries": ("gate", {"unused": {"a": 1}}),
    "a gate's entry without keys": ("gate", {"unused": [{}]}),
    "renderers as a list": ("renderers", []),
    "a policy of words": ("policy", {"admissible.edge": "wide"}),
    "a policy as a list": ("policy", [0.19]),
    "a renderer that is a text": ("renderers", {"grey": "1"}),
    "a version that is a number": ("tool", {"version": 3, "models": "m"}),
    "a tool that is none": ("tool", None),
    "jobs that are a number": ("jobs", 3),
    "a shard that is a list": ("jobs", {"shard": []}),
    "finished as a word": ("finished", "yes"),
    "a NUL in a scene's name": ("results", [GOOD | {"scene": "a\0b"}]),
    "a NUL in a renderer's name": ("results", [GOOD | {"renderer": "\0"}]),
    "a picture's name that is too long": ("results", [GOOD | {"image": "x" * 5000}]),
    "an image that is a NUL": ("results", [GOOD | {"images": {"nearest": "\0"}}]),
    "an image that no system can be asked for": ("results", [GOOD | {"image": "a/\ud800.exr"}]),
    "a panel that no system can be asked for": ("results", [GOOD | {"images": {"nearest": "\udfff"}}]),
    "a log that no system can be asked for": ("results", [GOOD | {"log": "\ud83d/log.txt"}]),
    "a card that no system can be asked for": ("calibration", [GOOD | {"image": "\ud800"}]),
    "a number of seeds beyond any": ("results", [GOOD | {"seeds": TOO_BIG}]),
    "a size of three": ("results", [GOOD | {"size": [1, 2, 3]}]),
    "results as an object": ("results", {"a": GOOD}),
    "cards that are texts": ("calibration", ["a"]),
}


@pytest.mark.parametrize("words", [["report"], ["report", "--to", "github"], ["report", "--to", "sarif"], ["merge"],
                                   ["diff"], ["gallery"], ["accept"]], ids=" ".join)  # fmt: skip
def test_any_damage_to_a_record_is_one_line(door: Any, tmp_path: Path, words: list[str]) -> None:
    door.patch.delenv("CI", raising=False)
    for name, (key, value) in DAMAGE.items():
        folder = tmp_path / "run"
        folder.mkdir(exist_ok=True)
        (folder / "run.json").write_text(json.dumps({**WHOLE, key: value}))
        more = {
            "merge": ["run", "--out", "merged"],
            "diff": ["run", "run"],
            "gallery": ["run", "--no-models", "--scene", "own", "--out", "site"],
            "accept": ["a/b", "-r", "grey", "--because", "x", "--run", "run"],
        }.get(words[0], ["run", *words[1:]])
        assert door(words[0], *more) == 2, name
        assert "run.json: " in door.stderr, name
        assert "Traceback" not in door.stderr, name
        assert len(door.stderr) < 2000, name


@pytest.mark.parametrize("words", [["report"], ["report", "--to", "sarif"], ["report", "--to", "junit"], ["merge"],
                                   ["report", "--to", "markdown"]], ids=" ".join)  # fmt: skip
def test_text_that_is_none_is_shown_somehow(door: Any, tmp_path: Path, words: list[str]) -> None:
    odd = {"scene": "\ud800", "renderer": "\udc80", "message": "\0\ud800\x1b", "command": "notabug run '\ud800.usda'"}
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "run.json").write_text(json.dumps({**WHOLE, "results": [{**GOOD, **odd}]}))
    assert door(words[0], "run", *words[1:], *(["--out", "m"] if words[0] == "merge" else [])) in (0, 1)


@pytest.mark.parametrize("lost", WHOLE)
@pytest.mark.parametrize("words", [["report"], ["report", "--to", "junit"], ["report", "--to", "sarif"], ["merge"]])
@pytest.mark.sweep_except(
    "words0-jobs",
    "words1-command",
    "words1-seconds",
    "words1-gate",
    "words1-renderers",
    "words2-tool",
    "words2-calibration",
    "words2-results",
    "words3-schema",
    "words3-finished",
)
def test_a_key_that_is_missing_is_no_trace(door: Any, tmp_path: Path, words: list[str], lost: str) -> None:
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "run.json").write_text(json.dumps({k: v for k, v in WHOLE.items() if k != lost}))
    assert door(words[0], "run", *words[1:], *(["--out", "m"] if words[0] == "merge" else [])) in (0, 1, 2)
    assert "internal error" not in door.stderr


@pytest.mark.parametrize(
    "text",
    ["[" * 20_000, '{"schema": 1, "results": ' + "[" * 20_000 + "]" * 20_000 + "}", "\xff", "", "null", "[]",
     '{"schema": 1e400, "results": []}', '{"schema": 1, "results": [], "x": ' + "9" * 5000 + "}"],
    ids=["deep", "deep and closed", "no UTF-8", "empty", "null", "list", "infinite", "digits"],
)  # fmt: skip
def test_what_is_no_document_is_one_line(door: Any, tmp_path: Path, text: str) -> None:
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "run.json").write_bytes(text.encode("latin-1"))
    assert door("report", "run") == 2
    assert door.stderr.count("\n") == 1


def test_expectations_that_are_nested_without_end_are_refused(door: Any, tmp_path: Path) -> None:
    for text in ("a" + ".a" * 3000 + " = 1", "a = " + "[" * 3000 + "]" * 3000, "a = " + "{a = " * 3000 + "}" * 3000):
        (tmp_path / "e.toml").write_text(text)
        assert door.run("terminator/sphere", "--expect", "e.toml") == 2
        assert "e.toml" in door.stderr
        assert "Traceback" not in door.stderr
