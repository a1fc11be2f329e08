"""Children that stay: a renderer that takes long to start does one job after another, until this process ends.

A kept child is told of a job by a line of its input, and answers by a line of its output; ``answers.py`` says which of
its lines are answers. The child scripts of this folder are told the folder of a job, and have the value of the
environment variable NOTABUG_JOB before their answers: one when they are ready, then for each job ``done``, or
``failed`` and why, as JSON. ``server.py`` has the conversation with the renderers of a configuration file. Limits hold
for each job; a child that breaks one is ended, and the next job starts another.
"""

from __future__ import annotations

import atexit
import contextlib
import json
import os
import subprocess
import threading
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from notabug.adapters.answers import Answers, Signed
from notabug.adapters.process import (
    DEFAULT,
    Ended,
    Limits,
    Stopped,
    ask_to_end,
    broken_limit,
    failure,
    kill_group,
    not_started,
    start_child,
)
from notabug.adapters.process_tree import MARK, Tree, adopt_orphans
from notabug.adapters.trees import replaced, size, states
from notabug.scenes_usd.temporary import temporary_folder

_LOOK = 0.1  # seconds from one look at a child's memory and files to the next
_TO_END = 1.0  # seconds that a child which says nothing any more has to end by itself

Key = tuple[int, tuple[str, ...], tuple[tuple[str, str], ...]]
_kept: dict[Key, KeptChild] = {}
_lock = threading.Lock()


def kept_child(
    command: tuple[str, ...],
    *,
    where: str,
    environment: Mapping[str, str] | None = None,
    answers: Callable[[], Answers] = Signed,
    state: str = "",
    output: int = 0,
) -> KeptChild:
    """The child of this process that runs ``command``; it is started with its first job.

    One whose ``state``, a hash of all that it was made from, has changed is ended, and another one takes its place.
    ``output`` are the bytes that it may write into any one file; 0: no limit.
    """
    key = (os.getpid(), command, tuple(sorted((environment or {}).items())))
    with _lock:
        if not _kept:
            atexit.register(end_kept)
        there = _kept.get(key)
        if there is None or there.state != state:
            if there is not None:
                there.end()
            there = _kept[key] = KeptChild(command, where, dict(environment or {}), answers(), state, output)
        return there


def end_kept() -> None:
    """End every child that this process keeps."""
    with _lock:
        for (process, *_), child in _kept.items():
            if process == os.getpid():
                child.end()
        _kept.clear()


@dataclass(frozen=True, slots=True)
class Answered:
    """What a child answered to one line, None where it did not, and how the job ended.

    ``lives``: a child that did not answer is still there, and has closed its output. ``told``: it was there to read the
    line.
    """

    answer: str | None
    ended: Ended
    lives: bool = False
    told: bool = True


class KeptChild:
    """One child, its log, and what it said when it was ready."""

    def __init__(
        self,
        command: tuple[str, ...],
        where: str,
        environment: dict[str, str],
        answers: Answers,
        state: str = "",
        output: int = 0,
    ) -> None:
        self.command, self.where, self.environment, self.state = command, where, environment, state
        self.hello = ""  # what it said when it was ready
        self.using = threading.RLock()
        self._answers, self._of_its_life = answers, Limits(output=output)  # files are counted job by job as well
        self._process: subprocess.Popen[bytes] | None = None

    @property
    def is_there(self) -> bool:
        return self._process is not None and self._process.poll() is None

    def greet(self, timeout: float) -> Ended:
        """Start the child where it is not there; its greeting is then in ``hello``."""
        failed = self.start(timeout)
        if failed is None:
            return Ended(self.command, 0, "", 0.0, "")
        return replace(failed.ended, exit=failed.ended.exit or 1)

    def do(self, folder: Path, *, timeout: float, limits: Limits = DEFAULT) -> Ended:
        """The job in ``folder``, which lasts ``timeout`` seconds at most, and how it ended."""
        began = time.perf_counter()
        with self.using:
            asked = self.start(timeout, limits) or self.ask(str(folder), folder, timeout=timeout, limits=limits)
            word, _, why = (asked.answer or "").partition(" ")
            ended = replace(asked.ended, seconds=time.perf_counter() - began)
            if word == "done":
                return ended
            if word == "failed":
                return replace(ended, exit=1, log=f"{ended.log}\n{json.loads(why)}")
            self.end()
            return replace(ended, exit=ended.exit or 1)

    def ask(self, line: str, folder: Path, *, timeout: float, limits: Limits = DEFAULT) -> Answered:
        """What a child that was started says to ``line``, of a job in ``folder``; one that does not answer is ended."""
        began, before = time.perf_counter(), states(folder.absolute())[1:]
        with self.using:
            assert self._process is not None
            assert self._process.stdin is not None
            if unasked := self._answers.begin():  # it is not told the line: this is the answer to another one, or none
                said = unasked.decode("utf-8", "replace").strip()
                return Answered(said, Ended(self.command, 0, "", 0.0, ""))
            if limits.cpu:
                limits = replace(limits, cpu=limits.cpu + self._tree.usage()[1])
            told = True
            try:
                self._process.stdin.write(f"{line}\n".encode())
                self._process.stdin.flush()
            except BrokenPipeError:  # it has just ended: no answer will come
                told = False
            answer, stopped = self._answer(folder, began + timeout, limits)
            if not stopped and limits.output and size(folder, limits.output) >= limits.output:
                answer, stopped = None, "output"  # the system let no more be written
            asked = self._answered(answer, stopped, began)
            if gone := replaced(before):
                self.end()
                what = f"it replaced a folder of the run, {gone}"
                raise failure(what, where=self.where, log=asked.ended.log, do="correct the renderer")
            return replace(asked, told=told)

    def unasked(self) -> str:
        """What a child has said between two jobs."""
        with self.using:
            return self._answers.begin().decode("utf-8", "replace") if self.is_there else ""

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
        for pipe in (child.stdin, child.stdout, child.stderr, self._told):
            if pipe is not None:
                with contextlib.suppress(BrokenPipeError):
                    pipe.close()
        self._folder.__exit__(None, None, None)

    def start(self, timeout: float, limits: Limits = DEFAULT) -> Answered | None:
        """None where the child is there and ready, else how it failed to be, within ``timeout`` seconds."""
        with self.using:
            return None if self.is_there else self._start(timeout, limits)

    def _start(self, timeout: float, limits: Limits) -> Answered | None:
        self.end()
        adopt_orphans()
        began = time.perf_counter()
        self._tree, self._folder = Tree(), temporary_folder()
        folder = self._folder.__enter__()
        environment = {**self.environment, MARK: self._tree.mark}
        self._process, self._told = start_child(
            self.command,
            folder,
            environment,
            self._of_its_life,
            where=self.where,
            stdin=subprocess.PIPE,
            stderr=subprocess.PIPE if self._answers.separate else subprocess.STDOUT,
        )
        self._tree.root = self._process.pid
        self._answers.open(self._process, self._tree.mark)
        hello, stopped = self._answer(folder, began + timeout, limits)
        self.hello = hello or ""
        return None if hello is not None else self._answered(None, stopped, began)

    def _answer(self, folder: Path, deadline: float, limits: Limits) -> tuple[str | None, Stopped]:
        """The child's next answer, or None and the limit that it broke, or None and "" where no answer can come."""
        process, look, is_open = self._process, time.perf_counter() + _LOOK, True
        assert process is not None
        while True:
            answer = self._answers.take()
            if answer is not None or not is_open:
                return answer, ""
            now = time.perf_counter()
            if now >= deadline:
                return None, "time"
            if now >= look:
                if broken := broken_limit(self._tree, folder, limits):
                    return None, broken
                look = now + _LOOK
            ended = process.poll() is not None  # what it said before is in the pipe, which others may hold open
            is_open = self._answers.wait(0.0 if ended else min(deadline, look) - now) and not ended

    def _answered(self, answer: str | None, stopped: Stopped, began: float) -> Answered:
        """A child that did not answer is ended."""
        code = self._code() if answer is None and not stopped else 0
        seconds, log = time.perf_counter() - began, self._answers.text()
        if answer is None:
            self.end()
        return Answered(answer, Ended(self.command, code or 0, stopped, seconds, log), lives=code is None)

    def _code(self) -> int | None:
        """The exit code of a child that answers no more, None of one that lives on; raises where it did not start."""
        assert self._process is not None
        try:
            code = self._process.wait(_TO_END)
        except subprocess.TimeoutExpired:
            return None
        said = self._told.read().split()
        if said[:1] == ["failed"]:
            self.end()
            raise not_started(self.command, self.where, os.strerror(int(said[1])))
        return os.waitstatus_to_exitcode(int(said[1])) if said else code
