"""Every command, sub-command and bench that ``--help`` lists runs on a tiny input and says what it should.

A command that is added without a row here fails ``test_every_command_has_a_row``.
"""

from __future__ import annotations

import enum
import functools
import inspect
import json
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, get_args, get_type_hints

import numpy as np
import pytest
from typer.models import ArgumentInfo

import notabug.bench.efficiency_plan
import notabug.bench.measuring
import notabug.bench.metamorphic
import notabug.bench.metamorphic_relations
import notabug.bench.speed
import notabug.bench.stability_sweeps
import notabug.bench.verdict.command
from notabug.bench.verdict.design import QUICK, groups
from notabug.cli import app, main
from notabug.command_line import options
from notabug.scenes_usd.picture import write_exr
from notabug.scenes_usd.reader import read_scene
from notabug.scenes_usd.writer import write_scene

pytestmark = pytest.mark.slow

SIDE = 24
Tell = Callable[..., tuple[int, str, str]]

# What each command is called with, in a folder that holds tiny.usda, frame.exr, run (of tiny.usda by inhouse) and run2.
# A row's codes are those that the command may end with here.
ROWS: tuple[tuple[tuple[str, ...], tuple[int, ...]], ...] = (
    (("run", "tiny.usda", "-r", "inhouse", "--out", "out"), (0,)),
    (("judge", "frame.exr", "--scene", "tiny.usda", "--filter", "point", "--json"), (0,)),
    (("why", "frame.exr", "--scene", "tiny.usda", "--pixel", "12,12"), (0,)),
    (("check", "tiny.usda", "--json"), (0,)),
    (("adapt", "tiny.usda", "--out", "own.usda", "--json"), (0,)),
    (("why", "run/own/{picture}", "--json"), (0,)),
    (("references", "verify", "terminator/sphere", "--json"), (0,)),
    (("calibrate", "-r", "inhouse", "--json"), (0,)),
    (("export", "terminator/sphere", "--to", "json", "--out", "exported", "--json"), (0,)),
    (("report", "run", "--to", "html", "--single-file", "--baseline", "run2", "--json"), (0,)),
    *((("export", "terminator/sphere", "--to", each.value, "--out", "exported"), (0,)) for each in options.Format),
    *((("list", each.value), (0,)) for each in options.Topic),
    (("doctor", "--json"), (0,)),
    (("install", "--json"), (0,)),
    (("reduce", "tiny.usda", "-r", "inhouse"), (5,)),
    (("accept", "tiny", "-r", "inhouse", "--because", "a test", "--run", "run", "--json"), (0,)),
    (("merge", "run", "run2", "--out", "merged", "--json"), (0,)),
    (("diff", "run", "run", "--json"), (0,)),
    *((("report", "run", "--to", each.value), (0,)) for each in options.Page),
    (("gallery", "run", "--scene", "terminator/sphere", "--no-models", "--out", "site", "--json"), (0,)),
)
WORDS = {  # the arguments that name a sub-command, and the test or the row that runs each
    "list": options.Topic,
    "export": options.Format,
    "report": options.Page,
    "references": options.Deed,
    "bench": options.Bench,
}
ELSEWHERE = {
    "references build": "writes into the package's own corpus: tests/notabug/test_corpus.py builds into a folder",
    "bench speed": "test_bench_speed",
    "bench verdict": "test_bench_verdict",
    "bench efficiency": "test_bench_efficiency",
    "bench stability": "test_bench_stability",
    "bench metamorphic": "test_bench_metamorphic",
    "bench faults": "tests/notabug/bench/test_faults.py",
    "bench generality": "tests/notabug/bench/test_generality_bench.py",
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a tiny scene, a picture of it, and two runs."""
    made = tmp_path_factory.mktemp("commands")
    scene = replace(read_scene("terminator/sphere", {"tessellation": "8x4"}), width=SIDE, height=SIDE)
    write_scene(scene, made / "tiny.usda")
    write_scene(replace(scene, lights=scene.lights[:1]), made / "second.usda")
    from notabug.references.predict import preview

    write_exr(made / "frame.exr", np.asarray(preview(read_scene(made / "tiny.usda"))))
    return made


@pytest.fixture
def tell(folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Tell:
    """The command line in this process, in the folder: exit code, standard output, standard error."""
    monkeypatch.chdir(folder)
    monkeypatch.setenv("NOTABUG_JOBS", "1")
    monkeypatch.delenv("NOTABUG_REQUIRE", raising=False)
    monkeypatch.delenv("CI", raising=False)
    monkeypatch.delenv("GITHUB_STEP_SUMMARY", raising=False)

    def told(*words: str) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["notabug", *words])
        with pytest.raises(SystemExit) as stop:
            main()
        out, err = capsys.readouterr()
        return int(stop.value.code or 0), out, err

    return told


@pytest.fixture
def runs(folder: Path, tell: Tell) -> None:
    for name, source in (("run", "tiny.usda"), ("run2", "second.usda")):
        if not (folder / name).is_dir():
            code, _, err = tell("run", source, "-r", "inhouse", "--out", name)
            assert code == 0, err


@pytest.mark.parametrize(
    ("words", "codes"), ROWS, ids=lambda each: "-".join(each[:4]) if isinstance(each[0], str) else ""
)
def test_it_runs(words: tuple[str, ...], codes: tuple[int, ...], tell: Tell, runs: None, folder: Path) -> None:
    picture = next((folder / "run" / "own").rglob("renders/*.exr")).relative_to(folder / "run" / "own")
    code, out, err = tell(*(word.format(picture=picture) for word in words))
    assert code in codes, err
    assert out + err or words[0] == "report"  # of a run without complaints a build server is told nothing
    assert "Traceback" not in out + err
    if "--json" in words:
        assert json.loads(out)


def commands() -> dict[str, Callable[..., Any]]:
    """The function of every command, by the name that ``--help`` lists."""
    return {each.name or each.callback.__name__: each.callback for each in app.registered_commands if each.callback}


def test_every_command_has_a_row() -> None:
    """A command with sub-commands needs one for each."""
    rows = {" ".join(words[: 1 + (words[0] in ("list", "references"))]) for words, _ in ROWS}
    rows |= {f"{words[0]} {words[words.index('--to') + 1]}" for words, _ in ROWS if "--to" in words}
    wanted = set()
    for name in commands():
        subs: Any = WORDS.get(name)
        wanted |= {f"{name} {each.value}" for each in subs} if subs is not None else {name}
    assert wanted - rows - set(ELSEWHERE) == set()
    assert set(ELSEWHERE) - wanted == set()


def test_every_choice_of_words_is_a_sub_command() -> None:
    """A word with choices that is an argument, or says to what, decides what a command does: each choice is run."""
    for name, function in commands().items():
        for parameter, kind in get_type_hints(function).items():
            chosen = inspect.isclass(kind) and issubclass(kind, enum.Enum)
            about = get_args(get_type_hints(function, include_extras=True)[parameter])[1:]
            if chosen and (parameter == "to" or any(isinstance(each, ArgumentInfo) for each in about)):
                assert WORDS.get(name) is kind, f"{name}: {parameter}"


def test_bench_speed(tell: Tell, monkeypatch: pytest.MonkeyPatch) -> None:
    """Every figure is measured: one that is misses its aim here is no failure, one that crashes is."""
    monkeypatch.setattr(notabug.bench.speed, "RAYS", 8)
    monkeypatch.setattr(notabug.bench.speed, "_best", functools.partial(notabug.bench.speed._best, repeats=1))
    monkeypatch.setattr(notabug.bench.speed, "PICTURES", 1)
    monkeypatch.setattr(notabug.bench.speed, "TESSELLATION", "8x4")
    code, out, err = tell("bench", "speed", "--json")
    assert code in (0, 1), err
    figures = {each["name"]: each for each in json.loads(out)["figures"]}
    assert len(figures) >= 5
    for name, each in figures.items():
        assert each["value"] or "no Embree" in each["note"], name
    rays = next(each for name, each in figures.items() if "Embree" in name)
    assert "Mrays/s" in rays["note"]


def test_bench_verdict(tell: Tell, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    few = [each for each in groups(QUICK) if each.label != "bug"][:1] + [
        each for each in groups(QUICK) if each.label == "bug"
    ][:1]
    tiny = [replace(each, pixels=SIDE, conditions=("point",)) for each in few]
    monkeypatch.setattr(notabug.bench.verdict.command, "groups", lambda size: tiny)
    monkeypatch.setattr(notabug.bench.verdict.command, "renderer_groups", lambda size: [])
    monkeypatch.setattr(notabug.bench.verdict.command, "folder", lambda: tmp_path / "kept")
    code, out, err = tell("bench", "verdict", "--quick", "--json", "--out", "verdict")
    assert code in (0, 1), err
    assert json.loads(out)["groups"] == [2, 2]


def test_bench_efficiency(tell: Tell, monkeypatch: pytest.MonkeyPatch) -> None:
    whole = notabug.bench.efficiency_plan.plan
    monkeypatch.setattr(notabug.bench.efficiency_plan, "CLASSES", ("terminator/sphere",))
    monkeypatch.setattr(notabug.bench.measuring, "QUICK_SIDE", SIDE)
    code, out, err = tell("bench", "efficiency", "--quick", "-r", "inhouse float64", "--json", "--out", "efficiency")
    assert whole is notabug.bench.efficiency_plan.plan
    assert code == 0, err
    assert json.loads(out)["results"]


def test_bench_stability(tell: Tell, monkeypatch: pytest.MonkeyPatch) -> None:
    name = "gap"
    only = {name: notabug.bench.stability_sweeps.SWEEPS[name]}
    monkeypatch.setattr(notabug.bench.stability_sweeps, "SWEEPS", only)
    monkeypatch.setattr(notabug.bench.measuring, "QUICK_SIDE", SIDE)
    code, out, err = tell("bench", "stability", "--quick", "-r", "inhouse float64", "--json", "--out", "stability")
    assert code == 0, err
    assert {each["sweep"] for each in json.loads(out)["results"]} == {name}


def test_bench_metamorphic(tell: Tell, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(notabug.bench.metamorphic, "SCENES", ("terminator/sphere",))
    stages = notabug.bench.metamorphic.stages
    monkeypatch.setattr(notabug.bench.metamorphic, "stages", lambda names: stages(names, side=SIDE))
    code, out, err = tell("bench", "metamorphic", "--quick", "-r", "inhouse float64", "--json", "--out", "relations")
    assert code == 0, err
    results = json.loads(out)["results"]
    assert results
    assert not any(each["broken"] for each in results)
