"""The numbers that decide a verdict: those of the policy, others in the code of metrics/, and how to change one."""

from __future__ import annotations

import ast
import importlib
import re
from collections.abc import Iterator, Mapping
from pathlib import Path

import notabug.metrics
from notabug.metrics.policy import POLICY, entries

FOLDER = Path(notabug.metrics.__path__[0])
SMALL = frozenset({0, 0.5, 1, 2, 3})
"""Literals that decide nothing by themselves: half and twice, counts of axes and channels."""
AGAINST_ZERO = 1e-8
"""Smaller literals only keep from dividing by zero."""
DECIDES_NOTHING = frozenset({"why", "verdict", "predictions", "channels", "image_filters", "formulas"})
"""They show, hold, keep in memory, compute without a choice, or state what mathematics does."""
STANDARDS = {
    "perceive": "matrices and constants of ITU-R BT.709, BT.2020, BT.2100, BT.2124 and SMPTE ST 2084",
    "calibration": "the resolution of searches; its limits are in the policy",
}
"""Files whose literals may stand in the code, and what they are."""
NOT_NUMBERS = frozenset({"calibration._TURNS", "excused.TOUCHING"})
NOT_NUMBERS |= {f"perceive.{name}" for name in ("_PEAK", "_M1", "_M2", "_C1", "_C2", "_C3")}
NOT_NUMBERS |= {f"perceive.{name}" for name in ("_TO_2020", "_TO_LMS", "_TO_ICTCP")}
"""Constants that a standard states, the turns of a picture, and the shape of a neighbourhood."""
SCALED = "_scaled_for_sensitivity"
"""The name under which a changed copy of a module of references/ finds ``scaled``."""


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
        if any(isinstance(part, ast.Name) and part.id == "POLICY" for part in ast.walk(node)):
            if _assigned(node):  # it is read from there; numbers that are put to it are not
                yield from _found(name, node)
            continue
        for target in _assigned(node):
            for part in ast.walk(target):
                if isinstance(part, ast.Name) and part.id.isupper() and numeric(getattr(module, part.id)):
                    yield f"{name}.{part.id}", getattr(module, part.id)


def _literal(part: ast.AST) -> int | float | None:
    """The number that ``part`` of a function is, if it may decide something."""
    value = part.value if isinstance(part, ast.Constant) else None
    if not isinstance(value, int | float) or isinstance(value, bool):
        return None
    return None if value in SMALL or abs(value) <= AGAINST_ZERO else value


def _found(name: str, node: ast.AST) -> Iterator[tuple[str, object]]:
    for part in ast.walk(node):
        value = _literal(part)
        if value is not None:
            yield f"{name}: {shown(value)}", value


def literals(name: str) -> Iterator[tuple[str, object]]:
    """``file: literal`` and the value of each number that stands in a function of metrics/``name``.py."""
    for node in _tree(name).body:
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            yield from _found(name, node)


def stray() -> dict[str, str]:
    """The numbers that decide and stand in the code of metrics/, not in its policy: there should be none."""
    result: dict[str, str] = {}
    for name in sorted(path.stem for path in FOLDER.glob("*.py")):
        if name == "__init__" or name in DECIDES_NOTHING:
            continue
        result |= {key: shown(value) for key, value in constants(name) if key not in NOT_NUMBERS}
        if name not in STANDARDS:
            result |= {key: shown(value) for key, value in literals(name)}
    return result


def unread() -> list[str]:
    """The numbers of the policy that no file of metrics/ reads."""
    code = "\n".join(path.read_text("utf-8") for path in FOLDER.glob("*.py"))
    read = {f"{group}.{entry}" for group, entry in re.findall(r"POLICY\.(\w+)\.(\w+)", code)}
    for group, alias in re.findall(r"(\w+) = POLICY\.(\w+)$", code, re.M):
        read |= {f"{alias}.{entry}" for entry in re.findall(rf"\b{group}\.(\w+)", code)}
    return [name for name in found() if name not in read]


def found() -> list[str]:
    """The names of the numbers of the policy."""
    return [entry.name for entry in entries(POLICY) if not entry.name.startswith("references.")]


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
    """The constant ``name`` of a module given to SCALED."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.places = 0

    def _call(self, value: ast.expr) -> ast.expr:
        self.places += 1
        return ast.Call(ast.Name(SCALED, ast.Load()), [value], [])

    def visit_Module(self, node: ast.Module) -> ast.Module:
        for statement in node.body:
            if not isinstance(statement, ast.Assign | ast.AnnAssign) or statement.value is None:
                continue
            for target in _assigned(statement):
                if isinstance(target, ast.Name) and target.id == self.name:
                    statement.value = self._call(statement.value)
                elif isinstance(target, ast.Tuple) and isinstance(statement.value, ast.Tuple):
                    pairs = zip(target.elts, statement.value.elts, strict=True)
                    named = [(isinstance(part, ast.Name) and part.id == self.name, value) for part, value in pairs]
                    statement.value.elts = [self._call(value) if is_it else value for is_it, value in named]
        return node


def changed(source: str, name: str) -> ast.Module:
    """The syntax tree of a module with ``source`` in which its constant ``name`` is given to SCALED.

    Raises ValueError where the module has no such constant.
    """
    change = _Changed(name)
    tree: ast.Module = change.visit(ast.parse(source))
    if not change.places:
        raise ValueError(f"the module has no constant {name}")
    return ast.fix_missing_locations(tree)
