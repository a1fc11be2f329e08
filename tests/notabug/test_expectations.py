"""Expectations: states, the file, `accept`, and which of them turn a gate red."""

from __future__ import annotations

import datetime
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from notabug.metrics.verdict import Finding, Verdict
from notabug.results.expect_file import ExpectationError, parse, with_entry
from notabug.results.expectation import Entry
from notabug.results.gate import Gate, code_of
from notabug.results.record import Result

TODAY = datetime.date(2026, 6, 1)
ENTRY = Entry("grey", "a/b", "s=1", "limitation", "it is so", "m1", name="acne", area_px=(90.0, 110.0), jnd=(1.0, 2.0))


def result(word: Any, *findings: tuple[str, float], visible: bool = True, jnd: float = 1.5) -> Result:
    found = tuple(Finding(word, name, area, (0, 0, 1, 1), jnd=jnd, visible=visible) for name, area in findings)
    return Result("a/b", "s=1", "grey", "1", Verdict(word, found))


def gate(*entries: Entry, models: str = "m1", fail_on: Any = "any") -> Gate:
    return Gate(entries, "f", fail_on, models, TODAY)


@pytest.mark.parametrize(
    ("found", "state", "fails"),
    [
        (result("limitation", ("acne", 100.0)), "as expected", False),
        (result("limitation", ("acne", 60.0), ("acne", 40.0)), "as expected", False),
        (result("limitation", ("acne", 111.0)), "grew", True),
        (result("limitation", ("acne", 100.0), jnd=2.1), "grew", True),
        (result("limitation", ("acne", 60.0), ("other", 40.0)), "grew", True),
        (result("limitation", ("acne", 89.0)), "improved", False),
        (result("limitation", ("acne", 100.0), jnd=0.9), "improved", False),
        (result("bug", ("acne", 100.0)), "new", True),
        (result("error"), "new", True),
        (result("pass"), "fixed", False),
    ],
)
def test_states(found: Result, state: str, fails: bool) -> None:
    judged = gate(ENTRY).judged(found)
    assert (judged.state, judged.fails) == (state, fails)
    changed = gate(ENTRY, models="m2").judged(found)  # other models: what left its band is told apart, as strictly
    assert (changed.state, changed.fails) == ("as expected" if state == "as expected" else "models changed", fails)


def test_an_entry_expires() -> None:
    inside = result("limitation", ("acne", 100.0))
    for day, state in ((TODAY, "as expected"), (TODAY - datetime.timedelta(1), "expired")):
        judged = gate(replace(ENTRY, expires=day)).judged(inside)
        assert (judged.state, judged.fails) == (state, state == "expired")


def test_an_accepted_bug_passes_and_a_limitation_in_its_place_is_better() -> None:
    bug = replace(ENTRY, verdict="bug")
    assert not gate(bug).judged(result("bug", ("acne", 100.0))).fails
    assert gate(bug).judged(result("limitation", ("acne", 100.0))).state == "improved"
    assert gate(bug).judged(result("bug", ("acne", 120.0))).fails


def test_the_table_of_the_scene_is_what_stands_without_an_entry() -> None:
    stated = replace(result("bug", ("acne", 1.0)), expected="bug")
    assert gate().judged(stated).state == "as expected"
    assert gate().judged(replace(stated, expected="limitation: acne")).fails
    assert gate().judged(replace(stated, expected="")).state == "new"
    other = replace(result("limitation", ("acne", 1.0)), expected="pass")
    assert (gate().judged(other).state, gate().judged(other).fails) == ("new", False)
    assert gate(replace(ENTRY, verdict="bug")).judged(replace(stated, expected="")).state == "improved"


def test_what_no_eye_sees_may_pass() -> None:
    unseen = result("bug", ("acne", 100.0), visible=False)
    assert gate(fail_on="any").judged(unseen).fails
    assert not gate(fail_on="visible").judged(unseen).fails
    assert gate(fail_on="visible").judged(result("bug", ("acne", 100.0))).fails
    assert gate(fail_on="visible").judged(result("bug")).fails  # nothing says that it cannot be seen


def test_unused_entries_are_listed() -> None:
    other = replace(ENTRY, scene="a/gone")
    document = gate(ENTRY, other).document([result("pass")])
    assert document["unused"] == [{"renderer": "grey", "scene": "a/gone", "variant": "s=1"}]


def test_codes() -> None:
    assert code_of([replace(result("limitation"), fails=True)]) == 1
    assert code_of([replace(result("error"), fails=True)]) == 3
    assert code_of([result("bug")]) == 0


COMMENTED = """\
# ours

# about the second
[[accepted]]
renderer = "b"   # the other one
scene = "x/y"
verdict = "bug"
because = "one\\ntwo \\"[[accepted]]\\""
models = "m1"

# at the end
"""


def test_writing_keeps_all_else(tmp_path: Path) -> None:
    before = with_entry(COMMENTED, replace(ENTRY, renderer="a"))
    after = with_entry(before, replace(ENTRY, renderer="c", expires=TODAY, link="https://x.example/1"))
    assert [each.renderer for each in parse(after)] == ["a", "b", "c"]
    assert before.index("# ours") < before.index('"a"') < before.index("# about the second") < before.index('"b"')
    assert all(line in after for line in COMMENTED.splitlines())
    again = with_entry(after, replace(ENTRY, renderer="b", scene="x/y", variant="", because="three"))
    assert "# the other one" in again
    assert len(parse(again)) == 3
    assert with_entry(again, replace(ENTRY, renderer="b", scene="x/y", variant="", because="three")) == again


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ("verdict = 'pass'", "not a verdict to accept"),
        ("area_px = [2, 1]", "not a band"),
        ("area_px = [nan, 1]", "not a band"),
        ("because = ''", "missing"),
        ("expires = 'soon'", "not a date"),
        ("becuse = 'x'", "unknown key"),
        ("scene = 3", "not a text"),
    ],
)
def test_a_wrong_entry_names_its_key(change: str, says: str) -> None:
    lines = ["renderer = 'r'", "scene = 's'", "verdict = 'bug'", "because = 'x'", "models = 'm'"]
    key = change.partition(" ")[0]
    text = "\n".join(["[[accepted]]", *(each for each in lines if not each.startswith(key + " ")), change])
    with pytest.raises(ExpectationError, match=says):
        parse(text)
    assert parse("\n".join(["[[accepted]]", *lines]))


def test_two_entries_for_one_job_are_refused() -> None:
    text = with_entry("", ENTRY)
    with pytest.raises(ExpectationError, match="second entry"):
        parse(text + text)


def test_accept_and_run(door: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("CI", raising=False)
    bug = Verdict("bug", (Finding("bug", "flat_normals", 40.0, (0, 0, 9, 9), jnd=3.0),), message="flat")
    door.judge.verdicts["terminator/sphere"] = bug
    assert door.run("terminator/sphere") == 1
    words = ("accept", "terminator/sphere", "-r", "grey", "--run", str(door.out), "--because", "ticket 12")
    assert door(*words) == 0
    text = Path("notabug.expect.toml").read_text()
    (entry,) = parse(text)
    assert (entry.area_px, entry.jnd, entry.name) == ((36.0, 44.0), (2.7, 3.3), "flat_normals")
    assert door.run("terminator/sphere") == 0
    record = json.loads((door.out / "run.json").read_text())
    assert (record["results"][0]["state"], record["results"][0]["because"]) == ("as expected", "ticket 12")
    assert record["gate"]["models"] == entry.models == record["tool"]["models"]
    monkeypatch.setenv("CI", "true")
    assert door(*words) == 2
    assert "a build server accepts nothing" in door.stderr
    assert Path("notabug.expect.toml").read_text() == text
    Path("notabug.expect.toml").write_text(text.replace("44.0", "39.0"))
    assert door.run("terminator/sphere") == 1
    assert "grew: 1" in door.stdout
    assert door.run("terminator/sphere", "--expect", "gone.toml") == 2
    assert door.run("texture/uneven_quad") == 0
    assert "unused: 1" in door.stdout
