"""What jobs of test_workers.py do while they have a renderer at work, in a worker process."""

from __future__ import annotations

import os
import signal
import time
from pathlib import Path

from notabug.runs.workers import rendering


def renders_until(sign: str) -> bool:
    """Whether the file ``sign`` appears meanwhile."""
    with rendering():
        for _ in range(3000):
            if Path(sign).exists():
                return True
            time.sleep(0.01)
    return False


def renders_alone(lock: str) -> bool:
    """True; raises where another one renders with the same ``lock``."""
    with rendering():
        Path(lock).touch(exist_ok=False)
        time.sleep(0.02)
        Path(lock).unlink()
    return True


def dies(_: str) -> None:
    """Die like a process that the system kills."""
    with rendering():
        os.kill(os.getpid(), signal.SIGKILL)
