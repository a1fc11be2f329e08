"""The command line: exit codes, purity of --json, errors in one line, and what starting it imports."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import notabug
import notabug.__main__ as program
from notabug.adapters.base import RendererError, RendererMissingError
from notabug.exit_codes import ExitCode, exit_code
from notabug.metrics.policy import flat
from notabug.metrics.verdict import Finding, Verdict
from notabug.results.gate import Gate, code_of
from notabug.results.record import Result
from notabug.runs.selection import NothingSelectedError
from notabug.scenes_usd.errors import NotabugError, SceneError
from notabug.scenes_usd.picture import write_exr

NAMES = [f"{index}.usda" for index in range(8)]


def test_starting_imports_nothing_heavy() -> None:
    heavy = "{'numpy', 'pxr', 'OpenImageIO', 'scipy', 'mitsuba', 'colour', 'jinja2', 'flip_evaluator'}"
    code = f"import sys, notabug.cli; print(sorted({heavy} & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_the_program_says_its_version_and_is_light_to_import() -> None:
    done = subprocess.run([sys.executable, "-m", "notabug", "--version"], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == f"notabug {notabug.__version__}"
    code = "import sys, notabug.__main__; print('typer' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"


@pytest.mark.parametrize(
    ("words", "long"),
    [
        (["run", *NAMES], True),
        (["run", *NAMES, "-r", "povray"], True),
        (["run", *NAMES[:3]], False),
        (["run"], False),
        (["judge", *NAMES], False),
        (["run", *NAMES, "--executor", "dask://a:1"], False),
        (["run", "--workarounds", *NAMES], False),
        ([], False),
    ],
)
def test_workers_are_started_ahead_for_a_long_run_alone(
    words: list[str], long: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    started: list[str] = []
    monkeypatch.setattr("notabug.runs.workers.cores_here", lambda: 2)
    monkeypatch.setattr("notabug.runs.workers.prepare", lambda: started.append("workers"))
    monkeypatch.setattr("notabug.cli.main", lambda: started.append("words are read"))
    monkeypatch.setattr(sys, "argv", ["notabug", *words])
    program.main()
    assert started == (["workers"] if long else []) + ["words are read"]


def test_help_names_every_command(door: Any) -> None:
    assert door("--help") == 0
    for command in ("run", "judge", "list", "doctor", "report"):
        assert command in door.stdout


def test_json_is_one_document_and_nothing_else(door: Any) -> None:
    door.judge.verdicts["terminator/sphere"] = Verdict("bug", message="x")
    assert door.run("terminator/sphere", "texture/uneven_quad", "--json") == 1
    document = json.loads(door.stdout)
    assert document == json.loads((door.out / "run.json").read_text()) | {"seconds": document["seconds"]}
    assert document["policy"] == flat()
    assert "terminator/sphere" in door.stderr


@pytest.mark.parametrize("topic", ["scenes", "renderers", "models", "variants", "declarations", "policy"])
def test_lists_are_json_too(door: Any, topic: str) -> None:
    assert door("list", topic, "--json") == 0
    assert json.loads(door.stdout)[topic]
    assert door("list", topic) == 0


def test_doctor(door: Any) -> None:
    door.renderers["gone"] = type(door.grey)("gone", install="apt install gone", installed=False)
    assert door("doctor", "--json") == 0
    checks = {each["name"]: each for each in json.loads(door.stdout)["checks"]}
    assert checks["grey"]["fine"] is True
    assert checks["gone"]["fine"] is None
    assert "apt install gone" in checks["gone"]["says"]
    assert checks["numpy"]["says"] == np.__version__


@pytest.mark.parametrize(
    ("words", "code", "says"),
    [
        (["no/such"], 2, "no scene or class called 'no/such'"),
        (["no*such"], 5, "no scene matches"),
        (["missing.usda"], 2, "missing.usda: no such file"),
        (["terminator", "--variant", "tessellation=1x1"], 2, "no selected scene has tessellation=1x1"),
        (["terminator", "--variant", "size=1"], 2, "no selected scene has the variant set 'size'"),
        (["terminator", "--variant", "tessellation"], 2, "expected SET=NAME"),
        (["-r", "nobody"], 2, "no renderer called 'nobody'"),
        (["--samples", "-1"], 2, "samples"),
    ],
)
def test_a_wrong_word_is_one_line_and_a_code(door: Any, words: list[str], code: int, says: str) -> None:
    assert door.run(*words) == code
    assert says in door.stderr
    assert "Traceback" not in door.stderr
    assert door.stdout == ""
    assert door.grey.drawn == []


def test_markup_in_an_error_is_text(door: Any) -> None:
    assert door.run("[bold]x[/nonsense]") in (2, 5)
    assert "[bold]x[/nonsense]" in door.stderr


@pytest.mark.parametrize(
    ("error", "code"),
    [
        (NotabugError("x"), ExitCode.USAGE),
        (SceneError("x"), ExitCode.USAGE),
        (RendererError("x"), ExitCode.RENDERER),
        (RendererMissingError("x"), ExitCode.RENDERER),
        (NothingSelectedError("x"), ExitCode.NOTHING),
    ],
)
def test_each_error_has_its_code(error: NotabugError, code: ExitCode) -> None:
    assert exit_code(error) is code


@pytest.mark.parametrize(
    ("words", "expected", "code"),
    [
        ([], "", ExitCode.OK),
        (["pass", "limitation", "inconclusive", "unsupported"], "", ExitCode.OK),
        (["pass", "bug", "error"], "", ExitCode.BUG),
        (["pass", "error"], "", ExitCode.RENDERER),
        (["bug"], "bug", ExitCode.OK),
        (["bug"], "limitation: facet_self_shadow", ExitCode.BUG),
    ],
)
def test_the_worst_result_decides(words: list[Any], expected: str, code: ExitCode) -> None:
    results = [Result("a/b", "", "r", "1", Verdict(word), expected=expected) for word in words]
    assert code_of([Gate().judged(each) for each in results]) is code


def test_judge_a_picture(door: Any, tmp_path: Path) -> None:
    write_exr(tmp_path / "a.exr", np.full((256, 256, 3), 0.5))
    bug = Finding("bug", "no_shadow", 12.0, (1, 2, 3, 4), message="[red]not markup[/red]")
    door.judge.verdicts["terminator/sphere"] = Verdict("bug", (bug,), message="a sentence")
    assert door("judge", "a.exr", "--scene", "terminator/sphere") == 1
    assert "a sentence" in door.stdout
    assert "no shadow" in door.stdout
    assert "[red]not markup[/red]" in door.stdout
    assert door("judge", "a.exr", "--scene", "terminator/sphere", "--json", "--variant", "tessellation=8x4") == 1
    document = json.loads(door.stdout)
    assert document["results"][0]["variant"] == "tessellation=8x4"
    assert document["declaration"]["filter"] == "unknown"


def test_judge_writes_a_report_where_asked(door: Any, tmp_path: Path) -> None:
    write_exr(tmp_path / "a.exr", np.full((256, 256, 3), 0.5))
    write_exr(tmp_path / "b.exr", np.full((256, 256, 3), 0.5))
    assert door("judge", "a.exr", "b.exr", "--scene", "terminator/sphere", "--out", "there", "--encoding", "srgb") == 0
    result = json.loads(Path("there/run.json").read_text())["results"][0]
    assert Path("there/report.html").is_file()
    assert (Path("there") / result["image"]).is_file()


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["gone.exr", "--scene", "terminator/sphere"], "gone.exr: no such file"),
        (["empty.exr", "--scene", "terminator/sphere"], "empty.exr: the file is empty"),
        (["text.exr", "--scene", "terminator/sphere"], "text.exr: not a picture"),
        (["text.exr", "--scene", "no/such"], "no scene called 'no/such'"),
        (["text.exr", "--scene", "terminator/sphere", "--variant", "tessellation=8x4,16x8"], "2 variants"),
    ],
)
def test_judge_refuses_what_is_no_picture(door: Any, words: list[str], says: str) -> None:
    Path("empty.exr").touch()
    Path("text.exr").write_text("not a picture")
    assert door("judge", *words) == 2
    assert says in door.stderr
    assert "Traceback" not in door.stderr


@pytest.mark.parametrize(
    "error", [ValueError("a [red]value[/]"), MemoryError(), RecursionError("deep"), ConnectionRefusedError(111, "no")]
)
def test_a_defect_of_ours_is_no_bug_of_a_renderer(
    error: Exception, door: Any, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    def fail(*_: object, **__: object) -> None:
        raise error

    monkeypatch.setattr("notabug.commands.listing.command", fail)
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    assert door("list") == ExitCode.INTERNAL == 70
    assert door.stderr.count("\n") == 1
    assert f"internal error: {type(error).__name__}: {error}" in door.stderr
    (saved,) = tmp_path.glob("notabug-*.log")
    assert str(saved) in door.stderr
    assert "Traceback" in saved.read_text()


@pytest.mark.parametrize(
    "error",
    [
        OSError(28, "No space left on device"),
        PermissionError(13, "Permission denied", "/x/run.json"),
        OSError(30, "Read-only file system", "/x"),
        IsADirectoryError(21, "Is a directory", "/x/log.txt"),
        OSError(27, "File too large"),
    ],
)
def test_what_the_system_says_of_files_is_one_line_and_a_usage_error(
    error: OSError, door: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object, **__: object) -> None:
        raise error

    monkeypatch.setattr("notabug.commands.listing.command", fail)
    assert door("list") == ExitCode.USAGE
    assert door.stderr.count("\n") == 1
    assert str(error.strerror) in door.stderr
    assert str(error.filename or "") in door.stderr


def test_an_import_that_fails_is_no_bug_of_a_renderer(tmp_path: Path) -> None:
    """A broken installation ends with Python's own exit code, 1, which here stands for a renderer's bug."""
    (tmp_path / "typer.py").write_text("raise ImportError('broken')")
    done = subprocess.run(
        [sys.executable, "-c", "import notabug.__main__ as program; program.main()", "list"],
        env={**os.environ, "PYTHONPATH": f"{tmp_path}:{os.environ.get('PYTHONPATH', '')}", "TMPDIR": str(tmp_path)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 70, done.stderr
    assert done.stderr.count("\n") == 1
    assert len(list(tmp_path.glob("notabug-*.log"))) == 1


def test_where_no_trace_can_be_saved_it_is_printed(door: Any, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr("notabug.commands.listing.command", lambda *_: 1 / 0)
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "gone"))
    assert door("list") == ExitCode.INTERNAL
    assert "Traceback" in door.stderr


def test_a_cache_that_cannot_be_is_a_usage_error(tmp_path: Path) -> None:
    write_exr(tmp_path / "a.exr", np.zeros((4, 4, 3)))
    words = ["judge", str(tmp_path / "a.exr"), "--scene", "terminator/sphere"]
    done = subprocess.run(
        [sys.executable, "-m", "notabug", *words],
        env={**os.environ, "NOTABUG_CACHE": "/dev/null/x"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 2, done.stderr
    assert "the cache cannot be used" in done.stderr
    assert done.stderr.count("\n") == 1
