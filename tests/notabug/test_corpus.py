"""notabug references: every variant is built and verified, a missing one does not end the rest, and the exit codes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from notabug.exit_codes import ExitCode
from notabug.references import store
from notabug.scenes_usd.reader import find
from notabug.scenes_usd.scene import Scene

TESSELLATIONS = ("8x4", "16x8", "24x12", "48x24", "96x48")


def grey(scene: Scene, value: float) -> store.Reference:
    pixels = np.full((scene.height, scene.width, 3), value, np.float16)
    return store.Reference(pixels, np.zeros_like(pixels))


@pytest.fixture
def computed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The variants computed, into an empty corpus; pictures are grey, for how they are made is tested elsewhere."""
    found: list[str] = []

    def compute(scene: Scene) -> Any:
        found.append(scene.variant)
        return grey(scene, 0.5)

    monkeypatch.setattr(store, "CORPUS", tmp_path / "corpus")
    monkeypatch.setattr(store, "compute", compute)
    return found


def test_build_and_verify_every_variant(door: Any, computed: list[str]) -> None:
    assert door("references", "build", "terminator/sphere") == ExitCode.OK
    assert computed == [f"tessellation={each}" for each in TESSELLATIONS]
    assert door.stdout == ""
    assert all(f"sphere/tessellation={each}.exr" in door.stderr for each in TESSELLATIONS)
    assert door("references", "verify", "terminator/sphere") == ExitCode.OK
    assert door.stderr.count("identical") == 5


def test_a_named_variant_alone(door: Any, computed: list[str]) -> None:
    assert door("references", "build", "terminator/sphere", "--variant", "tessellation=8x4") == ExitCode.OK
    assert computed == ["tessellation=8x4"]


def test_missing_and_differing_references(door: Any, computed: list[str], monkeypatch: pytest.MonkeyPatch) -> None:
    """All are told before the command ends."""
    door("references", "build", "terminator/sphere", "--variant", "tessellation=16x8")
    assert door("references", "verify", "terminator/sphere") == ExitCode.REFERENCE
    assert door.stderr.count("no reference is stored") == 4
    assert "run `notabug references build terminator/sphere --variant tessellation=8x4`" in door.stderr
    assert door.stderr.count("identical") == 1
    monkeypatch.setattr(store, "compute", lambda scene: grey(scene, 0.6))
    assert door("references", "verify", "terminator/sphere", "--variant", "tessellation=16x8") == ExitCode.REFERENCE
    assert "65536 pixels differ" in door.stderr


def test_a_scene_of_ones_own_has_no_stored_reference(door: Any, computed: list[str], tmp_path: Path) -> None:
    own = tmp_path / "own.usda"
    own.write_bytes(find("terminator/sphere").read_bytes())
    assert door("references", "build", str(own)) == ExitCode.USAGE
    assert "scenes of the corpus only" in " ".join(door.stderr.split())
    assert computed == []
