"""``notabug install``: an environment below the cache and nothing outside it, with its size told before."""

from __future__ import annotations

import json
import sys
import zipfile
from pathlib import Path
from typing import Any

import pytest

import notabug.commands.install
from notabug.adapters.environment import (
    COMPLETE,
    RECIPES,
    Recipe,
    environment_folder,
    environment_python,
    installed,
    version_in,
)
from notabug.adapters.registry import adapters
from notabug.commands.install import InstallError, command, find_python
from notabug.scenes_usd.errors import SelectionError


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("NOTABUG_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache"


@pytest.fixture
def wheel(tmp_path: Path) -> Path:
    """A distribution of one module, as pip takes it."""
    path = tmp_path / "tiny_renderer-1.5-py3-none-any.whl"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("tiny_renderer.py", "WHITE = 1.0\n")
        archive.writestr(
            "tiny_renderer-1.5.dist-info/METADATA", "Metadata-Version: 2.1\nName: tiny-renderer\nVersion: 1.5\n"
        )
        archive.writestr(
            "tiny_renderer-1.5.dist-info/WHEEL", "Wheel-Version: 1.0\nRoot-Is-Purelib: true\nTag: py3-none-any\n"
        )
        archive.writestr("tiny_renderer-1.5.dist-info/RECORD", "")
    return path


def recipe(monkeypatch: pytest.MonkeyPatch, **changes: Any) -> Recipe:
    given: dict[str, Any] = {"requirements": ("tiny==1",), "megabytes": 30, "licence": "MIT"} | changes
    made = Recipe(**given)
    monkeypatch.setitem(RECIPES, "tiny", made)
    return made


@pytest.mark.slow
def test_an_environment_is_made_found_and_removed(
    cache: Path, wheel: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    recipe(monkeypatch, requirements=(str(wheel),))
    assert environment_python("tiny") == sys.executable
    before = {path for path in cache.parent.iterdir() if path != cache}
    assert command("tiny", "", remove=False) == 0
    said = capsys.readouterr().err
    assert said.index("30 MB") < said.index("installed in")
    assert {path for path in cache.parent.iterdir() if path != cache} == before
    python = environment_python("tiny")
    assert Path(python).is_relative_to(cache)
    assert version_in(python, "tiny-renderer", where="tiny", install="") == "1.5"
    assert command("tiny", "", remove=False) == 0
    assert "already in" in capsys.readouterr().err
    assert command("tiny", "", remove=True) == 0
    assert not environment_folder("tiny").exists()
    assert environment_python("tiny") == sys.executable


def test_what_was_stopped_half_way_does_not_count(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = environment_folder("tiny")
    (folder / "bin").mkdir(parents=True)
    (folder / "bin" / "python").touch()
    assert environment_python("tiny") == sys.executable
    for broken in ("", "[]", "{", '{"requirements": null}'):
        (folder / COMPLETE).write_text(broken)
        assert installed(folder) == ()
    (folder / COMPLETE).write_text(json.dumps({"requirements": ["tiny==1"]}))
    assert installed(folder) == ("tiny==1",)
    (folder / "bin" / "python").unlink()
    assert installed(folder) == ()


def test_a_step_that_fails_says_which_and_leaves_no_environment(
    cache: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """The interpreter makes no environment: it only says which version it is."""
    recipe(monkeypatch, requirements=("tiny==1",), python="9.9")
    odd = tmp_path / "python9.9"
    odd.write_text('#!/bin/sh\n[ "$1" = -c ] && echo 9.9 && exit 0\necho no such module >&2\nexit 1\n')
    odd.chmod(0o755)
    with pytest.raises(InstallError, match=r"environment cannot be made.*no such module"):
        command("tiny", str(odd), remove=False)
    assert environment_python("tiny") == sys.executable


def test_a_python_that_is_missing_or_of_another_version(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(InstallError, match=r"no Python 9\.9 on PATH.*--python PATH"):
        find_python("9.9")
    with pytest.raises(InstallError, match=r"is none that runs"):
        find_python("9.9", "/bin/false")
    assert find_python("") == sys.executable


def test_an_interpreter_that_is_too_old_is_not_taken(tmp_path: Path) -> None:
    old = tmp_path / "python"
    old.write_text("#!/bin/sh\necho 3.9\n")
    old.chmod(0o755)
    with pytest.raises(InstallError, match=r"no Python from 3\.11 on .*python is 3\.9"):
        find_python("", str(old))


@pytest.mark.parametrize(
    ("variable", "folder", "program"),
    [
        ("PYENV_ROOT", "versions/9.9.2", "python"),
        ("PYENV_ROOT", "versions/9.9.10", "python"),
        ("UV_PYTHON_INSTALL_DIR", "cpython-9.9.3-linux-x86_64-gnu", "python3"),
    ],
)
def test_a_python_that_pyenv_or_uv_keeps_need_not_be_on_the_path(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, variable: str, folder: str, program: str
) -> None:
    """An older one of the same kind is there too, and one that does not run."""
    for each in ("PYENV_ROOT", "UV_PYTHON_INSTALL_DIR"):
        monkeypatch.setenv(each, str(tmp_path / each))
    for place, says in ((folder, 9.9), ("versions/9.9.1", 9.9), ("versions/9.9.20", 0)):
        python = tmp_path / variable / place / "bin" / program
        python.parent.mkdir(parents=True)
        python.write_text(f"#!/bin/sh\n[ {says} = 0 ] && exit 1\necho {says}\n")
        python.chmod(0o755)
    assert find_python("9.9") == str(tmp_path / variable / folder / "bin" / program)


def test_too_little_room_is_said_before_anything_is_made(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    recipe(monkeypatch, megabytes=10**9)
    with pytest.raises(InstallError, match="not enough room"):
        command("tiny", "", remove=False)
    assert not environment_folder("tiny").exists()


def test_a_name_that_is_not_known(cache: Path) -> None:
    with pytest.raises(
        SelectionError,
        match=r"povray.*expected one of babylon, cycles, filament, luxcore, panda3d, pygfx, threejs, vtk",
    ):
        command("povray", "", remove=False)


def test_every_recipe_is_of_an_adapter_and_pinned() -> None:
    known = adapters()
    for name, each in RECIPES.items():
        assert f"notabug install {name}" in known[name].install
        sign = {"pip": "==", "npm": "@"}[each.by]
        assert all(requirement.lstrip("@").count(sign) == 1 for requirement in each.requirements)


def test_a_package_of_npm_runs_no_script_and_leaves_nothing_outside(
    cache: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """npm is one that writes down its words and makes the folder that npm makes."""
    recipe(monkeypatch, requirements=("tiny@1.5.0",), by="npm")
    programs = tmp_path / "programs"
    programs.mkdir()
    npm = programs / "npm"
    npm.write_text('#!/bin/sh\nmkdir "$3/node_modules"\necho "$@" > "$3/words"\n')
    npm.chmod(0o755)
    monkeypatch.setenv("PATH", f"{programs}:/usr/bin:/bin")
    assert command("tiny", "", remove=False) == 0
    assert "30 MB" in capsys.readouterr().err
    folder = environment_folder("tiny")
    words = (folder / "words").read_text().split()
    assert words[:3] == ["install", "--prefix", str(folder)]
    assert {"--ignore-scripts", "--no-save", "tiny@1.5.0"} <= set(words)
    assert installed(folder) == ("tiny@1.5.0",)
    assert command("tiny", "", remove=True) == 0
    assert not folder.exists()


def test_npm_that_is_missing_fails_or_has_no_use_for_a_python(
    cache: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    recipe(monkeypatch, requirements=("tiny@1.5.0",), by="npm")
    with pytest.raises(InstallError, match="leave --python out"):
        command("tiny", sys.executable, remove=False)
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(InstallError, match=r"no npm on PATH.*apt install npm"):
        command("tiny", "", remove=False)
    npm = tmp_path / "npm"
    npm.write_text("#!/bin/sh\necho no such package >&2\nexit 1\n")
    npm.chmod(0o755)
    with pytest.raises(InstallError, match=r"npm failed.*no such package"):
        command("tiny", "", remove=False)
    assert installed(environment_folder("tiny")) == ()


def test_the_list_names_sizes(capsys: pytest.CaptureFixture[str], cache: Path) -> None:
    assert notabug.commands.install.command("", "", remove=False) == 0
    said = capsys.readouterr().out
    assert all(f"{each.megabytes} MB" in said for each in RECIPES.values())
