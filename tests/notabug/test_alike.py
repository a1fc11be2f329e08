"""One renderer's mistake is one line: messages that differ by names, paths and numbers only are alike."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from notabug.metrics.verdict import Verdict
from notabug.results.alike import alike, kind, missing_features
from notabug.results.gate import NOT_CALIBRATED, OF_FILES
from notabug.results.record import Result
from notabug.runs.progress import messages
from notabug.runs.run import not_to_blame


def result(message: str, word: Any = "error", renderer: str = "mine", scene: str = "a/b") -> Result:
    return Result(scene, "", renderer, "1", Verdict(word, message=message))


@pytest.mark.parametrize(
    ("one", "other"),
    [
        ("cannot open texture out/a.png", "cannot open texture out/b/c.png"),
        ("mine failed; got exit code 3", "mine failed; got exit code -11"),
        ("/Scene/Ball.points: too far; got 1e+29", "/Scene/Cube.points: too far; got 3.5"),
        ("no such prim 'Ball'", "no such prim 'Cube of mine'"),
        ("failed\n  | line 3", "failed\n  | line 30"),
    ],
)
def test_alike(one: str, other: str) -> None:
    assert kind(one) == kind(other)
    assert len(alike([result(one), result(other)])) == 1


def test_not_alike() -> None:
    found = [
        result("cannot open texture a/b"),
        result("cannot open mesh a/b"),
        result("cannot open texture a/b", renderer="other"),
        result("cannot open texture a/b", word="inconclusive"),
    ]
    assert [each.results for each in alike(found)] == [(each,) for each in found]


def test_the_scene_of_a_message_does_not_matter() -> None:
    found = [result(f"{name} is dark", scene=name) for name in ("own scene", "acne/slab")]
    assert len(alike(found)) == 1


def test_a_full_disk_is_told_once_for_all_renderers() -> None:
    full = [
        Result(scene, "", name, "1", Verdict("error", message=f"cannot write: {scene}/x", triggers=(OF_FILES,)))
        for name in ("mine", "theirs")
        for scene in ("a/b", "a/c")
    ]
    (same,) = alike(full)
    assert same.renderers == ("mine", "theirs")
    (line,) = messages(full)
    assert "mine, theirs: 4 jobs failed alike: cannot write" in line.plain


def test_a_card_that_the_disk_spoilt_blames_no_renderer() -> None:
    spoilt = Result("c/card", "", "mine", "1", Verdict("error", message="no space", triggers=(OF_FILES,)))
    refused = Verdict("error", message="calibration: no space", triggers=(NOT_CALIBRATED,))
    found = [
        not_to_blame(Result("a/b", "", name, "1", refused), replace(spoilt, renderer=name))
        for name in ("mine", "theirs", "others")
    ]
    (line,) = messages(found)
    assert "mine, theirs, others: 3 jobs failed alike: no space" in line.plain
    upside_down = replace(spoilt, verdict=Verdict("bug", message="upside down"))
    assert not_to_blame(Result("a/b", "", "mine", "1", refused), upside_down).verdict == refused
    assert not_to_blame(Result("a/b", "", "mine", "1", refused), None).verdict == refused


def test_what_every_scene_lacks_has_no_counts_of_its_own() -> None:
    told = "adapter 'mine': scene 'a/b' needs mirror, sphere; choose another renderer for this scene"
    for count in (1, 3):
        (same,) = alike([result(told, "unsupported")] * count)
        assert same.told == "it lacks mirror, sphere"


def test_what_a_renderer_lacks_is_counted() -> None:
    """The message is the one that adapters.requirements writes."""
    told = "adapter 'mine': scene 'a/b' needs {}; choose another renderer for this scene"
    found = [result(told.format(each), "unsupported") for each in ("mirror, sphere", "sphere", "shadows")]
    assert missing_features(found[0]) == ("mirror", "sphere")
    (same,) = alike(found)
    assert same.told == "it lacks sphere (2), mirror (1), shadows (1)"
