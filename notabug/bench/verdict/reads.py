"""Which numbers are read while something is judged: a judgement that never reads a number cannot move by it.

Numbers of the policy are read through it while the judge runs, or once where a file gives one a name at its top; those
of references/ are constants that other files import. So the judge is imported anew in a form that notes each use.
"""

from __future__ import annotations

import ast
import functools
import gc
import importlib
import importlib.util
import os
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec, PathFinder, SourceFileLoader
from pathlib import Path
from types import CodeType, ModuleType
from typing import TypeVar

from notabug.metrics.policy import POLICY, Policy, entries

FLOORS = ("notabug.references", "notabug.adapters", "notabug.metrics")  # that are read again
LISTS = "notabug.metrics.policy"  # where numbers stand, and are not used
NOTE = "_note_for_reads"
"""The name under which a copy of a module finds the function that notes a use."""
Rows = frozenset[str]
Said = TypeVar("Said")
EVERY = tuple(entry.name for entry in entries(POLICY))
"""The names of all numbers that decide: those of the policy, and the constants of references/."""


def forget(floors: Sequence[str]) -> dict[str, ModuleType]:
    """Forget the modules of ``floors``, so that they are imported anew; the C++ module has no second copy."""
    known = {name: module for name, module in sys.modules.items() if name.startswith(tuple(floors))}
    for name in known:
        if not name.endswith("_native"):
            del sys.modules[name]
    return known


def put_back(known: dict[str, ModuleType]) -> None:
    """Import what was ``known`` again as it was, also where it is asked for as a part of its package."""
    sys.modules.update(known)
    for name, module in known.items():
        package, _, part = name.rpartition(".")
        if package in sys.modules:
            setattr(sys.modules[package], part, module)


@contextmanager
def own_cache() -> Iterator[None]:
    """Predictions are kept in a folder of their own, which is empty at first and removed after."""
    before = os.environ.get("NOTABUG_CACHE")
    with tempfile.TemporaryDirectory() as folder:
        os.environ["NOTABUG_CACHE"] = folder
        try:
            yield
        finally:
            if before is None:
                os.environ.pop("NOTABUG_CACHE", None)
            else:
                os.environ["NOTABUG_CACHE"] = before


@contextmanager
def imported_by(finder: MetaPathFinder, floors: Sequence[str]) -> Iterator[None]:
    """The modules of ``floors`` are imported anew, by ``finder`` where it has something to say, and put back after."""
    known = forget(floors)
    sys.meta_path.insert(0, finder)
    try:
        yield
    finally:
        sys.meta_path.remove(finder)
        forget(floors)
        put_back(known)


def _of_policy(node: ast.AST) -> Rows:
    """The numbers of the policy that ``POLICY.group.number`` or ``POLICY.group`` names."""
    parts: list[str] = []
    while isinstance(node, ast.Attribute):
        parts.append(node.attr)
        node = node.value
    if not (isinstance(node, ast.Name) and node.id == "POLICY" and parts):
        return frozenset()
    name = ".".join(reversed(parts[-2:]))
    return frozenset(row for row in EVERY if row == name or row.startswith(f"{name}."))


def _rows(node: ast.AST | None, names: dict[str, Rows]) -> Rows:
    """The numbers that an expression uses, where ``names`` stand for some."""
    if node is None:
        return frozenset()
    own = names.get(node.id, frozenset()) if isinstance(node, ast.Name) else _of_policy(node)
    return own or frozenset().union(*(_rows(part, names) for part in ast.iter_child_nodes(node)))


def _targets(node: ast.Assign | ast.AnnAssign) -> list[str]:
    targets = node.targets if isinstance(node, ast.Assign) else [node.target]
    return [part.id for target in targets for part in ast.walk(target) if isinstance(part, ast.Name)]


@functools.cache
def named(module: str) -> dict[str, Rows]:
    """The names at the top of a module that stand for numbers that decide, or were computed from some."""
    spec = importlib.util.find_spec(module)
    if spec is None or spec.origin is None or not spec.origin.endswith(".py") or module.startswith(LISTS):
        return {}
    own = {row.rpartition(".")[2]: row for row in EVERY if row.rpartition(".")[0] == module[len("notabug.") :]}
    names: dict[str, Rows] = {}
    for node in ast.parse(Path(spec.origin).read_text("utf-8")).body:
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith(FLOORS):
            imported = named(node.module or "")
            names |= {part.asname or part.name: imported[part.name] for part in node.names if part.name in imported}
        elif isinstance(node, ast.Assign | ast.AnnAssign):
            rows = _rows(node.value, names)
            for target in _targets(node):
                here = rows | ({own[target]} if target in own else frozenset())
                names |= {target: here} if here else {}
    return names


class _Noting(ast.NodeTransformer):
    """Each use of one of ``names`` inside a function is noted; so are defaults of a parameter, at each call."""

    def __init__(self, names: dict[str, Rows]) -> None:
        self.names = names
        self.depth = 0

    def _note(self, rows: Rows, value: ast.expr) -> ast.expr:
        told = ast.Tuple([ast.Constant(row) for row in sorted(rows)], ast.Load())
        return ast.Call(ast.Name(NOTE, ast.Load()), [told, value], [])

    def visit_Name(self, node: ast.Name) -> ast.expr:
        rows = self.names.get(node.id, frozenset())
        return self._note(rows, node) if rows and self.depth and isinstance(node.ctx, ast.Load) else node

    def visit_Lambda(self, node: ast.Lambda) -> ast.expr:
        self.depth += 1
        self.generic_visit(node)
        self.depth -= 1
        return node

    def visit_FunctionDef(self, node: ast.FunctionDef) -> ast.stmt:
        defaults = [default for default in (*node.args.defaults, *node.args.kw_defaults) if default is not None]
        rows = frozenset[str]().union(*(_rows(default, self.names) for default in defaults))
        self.depth += 1
        node.body = [self.visit(statement) for statement in node.body]
        self.depth -= 1
        if rows:
            node.body.insert(0, ast.Expr(self._note(rows, ast.Constant(None))))
        return node


class _Loader(SourceFileLoader):
    """Loads a module so that ``note`` is told of each use of a number that decides."""

    def __init__(self, fullname: str, path: str, note: Callable[[Sequence[str], object], object]) -> None:
        super().__init__(fullname, path)
        self.note = note

    def get_code(self, fullname: str) -> CodeType:
        path = self.get_filename(fullname)
        tree = _Noting(named(fullname)).visit(ast.parse(Path(path).read_text("utf-8")))
        return compile(ast.fix_missing_locations(tree), path, "exec", dont_inherit=True)

    def exec_module(self, module: ModuleType) -> None:
        module.__dict__[NOTE] = self.note
        super().exec_module(module)


class _Finder(MetaPathFinder):
    def __init__(self, note: Callable[[Sequence[str], object], object]) -> None:
        self.note = note

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        if not fullname.startswith(FLOORS) or fullname.startswith(LISTS):
            return None
        spec = PathFinder.find_spec(fullname, path, target)
        if spec is not None and spec.origin is not None and spec.origin.endswith(".py"):
            spec.loader = _Loader(fullname, spec.origin, self.note)
        return spec


class _Watched:
    """A policy, or one of its groups, that notes each number that is asked for."""

    def __init__(self, of: object, name: str, read: set[str]) -> None:
        self._of, self._name, self._read = of, name, read

    def __getattr__(self, part: str) -> object:
        value = getattr(self._of, part)
        if isinstance(self._of, Policy) or not self._name:
            return _Watched(value, part, self._read)
        self._read.add(f"{self._name}.{part}")
        return value


def _forget_computed() -> None:
    """Empty the caches of functions of the floors: what they computed for one picture they read for the next again."""
    for thing in gc.get_objects():
        if isinstance(thing, functools._lru_cache_wrapper) and str(thing.__module__).startswith(FLOORS):
            thing.cache_clear()


class Noted:
    """The judge in the form that notes what it reads, inside ``noting``."""

    def __init__(self, read: set[str]) -> None:
        self._read = read

    @contextmanager
    def fresh(self) -> Iterator[None]:
        """Inside nothing that was computed before is known: what depends on a number reads it."""
        _forget_computed()
        with own_cache():
            yield

    def of(self, judge: Callable[[], Said]) -> tuple[Said, Rows]:
        """What ``judge`` says, which imports what it needs by ``importlib``, and the numbers that it reads."""
        self._read.clear()
        return judge(), frozenset(self._read)


@contextmanager
def noting() -> Iterator[Noted]:
    """The judge imported anew, in a form that notes the numbers that it reads."""
    read: set[str] = set()

    def note(rows: Sequence[str], value: object) -> object:
        read.update(rows)
        return value

    with imported_by(_Finder(note), FLOORS):
        policy = importlib.import_module(LISTS)
        vars(policy)["POLICY"] = _Watched(policy.POLICY, "", read)
        yield Noted(read)
