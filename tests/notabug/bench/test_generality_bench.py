"""The generality bench: a small fixed sample by the real renderers, and the machinery round it."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import notabug.bench.generality.command as bench
from notabug.adapters import registry
from notabug.adapters.base import Declaration, Found, Quality, Render, RendererError, UnsupportedError
from notabug.bench.generality.command import command, jobs
from notabug.bench.generality.draw import write_random_scene
from notabug.bench.generality.examine import controls, examine, guarded, unknown_making
from notabug.bench.generality.jobs import Job, expose, installed, sized
from notabug.bench.generality.reducing import write_bugs
from notabug.bench.generality.summary import is_bad, sentence, summary
from notabug.exit_codes import ExitCode
from notabug.scenes_usd.errors import SelectionError
from notabug.scenes_usd.picture import write_exr
from notabug.scenes_usd.reader import read_scene
from notabug.scenes_usd.scene import Scene

SIDE = 40
SAMPLE = ((0, 0), (0, 1), (0, 3), (0, 4), (0, 5), (1, 0))  # (seed, index): sphere, box, capsule, mirror, opacity, torus
WITH_CONTROLS = ((0, 4), (1, 0))


@pytest.fixture(scope="module")
def sample(tmp_path_factory: pytest.TempPathFactory) -> dict[tuple[int, int], Scene]:
    folder = tmp_path_factory.mktemp("sample")
    return {
        each: sized(read_scene(write_random_scene(*each, folder / f"{each[0]}-{each[1]}")), SIDE) for each in SAMPLE
    }


@pytest.mark.slow
@pytest.mark.parametrize("place", SAMPLE, ids=str)
@pytest.mark.sweep_except("(0, 0)", "(1, 0)")
def test_povray_has_no_bug_on_the_sample(place: tuple[int, int], sample: Any, povray: Any) -> None:
    found = examine(sample[place], povray, Quality(samples=16), naming=False)
    assert found["word"] in ("pass", "limitation", "unsupported"), sentence({**ABOUT, **found})


@pytest.mark.slow
@pytest.mark.parametrize("place", SAMPLE, ids=str)
@pytest.mark.sweep_except("(0, 0)", "(1, 0)")
def test_mitsuba_has_no_bug_on_the_sample(place: tuple[int, int], sample: Any, mitsuba: Any) -> None:
    found = examine(sample[place], mitsuba, Quality(samples=16), naming=False)
    assert found["word"] in ("pass", "limitation", "unsupported"), sentence({**ABOUT, **found})


@pytest.mark.slow
@pytest.mark.parametrize("place", WITH_CONTROLS, ids=str)
def test_black_and_noise_never_pass(place: tuple[int, int], sample: Any) -> None:
    made = controls(sample[place], 0)
    assert [each["renderer"] for each in made] == ["black", "noise"]
    assert {each["word"] for each in made} <= {"bug", "inconclusive"}


ABOUT = {"part": "scenes", "seed": 0, "index": 0}


class Painter:
    """A renderer of one colour, or of mishaps."""

    name = "painter"
    capabilities = frozenset({"mesh", "sphere", "normals", "uv", "texture", "point_light", "distant_light"})
    install = "part of the test"

    def __init__(self, mishap: Exception | None = None) -> None:
        self.mishap, self.drawn = mishap, 0

    def declaration(self, quality: Quality) -> Declaration:
        return replace(unknown_making(), filter="point", radius=0.0)

    def find(self) -> Found:
        return Found("1", "here")

    def render(self, scene: Scene, out: Path, quality: Quality) -> tuple[Render, ...]:
        self.drawn += 1
        if self.mishap:
            raise self.mishap
        write_exr(out / "a.exr", np.full((scene.height, scene.width, 3), 0.3))
        return (Render(out / "a.exr", 0, 1, 0.0),)


@pytest.mark.parametrize(
    ("mishap", "word"),
    [
        (UnsupportedError("no tori"), "unsupported"),
        (RendererError("crashed"), "error"),
        (ZeroDivisionError("x"), "traceback"),
    ],
)
def test_what_goes_wrong_is_a_record(mishap: Exception, word: str, sample: Any) -> None:
    found = examine(sample[0, 4], Painter(mishap), Quality(), naming=False)  # type: ignore[arg-type]
    assert found["word"] == word
    assert str(mishap) in found["message"]
    assert ("ZeroDivisionError" in found.get("trace", "")) == (word == "traceback")


def test_nothing_that_work_raises_gets_out() -> None:
    def work() -> dict[str, Any]:
        raise RecursionError("deep")

    assert guarded(work)["word"] == "traceback"


def test_the_jobs_of_each_part() -> None:
    made = jobs(("scenes", "faults", "limitations"), 10, 7, ("povray", "mitsuba"), quick=False, naming=True, side=0)
    by_part = {part: [each for each in made if each.part == part] for part in ("scenes", "faults", "limitations")}
    assert {part: len(found) for part, found in by_part.items()} == {"scenes": 10, "faults": 10, "limitations": 10}
    assert {each.seed for each in made} == {7}
    assert [each.renderers for each in by_part["faults"]] == [("povray",), ("mitsuba",)] * 5
    assert len({each.key() for each in made}) == len(made)
    assert len(jobs(("scenes",), 0, 0, ("povray",), quick=False, naming=True, side=0)) == bench.SCENES
    assert len(jobs(("faults", "limitations"), 0, 0, ("povray",), quick=False, naming=True, side=0)) == 400
    assert len(jobs(("meshes",), 0, 0, ("povray",), quick=False, naming=True, side=0)) >= 12


def test_a_renderer_that_is_named_must_be_there() -> None:
    with pytest.raises(SelectionError, match="no renderer called 'nobody'"):
        installed(("nobody",))
    assert set(installed(())) <= {"povray", "mitsuba"}


def record(**changes: Any) -> dict[str, Any]:
    return {**ABOUT, "renderer": "r", "word": "pass", "message": "", "bugs": [], "limitations": [], **changes}


@pytest.mark.parametrize(
    ("changes", "bad"),
    [
        ({}, False),
        ({"word": "limitation"}, False),
        ({"word": "bug", "bugs": ["unexplained"]}, True),
        ({"word": "error"}, False),
        ({"word": "traceback"}, True),
        ({"renderer": "black"}, True),
        ({"renderer": "noise", "word": "limitation"}, True),
        ({"renderer": "black", "word": "bug"}, False),
    ],
)
def test_what_is_wrong_with_us(changes: dict[str, Any], bad: bool) -> None:
    assert is_bad(summary([record(**changes)])["scenes"]) is bad


def test_shares_count_what_shows() -> None:
    made = [
        record(part="faults", shows=True, named=True, word="bug", bugs=["exponent"], right=["exponent"], fault="a"),
        record(part="faults", shows=True, named=True, word="bug", bugs=["albedo"], right=["exponent"], fault="a"),
        record(part="faults", shows=True, named=True, word="pass", right=["exponent"], fault="b"),
        record(part="faults", shows=False, named=True, word="unsupported", right=["exponent"], fault="b"),
    ]
    found = summary(made)["faults"]
    assert (found["called_bug"]["hits"], found["called_bug"]["of"]) == (2, 3)
    assert (found["named_right"]["hits"], found["named_right"]["of"]) == (1, 2)
    assert [each["word"] for each in found["missed"]] == ["pass"]


def known(painter: Painter, monkeypatch: pytest.MonkeyPatch) -> Painter:
    """``painter``, which the registry knows until the test ends."""
    monkeypatch.setitem(registry._adapters, painter.name, painter)
    return painter


@pytest.fixture
def painted(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Painter:
    """The bench in this process, with a painter, at a few pixels."""
    painter = known(Painter(), monkeypatch)
    monkeypatch.setattr(bench, "QUICK_SIDE", 16)
    monkeypatch.setattr(bench, "folder", lambda who: tmp_path / "kept")

    def alone(work: Any, expose: Any, within: Path, workers: int = 0) -> Any:
        from notabug.bench.verdict.run import _setting, kept

        within.mkdir(parents=True, exist_ok=True)
        for each in work:
            found = kept(each, within)
            yield found if found is not None else _setting([each], expose, within)[0]

    monkeypatch.setattr(bench, "run", alone)
    return painter


def told(out: Path, **changes: Any) -> ExitCode:
    words: dict[str, Any] = {"parts": ["scenes"], "scenes": 2, "seed": 0, "renderers": ["painter"], "quick": True}
    words |= {"naming": False, "reducing": False, "resume": True, "as_json": False, "out": out, **changes}
    return command(**words)


@pytest.mark.slow
def test_a_false_bug_is_printed_kept_and_shrunk(
    painted: Painter, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert told(tmp_path / "out", scenes=1, reducing=True) is ExitCode.BUG
    printed = capsys.readouterr()
    assert "scenes 0/0 painter: bug unexplained" in printed.out
    document = json.loads((tmp_path / "out" / "generality.json").read_text())
    assert document["summary"]["scenes"]["words"]["painter"]["bug"] == 1
    folder = tmp_path / "out" / "generality" / "0-0000-painter"
    assert read_scene(folder / "scene.usda").width <= 16
    assert (folder / "found.exr").is_file()
    assert (folder / "small-expected.exr").is_file()
    assert "expected" in (folder / "README.md").read_text()
    drawn = painted.drawn
    assert told(tmp_path / "out", scenes=1, as_json=True) is ExitCode.BUG
    assert painted.drawn == drawn  # it was kept
    assert json.loads(capsys.readouterr().out)["records"] == document["records"]


def test_shrinking_ends_in_time(sample: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    painter = known(Painter(), monkeypatch)
    scene = sample[0, 4]
    made = record(renderer="painter", word="bug", bugs=["x"], index=4, size=[16, 16], traits="")
    notes: list[str] = []
    (folder,) = write_bugs([made], tmp_path, notes.append, seconds=0.0)
    assert painter.drawn == 2  # the scene, and again what was left of it: nothing was tried in between
    assert len(read_scene(folder / "scene.usda").objects) == len(scene.objects)


@pytest.mark.slow
def test_one_scene_by_the_bench_itself(povray: Any, tmp_path: Path) -> None:
    made = expose(Job("scenes", 0, 4, ("povray",), naming=False, side=32))
    assert {each["renderer"] for each in made} == {"povray", "black", "noise"}
    assert not is_bad(summary(made)["scenes"]), [sentence(each) for each in made]
