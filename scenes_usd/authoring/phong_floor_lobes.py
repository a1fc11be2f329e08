"""phong/floor_lobes: a floor seen against the light, where the two reflection models differ most."""

from __future__ import annotations

from notabug.scenes_usd.authoring.phong_lobes import PLASTIC, lobe_sets
from notabug.scenes_usd.authoring.reflection import reflection
from notabug.scenes_usd.authoring.stage import camera, distant_light, looking, materials, mesh, selected, stage

CARD = {
    "class": "phong",
    "claim": (
        "On a floor seen against a low light Phong's highlight stays about as wide as it is long, while Blinn's runs "
        "towards the viewer as a narrow streak: the same light, the same place, the same exponent."
    ),
    "figure": "Phong versus Phong",
    "cites": "Phong 1975; Blinn 1977; Fisher and Woo 1994; Woo, Pearce and Ouellette 1996, Table 1",
}


def files() -> dict[str, bytes]:
    """The scene's files by their path below scenes_usd."""
    floor = mesh(
        "Floor",
        [(-14.0, 0.0, 7.0), (14.0, 0.0, 7.0), (14.0, 0.0, -14.0), (-14.0, 0.0, -14.0)],
        [(0, 1, 2, 3)],
        material="Plastic",
    )
    parts = [
        camera((0.0, 1.1, 5.0), looking((0.0, -1.5, -5.0)), 0.42, (0.1, 100.0)),
        distant_light(looking((-0.05, -0.24, 1.0)), 3.7),
        materials(reflection("Plastic", PLASTIC)),
        floor,
        *lobe_sets(),
    ]
    metadata = selected(lobe="phong", n="32")
    return {"phong/floor_lobes.usda": stage(CARD, parts, requires=("distant_light",), metadata=metadata)}
