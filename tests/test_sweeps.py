"""What `make test` leaves to `make sweep`: the instances that a mark does not name, and no others."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

ROOT = Path(__file__).resolve().parents[1]


@dataclass
class Instance:
    """What the marking asks of a collected test."""

    nodeid: str
    kept: tuple[str, ...] = ()
    added: list[str] = field(default_factory=list)

    def iter_markers(self, name: str) -> Iterator[pytest.Mark]:
        if self.kept and name == "sweep_except":
            yield pytest.mark.sweep_except(*self.kept).mark

    def add_marker(self, mark: pytest.MarkDecorator) -> None:
        self.added.append(mark.name)


def instances(*kept: str) -> list[Instance]:
    """Three of one test, of which ``kept`` are named, and another test."""
    return [*(Instance(f"a.py::test_it[{name}]", kept) for name in "abc"), Instance("a.py::test_other[a]")]


@pytest.fixture
def marking(request: pytest.FixtureRequest) -> ModuleType:
    """tests/conftest.py."""
    plugins = request.config.pluginmanager.get_plugins()
    return next(each for each in plugins if getattr(each, "__file__", None) == str(ROOT / "tests" / "conftest.py"))


def test_what_a_mark_does_not_name_is_swept(marking: Any) -> None:
    found = instances("a", "c")
    marking.mark_sweeps(found, complete=True)
    assert [each.added for each in found] == [[], ["sweep"], [], []]


def test_a_mark_that_names_what_is_not_there_is_refused(marking: Any) -> None:
    with pytest.raises(pytest.UsageError, match=r"test_it: sweep_except names instances that are not there: \['d'\]"):
        marking.mark_sweeps(instances("a", "d"), complete=True)
    marking.mark_sweeps(instances("a", "d")[:1], complete=False)  # asked for by its id: others are not collected


def test_sweeps_are_left_out_by_default_and_have_a_target() -> None:
    options = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["tool"]["pytest"]["ini_options"]["addopts"]
    assert options[options.index("-m") + 1] == "not sweep"
    assert "-m sweep" in (ROOT / "Makefile").read_text("utf-8")
