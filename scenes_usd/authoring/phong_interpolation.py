"""phong/interpolation: a coarse ball with a highlight: what is interpolated, and by which reflection model."""

from __future__ import annotations

from dataclasses import replace

from notabug.scenes_usd.authoring.phong_lobes import PLASTIC, lobe_set
from notabug.scenes_usd.authoring.reflection import reflection
from notabug.scenes_usd.authoring.shapes import lat_long
from notabug.scenes_usd.authoring.stage import camera, distant_light, looking, materials, mesh, placed, selected, stage
from notabug.scenes_usd.authoring.usda import block

CARD = {
    "class": "phong",
    "claim": (
        "The reflection model and what is interpolated over a facet are two choices: with interpolated normals the "
        "highlight of this coarse ball is a smooth spot, with interpolated colours it smears over the facets around "
        "a corner or is lost between corners, and with neither each facet has a tone of its own, for both lobes."
    ),
    "figure": "Phong versus Phong",
    "cites": "Phong 1975; Gouraud 1971; Blinn 1977; Woo, Pearce and Ouellette 1996",
}


def files() -> dict[str, bytes]:
    """The scene's files by their path below scenes_usd."""
    points, faces = lat_long(12, 6)
    ball = mesh("Mesh", points, faces, normals=points, material="Plastic")
    parts = [
        camera((0.0, 0.0, 8.0), (), 0.145, (0.1, 100.0)),
        distant_light(looking((-0.42, -0.5, -0.76)), 2.9),
        materials(reflection("Plastic", replace(PLASTIC, diffuse=(0.14, 0.24, 0.38), exponent=24.0))),
        block('def Xform "Ball"', placed(turn=(20.0, 8.0, -12.0)), ball),
        lobe_set(),
    ]
    metadata = selected(lobe="phong")
    return {"phong/interpolation.usda": stage(CARD, parts, requires=("normals", "distant_light"), metadata=metadata)}
