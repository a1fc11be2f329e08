"""The ``install`` command: a renderer that is a Python or npm package, in an environment of its own below the cache."""

from __future__ import annotations

import json
import os
import re
import shutil
import sys
import tempfile
import time
from pathlib import Path
from typing import TypedDict

from filelock import FileLock
from rich.console import Console
from rich.table import Table

from notabug.adapters.environment import COMPLETE, RECIPES, Recipe, environment_folder, installed, interpreter
from notabug.adapters.process import Ended, Limits, run_child
from notabug.exit_codes import ExitCode
from notabug.runs.progress import console
from notabug.scenes_usd.errors import NotabugError, SelectionError

_SECONDS = 3600.0  # for the downloads
_PROBE_SECONDS = 30.0
LEAST = (3, 11)  # the first Python that has -P, with which child scripts are started
_TELL = "import sys; print('%d.%d' % sys.version_info[:2])"
_ROOM = 2.0  # times the size on disk: the wheel is there beside what is unpacked from it


class InstallError(NotabugError):
    """A renderer that could not be installed: names the step that failed."""


def command(name: str, python: str, *, remove: bool, as_json: bool = False) -> ExitCode:
    """Install the renderer ``name``, or ``remove`` it; without a name list what there is, as a table or JSON."""
    said = console(stderr=True)
    if not name:
        _show(as_json)
        return ExitCode.OK
    if name not in RECIPES:
        raise SelectionError(
            f"no renderer called {name!r} is installed by notabug",
            expected=f"one of {', '.join(RECIPES)}",
            do="`notabug doctor` says how to get the others",
        )
    folder, recipe = environment_folder(name), RECIPES[name]
    folder.parent.mkdir(parents=True, exist_ok=True)
    with FileLock(folder.parent / f"{name}.lock"):
        if remove:
            shutil.rmtree(folder, ignore_errors=True)
            said.print(f"{name}: removed {folder}", markup=False, soft_wrap=True)
        elif installed(folder) == recipe.requirements:
            said.print(f"{name}: already in {folder}", markup=False, soft_wrap=True)
        else:
            _install(name, recipe, folder, python, said)
    if as_json:
        print(json.dumps({"renderers": [_row(name, recipe)]}, ensure_ascii=False))
    return ExitCode.OK


def _install(name: str, recipe: Recipe, folder: Path, python: str, said: Console) -> None:
    base = _find_npm(python) if recipe.by == "npm" else find_python(recipe.python, python)
    free = shutil.disk_usage(folder.parent).free
    if free < _ROOM * recipe.megabytes * 1e6:
        raise InstallError(
            "not enough room",
            where=str(folder.parent),
            expected=f"{_ROOM * recipe.megabytes:.0f} MB",
            got=f"{free / 1e6:.0f} MB",
            do="make room, or set NOTABUG_CACHE to a folder on another disk",
        )
    said.print(
        f"{name}: {', '.join(recipe.requirements)} ({recipe.licence}), {recipe.megabytes} MB, into {folder}; {base}",
        markup=False,
        soft_wrap=True,
    )
    began = time.perf_counter()
    shutil.rmtree(folder, ignore_errors=True)  # what an installation left that was stopped, or of other versions
    if recipe.by == "npm":
        folder.mkdir()
        words = [base, "install", "--prefix", str(folder), "--ignore-scripts", "--no-audit", "--no-fund", "--no-save"]
        _step("npm failed", [*words, "--loglevel=error", *recipe.requirements], name, "is the network there?")
    else:
        _install_by_pip(name, recipe, folder, base)
    (folder / COMPLETE).write_text(json.dumps({"requirements": recipe.requirements}), "utf-8")
    said.print(f"{name}: installed in {time.perf_counter() - began:.0f} s", markup=False)


def _install_by_pip(name: str, recipe: Recipe, folder: Path, base: str) -> None:
    _step(
        "the environment cannot be made", [base, "-m", "venv", str(folder)], name, "on Debian: apt install python3-venv"
    )
    pip = [str(interpreter(folder)), "-m", "pip", "install", "--no-deps", "--no-input", "--disable-pip-version-check"]
    _step("pip failed", [*pip, "--quiet", *recipe.requirements], name, "is the network there?")


def _find_npm(python: str) -> str:
    """npm on PATH; a Python that was asked for is told to have no use."""
    if python:
        raise InstallError("the renderer is an npm package", where="install", got="--python", do="leave --python out")
    if path := shutil.which("npm"):
        return path
    raise InstallError(
        "no npm on PATH", where="install", expected="npm, which comes with Node.js", do="on Debian: apt install npm"
    )


def _step(what: str, words: list[str], name: str, do: str) -> None:
    ended = _run(words, name, _SECONDS)
    if ended.exit or ended.stopped:
        raise InstallError(what, where=f"install {name}", got=" ".join(ended.log.split())[-600:], do=do)


def find_python(version: str, chosen: str = "") -> str:
    """An interpreter of ``version`` ("" for any that notabug runs on): the ``chosen`` one, this one, one on PATH.

    Then those of pyenv and uv, which need not be on PATH.
    """
    names = [chosen] if chosen else [sys.executable, f"python{version}", "python3", "python", *_kept_pythons(version)]
    found = []
    for name in names:
        path = shutil.which(name)
        if path is None:
            continue
        ended = _run([path, "-c", _TELL], "python", _PROBE_SECONDS)
        told = ended.log.strip().splitlines()[-1] if not ended.exit and ended.log.strip() else ""
        found.append(f"{path} is {told or 'none that runs'}")
        if told and (told == version or (not version and tuple(map(int, told.split("."))) >= LEAST)):
            return path
    raise InstallError(
        f"no Python {version or 'from 3.11 on'} on PATH",
        where="install",
        got="; ".join(found) or ", ".join(names),
        do="install one (apt, pyenv, uv), and name it with --python PATH",
    )


def _kept_pythons(version: str) -> list[str]:
    """Interpreters of ``version`` that pyenv and uv keep where they do by default, the newest first."""
    home = Path.home()
    pyenv = Path(os.environ.get("PYENV_ROOT") or home / ".pyenv") / "versions"
    data = Path(os.environ.get("XDG_DATA_HOME") or home / ".local" / "share")
    uv = Path(os.environ.get("UV_PYTHON_INSTALL_DIR") or data / "uv" / "python")
    found = [*pyenv.glob(f"{version}.*/bin/python"), *uv.glob(f"cpython-{version}.*/bin/python3")] if version else []
    return [str(path) for path in sorted(found, key=_by_number, reverse=True)]


def _by_number(path: Path) -> tuple[int, ...]:
    return tuple(int(number) for number in re.findall(r"\d+", path.parent.parent.name))


def _run(words: list[str], name: str, seconds: float) -> Ended:
    """A child that does not see the packages of this environment, in a folder of its own."""
    alone = {"PYTHONPATH": "", "PYTHONNOUSERSITE": "1", "PIP_USER": "0", "PIP_REQUIRE_VIRTUALENV": "0"}
    with tempfile.TemporaryDirectory(prefix="notabug-install-") as folder:
        limits = Limits(output=0)
        return run_child(words, where=name, folder=Path(folder), timeout=seconds, environment=alone, limits=limits)


class Row(TypedDict):
    """What is told of a renderer."""

    renderer: str
    installed: str
    megabytes: int
    licence: str
    python: str
    requirements: list[str]


def _row(name: str, recipe: Recipe) -> Row:
    """What is told of the renderer ``name``."""
    there = installed(environment_folder(name))
    return {
        "renderer": name,
        "installed": "yes" if there == recipe.requirements else "other versions" if there else "no",
        "megabytes": recipe.megabytes,
        "licence": recipe.licence,
        "python": "" if recipe.by == "npm" else recipe.python or "any",
        "requirements": list(recipe.requirements),
    }


def _show(as_json: bool) -> None:
    rows = [_row(name, recipe) for name, recipe in RECIPES.items()]
    if as_json:
        print(json.dumps({"renderers": rows}, ensure_ascii=False))
        return
    shown = Table(box=None, pad_edge=False)
    for heading in ("renderer", "installed", "on disk", "licence", "Python", "what"):
        shown.add_column(heading)
    for row in rows:
        size, what = f"{row['megabytes']} MB", ", ".join(row["requirements"])
        shown.add_row(row["renderer"], row["installed"], size, row["licence"], row["python"], what)
    console().print(shown)
