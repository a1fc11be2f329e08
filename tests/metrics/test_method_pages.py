"""docs/judge.md and docs/judge-numbers.md say what the code does: steps, files and numbers."""

from __future__ import annotations

import ast
import importlib.util
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from notabug.adapters.base import Quality
from notabug.adapters.registry import adapter
from notabug.bench.verdict.numbers import shown
from notabug.metrics.admissible import admissible
from notabug.metrics.policy import Policy, entries
from notabug.references.models.model import models
from notabug.references.predict import predict
from notabug.scenes_usd.reader import read_scene

ROOT = Path(__file__).resolve().parents[2]
JUDGE = (ROOT / "docs" / "judge.md").read_text("utf-8")
FILES = sorted(each.stem for each in (ROOT / "metrics").glob("*.py") if each.stem != "__init__")
STEPS = dict(re.findall(r"^## Step (\d+): .*?\n(.*?)(?=^## )", JUDGE, re.M | re.S))
ABBREVIATIONS = {"FLIP", "SMPTE", "E_ITP", "JSON"}
BESIDE = frozenset(
    {"calibration", "recalled", "why", "channels", "image_filters", "formulas", "telling"}
)  # before, beside and for the steps


@pytest.fixture(scope="module")
def numbers() -> ModuleType:
    spec = importlib.util.spec_from_file_location("judge_numbers", ROOT / "docs" / "judge_numbers.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@cache
def head(name: str) -> str:
    """The first line of the docstring of metrics/``name``.py."""
    return (ast.get_docstring(ast.parse((ROOT / "metrics" / f"{name}.py").read_text("utf-8"))) or "").split("\n")[0]


@pytest.mark.parametrize("name", FILES)
def test_each_file_names_its_step_and_the_step_its_file(name: str) -> None:
    assert "docs/judge.md" in head(name)
    assert f"`{name}.py`" in JUDGE or f"`metrics/{name}.py`" in JUDGE
    found = re.match(r"Step (\d+) of docs/judge\.md", head(name))
    assert (found is None) == (name in BESIDE)
    if found is not None:
        assert f"`{name}.py`" in STEPS[found[1]], f"section {found[1]} of docs/judge.md does not name {name}.py"


def docstrings(tree: ast.Module) -> Iterator[str]:
    for node in ast.walk(tree):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef):
            yield ast.get_docstring(node) or ""


@pytest.mark.parametrize("name", FILES)
def test_a_docstring_names_no_constant_that_is_gone(name: str) -> None:
    tree = ast.parse((ROOT / "metrics" / f"{name}.py").read_text("utf-8"))
    known = {node.id for node in ast.walk(tree) if isinstance(node, ast.Name)} | ABBREVIATIONS
    known |= {
        part.asname or part.name for node in ast.walk(tree) if isinstance(node, ast.ImportFrom) for part in node.names
    }
    said = {word for text in docstrings(tree) for word in re.findall(r"\b[A-Z][A-Z_]{3,}\b", text)}
    assert said <= known, "say `group.number` of a number of the policy"


def test_the_table_of_steps_lists_the_files_of_each_section() -> None:
    rows = dict(re.findall(r"^\| \[(\d+)\]\(#[^)]*\) \|[^|]*\| ([^|]*) \|$", JUDGE, re.M))
    assert rows.keys() == STEPS.keys()
    for step, files in rows.items():
        told = {each for each in FILES if f"Step {step} of" in head(each)}
        assert set(re.findall(r"`(\w+)\.py`", files)) == told


def test_the_page_of_numbers_is_that_of_the_policy(numbers: Any) -> None:
    assert numbers.PAGE.read_text("utf-8") == numbers.page(), "run python docs/judge_numbers.py"


def test_numbers_in_the_text_are_those_of_the_policy() -> None:
    values = {entry.name: shown(entry.value) for entry in entries()}
    told = re.findall(r"`([\w.]+)` = ([\d.e+-]*\d)", JUDGE)
    assert len(told) > 20
    assert [(name, value) for name, value in told if values.get(name) != value] == []
    named = [name for name in re.findall(r"`((?:\w+\.)+\w+)`", JUDGE) if name.split(".")[0] in Policy.__slots__]
    assert [name for name in named if name not in values and not name.endswith(".py")] == []


def test_the_pixel_that_is_followed_has_these_values() -> None:
    """The reference, the tolerance and the limitation at (144, 86), as Mitsuba's adapter declares its pictures."""
    scene = read_scene("terminator/sphere")
    declaration = adapter("mitsuba").declaration(Quality())
    to = admissible(predict(scene), declaration)
    facets = next(each for each in models(scene) if each.name == "facet_self_shadow")
    limited = admissible(predict(scene, (facets,)), declaration)
    reference, tolerance = (
        re.search(rf"\| {row} [^\n]*?(\.\d+) \|\n", JUDGE) for row in ("3 \\| reference R", "3 \\| tolerance")
    )
    assert reference is not None
    assert tolerance is not None
    assert float(to.value[86, 144, 0]) == pytest.approx(float(reference[1]), abs=1e-6)
    assert float(to.tau[86, 144, 0]) == pytest.approx(float(tolerance[1]), abs=1e-6)
    assert np.all(limited.value[86, 144] == 0.0)
    assert float(to.value[100, 40, 0]) == pytest.approx(0.22380, abs=5e-6)
    assert float(to.tau[100, 40, 0]) == pytest.approx(0.00125, abs=5e-6)


PAGES = (ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md")))


@pytest.mark.parametrize("page", PAGES, ids=lambda each: each.relative_to(ROOT).as_posix())
def test_files_and_headings_that_a_page_names_are_there(page: Path) -> None:
    text = re.sub(r"^```.*?^```", "", page.read_text("utf-8"), flags=re.M | re.S)
    floors = "scenes_usd|references|adapters|metrics|notabug|tests|docs"
    named = re.findall(rf"`((?:{floors})/[\w/.]*(?:/|\.\w+))`", text)
    gone = [each for each in named if not (ROOT / each).exists()]
    for target, anchor in re.findall(r"\]\((?!https?:)([^)#\s]*)(?:#([^)\s]*))?\)", text):
        there = page.parent / target if target else page
        if not there.exists():
            gone += [target]
        elif anchor:
            headings = re.findall(r"^#+ (.*)$", there.read_text("utf-8"), re.M)
            gone += [anchor] * (
                anchor not in {re.sub(r"[^\w -]", "", each.lower()).replace(" ", "-") for each in headings}
            )
    assert gone == []
