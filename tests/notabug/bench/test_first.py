"""What a user waits for is timed, and a command that fails is told, not timed."""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path
from typing import Any

import pytest
import typer

from notabug.bench.first import RENDERERS, WARM, Wait, run, timed, verdicts
from notabug.cli import app

# Writes down what it is told, and with what cache.
RECORDER = """
import json, os, sys
from pathlib import Path
cache = Path(os.environ.get("NOTABUG_CACHE", "."))
with Path(sys.argv[1]).open("a") as notes:
    print(json.dumps([sys.argv[2:], cache.is_dir()]), file=notes)
cache.mkdir(exist_ok=True)
"""


def test_seconds_and_processor_seconds_of_a_command() -> None:
    code = "import time; begun = time.process_time()\nwhile time.process_time() < begun + 0.2: pass\ntime.sleep(0.3)"
    seconds, processor = timed((sys.executable, "-c", code), os.environ)
    assert seconds > 0.5
    assert 0.2 <= processor < seconds + 0.1


def test_a_command_that_fails_is_no_short_wait() -> None:
    with pytest.raises(SystemExit, match="ended with 3"):
        timed((sys.executable, "-c", "raise SystemExit(3)"), os.environ)


def test_a_wait_says_whether_it_is_too_long() -> None:
    assert str(Wait("it", 0.5, 0.25, 1.0)) == "✓ it: 0.50 s (asked: under 1), 0.25 s of processor"
    assert str(Wait("it", 1.5, 0.25, 1.0)).startswith("✗")


def test_the_first_verdict_finds_no_cache_and_a_run_is_timed_when_all_is_predicted(tmp_path: Path) -> None:
    notes = tmp_path / "notes"
    program = (sys.executable, "-c", RECORDER, str(notes))
    waits = [*verdicts(program, tmp_path), run(program, tmp_path, RENDERERS)]
    assert all(wait.seconds > 0 and wait.processor > 0 for wait in waits)
    told = [json.loads(line) for line in notes.read_text().splitlines()]
    assert [words[0] for words, _ in told] == ["judge"] * (1 + WARM) + ["--help"] * WARM + ["run"] * 2
    assert [cache for _, cache in told[: 1 + WARM]] == [False] + [True] * WARM
    assert Path(told[0][0][1]).is_file()
    commands: Any = typer.main.get_command(app)
    for words, _ in told:
        if words[0] != "--help":  # the program understands what it is told
            commands.commands[words[0]].make_context(words[0], list(words[1:]), resilient_parsing=False)
