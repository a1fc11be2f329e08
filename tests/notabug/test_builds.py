"""Runs as build servers take them: JUnit, GitHub, Markdown, SARIF; merging and comparing runs."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import junitparser
import numpy as np
import pytest

from notabug.adapters.base import RendererError
from notabug.commands.merge import MergeError, merge
from notabug.metrics.verdict import Finding, Verdict
from notabug.results.changes import compare
from notabug.results.record import Result
from notabug.runs.selection import Choice, part
from notabug.scenes_usd.picture import write_exr
from notabug.scenes_usd.reader import find

NASTY = "a]]>\x00<b>\n::error::x|`%"


@pytest.fixture
def ran(door: Any) -> Any:
    """A run with a bug, an error, a limitation, a pass, an unsupported scene and a renderer that is missing."""
    door.renderers["gone"] = type(door.grey)("gone", install="apt install gone", installed=False)
    found = Finding("bug", "flat_normals", 40.0, (0, 0, 9, 9), jnd=3.0, message=NASTY)
    limited = Finding("limitation", "quad_split", 9.0, (0, 0, 9, 9))
    door.judge.verdicts |= {
        "terminator/sphere": Verdict("bug", (found,), message=NASTY),
        "terminator/bowl": Verdict("error", message="broke"),
        "texture/uneven_quad": Verdict("limitation", (limited,)),
        "mirror/corner": Verdict("unsupported", message="no mirrors"),
    }
    scenes = ("terminator/sphere", "terminator/bowl", "texture/uneven_quad", "mirror/corner", "acne/sphere")
    assert door.run(*scenes) == 1
    return door


def test_junit_is_read_by_others(ran: Any, tmp_path: Path) -> None:
    assert ran("report", str(ran.out), "--to", "junit") == 0
    read: Any = junitparser.JUnitXml.fromstring(ran.stdout.encode())
    suite, missing = read
    assert (suite.tests, suite.failures, suite.errors, suite.skipped) == (5, 1, 1, 1)
    assert (missing.tests, missing.skipped) == (1, 1)
    kinds = {case.name: [type(each).__name__ for each in case.result] for case in suite}
    assert kinds["terminator/sphere[tessellation=24x12]"] == ["Failure"]
    assert [each for name, each in kinds.items() if name.startswith("terminator/bowl")] == [["Error"]]
    assert sum(bool(each) for each in kinds.values()) == 3
    (failed,) = [case.result[0].text for case in suite if case.name.startswith("terminator/sphere")]
    assert "\nexplain: notabug why " in failed
    assert "\nagain: notabug run terminator/sphere" in failed
    before = (suite.tests, suite.failures, suite.errors, suite.skipped)
    suite.update_statistics()  # counted again from the cases
    assert (suite.tests, suite.failures, suite.errors, suite.skipped) == before


# What Jenkins' schema of JUnit files, junit-10.xsd, allows: element: (required attributes, optional ones, children)
COUNTS, TIMED = {"name", "tests", "failures", "errors"}, {"time"}
SAID = (set(), {"type", "message"}, set())
JUNIT: dict[str, tuple[set[str], set[str], set[str]]] = {
    "testsuites": (set(), COUNTS | TIMED, {"testsuite"}),
    "testsuite": (COUNTS, TIMED | {"skipped", "timestamp"}, {"properties", "testcase", "system-out", "system-err"}),
    "properties": (set(), set(), {"property"}),
    "property": ({"name", "value"}, set(), set()),
    "testcase": ({"name"}, TIMED | {"classname"}, {"skipped", "error", "failure", "system-out", "system-err"}),
    "skipped": SAID,
    "error": SAID,
    "failure": SAID,
    "system-out": (set(), set(), set()),
}


def test_junit_follows_the_schema_of_jenkins(ran: Any) -> None:
    assert ran("report", str(ran.out), "--to", "junit") == 0
    root = ElementTree.fromstring(ran.stdout.encode())
    assert root.tag == "testsuites"
    for each in root.iter():
        required, optional, children = JUNIT[each.tag]
        assert required <= set(each.keys()) <= required | optional, each.tag
        assert {child.tag for child in each} <= children, each.tag
        assert re.fullmatch(r"\d*(\.\d*)?", each.get("time", ""))
    assert {each.tag for each in root.iter()} == set(JUNIT)


def test_github_gets_one_command_a_line(ran: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    summary = tmp_path / "summary.md"
    monkeypatch.setenv("GITHUB_STEP_SUMMARY", str(summary))
    assert ran("report", str(ran.out), "--to", "github") == 0
    lines = ran.stdout.splitlines()
    assert [line.partition(" ")[0] for line in lines if "=terminator" in line or "/terminator" in line] == [
        "::error",
        "::error",
    ]
    assert all(line.startswith(("::error file=", "::warning file=")) for line in lines)
    assert "file=scenes_usd/terminator/sphere.usda" in ran.stdout
    assert "%25" in ran.stdout
    bug = next(line for line in lines if "title=terminator/sphere" in line)
    told, explain, again = bug.split("%0A")[0], bug.split("%0Aexplain: ")[1].split("%0A")[0], bug.split("%0Aagain: ")[1]
    assert told.partition("::")[2].partition("::")[2].startswith("bug: flat normals (40 px, jnd 3): ")
    assert explain.startswith(f"notabug why {(ran.out / 'terminator').as_posix()}/sphere/")
    assert explain.endswith("--pixel 4,4")
    assert again.startswith("notabug run terminator/sphere")
    assert lines[0].count("%0A") <= 3
    assert "flat normals" in summary.read_text()


def test_markdown_holds_no_markup_of_the_results(ran: Any) -> None:
    assert ran("report", str(ran.out), "--to", "markdown") == 0
    assert "<b>" not in ran.stdout
    assert "2 failing" in ran.stdout
    rows = [line for line in ran.stdout.splitlines() if line.startswith("| ✗")]
    assert len(rows) == 1
    assert rows[0].count("|") == 10


def test_sarif_is_of_the_schema(ran: Any) -> None:
    from pydantic import ValidationError
    from pydantic_sarif.model import StaticAnalysisResultsFormatSarifVersion210JsonSchema as Sarif

    assert ran("report", str(ran.out), "--to", "sarif") == 0
    document = json.loads(ran.stdout)
    Sarif.model_validate(document)
    assert "\nexplain: notabug why " in document["runs"][0]["results"][0]["message"]["text"]
    (run,) = document["runs"]
    assert {(each["ruleId"], each["level"]) for each in run["results"]} == {
        ("bug/flat_normals", "error"),
        ("error", "error"),
        ("limitation/quad_split", "note"),
    }
    assert all(run["tool"]["driver"]["rules"][each["ruleIndex"]]["id"] == each["ruleId"] for each in run["results"])
    run["results"][0]["level"] = "fatal"
    with pytest.raises(ValidationError):
        Sarif.model_validate(document)


def test_shards_are_a_partition_and_merge_to_the_whole(door: Any, tmp_path: Path) -> None:
    choices = [Choice(f"a/{index}", f"a/{index}") for index in range(100)]
    shards = [part(choices, f"{index}/8") for index in range(1, 9)]
    assert sorted(each.id for shard in shards for each in shard) == sorted(each.id for each in choices)
    assert max(map(len, shards)) < 30
    assert part(choices[:50], "3/8") == [each for each in shards[2] if each in choices[:50]]
    scenes = ("terminator/sphere", "terminator/bowl", "texture/uneven_quad", "mirror/corner")
    door.judge.verdicts["terminator/bowl"] = Verdict("bug", message="x")
    codes = [door("run", *scenes, "--out", f"part{index}", "--shard", f"{index}/3") for index in (1, 2, 3)]
    assert sorted(codes) == [0, 0, 1]
    assert door("merge", "part1", "part2", "part3", "--out", "whole") == 1
    whole = json.loads(Path("whole/run.json").read_text())
    assert sorted(each["scene"] for each in whole["results"]) == sorted(scenes)
    assert all((Path("whole") / each["image"]).is_file() for each in whole["results"])
    assert Path("whole/report.html").is_file()
    assert door("run", *scenes, "--shard", "4/3") == 2


def test_what_does_not_belong_together_is_not_merged(door: Any, tmp_path: Path) -> None:
    door("run", "terminator/sphere", "--out", "one")
    door.judge.verdicts["terminator/sphere"] = Verdict("bug", message="x")
    door("run", "terminator/sphere", "--out", "two")
    with pytest.raises(MergeError, match="two results for one job"):
        merge([Path("one"), Path("two")], tmp_path / "whole")
    record = Path("two/run.json")
    record.write_text(record.read_text().replace('"models": "', '"models": "x'))
    with pytest.raises(MergeError, match="different models"):
        merge([Path("one"), Path("two")], tmp_path / "whole")
    record = Path("one/run.json")
    record.write_text(record.read_text().replace('"image": "', '"image": "../'))
    with pytest.raises(MergeError, match="outside"):
        merge([Path("one")], tmp_path / "whole")


def test_changes_are_sorted_worst_first(door: Any) -> None:
    def one(scene: str, word: Any, area: float = 0.0) -> Result:
        found = (Finding(word, "acne", area, (0, 0, 1, 1), jnd=1.0),) if area else ()
        return Result(scene, "", "r", "1", Verdict(word, found))

    before = [one("a", "limitation", 9.0), one("b", "pass"), one("c", "bug", 9.0), one("d", "pass"), one("e", "pass")]
    after = [one("a", "limitation", 12.0), one("b", "bug", 5.0), one("c", "pass"), one("d", "pass"), one("f", "pass")]
    changes = compare(before, after)
    assert [(each.scene, each.worse) for each in changes] == [
        ("b", True),
        ("a", True),
        ("e", False),
        ("f", False),
        ("c", False),
    ]
    assert compare(after, after) == []
    slightly = replace(after[0], verdict=one("a", "limitation", 12.0 + 1e-6).verdict)
    assert compare(after[:1], [slightly]) == []


def test_a_merge_that_would_hide_something_is_refused(door: Any, tmp_path: Path) -> None:
    scenes = ("terminator/sphere", "terminator/bowl", "texture/uneven_quad", "mirror/corner")
    for index in (1, 2):
        door("run", *scenes, "--out", f"part{index}", "--shard", f"{index}/2")
    assert door("merge", "part1", "--out", "half") == 2
    assert "missing: the shard 2/2" in door.stderr
    assert not Path("half/run.json").exists()
    assert door("merge", "part1", "--out", "half", "--partial") == 0
    half = json.loads(Path("half/run.json").read_text())
    assert (half["finished"], half["partial"]) == (False, True)
    assert door("merge", "half", "part2", "--out", "whole") == 2  # what is not whole does not become so
    assert door("merge", "part1", "part2", "--out", "whole") == 0
    assert json.loads(Path("whole/run.json").read_text())["finished"] is True
    assert door("merge", "whole", "--out", "again") == 0  # its shards were merged before
    record = json.loads(Path("part1/run.json").read_text())
    lost = next(each["image"] for each in record["results"] if each["image"])
    (Path("part1") / lost).unlink()
    assert door("merge", "part1", "part2", "--out", "lossy") == 2
    assert lost in door.stderr
    assert door("merge", "part1", "part2", "--out", "lossy", "--partial") == 0
    record["jobs"]["shard"] = "1/3"
    Path("part1/run.json").write_text(json.dumps(record))
    assert door("merge", "part1", "part2", "--out", "other", "--partial") == 2
    assert "shards of different runs" in door.stderr
    record["finished"] = False
    Path("part1/run.json").write_text(json.dumps(record))
    assert door("merge", "part1", "--out", "other") == 2
    assert "the end of the run in part1" in door.stderr


@pytest.mark.parametrize("image", ["run.json", ".", "a/../run.json", "report.html", "terminator/x.json"])
def test_a_record_cannot_have_other_files_merged(door: Any, tmp_path: Path, image: str) -> None:
    door("run", "terminator/sphere", "--out", "one")
    record = json.loads(Path("one/run.json").read_text())
    record["results"][0]["image"] = image
    Path("one/run.json").write_text(json.dumps(record))
    (Path("one") / "a").mkdir()
    (Path("one") / "terminator" / "x.json").write_text("{}")
    assert door("merge", "one", "--out", "whole", "--partial") == 2
    assert "not a picture of a run" in door.stderr
    assert not Path("whole/run.json").exists()


def test_reports_need_no_scene(door: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    inner = tmp_path / "my scenes"
    inner.mkdir()
    source = inner / "card.usda"
    source.write_text(find("calibration/plain_card").read_text())
    door.judge.verdicts["card"] = Verdict("bug", message="x")
    assert door.run("my scenes/card.usda") == 1
    assert door("report", str(door.out), "--to", "github") == 0
    assert "file=my scenes/card.usda," in door.stdout
    source.unlink()
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    for place in (tmp_path, elsewhere):
        monkeypatch.chdir(place)
        for kind in ("github", "sarif", "junit", "markdown"):
            assert door("report", str(door.out), "--to", kind) == 0
            assert "card" in door.stdout


ESCAPES = "\x1b]52;c;cm0gLXJm\x07\x1b]0;title\x07\x1b[8mhidden\x9b31m\u202ereversed\r"


@pytest.mark.parametrize("kind", ["summary", "github", "markdown", "sarif", "junit", "json", "diff"])
def test_no_control_character_of_a_log_reaches_a_terminal(door: Any, kind: str) -> None:
    door.grey.mishaps["terminator/sphere"] = RendererError(f"it crashed\n  | {ESCAPES}")
    assert door.run("terminator/sphere", *(["--json"] if kind == "json" else [])) == 3
    if kind in ("github", "markdown", "sarif", "junit"):
        assert door("report", str(door.out), "--to", kind) == 0
    elif kind == "diff":
        assert door("diff", str(door.out), str(door.out)) == 0
    assert not set(door.stdout + door.stderr) & set("\x1b\x07\x9b\u202e\r")
    if kind == "json":
        assert "\x9b31m" in json.loads(door.stdout)["results"][0]["message"]


def test_a_terminal_gets_styles_of_ours_alone() -> None:
    import io

    from rich.text import Text

    from notabug.printable import SafeConsole

    out = io.StringIO()
    console = SafeConsole(file=out, force_terminal=True, color_system="standard", width=200, legacy_windows=False)
    console.print(Text(ESCAPES, style="bold red"), ESCAPES)
    said = out.getvalue()
    assert "\x1b[1;31m" in said
    assert "hidden" in said
    for each in ("\x1b]", "\x1b[8m", "\x07", "\x9b", "\u202e"):
        assert each not in said


def test_a_picture_that_was_judged_is_a_run_that_can_be_merged(door: Any, tmp_path: Path) -> None:
    """One builder writes ``run.json``: whoever reads the record of a run reads that of `judge --out`, too."""
    write_exr(tmp_path / "a.exr", np.full((256, 256, 3), 0.5, np.float32))
    door("judge", "a.exr", "--scene", "terminator/sphere", "--out", "one")
    judged = json.loads(Path("one/run.json").read_text())
    door("run", "terminator/sphere", "--out", "run")
    ran = json.loads(Path("run/run.json").read_text())
    assert set(ran) <= set(judged)
    assert set(judged) - set(ran) == {"declaration"}
    assert door("merge", "one", "--out", "whole") in (0, 1)
    whole = json.loads(Path("whole/run.json").read_text())
    assert [result["renderer"] for result in whole["results"]] == ["file"]
    assert set(whole) - set(ran) == {"partial"}
