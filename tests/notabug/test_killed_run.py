"""A run that is killed goes on where it was; two runs in one folder do not mix."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time
from collections import Counter
from pathlib import Path

import pytest

from notabug.bench.faults_setting import lay_out

pytestmark = pytest.mark.slow

NAMES = tuple(f"scene{index}" for index in range(6))


@pytest.fixture
def here(tmp_path: Path) -> Path:
    """Six small scenes and a renderer that takes a fifth of a second for each and notes each call."""
    return lay_out(tmp_path, NAMES, "slow", environment={"PAUSE": "0.2"}).folder


def start(here: Path) -> subprocess.Popen[str]:
    command = [sys.executable, "-m", "notabug.cli", "run", "-r", "slow", *(f"{name}.usda" for name in NAMES)]
    return subprocess.Popen(command, cwd=here, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def calls(here: Path) -> Counter[str]:
    log = here / "pictures" / "calls.txt"
    return Counter(log.read_text().split() if log.is_file() else [])


def wait_for(here: Path, number: int) -> None:
    for _ in range(3000):
        if calls(here).total() >= number:
            return
        time.sleep(0.02)
    raise AssertionError(f"{number} calls were never made")


def test_nothing_that_was_finished_is_drawn_again(here: Path) -> None:
    first = start(here)
    wait_for(here, 4)
    first.send_signal(signal.SIGKILL)
    first.communicate()
    assert first.returncode == -signal.SIGKILL
    before = calls(here)
    finished = {json.loads(path.read_text())["result"]["scene"] for path in (here / "notabug-out").rglob("result.json")}
    assert finished
    for path in (here / "notabug-out").rglob("*.json"):
        json.loads(path.read_text())  # whole, every one of them
    second = start(here)
    _, log = second.communicate()
    assert second.returncode == 0, log
    again = calls(here) - before
    assert not {"-".join(each.split("/")) for each in finished} & set(again)
    assert set(before + again) == {*NAMES, "calibration-plain_card"}
    results = json.loads((here / "notabug-out" / "run.json").read_text())["results"]
    assert Counter(each["verdict"] for each in results) == {"pass": len(NAMES)}


def test_a_second_run_in_the_folder_is_refused(here: Path) -> None:
    first = start(here)
    wait_for(here, 1)
    first.send_signal(signal.SIGSTOP)  # or it may be over before the second has come so far
    second = start(here)
    _, log = second.communicate()
    first.send_signal(signal.SIGCONT)
    assert second.returncode == 2
    assert "another run is writing into this folder" in log
    _, log = first.communicate()
    assert first.returncode == 0, log
    assert calls(here).most_common(1)[0][1] == 1
    assert (here / "notabug-out" / "run.json").is_file()
