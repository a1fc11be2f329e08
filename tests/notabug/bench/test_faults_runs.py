"""What the bench of faults says of runs: each thing that could be wrong is found, and a right run is let pass."""

from __future__ import annotations

import ast
import json
import random
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from notabug.bench import faults_disk, faults_kills, faults_misdeeds, faults_setting
from notabug.bench.faults_setting import PROGRAM, Setting, trace


def record(out: Path, verdicts: dict[str, tuple[str, str]]) -> None:
    out.mkdir(parents=True, exist_ok=True)
    results = [{"scene": name, "verdict": word, "message": says} for name, (word, says) in verdicts.items()]
    (out / "run.json").write_text(json.dumps({"results": results}))


@pytest.fixture
def setting(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Setting:
    """A folder in which nothing runs, with a picture and a place for temporary files."""
    monkeypatch.setattr(faults_setting, "GRACE", 0.0)
    for name in ("pictures", "tmp"):
        (tmp_path / name).mkdir()
    return Setting(tmp_path, ("good", "negative"), "wild")


def test_each_misdeed_is_one_that_the_program_does() -> None:
    body = [part for file in PROGRAM.parent.glob("*.py") for part in ast.parse(file.read_text(encoding="utf-8")).body]
    deeds = {each.name for each in body if isinstance(each, ast.FunctionDef) and each.decorator_list}
    assert deeds == {*faults_misdeeds.MATRIX, "fails_once"}  # which is for retries, and no misdeed when it is done


def test_a_run_with_misdeeds_that_are_told_is_right(setting: Setting) -> None:
    record(setting.out, {"good": ("pass", ""), "negative": ("bug", "negative values")})
    assert faults_misdeeds.judged(setting, 1, "  | Traceback (most recent call last):") == {}


def _forget(setting: Setting) -> None:
    record(setting.out, {"negative": ("bug", "negative values")})


def _misjudge(setting: Setting) -> None:
    record(setting.out, {"good": ("bug", "why"), "negative": ("bug", "negative values")})


def _believe(setting: Setting) -> None:
    record(setting.out, {"good": ("pass", ""), "negative": ("pass", "")})


def _fill(setting: Setting) -> None:
    with (setting.out / "large").open("wb") as file:
        file.truncate(faults_misdeeds.MOST_LEFT)


def _leak(setting: Setting) -> None:
    (setting.pictures / "outside-run").mkdir()
    (setting.pictures / "outside-run" / "log.txt").touch()


@pytest.mark.parametrize(
    ("spoil", "code", "log", "named"),
    [
        (_forget, 1, "", "good"),
        (_misjudge, 1, "", "good"),
        (_believe, 0, "", "negative"),
        (_fill, 1, "", "disk"),
        (_leak, 1, "", "outside"),
        (None, 3, "", "exit code"),
        (None, None, "", "exit code"),
        (None, 1, "line\nTraceback (most recent call last):\n", "trace"),
        (None, 1, "a \x1b]0;title\x07", "terminal"),
    ],
)
def test_what_is_wrong_with_a_run_over_misdeeds_is_named(
    spoil: Callable[[Setting], None] | None, code: int | None, log: str, named: str, setting: Setting
) -> None:
    record(setting.out, {"good": ("pass", ""), "negative": ("bug", "negative values")})
    if spoil is not None:
        spoil(setting)
    assert list(faults_misdeeds.judged(setting, code, log)) == [named]


def test_a_process_that_is_left_is_found_and_ended(setting: Setting) -> None:
    sleeps = [sys.executable, "-S", "-c", "import time; time.sleep(3600)"]
    with subprocess.Popen(sleeps, env=setting.environment()) as marked, subprocess.Popen(sleeps, env={}) as noted:
        (setting.pictures / f"daemon-{noted.pid}.pid").write_text("detaches")
        told = setting.end_all()
        assert (marked.wait(60), noted.wait(60)) == (-signal.SIGKILL, -signal.SIGKILL)
    assert "2 processes are left" in told
    assert "detaches" in told
    assert setting.end_all() == ""


SHOWN = frozenset({"run.json", "own/a/b/slow/result.json"})


@pytest.fixture
def attempt(setting: Setting, monkeypatch: pytest.MonkeyPatch) -> Any:
    """A run that went on after a kill, and what it has left is right."""
    out = setting.folder / "out0"
    (out / "own/a/b/slow").mkdir(parents=True)
    (out / "own/a/b/slow/result.json").write_text('{"result": {"scene": "good"}}')
    record(out, {"good": ("pass", ""), "negative": ("pass", "")})
    for source in setting.sources:
        (setting.folder / source).write_text("#usda 1.0\n")
    monkeypatch.setattr(Setting, "run", lambda self, *words: (0, ""))
    return faults_kills._Attempt(setting, out, "1", random.Random(0), 0.0)


def test_a_run_that_goes_on_as_it_should_is_right(attempt: Any) -> None:
    attempt._look()
    assert attempt.final == {"good": 0}
    assert attempt.finish(SHOWN) == []


def test_what_a_killed_run_has_lost_or_left_is_named(attempt: Any) -> None:
    attempt._look()
    attempt.final["negative"] = 1  # as if it had been on record
    (attempt.out / "half.json").write_text("{")
    attempt._look()
    assert attempt.found == ["half a file: half.json", "lost: negative"]
    (attempt.setting.pictures / "calls.txt").write_text("good\n")
    record(attempt.out, {"good": ("pass", "")})
    (attempt.setting.folder / "tmp" / "notabug-x").mkdir()
    told = "\n".join(attempt.finish(SHOWN))
    for says in ("results: {'good': 1}", "drawn again: good", "files: half.json", "temporary files: notabug-x"):
        assert says in told


def test_a_run_on_a_full_disk_that_ends_otherwise_is_named(setting: Setting, monkeypatch: pytest.MonkeyPatch) -> None:
    disk = setting.folder / "disk"
    record(disk / "out", {"good": ("bug", "")})
    (disk / "out" / ".run.json.x.partial").touch()
    monkeypatch.setattr(faults_disk, "_system", lambda *words: None)
    monkeypatch.setattr(Setting, "run", lambda self, *words, environment: (1, "Traceback (most recent call last):"))
    told = "\n".join(faults_disk._filled(setting, disk, cached=False, by_files=False))
    for says in ("exit code 1", "verdicts on a full disk", "with room again it ended with 1", "half files are left"):
        assert says in told
    assert trace("Traceback (most recent call last):") in told
    record(disk / "out", {"good": ("pass", ""), "negative": ("pass", "")})
    (disk / "out" / ".run.json.x.partial").unlink()
    monkeypatch.setattr(Setting, "run", lambda self, *words, environment: (0, ""))
    assert faults_disk._filled(setting, disk, cached=False, by_files=False) == []


@pytest.mark.slow
@pytest.mark.parametrize("kills", [1, pytest.param(3, marks=pytest.mark.sweep)])
def test_a_run_is_killed_and_goes_on(kills: int) -> None:
    assert faults_kills.take(7, 0, kills=kills) == []


@pytest.mark.slow
def test_a_disk_fills_and_has_room_again() -> None:
    if why := faults_disk.why_not():
        pytest.skip(why)
    assert faults_disk.take(7, 0, points=1) == []


@pytest.mark.slow
def test_misdeeds_at_the_command_line() -> None:
    assert faults_misdeeds.take(["prints_escapes", "links_its_folder", "links_in_our_place"]) == {}
