"""The reports in docs/defects stay true: each scene, written by hand, still draws what its page says."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from notabug.adapters.base import RendererMissingError
from notabug.adapters.registry import adapter

FOLDER = Path(__file__).parents[2] / "docs" / "defects"
FACTS = sorted(path.parent.name for path in FOLDER.glob("*/fact.json"))
_SECONDS = 300.0  # for one picture, where the machine is busy
HALF_STEP = 0.51 / 65535


def drawn(fact: dict[str, Any], defect: str, folder: Path, where: str) -> tuple[int, Any]:
    """The exit code of the page's command, and the picture (h, w) that it left, or None.

    ``where`` is the program or the interpreter that the adapter found.
    """
    for path in (FOLDER / defect).iterdir():
        shutil.copy(path, folder)
    command = [word.replace("{where}", where) for word in fact["command"]]
    ended = subprocess.run(command, cwd=folder, capture_output=True, timeout=_SECONDS)
    picture = folder / fact["picture"]
    if not picture.exists():
        return ended.returncode, None
    if picture.suffix == ".npy":
        return ended.returncode, np.load(picture, allow_pickle=False)
    content = picture.read_bytes()
    header = re.match(rb"P6\s+(\d+)\s+(\d+)\s+65535\s", content)
    assert header is not None
    values = np.frombuffer(content[header.end() :], ">u2").reshape(int(header[2]), int(header[1]), 3)
    return ended.returncode, values[..., 0] / 65535.0


@pytest.mark.parametrize("defect", FACTS)
def test_a_defect_is_still_there(defect: str, tmp_path: Path) -> None:
    fact = json.loads((FOLDER / defect / "fact.json").read_text("utf-8"))
    try:
        found = adapter(fact["renderer"]).find()
    except RendererMissingError as missing:
        pytest.skip(str(missing))
    if not found.version.startswith(fact["version"]):  # some name the device as well
        pytest.skip(f"found in {fact['renderer']} {fact['version']}; here is {found.version}")
    code, picture = drawn(fact, defect, tmp_path, found.where)
    if "exit" in fact:
        assert (code, picture) == (fact["exit"], None)
        return
    x, y = fact["pixel"]
    assert picture[y, x] == pytest.approx(fact["found"], abs=fact.get("tolerance", 2 * HALF_STEP))
    assert abs(picture[y, x] - fact["expected"]) > max(100 * HALF_STEP, fact.get("tolerance", 0.0))


@pytest.mark.parametrize("defect", FACTS)
def test_every_defect_has_a_page_and_a_line(defect: str) -> None:
    page = (FOLDER / defect / "README.md").read_text("utf-8")
    for heading in ("expected", "found", "command", "## Second route"):
        assert heading in page, heading
    assert f"]({defect})" in (FOLDER / "README.md").read_text("utf-8")


def test_the_highlight_is_not_attenuated_and_the_diffuse_light_is(tmp_path: Path) -> None:
    """The second route of the page: the same lamp on the same floor, without the highlight."""
    defect = "tachyon-highlight-attenuation"
    fact = json.loads((FOLDER / defect / "fact.json").read_text("utf-8"))
    if shutil.which(fact["command"][0]) is None:
        pytest.skip("tachyon is not installed: apt install tachyon-bin-nox")
    text = (FOLDER / defect / "scene.dat").read_text("ascii")
    plain = text.replace("diffuse 0", "diffuse 1").replace("phong plastic 0.5 phong_size 10", "")
    (tmp_path / "scene.dat").write_text(plain, "ascii")
    subprocess.run(fact["command"], cwd=tmp_path, capture_output=True, timeout=60, check=True)
    content = (tmp_path / "picture.ppm").read_bytes()
    values = np.frombuffer(content[-8 * 8 * 6 :], ">u2").reshape(8, 8, 3) / 65535.0
    assert values[4, 3, 0] == pytest.approx(1 / 64, abs=2 * HALF_STEP)
