"""The pages of the site that are made of the code: commands, configuration, files, Python, classes, messages."""

from __future__ import annotations

import ast
import inspect
import re
from collections.abc import Iterator, Sequence
from dataclasses import fields
from enum import Enum
from pathlib import Path
from typing import Any, get_args, get_type_hints

import typer

from notabug.adapters.schema import schema
from notabug.cli import app
from notabug.commands.listing import list_scenes
from notabug.exit_codes import _BY_ERROR, ExitCode
from notabug.gallery.taxonomy import taxonomy
from notabug.metrics.verdict import Finding, Leg, Verdict
from notabug.results.expectation import Entry
from notabug.results.record import Result

ROOT = Path(__file__).resolve().parents[1]
FLOORS = ("scenes_usd", "references", "adapters", "metrics", "notabug")
ERRORS = re.compile(r"\w*(?:Error|fault|refuse|reject)\w*$")


def cell(text: object) -> str:
    """``text`` for one cell of a table: on one line, its bars escaped, and none of it taken for HTML."""
    return " ".join(str(text).split()).replace("|", "\\|").replace("<", "&lt;")


def table(headings: tuple[str, ...], rows: Sequence[tuple[object, ...]]) -> str:
    lines = [f"| {' | '.join(headings)} |", f"|{'---|' * len(headings)}"]
    return "\n".join([*lines, *(f"| {' | '.join(cell(value) for value in row)} |" for row in rows)]) + "\n"


def commands() -> str:
    """Every command with its arguments and options, from the command line itself."""
    group: Any = typer.main.get_command(app)
    functions = {
        each.name or each.callback.__name__: each.callback for each in app.registered_commands if each.callback
    }
    parts = ["# Commands", "", group.help or "", "", "`notabug COMMAND --help` says the same in the terminal.", ""]
    for name in sorted(group.commands):
        command, kinds = group.commands[name], get_type_hints(functions[name])
        parts += [f"## notabug {name}", "", inspect.cleandoc(command.help or ""), ""]
        parts += [
            table(("argument or option", "default", "meaning"), [_option(each, kinds) for each in command.params])
        ]
        parts += ["", re.sub(r"^Example: (.*)$", r"```text\n\1\n```", command.epilog or ""), ""]
    parts += ["## Exit codes", "", table(("code", "name", "errors"), [_code(each) for each in ExitCode])]
    return "\n".join(parts)


def _option(parameter: Any, kinds: dict[str, Any]) -> tuple[object, ...]:
    names = ", ".join(f"`{name}`" for name in (*parameter.opts, *parameter.secondary_opts))
    if parameter.param_type_name == "argument":
        names = f"`{(parameter.metavar or parameter.name).upper()}`"
    inner = [each for each in (kinds[parameter.name], *get_args(kinds[parameter.name])) if not get_args(each)]
    inner += [each for outer in get_args(kinds[parameter.name]) for each in get_args(outer)]
    choices = [member for each in inner if inspect.isclass(each) and issubclass(each, Enum) for member in each]
    default = getattr(parameter.default, "value", parameter.default)
    shown = (
        "required"
        if parameter.required
        else ""
        if default in (None, "", False) or callable(default)
        else f"`{default}`"
    )
    help_text = getattr(parameter, "help", None) or ""
    values = [f"`{getattr(choice, 'value', choice)}`" for choice in choices]
    one_of = f" One of {', '.join(values)}." if values else ""
    variable = f" Environment variable: `{parameter.envvar}`." if getattr(parameter, "envvar", None) else ""
    return names, shown, help_text + one_of + variable


def _code(code: ExitCode) -> tuple[object, ...]:
    errors = ", ".join(f"`{name}`" for name, given in _BY_ERROR.items() if given is code)
    return f"`{int(code)}`", code.name, errors


def configuration() -> str:
    """Every key of notabug.toml, from the schema that reading it uses."""
    parts = [
        "# Configuration",
        "",
        "`notabug.toml` (or `[tool.notabug]` of `pyproject.toml`) holds tables `[renderers.NAME]`, each of one kind.",
        "[Your renderer](../your-renderer.md) explains them; an editor can take",
        "[notabug.schema.json](../notabug.schema.json).",
        "",
    ]
    for kind in schema()["properties"]["renderers"]["additionalProperties"]["anyOf"]:
        parts += [f"## {kind['title']}", ""]
        rows = [(f"`{key}`", _kind(value), value.get("description", "")) for key, value in kind["properties"].items()]
        parts += [table(("key", "values", "meaning"), rows), ""]
    variables = sorted(set(re.findall(r'"(NOTABUG_[A-Z_]+)"', "".join(text for _, text in sources()))))
    where = {name: next(str(path) for path, text in sources() if f'"{name}"' in text) for name in variables}
    parts += [
        "## Environment variables",
        "",
        table(("variable", "read by"), [(f"`{k}`", f"`{v}`") for k, v in where.items()]),
    ]
    return "\n".join(parts)


def _kind(value: dict[str, Any]) -> str:
    if "enum" in value:
        return ", ".join(f"`{each}`" if each != "" else '`""`' for each in value["enum"])
    if "anyOf" in value:
        return " or ".join(_kind(each) for each in value["anyOf"])
    if value.get("type") == "array":
        return f"list of {_kind(value['items'])}"
    low, high = value.get("minimum", value.get("exclusiveMinimum")), value.get("maximum")
    limits = f", from {low}" if low is not None else ""
    return f"{value.get('type', '')}{limits}{f' to {high}' if high is not None else ''}"


def files() -> str:
    """The fields of what is written and read: run.json's results, notabug.expect.toml."""
    parts = ["# File formats", "", "[The design](../design.md#runs-and-runjson) says what else `run.json` holds.", ""]
    for title, kind in (
        ("run.json: a result", Result),
        ("run.json: a verdict", Verdict),
        ("run.json: a finding", Finding),
        ("run.json: a leg", Leg),
        ("notabug.expect.toml: an entry", Entry),
    ):
        parts += [f"## {title}", "", inspect.cleandoc(kind.__doc__ or ""), ""]
        parts += [table(("field", "type"), [(f"`{each.name}`", f"`{each.type}`") for each in fields(kind)]), ""]
    return "\n".join(parts)


def sources() -> Iterator[tuple[Path, str]]:
    """Every module: its path from the root, and its text."""
    for floor in FLOORS:
        for path in sorted((ROOT / floor).rglob("*.py")):
            relative = path.relative_to(ROOT)
            if not any((ROOT / parent).is_symlink() for parent in relative.parents):
                yield relative, path.read_text("utf-8")


def python(floor: str) -> str:
    """Every public function and class of a floor that has a docstring, by module."""
    parts = [f"# Python: {floor}", ""]
    for path, text in sources():
        if path.parts[0] != floor or path.name == "__init__.py":
            continue
        tree = ast.parse(text)
        module = ".".join(
            path.with_suffix("").parts if floor == "notabug" else ("notabug", *path.with_suffix("").parts)
        )
        parts += [f"## {module}", "", _told(ast.get_docstring(tree)), ""]
        for node in tree.body:
            if isinstance(node, ast.FunctionDef | ast.ClassDef) and not node.name.startswith("_"):
                parts += [
                    f"### {node.name}",
                    "",
                    f"```python\n{_signature(node)}\n```",
                    "",
                    _told(ast.get_docstring(node)),
                    "",
                ]
    return "\n".join(parts)


def _signature(node: ast.FunctionDef | ast.ClassDef) -> str:
    if isinstance(node, ast.FunctionDef):
        returns = f" -> {ast.unparse(node.returns)}" if node.returns else ""
        return f"def {node.name}({ast.unparse(node.args)}){returns}"
    bases = f"({', '.join(ast.unparse(each) for each in node.bases)})" if node.bases else ""
    lines = [f"    {ast.unparse(each)}" for each in node.body if isinstance(each, ast.AnnAssign)]
    lines += [
        f"    {_signature(each)}" for each in node.body if isinstance(each, ast.FunctionDef) and each.name[0] != "_"
    ]
    return "\n".join([f"class {node.name}{bases}", *lines])


def _told(text: str | None) -> str:
    """A docstring as text: reStructuredText's double backquotes become single ones, and nothing is taken for HTML."""
    plain = re.sub(r"``(.+?)``", r"`\1`", text or "").replace("<", "&lt;")
    return re.sub(r"^(Attributes|Parameters|Returns|Raises)\n-+$", r"**\1**\n", plain, flags=re.M)


def messages() -> str:
    """Every message of an error with what to do, from the places that raise them."""
    parts = [
        "# Troubleshooting",
        "",
        "Every message has the form `where: what; expected ..., got ...; what to do`. Search for a part of yours that",
        "holds no name or number of your own: `…` stands for what differs from case to case. Where that is not enough,",
        "`--verbose` tells more, the log's path is in the message, and `notabug doctor` says what is installed.",
        "",
    ]
    for floor in FLOORS:
        told: dict[str, tuple[str, str]] = {}
        for path, text in sources():
            for message, *rest in _raised(ast.parse(text)) if path.parts[0] == floor else ():
                expected, do = (max(pair, key=len) for pair in zip(told.get(message, ("", "")), rest, strict=True))
                told[message] = expected, do
        rows = [(message, expected, do) for message, (expected, do) in sorted(told.items()) if expected or do]
        parts += [f"## From {floor}", "", table(("message", "expected", "what to do"), rows), ""]
    return "\n".join(parts)


def _raised(tree: ast.AST) -> Iterator[tuple[str, str, str]]:
    """What is said, what was expected and what to do, of each error that a module raises."""
    for node in ast.walk(tree):
        if not isinstance(node, ast.Call) or not node.args:
            continue
        name = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
        words = {each.arg: _text(each.value) for each in node.keywords if each.arg}
        if ERRORS.match(name) and set(words) & {"do", "where", "expected", "got"}:
            texts = [text for each in node.args if (text := _text(each))]
            if texts:
                yield texts[-1], words.get("expected", ""), words.get("do", "")


def _text(node: ast.expr) -> str:
    """The literal words of an expression, with … for the rest; "" where it has none."""
    if isinstance(node, ast.Constant):
        return node.value if isinstance(node.value, str) else ""
    if isinstance(node, ast.JoinedStr):
        return "".join(each.value if isinstance(each, ast.Constant) else "…" for each in node.values)
    if isinstance(node, ast.BinOp):
        return _text(node.left) + _text(node.right)
    if isinstance(node, ast.IfExp):
        return " / ".join(text for each in (node.body, node.orelse) if (text := _text(each)))
    return ""


def classes() -> str:
    """The classes: what is seen, why it is no bug, when it is one, and the scenes with what each claims."""
    claims: dict[str, list[tuple[object, ...]]] = {}
    for row in list_scenes():
        claims.setdefault(row["id"].split("/")[0], []).append((f"`{row['id']}`", row["claim"]))
    parts = [
        "# The classes",
        "",
        "The seven of Woo, Pearce and Ouellette, *It's Really Not a Rendering Bug, You See...* (1996), shadow maps,",
        "and the card that each renderer draws first.",
        "",
    ]
    for kind in taxonomy():
        parts += [f"## {kind.name}", "", f"{kind.symptom} {kind.cause}", "", kind.what, ""]
        parts += [
            f"**No bug:** {kind.innocent}",
            "",
            f"**A bug:** {kind.guilty}",
            "",
            *(f"    {x}" for x in kind.formulas),
            "",
        ]
        parts += [table(("scene", "what it claims"), claims.get(kind.id, [])), ""]
    return "\n".join(parts)
