"""The judge asks a model what it is, and never what it is called: a new model is one file."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

from notabug.bench.verdict.catalogue import FAULTS, LIMITATIONS
from notabug.metrics.causes import _of_no_strength
from notabug.references.models.camera import pixel_shift

FOLDER = Path(__file__).resolve().parents[2] / "metrics"
NAMES = {name for fault in FAULTS for name in fault.right} | {limitation.name for limitation in LIMITATIONS}
NAMES |= {pixel_shift(1, 1, 0.0, 0.0).name, "unexplained"}
OF_PICTURES = {cause.name for cause in _of_no_strength()}
"""Causes in the whole picture, which have no models; calibration tells of them in words of its own."""
MADE_BY_NAME = {"causes.cause_called"}
"""Functions that make a cause in the whole picture again of the name by which a verdict tells of it."""


def compared(tree: ast.Module, file: str) -> Iterator[str]:
    """What is compared with a literal name of a model, or looked up in a collection of such names."""
    asked = (top for top in tree.body if f"{file}.{getattr(top, 'name', '')}" not in MADE_BY_NAME)
    for node in (node for top in asked for node in ast.walk(top)):
        parts: list[ast.expr | None] = []
        names = NAMES - OF_PICTURES
        if isinstance(node, ast.Compare):
            parts = [node.left, *node.comparators]
            names = NAMES | OF_PICTURES
        elif isinstance(node, ast.Set):
            parts = [*node.elts]
        elif isinstance(node, ast.Dict):
            parts = [*node.keys]
        for leaf in (leaf for part in parts if part is not None for leaf in ast.walk(part)):
            if isinstance(leaf, ast.Constant) and leaf.value in names:
                yield f"{file}, line {leaf.lineno}: {leaf.value}"


@pytest.mark.parametrize("path", sorted(FOLDER.glob("*.py")), ids=lambda path: path.stem)
def test_nothing_is_compared_with_the_name_of_a_model(path: Path) -> None:
    found = list(compared(ast.parse(path.read_text("utf-8")), path.stem))
    assert not found, "give the model a field that says it (references/models/model.py)"


@pytest.mark.parametrize(
    "code", ['name == "gamma"', 'name in ("gamma", "albedo")', 'RARE = {"albedo"}', '{"albedo": 1}[name]']
)
def test_a_name_would_be_found(code: str) -> None:
    assert list(compared(ast.parse(code), "some"))
