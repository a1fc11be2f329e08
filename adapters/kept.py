"""Children that stay: a renderer that takes long to start does one job after another, until this process ends.

A kept child is told the folder of a job by a line of its input. Whatever it prints is log, but for lines that begin
with the value of the environment variable NOTABUG_JOB, which are its answers: one when it is ready, then for each job
``done``, or ``failed`` and why, as JSON. Limits hold for each job; a child that breaks one is killed, and the next job
starts another.
"""

from __future__ import annotations

import atexit
import contextlib
import json
import os
import subprocess
import threading
import time
from collections.abc import Mapping
from pathlib import Path

from notabug.adapters.process import (
    DEFAULT,
    Ended,
    Limits,
    Log,
    Stopped,
    ask_to_end,
    broken_limit,
    kill_group,
    start_child,
)
from notabug.adapters.process_tree import MARK, Tree, adopt_orphans
from notabug.scenes_usd.temporary import temporary_folder

_LOOK = 0.1  # seconds from one look at a child's memory and files to the next
_OF_ITS_LIFE = Limits(output=0)  # what a child may write is counted job by job

Key = tuple[int, tuple[str, ...], tuple[tuple[str, str], ...]]
_kept: dict[Key, KeptChild] = {}
_lock = threading.Lock()


def kept_child(command: tuple[str, ...], *, where: str, environment: Mapping[str, str] | None = None) -> KeptChild:
    """The child of this process that runs ``command``; it is started with its first job."""
    key = (os.getpid(), command, tuple(sorted((environment or {}).items())))
    with _lock:
        if not _kept:
            atexit.register(end_kept)
        return _kept.setdefault(key, KeptChild(command, where, dict(environment or {})))


def end_kept() -> None:
    """End every child that this process keeps."""
    with _lock:
        for (process, *_), child in _kept.items():
            if process == os.getpid():
                child.end()
        _kept.clear()


class KeptChild:
    """One child, its log, and the word that its answers begin with."""

    def __init__(self, command: tuple[str, ...], where: str, environment: dict[str, str]) -> None:
        self.command, self.where, self.environment = command, where, environment
        self.hello = ""  # what it said when it was ready
        self._using = threading.Lock()
        self._process: subprocess.Popen[bytes] | None = None

    def greet(self, timeout: float) -> Ended:
        """Start the child where it is not there; its greeting is then in ``hello``."""
        with self._using:
            return self._started(timeout) or Ended(self.command, 0, "", 0.0, "")

    def do(self, folder: Path, *, timeout: float, limits: Limits = DEFAULT) -> Ended:
        """The job in ``folder``, which lasts ``timeout`` seconds at most, and how it ended."""
        began = time.perf_counter()
        with self._using:
            if failed := self._started(timeout):
                return failed
            assert self._process is not None
            assert self._process.stdin is not None
            self._log.tail.clear()
            with contextlib.suppress(BrokenPipeError):  # it has just ended: no answer will come
                self._process.stdin.write(f"{folder}\n".encode())
                self._process.stdin.flush()
            answer, stopped = self._answer(folder, began + timeout, limits)
            word, _, why = answer.partition(" ")
            log = self._log.text()
            if word == "failed":
                return Ended(self.command, 1, "", time.perf_counter() - began, f"{log}\n{json.loads(why)}")
            code = 0 if word == "done" else self._code()
            if word != "done":
                self.end()
            return Ended(self.command, code, stopped, time.perf_counter() - began, log)

    def end(self) -> None:
        """End the child, with all that it has started."""
        child, self._process = self._process, None
        if child is None:
            return
        if child.poll() is None:
            ask_to_end(child)
        kill_group(child.pid)
        child.wait()
        self._tree.kill()
        for pipe in (child.stdin, child.stdout, self._told):
            with contextlib.suppress(BrokenPipeError):
                assert pipe is not None
                pipe.close()
        self._folder.__exit__(None, None, None)

    def _started(self, timeout: float) -> Ended | None:
        """None where the child is there and ready, else how it failed to be."""
        if self._process is not None and self._process.poll() is None:
            return None
        self.end()
        adopt_orphans()
        began = time.perf_counter()
        self._tree, self._folder = Tree(), temporary_folder()
        folder = self._folder.__enter__()
        environment = {**os.environ, **self.environment, MARK: self._tree.mark}
        self._process, self._told = start_child(
            self.command, folder, environment, _OF_ITS_LIFE, where=self.where, stdin=subprocess.PIPE
        )
        self._tree.root = self._process.pid
        assert self._process.stdout is not None
        self._log = Log(self._process.stdout)
        self.hello, stopped = self._answer(folder, began + timeout, DEFAULT)
        if self.hello:
            return None
        ended = Ended(self.command, self._code(), stopped, time.perf_counter() - began, self._log.text())
        self.end()
        return ended

    def _answer(self, folder: Path, deadline: float, limits: Limits) -> tuple[str, Stopped]:
        """The child's next answer, or "" and the limit that it broke, or twice "" where it has ended."""
        process, sign = self._process, f"{self._tree.mark} ".encode()
        assert process is not None
        look = time.perf_counter() + _LOOK
        while True:
            begins = self._log.tail.find(sign)
            ends = self._log.tail.find(b"\n", begins) if begins >= 0 else -1
            if ends >= 0:
                answer = bytes(self._log.tail[begins + len(sign) : ends]).decode("utf-8", "replace")
                del self._log.tail[begins : ends + 1]
                return answer, ""
            if not self._log.open or process.poll() is not None:
                return "", ""
            now = time.perf_counter()
            if now >= deadline:
                return "", "time"
            if now >= look:
                if broken := broken_limit(self._tree, folder, limits):
                    return "", broken
                look = now + _LOOK
            self._log.wait(min(deadline, look) - now)

    def _code(self) -> int:
        """The exit code of a child that has closed its output; 1 of one that lives on, or did not say."""
        assert self._process is not None
        with contextlib.suppress(subprocess.TimeoutExpired):
            return self._process.wait(1.0) or 1
        return 1
