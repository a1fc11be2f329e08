"""Workers: processes that die, and a Dask cluster whose worker is killed; nothing is lost, nothing comes twice."""

from __future__ import annotations

import atexit
import json
import multiprocessing
import os
import signal
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import psutil
import pytest

from notabug.bench.faults_setting import lay_out
from notabug.runs import workers as workers_module
from notabug.runs.workers import Alone, Processes, cores_here, prepare, workers_for
from notabug.scenes_usd.errors import NotabugError, SelectionError

NAMES = tuple(f"scene{index}" for index in range(8))
DIE = "__import__('os').kill(__import__('os').getpid(), 9)"


def done(at_once: int, jobs: list[str]) -> dict[int, Any]:
    """What each of ``jobs``, expressions of Python, comes to; fails where one comes twice."""
    with Processes(at_once, 1) as workers:
        pairs = list(workers.each(eval, jobs))
    assert len(pairs) == len(dict(pairs))
    return dict(pairs)


def test_a_job_that_ends_its_process_costs_no_other() -> None:
    results = done(2, ["1 + 1", DIE, "3", "1 / 0", DIE, "6"])
    assert [results[index] for index in (0, 2, 5)] == [2, 3, 6]
    assert isinstance(results[3], ZeroDivisionError)
    assert all("two processes died" in str(results[index]) for index in (1, 4))
    assert all(isinstance(results[index], NotabugError) for index in (1, 4))


def test_a_process_that_is_killed_once_costs_nothing(tmp_path: Path) -> None:
    mark = tmp_path / "mark"
    once = f"'again' if __import__('os').path.exists({str(mark)!r}) else (open({str(mark)!r}, 'w').close(), {DIE})"
    assert done(2, ["1", once, "3"]) == {0: 1, 1: "again", 2: 3}


def _at_work(deed: str, path: Path) -> str:
    """The expression that does ``deed`` of ``at_work.py`` with ``path``."""
    return f"__import__('runpy').run_path({str(Path(__file__).with_name('at_work.py'))!r})[{deed!r}]({str(path)!r})"


def test_others_judge_while_one_renders(tmp_path: Path) -> None:
    sign = tmp_path / "sign"
    assert done(1, [_at_work("renders_until", sign), f"open({str(sign)!r}, 'w').close()"])[0] is True


def test_no_more_renderers_at_work_than_places(tmp_path: Path) -> None:
    alone = _at_work("renders_alone", tmp_path / "lock")
    assert done(1, [alone] * 8) == dict.fromkeys(range(8), True)
    # a process that is killed at work takes no place with it
    results = done(1, [_at_work("dies", tmp_path), alone, alone])
    assert "two processes died" in str(results[0])
    assert (results[1], results[2]) == (True, True)


def test_processes_end_with_their_parent() -> None:
    code = (
        "from notabug.runs.workers import Processes\n"
        "if __name__ == '__main__':\n"
        "    with Processes(2, 1) as workers:\n"
        "        print('go', flush=True)\n"
        "        list(workers.each(eval, [\"__import__('time').sleep(600)\"] * 2))\n"
    )
    parent = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True)
    assert parent.stdout is not None
    parent.stdout.readline()
    children: list[psutil.Process] = []
    wanted = 3 if prepare() == "forkserver" else 2  # two, and what they are forked from
    for _ in range(3000):
        children = psutil.Process(parent.pid).children(recursive=True)
        if sum("forkserver" in _line(each) or "spawn_main" in _line(each) for each in children) >= wanted:
            break
        time.sleep(0.02)
    time.sleep(1.0)  # for them to begin
    parent.kill()
    parent.communicate()
    gone, alive = psutil.wait_procs(children, timeout=60)
    assert alive == []
    assert len(gone) >= wanted


def _line(process: psutil.Process) -> str:
    try:
        return " ".join(process.cmdline())
    except psutil.Error:
        return ""


def test_getting_ready_leaves_the_environment_as_it_is() -> None:
    before = dict(os.environ)
    assert prepare() in ("forkserver", "spawn")
    assert dict(os.environ) == before


def test_folders_of_the_dead_are_removed_and_long_names_left_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("notabug-work-999999999-x", f"notabug-work-{os.getpid()}-x", "notabug-work-me", "mine"):
        (tmp_path / name).mkdir()
    configuration: dict[str, Any] = {}
    monkeypatch.setattr(multiprocessing.current_process(), "_config", configuration)
    monkeypatch.setattr(atexit, "register", lambda *_: None)
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    monkeypatch.setattr(workers_module, "_SHORT", ())
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    monkeypatch.setattr(workers_module, "_LONGEST", 1)
    assert not workers_module._own_temporary_folder()
    assert "tempdir" not in configuration
    names = {f"notabug-work-{os.getpid()}-x", "notabug-work-me", "mine"}
    assert {each.name for each in tmp_path.iterdir()} == names
    monkeypatch.setattr(workers_module, "_LONGEST", 1000)
    assert workers_module._own_temporary_folder()
    made = Path(configuration["tempdir"])
    assert made.is_dir()
    assert made.parent == tmp_path
    workers_module._remove_own(made, os.getpid() + 1)
    assert made.is_dir()
    workers_module._remove_own(made, os.getpid())
    assert not made.exists()


@pytest.mark.parametrize(("short", "method"), [("('/tmp',)", "forkserver"), ("()", "spawn")])
def test_a_temporary_folder_with_a_path_too_long_for_a_socket(tmp_path: Path, short: str, method: str) -> None:
    long = tmp_path / ("long" * 40)
    long.mkdir()
    code = (
        "from notabug.runs import workers\n"
        f"workers._SHORT = {short}\n"
        "if __name__ == '__main__':\n"
        "    with workers.Processes(2, 1) as jobs:\n"
        "        print(workers.prepare(), sorted(jobs.each(eval, ['1 + 1', '3'])))\n"
    )
    program = tmp_path / "program.py"
    program.write_text(code)
    environment = {**os.environ, "TMPDIR": str(long), "XDG_RUNTIME_DIR": str(long)}
    ended = subprocess.run([sys.executable, program], env=environment, capture_output=True, text=True)
    assert ended.stdout == f"{method} [(0, 2), (1, 3)]\n", ended.stderr
    assert list(long.iterdir()) == []


def test_what_is_worth_a_process() -> None:
    few, threads = workers_for("", 0, 3)
    assert isinstance(few, Alone)
    assert threads == 0  # a lone job has all cores
    many, threads = workers_for("", 0, 1000)
    assert many.at_once == cores_here() or cores_here() == 1
    assert many.at_once * max(1, threads) <= max(cores_here(), 1)
    with pytest.raises(SelectionError, match="dask://host:port"):
        workers_for("ftp://x", 0, 1)


@pytest.fixture
def here(tmp_path: Path) -> Path:
    """Eight small scenes and a renderer that takes .4 seconds for each and notes each call."""
    return lay_out(tmp_path, NAMES, "slow", environment={"PAUSE": "0.4"}).folder


def calls(here: Path) -> Counter[str]:
    log = here / "pictures" / "calls.txt"
    return Counter(log.read_text().split() if log.is_file() else [])


def run(here: Path, *words: str) -> subprocess.Popen[str]:
    command = [sys.executable, "-m", "notabug.cli", "run", "-r", "slow", *(f"{name}.usda" for name in NAMES), *words]
    return subprocess.Popen(command, cwd=here, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def results(here: Path) -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = json.loads((here / "notabug-out" / "run.json").read_text())["results"]
    return found


def test_processes_give_what_one_gives(here: Path) -> None:
    started = run(here, "--jobs", "2")
    _, log = started.communicate()
    assert started.returncode == 0, log
    assert [each["scene"] for each in results(here)] == list(NAMES)
    assert {each["verdict"] for each in results(here)} == {"pass"}
    assert calls(here) == Counter({**dict.fromkeys(NAMES, 1), "calibration-plain_card": 1})
    jobs = json.loads((here / "notabug-out" / "run.json").read_text())["jobs"]
    assert (jobs["executor"], jobs["at_once"]) == ("processes", 2)


CLUSTER = """
import os, sys
from distributed import Client, LocalCluster
if __name__ == "__main__":
    with LocalCluster(n_workers=2, threads_per_worker=1, host="127.0.0.1", dashboard_address=None) as cluster:
        with Client(cluster) as client:
            print(cluster.scheduler_address, *client.run(os.getpid).values(), flush=True)
            sys.stdin.read()
"""


@pytest.fixture
def cluster(tmp_path: Path) -> Iterator[tuple[str, list[int]]]:
    """A Dask cluster of two local workers: its address and the workers' process ids."""
    pytest.importorskip("distributed")
    command = [sys.executable, "-c", CLUSTER]
    process = subprocess.Popen(
        command, cwd=tmp_path, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
    )
    assert process.stdout is not None
    address, *workers = process.stdout.readline().split()
    yield address.removeprefix("tcp://"), [int(each) for each in workers]
    process.communicate("")


def test_a_cluster_that_loses_a_worker_loses_no_job(here: Path, cluster: tuple[str, list[int]]) -> None:
    address, workers = cluster
    assert len(workers) == 2
    started = run(here, "--executor", f"dask://{address}")
    for _ in range(6000):
        if calls(here).total() >= 4 or started.poll() is not None:
            break
        time.sleep(0.02)
    assert started.poll() is None, started.communicate()
    os.kill(workers[0], signal.SIGKILL)
    _, log = started.communicate()
    assert started.returncode == 0, log
    assert [each["scene"] for each in results(here)] == list(NAMES)
    assert {each["verdict"] for each in results(here)} == {"pass"}
    drawn = calls(here)
    assert set(drawn) == {*NAMES, "calibration-plain_card"}
    assert drawn.total() <= len(NAMES) + 2  # at most the one job that the worker had in hand is drawn again
