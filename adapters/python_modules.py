"""The modules that a Python program imports from its own folder: a driver in several files is one driver."""

from __future__ import annotations

import ast
from collections.abc import Iterable, Iterator
from pathlib import Path


def with_modules(programs: Iterable[Path]) -> list[Path]:
    """``programs`` and, of those in Python, all modules below their folders that they import, and so on."""
    found: dict[Path, None] = {}
    waiting = list(programs)
    while waiting:
        path = waiting.pop(0)
        if path in found:
            continue
        found[path] = None
        if path.suffix == ".py":
            waiting += _imported(path)
    return list(found)


def _imported(path: Path) -> Iterator[Path]:
    """The files beside ``path`` that its import statements name; a program that cannot be parsed imports nothing."""
    try:
        tree = ast.parse(path.read_bytes())
    except (SyntaxError, ValueError, OSError):
        return
    for node in ast.walk(tree):
        names: list[str] = []
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            base = node.module or ""
            names = [base, *(f"{base}.{alias.name}".lstrip(".") for alias in node.names)]
        for name in filter(None, names):
            place = path.parent.joinpath(*name.split("."))
            parents = [path.parent.joinpath(*name.split(".")[:depth]) for depth in range(1, name.count(".") + 2)]
            for file in (place.with_suffix(".py"), *(parent / "__init__.py" for parent in parents)):
                if file.is_file():
                    yield file
