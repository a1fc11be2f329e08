"""A configured renderer that is started once and then draws one picture after the other: ``server = true``.

Its first line of output says which version of this protocol it speaks. Then it reads one line of JSON for each picture
and prints one line of JSON when the picture is there, or why it is not; ``docs/your-renderer.md`` shows both. Standard
output is for these lines alone, standard error is the log. A server that breaks the protocol or a limit is ended: that
costs the picture that it was at, and the next one starts another server.
"""

from __future__ import annotations

import itertools
import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from notabug.adapters.answers import LONGEST, Plain
from notabug.adapters.base import RendererError
from notabug.adapters.kept import Answered, KeptChild, kept_child
from notabug.adapters.process import Ended, Limits, failure

PROTOCOL = 1
GREETING = "notabug_server"
START_SECONDS = 60.0  # that a server has to say that it is ready, where its table says nothing
_QUOTED = 200  # characters of a line that is no answer, in an error's message
_numbers = itertools.count(1)


class AnswerError(ValueError):
    """A line that is no answer: what is wrong with it, and what was expected."""

    def __init__(self, what: str, expected: str) -> None:
        super().__init__(what)
        self.what, self.expected = what, expected


@dataclass(frozen=True, slots=True)
class Server:
    """How the server of the renderer ``where`` is started, and its limits for each picture.

    ``state`` is a hash of what it was made from: one that was made from something else is ended. ``start`` are the
    seconds that it has to say that it is ready.
    """

    command: tuple[str, ...]
    where: str
    environment: Mapping[str, str]
    state: str
    start: float
    limits: Limits

    def draw(self, job: Mapping[str, str | int], folder: Path, timeout: float) -> Ended:
        """Have ``job`` drawn, whose files lie in ``folder``; how that ended, at a limit or well.

        Raises RendererError for everything else: what the server says against the job, and a broken protocol.
        """
        child = kept_child(
            self.command,
            where=self.where,
            environment=self.environment,
            answers=Plain,
            state=self.state,
            output=self.limits.output,
        )
        number = next(_numbers)
        line = json.dumps({"job": number, **job})
        with child.using:
            for _ in range(2):  # one that ended between two jobs, and was not seen to, is started again
                self._make_ready(child)
                asked = child.ask(line, folder, timeout=timeout, limits=self.limits)
                if asked.told:
                    break
            said = "nothing" if asked.answer is None else asked.answer[:_QUOTED]
            ended = replace(asked.ended, log=f"notabug: {line}\nserver: {said}\n{asked.ended.log}")
            if ended.stopped:
                return ended
            if asked.answer is None:
                raise _silent(asked, f"an answer to job {number}", self.where, ended.log)
            try:
                refusal = read_answer(asked.answer, number)
            except AnswerError as error:
                raise self._broken(child, error, said, ended.log) from error
        if refusal:
            raise failure(f"the server could not draw it: {refusal}", where=self.where, log=ended.log)
        return ended

    def _make_ready(self, child: KeptChild) -> None:
        """Start the server where it is not there, and hear its greeting."""
        if unasked := child.unasked():
            error = AnswerError("the server printed a line that nobody had asked for", "one line for each job")
            raise self._broken(child, error, unasked.strip()[:_QUOTED], "")
        if child.is_there:
            return
        failed = child.start(self.start, self.limits)
        greeting = json.dumps({GREETING: PROTOCOL})
        if failed is not None and failed.ended.stopped == "time":
            raise failure(
                f"the server did not say within {self.start:g} s that it is ready",
                where=self.where,
                expected=f"the line {greeting} on its standard output",
                log=failed.ended.log,
                do="print it and flush; where it takes longer, raise start_timeout",
            )
        if failed is not None and failed.ended.stopped:
            failed.ended.check(self.where)
        if failed is not None:
            raise _silent(failed, f"the line {greeting}", self.where, failed.ended.log)
        try:
            read_greeting(child.hello)
        except AnswerError as error:
            raise self._broken(child, error, child.hello[:_QUOTED], "") from error

    def _broken(self, child: KeptChild, error: AnswerError, got: str, log: str) -> RendererError:
        """The error of a server that has broken the protocol; it is ended."""
        child.end()
        return failure(
            error.what,
            where=self.where,
            expected=error.expected,
            got=repr(got),
            log=log or f"server: {got}",
            do="print nothing else on standard output: what is for people goes to standard error",
        )


def _silent(asked: Answered, expected: str, where: str, log: str) -> RendererError:
    """The error of a server that has ended, or closed its output, where a line was expected."""
    what = "the server closed its standard output" if asked.lives else "the server ended"
    got = "" if asked.lives else asked.ended.signal or f"exit code {asked.ended.exit}"
    return failure(what, where=where, expected=expected, got=got, log=log)


def read_greeting(line: str) -> None:
    """Raise AnswerError where ``line`` is not the greeting of a server that speaks this protocol.

    >>> read_greeting('{"notabug_server": 1}')
    """
    expected = json.dumps({GREETING: PROTOCOL})
    said = _object(line, "the server's first line is not its greeting", expected)
    if said.keys() != {GREETING}:
        raise AnswerError("the server's first line is not its greeting", expected)
    if said[GREETING] is True or said[GREETING] != PROTOCOL:
        raise AnswerError("the server speaks another version of the protocol", expected)


def read_answer(line: str, number: int) -> str:
    """What the server says against job ``number``; "" where it has drawn it. Raises AnswerError for any other line.

    >>> read_answer('{"job": 7, "ok": true}', 7)
    ''
    >>> read_answer('{"job": 7, "error": "no such texture"}', 7)
    'no such texture'
    """
    ok = json.dumps({"job": number, "ok": True})
    expected = f'{ok}, or "error" and a text in the place of "ok"'
    said = _object(line, "a line on standard output is no answer", expected)
    if said.keys() not in ({"job", "ok"}, {"job", "error"}):
        raise AnswerError("an answer with other keys", expected)
    if isinstance(said["job"], bool) or not isinstance(said["job"], int):
        raise AnswerError("an answer whose job is no whole number", expected)
    if said["job"] != number:
        raise AnswerError("an answer to another job", expected)
    if "ok" in said and said["ok"] is not True:
        raise AnswerError("an answer that is neither ok nor an error", expected)
    refusal = said.get("error", "")
    if not isinstance(refusal, str) or ("error" in said and not refusal.strip()):
        raise AnswerError("an error without a text", expected)
    return refusal


def _object(line: str, what: str, expected: str) -> dict[str, object]:
    """``line`` as a JSON object; raises AnswerError, which says ``what``, where it is none or too long."""
    if len(line.encode("utf-8", "surrogatepass")) > LONGEST:
        raise AnswerError(f"a line of more than {LONGEST} bytes on standard output", expected)
    try:
        said = json.loads(line)
    except (ValueError, RecursionError):
        said = None
    if not isinstance(said, dict):
        raise AnswerError(what, expected)
    return said
