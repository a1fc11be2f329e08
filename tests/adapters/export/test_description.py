"""The example of ``scene.json`` in the manual has the keys that an export has, no more and no less."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import pytest

from notabug.adapters.export.description import describe
from notabug.scenes_usd.catalogue import scenes
from notabug.scenes_usd.reader import read_scene

MANUAL = Path(__file__).resolve().parents[3] / "docs" / "your-renderer.md"
SCENES = ("texture/uneven_quad", "terminator/sphere", "mirror/corner", "calibration/plain_card")


def keys(said: Any, where: str = "") -> set[str]:
    """The keys of a document with the way to each; things of a list count by their ``kind``."""
    if isinstance(said, dict):
        here = f"{where}/{said['kind']}" if "kind" in said else where
        return {f"{here}/{key}" for key in said}.union(*(keys(inner, f"{here}/{key}") for key, inner in said.items()))
    if isinstance(said, list):
        return set().union(*(keys(inner, where) for inner in said))
    return set()


@pytest.fixture(scope="module")
def example() -> Any:
    found = re.search(r"```json\n(.*?)```", MANUAL.read_text(encoding="utf-8"), re.DOTALL)
    assert found is not None
    return json.loads(found.group(1))


def test_the_manual_s_example_has_every_key_of_a_scene(example: Any) -> None:
    assert set(SCENES) <= {entry.id for entry in scenes()}
    written = set[str]().union(*(keys(describe(read_scene(scene))) for scene in SCENES))
    assert {key for key in written if "/sphere/" in key}
    assert keys(example) == written


def test_the_manual_s_example_is_a_scene_of_one_piece(example: Any) -> None:
    mesh = example["objects"][0]
    assert sum(mesh["counts"]) == len(mesh["corners"]) == len(mesh["normals"]) == len(mesh["uv"])
    assert {corner for triangle in mesh["triangles"] for corner in triangle} <= set(range(len(mesh["corners"])))
    assert set(mesh["corners"]) <= set(range(len(mesh["points"])))
    assert all(thing["material"] < len(example["materials"]) for thing in example["objects"])
