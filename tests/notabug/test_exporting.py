"""The export command: a folder for each variant, and the file that a renderer opens on standard output."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest


@pytest.mark.parametrize(("kind", "name"), [("obj", "scene.obj"), ("gltf", "scene.gltf"), ("json", "scene.json")])
def test_each_variant_has_a_folder_with_its_description(kind: str, name: str, door: Any, tmp_path: Path) -> None:
    out = tmp_path / "scenes"
    words = ("export", "terminator/sphere", "--to", kind, "--out", str(out), "--variant", "tessellation=8x4,24x12")
    assert door(*words) == 0
    made = [Path(line) for line in door.stdout.split()]
    assert made == [out / "terminator" / "sphere" / f"tessellation={each}" / name for each in ("8x4", "24x12")]
    counts = []
    for path in made:
        said = json.loads((path.parent / "scene.json").read_text())
        assert said["variant"] == path.parent.name
        counts.append(sum(len(each["triangles"]) for each in said["objects"]))
    assert counts[0] < counts[1]


def test_an_unknown_format_is_a_usage_error(door: Any) -> None:
    assert door("export", "terminator/sphere", "--to", "fbx") == 2
