"""A light behind the plane of a facet: renderers that sort light by the geometric normal leave the facet black.

On a closed mesh the mesh itself hides such a light. On an open one it slips through, and the two kinds differ.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from notabug.adapters import declared
from notabug.adapters.base import Declaration, Pixels
from notabug.metrics.verdict import Verdict
from notabug.references.tracer.envelope import Options, trace_picture
from notabug.references.tracer.flatten import flatten
from notabug.references.tracer.probe import probe
from notabug.scenes_usd.scene import Mesh, Scene

POINT = Declaration("float64", "point", 0.0, 2.0**-24, relative_quantum=True, noisy=False, silhouette="keep")
UNKNOWN = replace(POINT, **declared.unknown())
LIT, BLACK = replace(POINT, behind_facet="lit"), replace(POINT, behind_facet="black")
SIZE = 96
VISIBLE = 1e-3


def drawn(scene: Scene, **options: Any) -> Pixels:
    return np.asarray(trace_picture(scene, Options(**options)), np.float32)


def _opened(mesh: Mesh) -> Mesh:
    kept = np.repeat(np.arange(len(mesh.counts)) % 2 == 0, mesh.counts)
    normals, uv = (None if each is None else each[kept] for each in (mesh.normals, mesh.uv))
    return replace(mesh, counts=mesh.counts[::2], corners=mesh.corners[kept], normals=normals, uv=uv)


def every_second_facet(scene: Scene) -> Scene:
    """The scene with every second facet of its smooth mesh taken out."""
    objects = tuple(
        _opened(each) if isinstance(each, Mesh) and each.normals is not None else each for each in scene.objects
    )
    return replace(scene, objects=objects, intent=None)


@pytest.fixture(
    params=[
        ("terminator/bowl", "8x4", False),
        ("terminator/bowl", "16x8", False),
        ("terminator/bowl", "24x12", True),
        ("terminator/sphere", "8x4", True),
    ],
    ids=lambda told: f"{told[0]}-{told[1]}{'-opened' * told[2]}",
)
def open_mesh(request: pytest.FixtureRequest, studio: Any) -> Scene:
    name, tessellation, opened = request.param
    scene = replace(studio.scene(name, tessellation=tessellation), width=SIZE, height=SIZE)
    return every_second_facet(scene) if opened else scene


def test_no_light_from_behind_a_facet_arrives_and_all_other_light_does(open_mesh: Scene) -> None:
    """Each pixel where the two kinds differ sees such a facet, with nothing in the light's way."""
    planes, facets = drawn(open_mesh, shadows="planes"), drawn(open_mesh, shadows="facets")
    differs = np.abs(planes - facets).max(axis=2) > VISIBLE
    assert differs.sum() >= 8
    assert (planes <= facets).all()
    flat = flatten(open_mesh)
    for y, x in np.argwhere(differs):
        seen = probe(open_mesh, Options(shadows="facets"), x + 0.5, y + 0.5, flat)
        toward_viewer = np.sign(np.dot(seen.facet_normal, np.asarray(seen.normal)))
        (light,) = seen.lights
        assert light.geometric_cosine * toward_viewer <= 0 < light.cosine
        assert (light.blocker, light.share) == ("", 1.0)
        assert planes[y, x].max() == 0


@pytest.mark.parametrize("tessellation", ["24x12", "8x4"])
def test_a_closed_mesh_hides_such_a_light_itself(studio: Any, tessellation: str) -> None:
    scene = replace(studio.scene("terminator/sphere", tessellation=tessellation), width=SIZE, height=SIZE)
    assert np.array_equal(drawn(scene, shadows="planes"), drawn(scene, shadows="facets"))


@pytest.mark.parametrize(
    ("tessellation", "times"), [("16x8", (2.0, 1.0, 0.5)), ("16x8", (1.0, 1.0, -1.0)), ("24x12", (1.0, 1.0, -1.0))]
)
@pytest.mark.sweep_except("16x8-times0", "16x8-times1")
def test_black_facets_on_the_outside_of_a_bowl_are_a_limitation_unless_they_are_declared_lit(
    studio: Any, tessellation: str, times: tuple[float, float, float]
) -> None:
    """The light stands where it grazes the outside of the bowl, which looks at the viewer."""
    bowl = replace(studio.scene("terminator/bowl", tessellation=tessellation), width=SIZE, height=SIZE)
    position = np.multiply(bowl.lights[0].position, times)
    scene = replace(bowl, lights=(replace(bowl.lights[0], position=tuple(map(float, position))),))

    def judged(picture: Pixels, declaration: Declaration) -> tuple[str, list[str]]:
        found: Verdict = studio.verdict([picture], scene, declaration, naming=False)
        return found.word, [each.name for each in found.findings]

    black, lit = drawn(scene, shadows="planes"), drawn(scene, shadows="facets")
    limited = ("limitation", ["facet_self_shadow"])
    assert (judged(black, BLACK), judged(black, UNKNOWN), judged(lit, LIT)) == (limited, limited, limited)
    assert judged(black, LIT)[0] == "bug"
    assert judged(black * np.float32(0.98), BLACK)[0] == "bug"
