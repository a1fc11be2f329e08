"""A renderer in C that reads ``scene.json`` is judged by configuration alone, bugs and all."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import psutil
import pytest

from notabug.scenes_usd.reader import read_scene
from notabug.scenes_usd.writer import write_scene

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


DOCS = SOURCE.parent
PAGE = (DOCS / "your-renderer.md").read_text("utf-8")
SERVER = (DOCS / "tiny_server.py").read_text("utf-8")


def blocks(language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```", PAGE, re.M | re.S)


def test_the_page_shows_the_server_as_it_is() -> None:
    (shown,) = (block for block in blocks("python") if "notabug_server" in block)
    for part in shown.split("\n\n"):
        assert part.replace("numpy as np  # stands", "numpy as np  # noqa: E402 - stands").strip() in SERVER


def test_the_server_of_the_page_is_judged_and_two_workers_have_one_each(tmp_path: Path) -> None:
    """With the page's own table; each process of a server says its number, and none is left."""
    (config,) = (block for block in blocks("toml") if "server = true" in block)
    (tmp_path / "notabug.toml").write_text(config)
    started = tmp_path / "started"
    told = f"with open({str(started)!r}, 'a') as file:\n    print(os.getpid(), os.getcwd(), file=file)\n"
    (tmp_path / "tiny_server.py").write_text(SERVER.replace("\nprint(json", f"\n{told}print(json", 1))
    scenes = []
    for place in range(4):
        scene = read_scene("terminator/sphere", {"tessellation": "8x4"})
        scenes.append(tmp_path / f"scene{place}.usda")
        write_scene(replace(scene, width=24 + place, height=24 + place), scenes[-1])
    done = subprocess.run(
        [sys.executable, "-m", "notabug", "run", "-r", "served", "--jobs", "2", "--json", *map(str, scenes)],
        cwd=tmp_path,
        env={**os.environ, "PATH": os.pathsep.join((str(Path(sys.executable).parent), os.environ["PATH"]))},
        capture_output=True,
        text=True,
        check=False,
    )
    results = json.loads(done.stdout)["results"]
    lines = [line.split() for line in started.read_text().splitlines()]
    assert [result["verdict"] for result in results] == ["limitation"] * 4, done.stderr
    assert done.returncode == 0
    assert 2 <= len(lines) <= 4  # one drew the card, and each worker has one
    assert len({folder for _, folder in lines}) == len(lines)
    assert not any(psutil.pid_exists(int(pid)) for pid, _ in lines)
