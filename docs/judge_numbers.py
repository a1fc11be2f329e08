"""Writes docs/judge-numbers.md: the numbers that decide a verdict, from metrics/policy/.

``python docs/judge_numbers.py`` writes the page; a test says when it is stale.
"""

from __future__ import annotations

from itertools import groupby
from pathlib import Path

from notabug.bench.verdict.numbers import shown
from notabug.metrics.policy import Entry, entries
from notabug.metrics.policy.number import KINDS

PAGE = Path(__file__).resolve().parents[1] / "docs" / "judge-numbers.md"
HEAD = """\
# The numbers that decide a verdict

Every number that takes part in a verdict, by the step of [judge.md](judge.md) that uses it.
`python docs/judge_numbers.py` writes this page from `metrics/policy/`, where the numbers are to be changed;
`notabug list policy` prints them, and `run.json` keeps them under `policy`. A test fails when a number that decides
stands elsewhere in `metrics/`.

A name such as `admissible.edge` is `POLICY.admissible.edge` in the code: the number that `metrics/admissible.py`
reads, and perhaps other files too. A name that begins with `references` is a constant that stands there,
as the tracer and the models use it. The source of a number is one of

- **derived**: it follows from a formula or from a statement that can be checked, which is given;
- **measured**: it was read off pictures, and the row says which; where two values are given, the number lies between;
- **convention**: somebody chose it. These rows are the ones to question first; what moves when each is halved and
  doubled is in [judge-sensitivity.md](judge-sensitivity.md).

"Word" in the last column says that the number can change the word of a verdict (`pass`, `limitation`, `bug`,
`inconclusive`), "name" that it can change what a bug or a limitation is called, "time" that it bounds the search and
is meant to change nothing but how long the search takes.

"""


def row(entry: Entry) -> str:
    """One line of a table."""
    said = entry.said
    return f"| `{entry.name}` | {shown(entry.value)} | {said.unit} | {said.meaning} | {said.source} | {said.decides} |"


def page() -> str:
    """The whole page."""
    every = entries()
    counts = ", ".join(f"{sum(entry.said.source.startswith(kind) for entry in every)} {kind}" for kind in KINDS)
    parts = [HEAD, f"There are {len(every)}: {counts}.\n"]
    for step, some in groupby(every, key=lambda entry: entry.step):
        parts.append(
            f"\n## {step}\n\n| number | value | unit | meaning | source | decides |\n|---|---|---|---|---|---|\n"
        )
        parts += [f"{row(entry)}\n" for entry in some]
    return "".join(parts)


if __name__ == "__main__":
    PAGE.write_text(page(), "utf-8")
