"""The numbers that decide a verdict: where each stands in metrics/, and a copy of its module with another value."""

from __future__ import annotations

import ast
import importlib
from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path

import notabug.metrics

FOLDER = Path(notabug.metrics.__path__[0])
SMALL = frozenset({0, 0.5, 1, 2, 3})
"""Literals that need no row: half and twice, counts of axes and channels."""
AGAINST_ZERO = 1e-8
"""Smaller literals only keep from dividing by zero."""
DECIDES_NOTHING = frozenset({"why", "verdict", "predictions", "channels", "image_filters"})
"""They show, hold, keep in memory, or compute without a choice."""
STANDARDS = {
    "perceive": "matrices and constants of ITU-R BT.709, BT.2020, BT.2100, BT.2124 and SMPTE ST 2084",
    "calibration": "the resolution of searches; its limits are constants",
}
"""Files whose literals need no row, and what they are."""
NOT_NUMBERS = frozenset(
    {"calibration._TURNS", "perceive._TO_2020", "perceive._TO_LMS", "perceive._TO_ICTCP", "excused.TOUCHING"}
)
NOT_NUMBERS |= {f"perceive.{name}" for name in ("_PEAK", "_M1", "_M2", "_C1", "_C2", "_C3")}
"""Constants that a standard states, the turns of a picture, and the shape of a neighbourhood."""
SCALED = "_scaled_for_sensitivity"
"""The name under which a changed copy of a module finds ``scaled``."""


def shown(value: object) -> str:
    """``value`` as the page has it."""
    if isinstance(value, Mapping):
        joint = ": " if all(isinstance(key, int) for key in value) else " "
        return ", ".join(f"{key}{joint}{shown(entry)}" for key, entry in value.items())
    if isinstance(value, tuple):
        return f"({', '.join(map(shown, value))})"
    return f"{value:g}"


def numeric(value: object) -> bool:
    """Whether ``value`` is a number, or made of numbers."""
    if isinstance(value, Mapping):
        return bool(value) and all(numeric(entry) for entry in value.values())
    if isinstance(value, tuple):
        return bool(value) and all(numeric(entry) for entry in value)
    return isinstance(value, int | float) and not isinstance(value, bool)


def _tree(name: str) -> ast.Module:
    return ast.parse((FOLDER / f"{name}.py").read_text("utf-8"))


def _assigned(node: ast.stmt) -> list[ast.expr]:
    """What a statement at the top of a module assigns to."""
    if isinstance(node, ast.AnnAssign):
        return [node.target]
    return node.targets if isinstance(node, ast.Assign) else []


def constants(name: str) -> Iterator[tuple[str, object]]:
    """``file.NAME`` and the value of each number that is assigned at the top of metrics/``name``.py."""
    module = importlib.import_module(f"notabug.metrics.{name}")
    for node in _tree(name).body:
        for target in _assigned(node):
            for part in ast.walk(target):
                if isinstance(part, ast.Name) and part.id.isupper() and numeric(getattr(module, part.id)):
                    yield f"{name}.{part.id}", getattr(module, part.id)


def _literal(part: ast.AST) -> int | float | None:
    """The number that ``part`` of a function is, if it needs a row."""
    value = part.value if isinstance(part, ast.Constant) else None
    if not isinstance(value, int | float) or isinstance(value, bool):
        return None
    return None if value in SMALL or abs(value) <= AGAINST_ZERO else value


def literals(name: str) -> Iterator[tuple[str, object]]:
    """``file: literal`` and the value of each number that stands in a function of metrics/``name``.py."""
    for node in _tree(name).body:
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            for part in ast.walk(node):
                value = _literal(part)
                if value is not None:
                    yield f"{name}: {shown(value)}", value


@cache
def found() -> Mapping[str, str]:
    """Every number that decides, by the name of its row: its value as the page shows it."""
    result: dict[str, str] = {}
    for name in sorted(path.stem for path in FOLDER.glob("*.py")):
        if name == "__init__" or name in DECIDES_NOTHING:
            continue
        result |= {key: shown(value) for key, value in constants(name) if key not in NOT_NUMBERS}
        if name not in STANDARDS:
            result |= {key: shown(value) for key, value in literals(name)}
    return result


def module_of(row: str) -> str:
    """The module in which the number of ``row`` stands.

    >>> module_of("rules: 5"), module_of("references.tracer.precision.RELATIVE")
    ('notabug.metrics.rules', 'notabug.references.tracer.precision')
    """
    if row.startswith("references."):
        return f"notabug.{row.rpartition('.')[0]}"
    return f"notabug.metrics.{row.partition(':')[0].partition('.')[0]}"


def scaled(value: object, factor: float) -> object:
    """``value`` times ``factor``, whole numbers to whole ones from 1 on; of tuples and tables every number.

    >>> scaled((4, 1), 0.5), scaled({"box": 0.4}, 2.0), scaled(3, 0.5)
    ((2, 1), {'box': 0.8}, 2)
    """
    if isinstance(value, Mapping):
        return {key: scaled(entry, factor) for key, entry in value.items()}
    if isinstance(value, tuple):
        return tuple(scaled(entry, factor) for entry in value)
    if isinstance(value, int):
        return max(1, int(value * factor + 0.5))
    assert isinstance(value, float)
    return value * factor


class _Changed(ast.NodeTransformer):
    """The number of one row replaced by a call of SCALED."""

    def __init__(self, row: str) -> None:
        _, joint, self.literal = row.partition(": ")
        self.name = "" if joint else row.rpartition(".")[2]
        self.places = 0

    def _call(self, value: ast.expr) -> ast.expr:
        self.places += 1
        return ast.Call(ast.Name(SCALED, ast.Load()), [value], [])

    def _at_top(self, node: ast.stmt) -> None:
        if not isinstance(node, ast.Assign | ast.AnnAssign) or node.value is None:
            return
        for target in _assigned(node):
            if isinstance(target, ast.Name) and target.id == self.name:
                node.value = self._call(node.value)
            elif isinstance(target, ast.Tuple) and isinstance(node.value, ast.Tuple):
                pairs = list(zip(target.elts, node.value.elts, strict=True))
                named = [isinstance(part, ast.Name) and part.id == self.name for part, _ in pairs]
                node.value.elts = [
                    self._call(part) if is_it else part for is_it, (_, part) in zip(named, pairs, strict=True)
                ]

    def visit_Module(self, node: ast.Module) -> ast.Module:
        for statement in node.body:
            if self.name:
                self._at_top(statement)
            elif isinstance(statement, ast.FunctionDef | ast.ClassDef):
                self.generic_visit(statement)
        return node

    def visit_Constant(self, node: ast.Constant) -> ast.expr:
        value = _literal(node)
        return self._call(node) if value is not None and shown(value) == self.literal else node


def changed(source: str, row: str) -> ast.Module:
    """The syntax tree of a module with ``source`` in which the number of ``row`` is given to SCALED.

    Raises ValueError where the module does not hold the number.
    """
    change = _Changed(row)
    tree: ast.Module = change.visit(ast.parse(source))
    if not change.places:
        raise ValueError(f"{module_of(row)} holds no number {row}")
    return ast.fix_missing_locations(tree)
