"""acne/with_terminator: black dots and black facets in one picture, and how to tell them apart."""

from __future__ import annotations

from notabug.scenes_usd.authoring import stage as usd
from notabug.scenes_usd.authoring.acne_sphere import TILT, lamp, wall
from notabug.scenes_usd.authoring.shapes import lat_long
from notabug.scenes_usd.authoring.usda import block

CARD = {
    "class": "acne",
    "claim": (
        "A coarse ball lit from far to the right shows both artifacts where the light grazes it: steps as large as a "
        "facet from every distance, which are the facets shadowing each other, and dots as small as a pixel, which "
        "come with the distance of the camera and with the precision of the renderer."
    ),
    "figure": "2",
    "cites": "Woo, Pearce and Ouellette 1996, Table 1 and figure 2",
}


def files() -> dict[str, bytes]:
    """The scene's files by their path below scenes_usd."""
    points, faces = lat_long(24, 12)
    ball = usd.mesh("Mesh", points, faces, normals=points, material="Clay")
    parts = [
        usd.orbiting_camera((0.0, 0.0, 0.0), (0.0, 0.0, 0.0)),
        usd.point_light(*lamp(1e2)),
        usd.materials(usd.lambert("Clay", (0.65, 0.6, 0.5)), usd.lambert("Grey", (0.5, 0.5, 0.5))),
        wall(),
        block('def Xform "Ball"', usd.placed(turn=TILT), ball),
        usd.distances(1.4, ("10", "1e5")),
    ]
    metadata = usd.selected(camera_distance="1e5")
    return {"acne/with_terminator.usda": usd.stage(CARD, parts, requires=("point_light",), metadata=metadata)}
