"""The documentation as a site: what is made of the code is whole, links hold, and nothing is asked of the network."""

from __future__ import annotations

import importlib
import os
import re
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import fields
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest
import typer

from notabug.adapters import declared
from notabug.adapters.configured import COMMAND_KEYS, FILES_KEYS, LIMIT_KEYS
from notabug.cli import app
from notabug.results.record import Result
from notabug.scenes_usd.card import CLASSES
from notabug.scenes_usd.catalogue import scenes

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module")
def reference() -> Iterator[Any]:
    sys.path.insert(0, str(ROOT / "docs"))
    yield importlib.import_module("site_reference")
    sys.path.remove(str(ROOT / "docs"))


def test_every_command_and_option_is_on_its_page(reference: Any) -> None:
    page, group = reference.commands(), typer.main.get_command(app)
    parts = dict(re.findall(r"^## notabug (\w+)\n(.*?)(?=^## )", page, re.M | re.S))
    commands: Any = group.commands  # type: ignore[attr-defined]
    assert set(parts) == set(commands)
    for name, command in commands.items():
        for parameter in command.params:
            if parameter.param_type_name == "option":
                assert all(f"`{word}`" in parts[name] for word in parameter.opts), (name, parameter.opts)
    assert "One of `point`, `box`, `tent`, `gaussian`, `unknown`." in parts["judge"]
    assert "`SCENE`" in parts["check"]


def test_every_key_field_class_and_scene_is_on_its_page(reference: Any) -> None:
    configuration, files, classes = reference.configuration(), reference.files(), reference.classes()
    for key in {*COMMAND_KEYS, *FILES_KEYS, *LIMIT_KEYS, *declared.KEYS}:
        assert f"| `{key}` |" in configuration, key
    assert "| `NOTABUG_CACHE` |" in configuration
    assert all(f"| `{field.name}` |" in files for field in fields(Result))
    assert classes.count("\n## ") == len(CLASSES)
    assert all(f"| `{scene.id}` |" in classes for scene in scenes())


def test_public_functions_and_messages_are_told(reference: Any) -> None:
    assert "### read_scene" in reference.python("scenes_usd")
    assert "def read_scene(" in reference.python("scenes_usd")
    messages = reference.messages()
    row = next(line for line in messages.splitlines() if line.startswith("| the cache cannot be used |"))
    assert "a folder in which files can be made" in row
    assert "set … to another folder, or unset it" in row
    assert messages.count("\n| ") > 150


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    if find_spec("mkdocs") is None:
        (pytest.fail if os.environ.get("CI") else pytest.skip)("mkdocs-material is not installed: make setup")
    out = tmp_path_factory.mktemp("docs") / "site"
    done = build(out)
    assert done.returncode == 0, done.stdout + done.stderr
    return out


def build(out: Path) -> subprocess.CompletedProcess[str]:
    words = [sys.executable, str(ROOT / "docs" / "build_site.py"), str(out)]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    return subprocess.run(words, env=environment, capture_output=True, text=True, check=False)


@pytest.mark.slow
def test_the_site_is_built_strictly_and_asks_nothing_of_the_network(site: Path) -> None:
    pages = list(site.rglob("*.html"))
    assert len(pages) > 40
    for page in pages:
        text = page.read_text("utf-8")
        asked = re.findall(r"<(?:script|img|iframe)[^>]*\ssrc=\"?(https?://[^\s\">]+)", text)
        asked += re.findall(
            r"<link[^>]*rel=\"?(?:stylesheet|preconnect|icon)\"?[^>]*href=\"?(https?://[^\s\">]+)", text
        )
        assert asked == [], page
    for name in ("action.yml", "workflow.yml", "gitlab.yml", "Dockerfile.txt"):
        assert (site / "ci" / name).is_file()
    index = (site / "index.html").read_text("utf-8")
    for tab in (
        "Judge your pictures",
        "Judge your renderer",
        "In CI",
        "How it decides",
        "Reference",
        "Troubleshooting",
    ):
        assert tab in index


@pytest.mark.slow
def test_a_link_that_is_broken_is_an_error(site: Path, tmp_path: Path) -> None:
    """The configuration that the site was built with, and one page with three wrong links."""
    made = (site.with_name("site-sources") / "mkdocs.yml").read_text("utf-8")
    docs = tmp_path / "docs"
    docs.mkdir()
    (docs / "index.md").write_text("# A\n[1](gone.md) [2](#nowhere) [3](gone.txt)\n")
    made = re.sub(r"^nav:\n(?:[- ].*\n)+", "", made, flags=re.M)
    made = re.sub(r"^docs_dir:.*$", f"docs_dir: {docs}", made, flags=re.M)
    made = re.sub(r"^site_dir:.*$", f"site_dir: {tmp_path / 'site'}", made, flags=re.M)
    (tmp_path / "mkdocs.yml").write_text(made)
    words = [sys.executable, "-m", "mkdocs", "build", "--strict", "--config-file", str(tmp_path / "mkdocs.yml")]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert all(each in done.stderr for each in ("gone.md", "#nowhere", "gone.txt"))
