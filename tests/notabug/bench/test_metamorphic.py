"""Relations hold for our own renderer, and one that breaks a relation is caught at it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest

from notabug.bench.metamorphic import EXACT, ROUNDED, check, delicate, in_house, measure, stages
from notabug.bench.metamorphic_reduced import write_reduced
from notabug.bench.metamorphic_relations import RELATIONS, Relation
from notabug.scenes_usd.reader import read_scene
from notabug.scenes_usd.scene import Mesh, Scene

Floats = npt.NDArray[np.floating]
SIDE = 32
BY_NAME = {each.name: each for each in RELATIONS}


@pytest.fixture(scope="module")
def scenes() -> list[Scene]:
    return stages(("terminator/sphere", "texture/uneven_quad"), side=SIDE)


@pytest.mark.parametrize("relation", RELATIONS, ids=lambda each: each.name)
def test_every_relation_holds_in_house_in_float64(relation: Relation, scenes: list[Scene]) -> None:
    found = measure(scenes, [("inhouse float64", in_house("float64"), EXACT)], relations=[relation])
    assert found
    assert [each for each in found if each.broken] == []


def test_edges_leave_most_of_the_picture(scenes: list[Scene]) -> None:
    """A relation that only looks at nothing holds always."""
    for each in scenes:
        assert 0.0 < delicate(each).mean() < 0.7


def broken_by(draw: object, scene: Scene) -> set[str]:
    checks = (check(each, scene, "fake", draw, ROUNDED) for each in RELATIONS)  # type: ignore[arg-type]
    return {each.relation for each in checks if each is not None and each.broken}


@pytest.fixture(scope="module")
def ball(scenes: list[Scene]) -> Scene:
    return scenes[0]


def test_an_absolute_epsilon_breaks_translation_or_scale(ball: Scene) -> None:
    """What depends on the origin is named by the relation that moves the origin."""

    def draw(scene: Scene) -> Floats:
        return in_house("float64")(scene) * (1.0 + 1e-3 * float(np.abs(scene.camera.to_world[3, :3]).sum()))

    found = broken_by(draw, ball)
    assert {"translate", "scale"} <= found
    assert not found & {"bake", "split", "reorder_faces", "two_half_lights", "usdc"}


def test_a_broken_relation_is_reduced_to_a_pair_of_scenes(ball: Scene, tmp_path: Path) -> None:
    def draw(scene: Scene) -> Floats:
        return in_house("float64")(scene) * (1.0 + 1e-3 * float(np.abs(scene.camera.to_world[3, :3]).sum()))

    made = check(BY_NAME["translate"], ball, "fake", draw, ROUNDED)
    assert made is not None
    folder = write_reduced(made, ball, BY_NAME["translate"], draw, tmp_path / "pair", lambda _: None)
    one, two = (read_scene(folder / name) for name in ("scene.usda", "double.usda"))
    assert sum(len(each.counts) for each in one.meshes) < sum(len(each.counts) for each in ball.meshes)
    assert np.abs(draw(one) - draw(two)).max() > ROUNDED * np.abs(draw(one)).max()
    assert "breaks a relation: translate" in (folder / "README.md").read_text()


def test_losing_the_second_light_is_named(ball: Scene) -> None:
    def draw(scene: Scene) -> Floats:
        return in_house("float64")(replace(scene, lights=scene.lights[:1]))

    assert broken_by(draw, ball) == {"two_half_lights"}


def test_forgetting_a_mesh_is_named(ball: Scene) -> None:
    def draw(scene: Scene) -> Floats:
        return in_house("float64")(replace(scene, objects=scene.objects[:2]))

    assert broken_by(draw, ball) == {"split"}


def test_not_a_number_is_broken(ball: Scene) -> None:
    calls: list[int] = []

    def draw(scene: Scene) -> Floats:
        calls.append(1)
        return in_house("float64")(scene) + (np.nan if len(calls) == 2 else 0.0)

    found = check(BY_NAME["translate"], ball, "fake", draw, ROUNDED)
    assert found is not None
    assert found.broken


def test_split_keeps_every_face(ball: Scene) -> None:
    second = BY_NAME["split"].second(ball)
    assert second is not None

    def faces(scene: Scene) -> int:
        return sum(len(each.counts) for each in scene.objects if isinstance(each, Mesh))

    assert faces(second) == faces(ball)
    assert len(second.objects) == len(ball.objects) + 1
