"""The program ``notabug``, as it is typed: the command line, and ahead of it what takes longest to start."""

from __future__ import annotations

import contextlib
import gc
import sys
from collections.abc import Sequence

from notabug.ending import exit_state, report_defect

ALLOCATED = 50_000
"""Objects between two searches for cycles of garbage: modules that load make a million, none of which is garbage."""


def main() -> None:
    """``notabug.cli``; of a run that is to be long, its workers start to load before the words are understood."""
    gc.set_threshold(ALLOCATED, *gc.get_threshold()[1:])
    try:
        if _is_long(sys.argv[1:]):
            from notabug.runs.workers import prepare

            with contextlib.suppress(Exception):  # the run starts one again, and tells what is wrong
                prepare()
        from notabug.cli import main as command_line

        command_line()
    except KeyboardInterrupt as error:
        sys.exit(exit_state(error))
    except Exception as error:  # what is installed is broken; Python would end with 1, which tells of a renderer's bug
        sys.exit(report_defect(error))


def _is_long(words: Sequence[str]) -> bool:
    """Whether ``words`` name so many scenes that processes will do them; a guess, which nothing depends on."""
    if words[:1] != ["run"]:
        return False
    from notabug.runs.workers import JOBS_PER_PROCESS, cores_here

    named = sum(not word.startswith("-") for word in words[1:])
    elsewhere = {"--executor", "--workarounds", "--help"}.intersection(words)
    return named >= 2 * JOBS_PER_PROCESS and not elsewhere and cores_here() > 1


if __name__ == "__main__":
    main()
