"""``report --to``: a run as build servers take it, drawn from ``run.json`` alone."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from pathlib import Path

from notabug.exit_codes import ExitCode
from notabug.report.github import github
from notabug.report.junit import junit
from notabug.report.markdown import markdown
from notabug.report.sarif import sarif
from notabug.results.document import RunDocument
from notabug.results.record import Result, load

Writer = Callable[[RunDocument, list[Result], Path], str]
WRITERS: dict[str, Writer] = {"junit": junit, "github": github, "markdown": markdown, "sarif": sarif}


def command(out: Path, to: str) -> ExitCode:
    """Write the run in the folder ``out`` to standard output.

    ``github`` prints annotations and, where GitHub says which file it is, adds the summary to the job's page.
    """
    document = load(out)
    results = [Result.from_dict(each) for each in document["results"]]
    sys.stdout.write(WRITERS[to](document, results, out))
    summary = os.environ.get("GITHUB_STEP_SUMMARY", "")
    if to == "github" and summary:
        with Path(summary).open("a", encoding="utf-8", errors="backslashreplace") as page:
            page.write(markdown(document, results, out))
    return ExitCode.OK
