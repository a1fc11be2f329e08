"""terminator/sphere: a smooth sphere of facets, lit from the side, over a floor that catches its shadow."""

from __future__ import annotations

from notabug.scenes_usd.authoring.shapes import lat_long
from notabug.scenes_usd.authoring.stage import camera, lambert, materials, mesh, placed, point_light, stage, variant_set
from notabug.scenes_usd.authoring.usda import indent

TESSELLATIONS = ((8, 4), (16, 8), (24, 12), (48, 24), (96, 48))
DEFAULT = "24x12"

CARD = {
    "class": "terminator",
    "claim": (
        "Facets that stand for a smooth sphere throw shadows on each other beside the terminator, where the "
        "interpolated normal still sees the light; for this light the dark notches cover an area that falls as "
        "one over the number of facets around the sphere."
    ),
    "figure": "2, 3",
    "cites": "Woo, Pearce and Ouellette 1996, Table 1, figures 2 and 3; Snyder and Barr 1987",
}

# Degrees about x, y, z. Where the terminator crosses the facets scatters the area about its law; at this tilt, oblique
# to the grid's lines, the pixels that differ by more than 0.002 keep within 5 % of 7,400 over n at every tessellation.
TILT = (-18.0, -7.0, -15.0)
HEIGHT = 1.05  # of the centre: the sphere stands clear of the floor


def files() -> dict[str, bytes]:
    """The scene's files by their path below scenes_usd."""
    floor = mesh(
        "Floor",
        [(-16.0, 0.0, 8.0), (12.0, 0.0, 8.0), (12.0, 0.0, -20.0), (-16.0, 0.0, -20.0)],
        [(0, 1, 2, 3)],
        material="Grey",
    )
    ball = (
        'def Mesh "Ball" (\n    prepend apiSchemas = ["MaterialBindingAPI"]\n)\n{\n'
        "    rel material:binding = </Scene/Materials/Clay>\n"
        '    uniform token subdivisionScheme = "none"\n'
        f"{indent(placed((0.0, HEIGHT, 0.0), TILT))}"
        "}"
    )
    parts = [
        camera((0.0, 4.2, 8.2), (-23.0, 3.5, 0.0), 0.22, (0.1, 100.0)),
        point_light((14.0, 12.0, -2.0), 4000.0),
        materials(lambert("Clay", (0.65, 0.6, 0.5)), lambert("Grey", (0.5, 0.5, 0.5))),
        floor,
        ball,
        variant_set("tessellation", {f"{n}x{m}": _variant(n, m) for n, m in TESSELLATIONS}),
    ]
    metadata = f'variants = {{\n    string tessellation = "{DEFAULT}"\n}}\nprepend variantSets = "tessellation"'
    return {
        "terminator/sphere.usda": stage(CARD, parts, requires=("mesh", "normals", "point_light"), metadata=metadata)
    }


def _variant(n: int, m: int) -> str:
    points, faces = lat_long(n, m)
    text = mesh("Ball", points, faces, normals=points, how="over")
    body = "\n".join("    " + line if line else "" for line in text.split("\n") if "subdivisionScheme" not in line)
    return "{\n" + body + "\n}"
