"""What a finished result depends on, what a table may say of its numbers, and the schema that editors read."""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from notabug.adapters import declared
from notabug.adapters.base import Quality
from notabug.adapters.config import ConfigError, Table, renderer_tables
from notabug.adapters.configured import COMMAND_KEYS, FILES_KEYS, LIMIT_KEYS, configured
from notabug.adapters.python_modules import with_modules
from notabug.adapters.schema import schema

ROOT = Path(__file__).parents[2]

CHANGES: dict[str, Callable[[Path], object]] = {
    "the driver": lambda folder: (folder / "drive.py").write_text("import helper, package.deep\n# other\n"),
    "a module it imports": lambda folder: (folder / "helper.py").write_text("from package import *  # other\n"),
    "a module of a module's package": lambda folder: (folder / "package" / "deep.py").write_text("x = 2\n"),
    "the package itself": lambda folder: (folder / "package" / "__init__.py").write_text("x = 2\n"),
    "a file of the glob": lambda folder: (folder / "data" / "b.bin").write_bytes(b"other"),
    "a new file of the glob": lambda folder: (folder / "data" / "new.bin").write_bytes(b"new"),
    "the program of the version": lambda folder: (folder / "tell.py").write_text("print(1.0)  # other\n"),
}


def key(folder: Path, version: Any) -> str:
    words = [sys.executable, "drive.py", "{scene}", "{image}"]
    values = {"command": words, "version": version, "files": ["data/*.bin"]}
    return configured("mine", Table(values, "here", folder), {}).find().key


@pytest.fixture
def driver(tmp_path: Path) -> Path:
    (tmp_path / "data").mkdir()
    (tmp_path / "package").mkdir()
    (tmp_path / "drive.py").write_text("import helper, package.deep\n")
    (tmp_path / "helper.py").write_text("from package import *\nimport drive\n")
    (tmp_path / "package" / "__init__.py").write_text("")
    (tmp_path / "package" / "deep.py").write_text("x = 1\n")
    (tmp_path / "data" / "b.bin").write_bytes(b"one")
    (tmp_path / "tell.py").write_text("print(1.0)\n")
    (tmp_path / "unrelated.py").write_text("")
    return tmp_path


@pytest.mark.parametrize("what", CHANGES)
def test_a_change_of_what_the_pictures_depend_on_is_another_state(driver: Path, what: str) -> None:
    """Even where the version that the table states, or the program tells, stays the same."""
    version = [sys.executable, "tell.py"] if "version" in what else "1.0"
    before = key(driver, version)
    assert key(driver, version) == before
    CHANGES[what](driver)
    assert key(driver, version) != before


def test_other_files_of_the_folder_do_not_matter(driver: Path) -> None:
    before = key(driver, "1.0")
    (driver / "unrelated.py").write_text("x = 3\n")
    (driver / "data" / "notes.txt").write_text("x")
    assert key(driver, "1.0") == before


def test_modules_of_what_is_no_python(tmp_path: Path) -> None:
    broken = tmp_path / "broken.py"
    broken.write_bytes(b"import (\x00")
    assert with_modules([broken, tmp_path / "gone.py"]) == [broken, tmp_path / "gone.py"]


@pytest.mark.parametrize("glob", ["", "/etc/passwd"])
def test_a_glob_is_below_the_folder(tmp_path: Path, glob: str) -> None:
    values = {"command": ["x", "{scene}", "{image}"], "files": [glob]}
    with pytest.raises(ConfigError, match="files"):
        configured("mine", Table(values, "here", tmp_path), {})


def test_a_table_says_what_its_numbers_are(tmp_path: Path) -> None:
    words = ["x", "{scene}", "{image}"]
    values = {"command": words, "quantum": 0.001, "white": 4.0, "bounces": 3, "normalised": "no"}
    made = configured("mine", Table(values, "here", tmp_path), {}).declaration(Quality())
    assert (made.quantum, made.white, made.bounces, made.normalised) == (0.001, 4.0, 3, "no")
    assert declared.said(["quantum=0.001", "white=4"]) == {"quantum": 0.001, "white": 4.0}
    for wrong in ("quantum=2", "quantum=-1", "white=0", "white=nan", "white=much"):
        with pytest.raises(ConfigError, match=wrong.partition("=")[0]):
            declared.said([wrong])


def test_the_schema_is_that_of_the_file() -> None:
    """docs/notabug.schema.json: `python docs/schema.py` writes it."""
    assert json.loads((ROOT / "docs/notabug.schema.json").read_text("utf-8")) == schema()


def test_the_schema_knows_each_key_and_no_other() -> None:
    program, folder, _ = schema()["properties"]["renderers"]["additionalProperties"]["anyOf"]
    assert set(program["properties"]) == {*COMMAND_KEYS, *LIMIT_KEYS, *declared.KEYS}
    assert set(folder["properties"]) == {*FILES_KEYS, *declared.KEYS}
    assert all(each for each in [*program["properties"].values(), *folder["properties"].values()])
    assert {row["key"] for row in declared.declarations()} <= set(program["properties"])


def test_the_tables_of_the_docs_fit_the_schema(tmp_path: Path) -> None:
    """Each key and each choice, by the schema alone; that a reader takes them too is what other tests show."""
    known = schema()["properties"]["renderers"]["additionalProperties"]["anyOf"][0]["properties"]
    found = 0
    for page in (ROOT / "README.md", ROOT / "docs/your-renderer.md"):
        for place, block in enumerate(re.findall(r"```toml\n(\[renderers.*?)```", page.read_text("utf-8"), re.S)):
            path = tmp_path / f"{page.stem}{place}.toml"
            path.write_text(block)
            for table in renderer_tables(path).values():
                if "command" not in table.values:
                    continue
                found += 1
                for name, value in table.values.items():
                    assert value in known[name].get("enum", [value]), name
    assert found
