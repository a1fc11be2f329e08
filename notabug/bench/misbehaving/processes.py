"""Misdeeds of time, memory and processes."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time

from notabug.bench.misbehaving.job import MIB, Deed, deed, draw, grey, leave, pictures, write

HOUR = 3600.0


def detach(then: Deed) -> None:
    """A daemon: two forks and a session of its own; it does ``then``."""
    if os.fork() == 0:
        os.setsid()
        if os.fork() == 0:
            leave("daemon", os.getpid())
            then()
        os._exit(0)
    os.wait()


def child(then: Deed) -> None:
    """A child that is not waited for; it does ``then``."""
    if os.fork() == 0:
        leave("child", os.getpid())
        then()
        os._exit(0)


def sleep() -> None:
    time.sleep(HOUR)


def spin() -> None:
    while True:
        pass


def hoard(most: int = 1 << 40) -> None:
    kept: list[bytearray] = []
    while 8 * MIB * len(kept) < most:
        kept.append(bytearray(b"x") * (8 * MIB))
        time.sleep(0.01)
    sleep()


@deed
def hangs() -> None:
    sleep()


@deed
def ignores_sigterm() -> None:
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    sleep()


@deed
def stops_itself() -> None:
    os.kill(os.getpid(), signal.SIGSTOP)


@deed
def stops_its_keeper() -> None:
    os.kill(os.getppid(), signal.SIGSTOP)
    sleep()


@deed
def kills_its_keeper() -> None:
    os.kill(os.getppid(), signal.SIGKILL)
    sleep()


@deed
def kills_its_group() -> None:
    draw()
    os.killpg(0, signal.SIGKILL)


@deed
def spins() -> None:
    spin()


@deed
def spins_in_children() -> None:
    for _ in range(4):
        child(spin)
    sleep()


@deed
def detaches() -> None:
    detach(sleep)


@deed
def detaches_and_draws() -> None:
    detach(sleep)
    draw()


@deed
def detaches_and_hangs() -> None:
    """As above, with an empty environment."""
    daemon = [sys.executable, "-S", "-c", "import time; time.sleep(3600)"]
    leave("daemon", subprocess.Popen(daemon, env={}, start_new_session=True).pid)
    sleep()


@deed
def overwrites_late() -> None:
    """A daemon would write over the picture for as long as it lives."""

    def spoil() -> None:
        time.sleep(1.0)
        while True:
            write(grey)

    draw()
    detach(spoil)


@deed
def breeds() -> None:
    for _ in range(30):
        child(sleep)
    draw()


@deed
def leaves_zombies() -> None:
    for _ in range(60):
        if os.fork() == 0:
            os._exit(0)
    draw()


@deed
def eats_memory() -> None:
    hoard()


@deed
def eats_memory_in_children() -> None:
    for _ in range(6):
        child(lambda: hoard(80 * MIB))
    sleep()


@deed
def crashes() -> None:
    os.kill(os.getpid(), signal.SIGSEGV)


@deed
def killed_half_way() -> None:
    write(grey, cut=len(grey))
    os.kill(os.getpid(), signal.SIGKILL)


@deed
def exits_with_3() -> None:
    draw()
    sys.exit(3)


@deed
def fails_once() -> None:
    mark = f"{pictures}/failed-once"
    if not os.access(mark, os.F_OK):
        os.mkdir(mark)
        sys.exit(1)
    draw()


@deed
def asks_for_an_answer() -> None:
    sys.stdin.read()
    draw()


@deed
def closes_its_descriptors() -> None:
    os.closerange(0, 256)
    draw()


@deed
def floods_the_log() -> None:
    for _ in range(64):
        sys.stdout.write("x" * MIB)
    sys.exit(1)


@deed
def prints_escapes() -> None:
    """A terminal's clipboard and title, a build server's command, and what is no text."""
    os.write(
        1, b"\x1b]52;c;c2VjcmV0\x07\x1b]0;title\x07\x1b[8m\0\xff\xfe\r\n::error file=a.c::injected\n##[error]injected\n"
    )
    sys.exit(1)
