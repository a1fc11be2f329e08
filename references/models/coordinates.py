"""World coordinates in float32: far from the origin points, camera and lights move before any ray starts."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from notabug.references.models.acne import width_of_view
from notabug.references.models.model import Edit, Model, edit_meshes
from notabug.scenes_usd.scene import Floats, Light, Scene, Sphere

# A coordinate is rounded by half of its last place when it is stored, and by up to three halves where a transform sums
# the four terms that make it. The order of transforms differs from renderer to renderer, so no one picture is right.
PLACES = 2.0
LEAST_MOVED = 0.05  # pixels: what moves less moves no picture by more than edges are allowed anyway
DRAWS = 8  # pictures whose points are moved to either side of their places: what lies between them is admitted


def models(scene: Scene) -> Iterator[Model]:
    """Models of a scene whose coordinates are so large that float32 moves what is seen."""
    if not scene.objects:
        return
    pixel, step = width_of_view(scene) / scene.width, sideways(scene)
    if not step > LEAST_MOVED * pixel > 0.0:
        return
    yield Model(
        name="float32_coordinates",
        kind="limitation",
        rule="hull",
        claim=f"coordinates are held in float32, whose steps are {step / pixel:.2g} pixels wide here",
        cites="Goldberg 1991, section 1.2; Thorne 2005, Using a floating origin to improve fidelity and performance",
        edit=moved(0),
        edits=tuple(moved(each) for each in range(1, DRAWS)),
        when=("coordinates", "float32"),
    )


def sideways(scene: Scene) -> float:
    """The largest step of float32 among the scene's coordinates and the camera's, across the line of sight."""
    axes = np.abs(scene.camera.to_world[:2, :3])
    places = [np.abs(each.points).max(axis=0, initial=0.0) for each in scene.meshes]
    places += [np.abs(each.to_world[3, :3]) for each in scene.spheres]
    places.append(np.abs(scene.camera.to_world[3, :3]))
    return float((last_place(np.array(places)) @ axes.T).max())


def last_place(values: Floats) -> Floats:
    """The distance of each number to the next one in float32.

    >>> last_place(np.array([1.0, 1e6])).tolist()
    [1.1920928955078125e-07, 0.0625]
    """
    return np.asarray(np.spacing(np.abs(values).astype(np.float32)), np.float64)


def moved(draw: int) -> Edit:
    """An edit that puts every coordinate PLACES steps of float32 to one side or the other, by a fixed coin."""

    def edit(scene: Scene) -> Scene:
        rng = np.random.default_rng(draw)

        def shifted(points: Floats) -> Floats:
            side = rng.integers(0, 2, points.shape) * 2.0 - 1.0
            return np.asarray(np.ascontiguousarray(points + PLACES * side * last_place(points)))

        def placed(matrix: Floats) -> Floats:
            new = matrix.copy()
            new[3, :3] = shifted(matrix[3, :3])
            return new

        def light(each: Light) -> Light:
            x, y, z = shifted(np.array(each.position)).tolist()
            return replace(each, position=(x, y, z)) if each.kind not in ("distant", "sun", "dome") else each

        drawn = edit_meshes(scene, lambda mesh: replace(mesh, points=shifted(mesh.points)))
        objects = tuple(
            replace(each, to_world=placed(each.to_world)) if isinstance(each, Sphere) else each
            for each in drawn.objects
        )
        camera = replace(scene.camera, to_world=placed(scene.camera.to_world))
        return replace(drawn, objects=objects, camera=camera, lights=tuple(light(each) for each in scene.lights))

    return edit
