"""The product stays readable: functions of 80 lines at most, files of 400, and no ``Any`` in a signature."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
FLOORS = ("scenes_usd", "references", "adapters", "metrics", "notabug")
LONGEST_FUNCTION, LONGEST_FILE = 80, 400  # lines

# A value whose type is known only when the program runs, and is checked then.
ANY_IS_RIGHT = {
    "scenes_usd/reader_values.py": {"value", "read", "checked"},  # of a USD attribute: ``kind`` is checked
    "scenes_usd/reader_inputs.py": {"constant"},  # the same of a shader's input
    "adapters/declared.py": {"_value", "unknown", "said"},  # fields of a Declaration, checked by their type hints
    "metrics/verdict.py": {"_finding"},  # fields of a Finding, as ``run.json`` has them, checked by results/shape.py
    "notabug/results/record.py": {"_numbers"},  # the same
    "notabug/bench/page.py": {"course_from", "result_from", "_check_from"},  # fields of our own benches' records
    "scenes_usd/picture_child.py": {"read_by_child"},  # fields of a Picture, which our own child has written
    "adapters/opengl_child.py": {"_egl"},  # settings that the stub of moderngl does not know
    "adapters/mitsuba_bsdf.py": {  # what drjit computes with has the types of the variant that is loaded
        *("whitted", "eval", "sample", "pdf", "eval_pdf", "eval_null_transmission", "eval_diffuse_reflectance"),
        *("emitting", "_opacity", "_evaluated", "_sampled", "_preview", "_lobe", "lobe"),
    },
    "adapters/browser_child.py": {"call", "_next", "run"},  # what a browser answers to a message
    "notabug/pytest_plugin.py": {"__init__"},  # words that pytest passes on to its own class
}

Function = ast.FunctionDef | ast.AsyncFunctionDef


@cache
def product() -> tuple[Path, ...]:
    """The product's Python files, links not followed."""
    found = [path for floor in FLOORS for path in (ROOT / floor).rglob("*.py")]
    return tuple(path for path in found if not any(parent.is_symlink() for parent in path.parents if parent != ROOT))


def functions(text: str) -> Iterator[Function]:
    yield from (node for node in ast.walk(ast.parse(text)) if isinstance(node, Function))


def says_any(function: Function) -> bool:
    """Whether ``Any`` stands in an annotation of the function's arguments or of what it returns."""
    of = function.args
    arguments = [*of.posonlyargs, *of.args, *of.kwonlyargs, *filter(None, (of.vararg, of.kwarg))]
    said = [argument.annotation for argument in arguments] + [function.returns]
    parts = (part for annotation in said if annotation is not None for part in ast.walk(annotation))
    return any(
        (isinstance(part, ast.Name) and part.id == "Any") or (isinstance(part, ast.Attribute) and part.attr == "Any")
        for part in parts
    )


def lines_of(function: Function) -> int:
    assert function.end_lineno is not None
    return function.end_lineno - function.lineno + 1


def test_no_function_is_longer_than_a_page() -> None:
    long = [
        f"{path.relative_to(ROOT)}: {function.name} has {lines_of(function)} lines"
        for path in product()
        for function in functions(path.read_text("utf-8"))
        if lines_of(function) > LONGEST_FUNCTION
    ]
    assert long == []


@pytest.mark.parametrize("suffix", ["*.py", "*.h", "*.cpp", "*.mjs"])
def test_no_file_is_long(suffix: str) -> None:
    sources = product() if suffix == "*.py" else [path for floor in FLOORS for path in (ROOT / floor).rglob(suffix)]
    long = [
        f"{path.relative_to(ROOT)} has {count} lines"
        for path in sources
        if "vendor" not in path.parts and (count := len(path.read_text("utf-8").splitlines())) > LONGEST_FILE
    ]
    assert long == []


def test_no_signature_says_any() -> None:
    said = {
        (path.relative_to(ROOT).as_posix(), function.name)
        for path in product()
        for function in functions(path.read_text("utf-8"))
        if says_any(function)
    }
    allowed = {(file, name) for file, names in ANY_IS_RIGHT.items() for name in names}
    assert sorted(said - allowed) == [], "say what the value is: object for what is unknown, a TypedDict for a document"
    assert sorted(allowed - said) == [], "no longer needed: take it out of ANY_IS_RIGHT"


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("def f(a: dict[str, Any]) -> int: ...", True),
        ("def f(*a: typing.Any) -> int: ...", True),
        ("async def f(a: int) -> Callable[..., Any]: ...", True),
        ("def f(a: object) -> int:\n    b: Any = a\n    return b", False),
    ],
)
def test_the_test_of_signatures_can_fail(text: str, expected: bool) -> None:
    (function,) = functions(text)
    assert says_any(function) is expected
