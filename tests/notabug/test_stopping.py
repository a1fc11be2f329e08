"""A run that is stopped: finished results are on record, one line says so, and nothing is left behind."""

from __future__ import annotations

import contextlib
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from notabug.bench.faults_setting import lay_out
from notabug.ending import Stopped, exit_state, signals_as_exceptions

PATIENCE = 300.0  # seconds until a run that does not end is a failure
NAMES = ("scene0", "scene1", "scene2", "hangs")


@pytest.fixture
def here(tmp_path: Path) -> Path:
    """Three small scenes, one at which the renderer hangs, and a folder for temporary files."""
    return lay_out(tmp_path, NAMES, "slow").folder


def start(here: Path, *words: str) -> subprocess.Popen[str]:
    command = [sys.executable, "-m", "notabug", "run", "-r", "slow", *(f"{name}.usda" for name in NAMES), *words]
    environment = {**os.environ, "TMPDIR": str(here / "tmp")}
    return subprocess.Popen(
        command,
        cwd=here,
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=heeding,
    )


def heeding() -> None:
    """Heed the signals that whoever started the tests in the background had ignored (nohup, a shell's &)."""
    for number in (signal.SIGINT, signal.SIGHUP):
        signal.signal(number, signal.SIG_DFL)


def wait_until(seen: Any, process: subprocess.Popen[str]) -> None:
    for _ in range(12_000):
        if seen() or process.poll() is not None:
            break
        time.sleep(0.02)
    assert process.poll() is None, process.communicate(timeout=PATIENCE)


def is_at_work(here: Path, done: int) -> bool:
    calls = here / "pictures" / "calls.txt"
    finished = len(list((here / "notabug-out").glob("own/*/*/slow/result.json")))
    return calls.is_file() and "hangs" in calls.read_text() and finished >= done


@pytest.mark.slow
@pytest.mark.parametrize(
    ("number", "code", "jobs"), [(signal.SIGINT, 130, "1"), (signal.SIGHUP, 129, "1"), (signal.SIGTERM, 143, "2")]
)
@pytest.mark.sweep_except("2-130-1", "15-143-2")
def test_what_is_finished_is_on_record_and_nothing_is_left(
    here: Path, number: signal.Signals, code: int, jobs: str
) -> None:
    process = start(here, "--jobs", jobs)
    wait_until(lambda: is_at_work(here, 3), process)
    process.send_signal(number)
    _, log = process.communicate(timeout=PATIENCE)
    assert process.returncode == code, log
    assert "Traceback" not in log
    assert [line for line in log.splitlines() if "stopped" in line] == [
        "stopped; finished results stay in notabug-out and the same command goes on from there"
    ]
    record = json.loads((here / "notabug-out" / "run.json").read_text())
    assert record["finished"] is False
    assert {each["scene"] for each in record["results"]} == set(NAMES) - {"hangs"}
    assert (here / "notabug-out" / "report.html").is_file()
    assert not list((here / "tmp").iterdir())
    for path in (here / "pictures").glob("*.pid"):
        with contextlib.suppress(ProcessLookupError):
            os.kill(int(path.stem.split("-")[1]), 0)
            raise AssertionError("a renderer is left")


def test_a_signal_becomes_an_exception_and_is_handled_as_before_afterwards() -> None:
    before = signal.getsignal(signal.SIGTERM)
    with pytest.raises(Stopped) as stopped, signals_as_exceptions():
        signal.raise_signal(signal.SIGTERM)
    assert exit_state(stopped.value) == 143
    assert exit_state(KeyboardInterrupt()) == 130
    assert signal.getsignal(signal.SIGTERM) is before
    assert not isinstance(stopped.value, Exception)


def test_a_command_that_is_interrupted_is_no_bug(door: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    for error, code in ((KeyboardInterrupt(), 130), (Stopped(signal.SIGTERM), 143)):

        def stop(*_: object, error: BaseException = error) -> None:
            raise error

        monkeypatch.setattr("notabug.commands.listing.command", stop)
        assert door("list") == code
        assert door.stderr == "notabug: stopped\n"


def test_results_of_other_processes_are_collected(door: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """As when the process that was to hear of them is stopped first."""
    from notabug.runs.workers import Alone

    assert door.run("terminator/sphere", "texture/uneven_quad") == 0
    door.grey.drawn.clear()

    def stopped(self: Alone, function: Any, jobs: Any) -> Iterator[Any]:
        del self
        if hasattr(jobs[0], "choice"):
            raise Stopped(signal.SIGTERM)
        for index, job in enumerate(jobs):
            yield index, function(job)

    monkeypatch.setattr(Alone, "each", stopped)
    assert door.run("terminator/sphere", "texture/uneven_quad", "mirror/corner") == 143
    record = json.loads((door.out / "run.json").read_text())
    assert {each["scene"]: each["verdict"] for each in record["results"]} == {
        "terminator/sphere": "pass",
        "texture/uneven_quad": "pass",
    }
    assert record["finished"] is False


CLUSTER = """
import os, sys
from distributed import Client, LocalCluster
if __name__ == "__main__":
    with LocalCluster(n_workers=1, threads_per_worker=1, host="127.0.0.1", dashboard_address=None) as cluster:
        print(cluster.scheduler_address, flush=True)
        sys.stdin.read()
"""


@pytest.mark.slow
def test_a_scheduler_that_is_lost_is_one_line_and_costs_no_finished_result(here: Path) -> None:
    pytest.importorskip("distributed")
    with subprocess.Popen(
        [sys.executable, "-c", CLUSTER],
        cwd=here,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
        start_new_session=True,
    ) as cluster:
        try:
            assert cluster.stdout is not None
            address = cluster.stdout.readline().strip().removeprefix("tcp://")
            process = start(here, "--executor", f"dask://{address}")
            wait_until(lambda: is_at_work(here, 3), process)
        finally:
            os.killpg(cluster.pid, signal.SIGKILL)
    _, log = process.communicate(timeout=PATIENCE)
    assert process.returncode == 3, log
    assert "Traceback" not in log
    assert "the Dask scheduler is out of reach" in log.splitlines()[-1]
    record = json.loads((here / "notabug-out" / "run.json").read_text())
    assert {each["scene"] for each in record["results"]} == set(NAMES) - {"hangs"}
    for path in (here / "notabug-out").rglob("*.json"):
        json.loads(path.read_text())
