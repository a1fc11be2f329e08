"""Children that stay: they answer job after job, and one that fails, hangs or dies costs its own job alone."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import psutil
import pytest

from notabug.adapters.kept import KeptChild, end_kept, kept_child

CHILD = """
import json, os, sys, time
def say(word): print("noise without an end", end=""); print(f"\\n{os.environ['NOTABUG_JOB']} {word}", flush=True)
if sys.argv[1:] == ["dumb"]: sys.exit("it cannot start")
say(f"hello {os.getpid()}")
for line in sys.stdin:
    job = line.strip()
    print("at", job)
    if job.endswith("hang"): time.sleep(60)
    if job.endswith("die"): os._exit(7)
    say("failed " + json.dumps("no such\\nscene") if job.endswith("fail") else "done")
"""


@pytest.fixture
def child(tmp_path: Path) -> Iterator[KeptChild]:
    script = tmp_path / "child.py"
    script.write_text(CHILD)
    made = kept_child((sys.executable, str(script)), where="tiny")
    yield made
    made.end()


def test_it_is_started_once_and_does_job_after_job(child: KeptChild, tmp_path: Path) -> None:
    ended = [child.do(tmp_path / name, timeout=30.0) for name in "abc"]
    assert [one.exit for one in ended] == [0, 0, 0]
    assert "at " + str(tmp_path / "c") in ended[2].log
    assert str(tmp_path / "a") not in ended[2].log
    assert kept_child(child.command, where="tiny") is child


def test_a_job_that_fails_says_why_and_the_child_stays(child: KeptChild, tmp_path: Path) -> None:
    child.greet(30.0)
    hello = child.hello
    ended = child.do(tmp_path / "fail", timeout=30.0)
    assert (ended.exit, ended.stopped) == (1, "")
    assert "no such\nscene" in ended.log
    assert child.do(tmp_path / "a", timeout=30.0).exit == 0
    assert child.hello == hello


@pytest.mark.parametrize(("job", "timeout", "stopped"), [("hang", 0.5, "time"), ("die", 30.0, "")])
def test_one_that_hangs_or_dies_is_replaced(
    child: KeptChild, tmp_path: Path, job: str, timeout: float, stopped: str
) -> None:
    child.greet(30.0)
    hello = child.hello
    ended = child.do(tmp_path / job, timeout=timeout)
    assert (ended.stopped, ended.exit != 0) == (stopped, True)
    assert not psutil.pid_exists(int(hello.split()[1]))
    assert child.do(tmp_path / "a", timeout=30.0).exit == 0
    assert child.hello != hello


def test_one_that_was_killed_between_jobs_is_replaced(child: KeptChild, tmp_path: Path) -> None:
    child.greet(30.0)
    psutil.Process(int(child.hello.split()[1])).kill()
    psutil.wait_procs(psutil.Process().children(), timeout=5.0)
    assert child.do(tmp_path / "a", timeout=30.0).exit == 0


def test_one_that_cannot_start_says_why(child: KeptChild, tmp_path: Path) -> None:
    dumb = kept_child((*child.command, "dumb"), where="tiny")
    ended = dumb.do(tmp_path / "a", timeout=30.0)
    assert ended.exit == 1
    assert "it cannot start" in ended.log


def test_none_is_left_when_all_are_ended(child: KeptChild, tmp_path: Path) -> None:
    child.greet(30.0)
    process = int(child.hello.split()[1])
    end_kept()
    assert not psutil.pid_exists(process)
    assert kept_child(child.command, where="tiny") is not child


def test_what_it_leaves_among_temporary_files_goes_with_it(tmp_path: Path) -> None:
    script = tmp_path / "child.py"
    script.write_text(
        CHILD.replace("for line", "import tempfile\nkeeps = tempfile.mkdtemp()\nfor line").replace(
            'at", job', 'at", keeps'
        )
    )
    made = kept_child((sys.executable, str(script)), where="tiny")
    said = made.do(tmp_path, timeout=30.0).log.split("at ")[1].split()[0]
    assert Path(said).is_dir()
    made.end()
    assert not Path(said).exists()
