"""The pages that say where to change what name files that are there, and names that those files hold."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PAGES = ("CONTRIBUTING.md", "docs/judge.md", "docs/design.md")
FILE = r"`([\w./*-]+\.(?:py|h|cpp|md|html|css|js))`"
STATED = r"^\s*(?:[\w:]+ )*{}\b\s*[(:=,{{]"  # of Python and of C++
NAMES_IN = re.compile(r"((?:`\w+`(?:, | and )?)+) in " + FILE)


def places(page: str, name: str) -> list[Path]:
    """The files that ``name`` means on ``page``: seen from the root, in the judge's page also from ``metrics/``."""
    rooms = [path for path in (ROOT / "notabug").iterdir() if path.is_dir()]
    homes = [ROOT, ROOT / "docs", ROOT / "metrics", ROOT / "notabug", *rooms]
    return [path for home in (homes if page != "CONTRIBUTING.md" else homes[:1]) for path in home.glob(name)]


def named(page: str) -> Iterator[tuple[str, str]]:
    """Each "`A` and `B` in `file`" of ``page``: a name and its file."""
    for found in NAMES_IN.finditer(" ".join((ROOT / page).read_text(encoding="utf-8").split())):
        yield from ((name, found.group(2)) for name in re.findall(r"\w+", found.group(1)) if name != "and")


@pytest.mark.parametrize("page", PAGES)
def test_every_file_that_is_named_is_there(page: str) -> None:
    files = set(re.findall(FILE, (ROOT / page).read_text(encoding="utf-8")))
    assert len(files) > 10
    # in CONTRIBUTING a bare name is one of the folder named before it
    assert sorted(name for name in files if not places(page, name) and ("/" in name or page != PAGES[0])) == []


@pytest.mark.parametrize("page", PAGES[:2])
def test_every_name_stands_in_the_file_that_is_said_to_hold_it(page: str) -> None:
    pairs = set(named(page))
    assert len(pairs) > 3
    wrong = []
    for name, file in sorted(pairs):
        texts = [path.read_text(encoding="utf-8") for path in places(page, file)]
        if not any(re.search(STATED.format(name), text, re.M) for text in texts):
            wrong.append(f"{name} in {file}")
    assert wrong == []


def test_the_pages_can_be_wrong() -> None:
    assert places("CONTRIBUTING.md", "metrics/admissible.py")
    assert not places("CONTRIBUTING.md", "metrics/not_there.py")
    text = (ROOT / "metrics" / "admissible.py").read_text(encoding="utf-8")
    assert not re.search(STATED.format("RELATIVE"), text, re.M)  # imported there, and not its home
