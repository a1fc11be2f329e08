"""A renderer in C that reads ``scene.json`` is judged by configuration alone, bugs and all."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

pytestmark = pytest.mark.slow

SOURCE = Path(__file__).resolve().parents[2] / "docs" / "tiny.c"
CONFIG = """
[renderers.tiny]
command = ["./tiny", "{scene}", "{image}"]
scene = "json"
image = "pfm"
filter = "point"
precision = "float64"
silhouette = "flip"
capabilities = ["mesh", "normals", "point_light", "distant_light", "shadows"]
"""


@pytest.fixture(scope="module")
def compiler() -> str:
    found = shutil.which("cc")
    if found is None:
        pytest.skip("no C compiler: apt install gcc")
    return found


def run(compiler: str, folder: Path, source: str, *words: str) -> dict[str, Any]:
    """What ``notabug run`` says of the renderer compiled from ``source``: verdict and findings by scene."""
    (folder / "tiny.c").write_text(source)
    (folder / "notabug.toml").write_text(CONFIG)
    subprocess.run([compiler, "-O2", "tiny.c", "-o", "tiny", "-lm"], cwd=folder, check=True)
    command = [sys.executable, "-m", "notabug.cli", "run", "-r", "tiny", "--json", *words]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode in (0, 1, 3), done.stderr
    return {
        each["scene"]: (each["verdict"], {found["name"] for found in each["findings"]}, each["message"])
        for each in json.loads(done.stdout)["results"]
    }


def test_it_is_short() -> None:
    assert len(SOURCE.read_text().splitlines()) <= 70


def test_it_is_right(compiler: str, tmp_path: Path) -> None:
    found = run(
        compiler, tmp_path, SOURCE.read_text(), "calibration/plain_card", "terminator/sphere", "texture/uneven_quad"
    )
    assert found["calibration/plain_card"][:2] == ("pass", set())
    assert found["terminator/sphere"][:2] == ("limitation", {"facet_self_shadow", "silhouette_flip"})
    assert found["texture/uneven_quad"][0] == "unsupported"


@pytest.mark.parametrize(
    ("right", "wrong", "word", "says"),
    [
        ("*lit/M_PI", "*lit", "error", "a 1/pi is missing"),
        ("for (int y = H - 1; y >= 0; y--)", "for (int y = 0; y < H; y++)", "error", "upside down"),
        ("if (!T->smooth) cross", "cross", "bug", "facet"),
    ],
    ids=["gain", "flip", "flat-normals"],
)
@pytest.mark.sweep_except("flat-normals")
def test_its_faults_are_found(compiler: str, tmp_path: Path, right: str, wrong: str, word: str, says: str) -> None:
    source = SOURCE.read_text()
    assert right in source
    found = run(compiler, tmp_path, source.replace(right, wrong), "terminator/sphere")["terminator/sphere"]
    assert found[0] == word
    assert says in found[2]
