"""How a child that stays answers: in lines with a sign among what it prints, or by every line that it prints."""

from __future__ import annotations

import os
import selectors
import subprocess
from typing import Protocol

from notabug.adapters.process import Log

LONGEST = 1 << 16  # bytes of an answer: a longer one is none, and what follows it is not waited for
_READS = 16  # of what a child has logged before an answer: as much as a pipe of Linux holds, sixteen times


class Answers(Protocol):
    """What a child says: its answers, one at a time, and its log."""

    separate: bool
    """The child's standard error is a pipe of its own."""

    def open(self, process: subprocess.Popen[bytes], mark: str) -> None:
        """Listen to ``process``, which was told the word ``mark``."""
        ...

    def begin(self) -> bytes:
        """Forget the log, as a job begins; what was said since the last answer and is none."""
        ...

    def take(self) -> str | None:
        """The next answer, where it is there."""
        ...

    def wait(self, seconds: float) -> bool:
        """Read what there is, after at most ``seconds`` without any; False once no answer can come."""
        ...

    def text(self) -> str:
        """The log since the job began."""
        ...


class Signed:
    """Answers are the lines that begin with the child's mark; all else that it prints is log."""

    separate = False

    def open(self, process: subprocess.Popen[bytes], mark: str) -> None:
        assert process.stdout is not None
        self._log, self._sign = Log(process.stdout), f"{mark} ".encode()

    def begin(self) -> bytes:
        self._log.tail.clear()
        return b""

    def take(self) -> str | None:
        tail = self._log.tail
        begins = tail.find(self._sign)
        ends = tail.find(b"\n", begins) if begins >= 0 else -1
        if ends < 0:
            return None
        answer = bytes(tail[begins + len(self._sign) : ends]).decode("utf-8", "replace")
        del tail[begins : ends + 1]
        return answer

    def wait(self, seconds: float) -> bool:
        self._log.wait(seconds)
        return self._log.open

    def text(self) -> str:
        return self._log.text()


class Plain:
    """Every line of the child's standard output is an answer; its standard error is its log."""

    separate = True

    def open(self, process: subprocess.Popen[bytes], mark: str) -> None:
        del mark
        assert process.stdout is not None
        assert process.stderr is not None
        self._said, self._output, self._open = bytearray(), process.stdout, True
        self._log = Log(process.stderr)

    def begin(self) -> bytes:
        while self._read(0.0) and len(self._said) <= LONGEST:
            pass
        self._log.tail.clear()
        unasked, self._said = bytes(self._said), bytearray()
        return unasked

    def take(self) -> str | None:
        ends = self._said.find(b"\n")
        whole = ends >= 0 or len(self._said) > LONGEST or (self._said and not self._open)
        if not whole:
            return None
        length = ends if ends >= 0 else len(self._said)
        answer = bytes(self._said[:length]).decode("utf-8", "replace")
        del self._said[: length + 1]
        for _ in range(_READS):  # what was logged before the answer is in the pipe by now
            if not self._read(0.0):
                break
        return answer

    def wait(self, seconds: float) -> bool:
        self._read(seconds)
        return self._open

    def text(self) -> str:
        return self._log.text()

    def _read(self, seconds: float) -> bool:
        """Read what there is of both pipes, after at most ``seconds`` without any; whether there was something."""
        with selectors.DefaultSelector() as ready:
            for pipe, is_open in ((self._output, self._open), (self._log.pipe, self._log.open)):
                if is_open:
                    ready.register(pipe, selectors.EVENT_READ)
            if not ready.get_map():
                return False
            found = {key.fileobj for key, _ in ready.select(max(0.0, seconds))}
        if self._log.pipe in found:
            self._log.read()
        if self._output in found:
            chunk = os.read(self._output.fileno(), LONGEST)
            self._open = bool(chunk)
            self._said += chunk
        return bool(found)
