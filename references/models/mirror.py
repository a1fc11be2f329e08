"""Mirror reflections: each mirror ray is a view ray of its own, so highlights differ in every mirror."""

from __future__ import annotations

from collections.abc import Iterator

from notabug.references.models.model import Model
from notabug.scenes_usd.scene import Scene

_PAPER = "Woo, Pearce and Ouellette 1996, figure 8; Whitted 1980"


def models(scene: Scene) -> Iterator[Model]:
    """Models of a scene with a mirror."""
    if not any(any(material.mirror) for material in scene.materials):
        return
    yield Model(
        name="mirror_reversed",
        kind="fault",
        claim="mirror rays go back where they came from: the sign of the reflection is wrong",
        cites=_PAPER,
        options={"retroreflection": True},
    )
    yield Model(
        name="mirror_handedness",
        kind="fault",
        claim="the picture in a mirror is not reversed: the reflected ray has one tangent with the wrong sign",
        cites=_PAPER,
        options={"unreversed": True},
    )
    if any(any(material.specular) for material in scene.materials):
        yield Model(
            name="primary_view_vector",
            kind="fault",
            claim="highlights in a mirror are computed with the camera's view vector",
            cites=_PAPER,
            options={"mirrored_highlight": "primary"},
        )
        yield Model(
            name="mirrored_highlight_lost",
            kind="fault",
            claim="objects seen in a mirror have no highlight",
            cites=_PAPER,
            options={"mirrored_highlight": "lost"},
        )
