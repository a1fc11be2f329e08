"""The workers of a bench end with it, however it ends."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import psutil
import pytest

PATIENCE = 60.0  # seconds: on a busy machine processes start slowly
SLOW = """
import os, sys, time
from dataclasses import dataclass
from pathlib import Path
from notabug.bench.verdict.run import run

@dataclass(frozen=True)
class Work:
    number: int
    def key(self): return str(self.number)
    def setting(self): return self.number

def expose(work):
    Path(sys.argv[1], f"pid-{os.getpid()}").touch()
    time.sleep(120)
    return []

if __name__ == "__main__":
    list(run([Work(k) for k in range(8)], expose, Path(sys.argv[1]), workers=2))
"""


@pytest.mark.parametrize("how", [signal.SIGTERM, signal.SIGKILL])
def test_no_worker_outlives_a_bench_that_is_killed(how: signal.Signals, tmp_path: Path) -> None:
    script = tmp_path / "slow.py"
    script.write_text(SLOW)
    bench = subprocess.Popen([sys.executable, str(script), str(tmp_path)])
    try:
        assert _until(lambda: len(list(tmp_path.glob("pid-*"))) == 2), "the workers did not start"
        workers = [int(each.name.removeprefix("pid-")) for each in tmp_path.glob("pid-*")]
        bench.send_signal(how)
        bench.wait(PATIENCE)
        assert _until(lambda: not any(map(_runs, workers))), "a worker goes on"
    finally:
        bench.kill()


def _runs(pid: int) -> bool:
    """Whether the process goes on; one that has ended may wait for whoever adopted it to take note."""
    try:
        return psutil.Process(pid).status() != psutil.STATUS_ZOMBIE
    except psutil.NoSuchProcess:
        return False


def _until(true: Callable[[], bool]) -> bool:
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end:
        if true():
            return True
        time.sleep(0.1)
    return False
