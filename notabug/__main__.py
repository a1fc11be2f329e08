"""The program ``notabug``, as it is typed: the command line, and ahead of it what takes longest to start."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Sequence

from notabug.crew import JOBS_PER_PROCESS, cores_here, prepare


def main() -> None:
    """``notabug.cli``; of a run that is to be long, a crew starts to load before the words are understood."""
    if _is_long(sys.argv[1:]):
        with contextlib.suppress(Exception):  # the run starts one again, and tells what is wrong
            prepare()
    from notabug.cli import main as command_line

    command_line()


def _is_long(words: Sequence[str]) -> bool:
    """Whether ``words`` name so many scenes that processes will do them; a guess, which nothing depends on."""
    named = sum(not each.startswith("-") for each in words[1:])
    elsewhere = {"--executor", "--workarounds", "--help"}.intersection(words)
    return words[:1] == ["run"] and named >= 2 * JOBS_PER_PROCESS and not elsewhere and cores_here() > 1


if __name__ == "__main__":
    main()
