"""What is found of a scene is kept as long as the scene is, and no longer."""

from __future__ import annotations

import gc
import pickle
import weakref
from collections.abc import Callable
from copy import copy
from dataclasses import dataclass, replace
from typing import Any

import pytest

from notabug.references.models.camera import _size
from notabug.scenes_usd.faces import shapes
from notabug.scenes_usd.once import once
from notabug.scenes_usd.reader import read_scene
from notabug.scenes_usd.scene import Scene


@dataclass(frozen=True, eq=False)
class Thing:
    """Told from others by identity alone."""

    name: str


def test_it_is_found_once_for_each_thing_and_forgotten_with_it() -> None:
    asked: list[str] = []

    @once
    def length(thing: Thing) -> int:
        asked.append(thing.name)
        return len(thing.name)

    first, second = Thing("alike"), Thing("alike")
    assert [length(first), length(first), length(second)] == [5, 5, 5]
    assert asked == ["alike", "alike"]
    gone = weakref.ref(first)
    del first
    gc.collect()
    assert gone() is None
    assert length(second) == 5
    assert len(asked) == 2


def test_a_failure_is_not_remembered() -> None:
    tries: list[int] = []

    @once
    def fails(thing: Thing) -> int:
        tries.append(1)
        if len(tries) == 1:
            raise ValueError(thing.name)
        return 7

    thing = Thing("poor")
    with pytest.raises(ValueError, match="poor"):
        fails(thing)
    assert fails(thing) == 7


LOOKS: dict[str, Callable[[Scene], Any]] = {
    "digest": lambda scene: scene.digest(),
    "shapes": lambda scene: [shapes(mesh) for mesh in scene.meshes],
    "size of the view": _size,
}


@pytest.mark.parametrize("look", LOOKS)
def test_no_look_at_a_scene_holds_it(look: str) -> None:
    """Sixteen scenes and a hundred meshes were once held, with all their arrays."""
    scene = read_scene("terminator/sphere", {"tessellation": "8x4"})
    moved = replace(scene, objects=tuple(replace(mesh, points=mesh.points + 1.0) for mesh in scene.meshes))
    held = [weakref.ref(moved), *(weakref.ref(mesh) for mesh in moved.meshes)]
    LOOKS[look](moved)
    del moved
    gc.collect()
    assert [each() for each in held] == [None] * len(held)


def test_scenes_go_to_other_processes_as_before() -> None:
    scene = read_scene("terminator/sphere", {"tessellation": "8x4"})
    assert pickle.loads(pickle.dumps(scene)).digest() == copy(scene).digest() == scene.digest()


@pytest.mark.parametrize(
    ("names", "value"),
    [(("diffuse", "specular"), 0.5), (("unlit", "unshadowing"), ("/Ball",)), (("shift_x", "shift_y"), 0.1)],
    ids=lambda found: str(found),
)
def test_fields_that_change_places_change_the_digest(names: tuple[str, str], value: Any) -> None:
    """Half the highlights of a light are not half its diffuse light, though both leave the other field as it was."""
    scene = read_scene("terminator/sphere")
    if names[0].startswith("shift"):
        changed = [replace(scene, camera=replace(scene.camera, **{name: value})) for name in names]
    else:
        changed = [
            replace(scene, lights=(replace(scene.lights[0], **{name: value}), *scene.lights[1:])) for name in names
        ]
    assert len({each.digest() for each in (scene, *changed)}) == 3
