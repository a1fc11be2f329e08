"""A bug is shrunk while it stays the same bug, and what is written shows it again."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from notabug.adapters.base import Quality
from notabug.adapters.inhouse import InHouse
from notabug.adapters.mitsuba import Mitsuba
from notabug.commands.reduce import command, configured, readme
from notabug.exit_codes import ExitCode
from notabug.runs.shrinking import Examiner, bug, minimal, reduced, size
from notabug.scenes_usd.errors import SelectionError
from notabug.scenes_usd.reader import read_scene
from notabug.scenes_usd.scene import Light, Scene
from notabug.scenes_usd.writer import write_scene

FAULT = "no_shadow"


@pytest.fixture
def scene() -> Scene:
    """The sphere of few facets above its floor."""
    return replace(read_scene("terminator/sphere", {"tessellation": "8x4"}), width=32, height=32)


@pytest.mark.parametrize("needed", [{3}, {0, 99}, {10, 11, 12}, set(range(40, 60))])
def test_delta_debugging_keeps_what_is_needed_and_nothing_else(needed: set[int]) -> None:
    assert set(minimal(range(100), lambda kept: needed <= set(kept))) == needed


def test_delta_debugging_of_nothing_needed_leaves_one() -> None:
    assert len(minimal(range(100), lambda _: True)) == 1


def test_a_scene_is_reduced_to_what_the_condition_needs(scene: Scene) -> None:
    ball = max(scene.meshes, key=lambda each: len(each.counts))

    def holds(candidate: Scene) -> bool:
        return any(each.path == ball.path and len(each.counts) >= 3 for each in candidate.meshes)

    small = reduced(scene, holds)
    (mesh,) = small.meshes
    assert (len(mesh.counts), mesh.path) == (3, ball.path)
    assert (len(small.materials), min(small.width, small.height)) == (1, 16)
    assert len(mesh.points) == len(np.unique(mesh.corners))


def test_the_writing_of_a_size() -> None:
    scene = read_scene("mirror/corner")
    assert f"{scene.width} x {scene.height} pixels" in size(scene)
    assert "1 light," in size(scene)


@pytest.mark.slow
def test_a_renderer_with_a_fault_gives_a_small_scene_with_that_fault(scene: Scene, tmp_path: Path) -> None:
    extra = Light("/Scene/Second", "distant", (0.2, 0.2, 0.2), direction=(0.0, -1.0, 0.0))
    crowded = replace(scene, lights=(*scene.lights, extra))
    examiner = Examiner(InHouse(faults=(FAULT,)), Quality(samples=1))
    name = bug(examiner.show(crowded).verdict)
    assert name
    small = reduced(crowded, examiner.is_same(name))
    assert len(small.lights) == 1
    assert sum(len(each.counts) for each in small.meshes) < 0.2 * sum(len(each.counts) for each in crowded.meshes)
    again = examiner.show(read_scene(write_scene(small, tmp_path / "scene.usda")))
    assert bug(again.verdict) == name
    x, y = again.pixel
    text = readme("id", "", InHouse(), "1", (), name, again, crowded)
    assert f"pixel ({x}, {y})" in text
    assert " ".join(f"{v:.5g}" for v in again.found[y, x]) in text
    assert np.abs(again.found[y, x] - again.expected[y, x]).max() > 0.01


def test_a_right_renderer_has_nothing_to_reduce(tmp_path: Path) -> None:
    code = command(
        scene="phong/floor_lobes", renderer="inhouse", variants=[], settings=[], out=tmp_path, samples=1, seeds=1
    )
    assert code is ExitCode.NOTHING
    assert list(tmp_path.iterdir()) == []


def test_attributes_of_an_adapter_are_set_by_name() -> None:
    made = configured(Mitsuba(), ["variant=scalar_rgb", "opacity=mask", "keep_jobs=true"])
    assert made == Mitsuba(variant="scalar_rgb", opacity="mask", keep_jobs=True)
    with pytest.raises(SelectionError, match="KEY one of"):
        configured(Mitsuba(), ["nonsense=1"])


@pytest.mark.slow
def test_mitsubas_squared_opacity_is_reduced_to_one_sheet(mitsuba: Mitsuba, tmp_path: Path) -> None:
    """A genuine defect: under ``path`` a sheet of opacity 0.5 before nothing sends a quarter of its light, not half."""
    scene = replace(read_scene("visibility/near_clip"), width=20, height=20)
    sheets = tuple(each for each in scene.objects if each.path != "/Scene/Floor")
    clear = tuple(replace(each, opacity=0.5) for each in scene.materials)
    path = write_scene(replace(scene, objects=sheets, materials=clear), tmp_path / "sheets.usda")
    code = command(
        scene=str(path),
        renderer="mitsuba",
        variants=[],
        settings=["opacity=mask"],
        out=tmp_path / "out",
        samples=16,
        seeds=4,
        any_name=True,
    )
    assert code is ExitCode.BUG
    small = read_scene(tmp_path / "out" / "scene.usda")
    assert (len(small.objects), len(small.lights)) == (1, 1)
    examiner = Examiner(Mitsuba(opacity="mask"), Quality(samples=64))
    shown = examiner.show(small)
    y, x = np.unravel_index(shown.expected[..., 0].argmax(), shown.expected.shape[:2])
    inside = (slice(max(y - 1, 0), y + 2), slice(max(x - 1, 0), x + 2))
    assert shown.found[inside].mean() / shown.expected[inside].mean() == pytest.approx(0.5, abs=0.2)
