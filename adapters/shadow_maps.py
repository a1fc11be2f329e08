"""Shadow maps as a scene's lights ask for them, for adapters that draw them so."""

from __future__ import annotations

from notabug.adapters.base import UnsupportedError
from notabug.scenes_usd.scene import Scene, ShadowMap


def asked_for(name: str, scene: Scene) -> ShadowMap:
    """How the maps of ``scene`` are made for the adapter ``name``; a resolution of 0: there are none.

    Raises UnsupportedError where its lights do not say it, or not all the same.
    """
    said = {light.shadow_map for light in scene.lights}
    if said == {None} and scene.card.artifact_class == "calibration":
        return ShadowMap(0)  # nothing on a card casts a shadow
    found = said.pop() if len(said) == 1 else None
    if found is None:
        raise UnsupportedError(
            f"scene {scene.id!r} needs shadow_map",
            where=f"adapter {name!r}",
            expected="the same numbers of a shadow map on every light",
            do="author notabug:shadowMap:resolution, :bias and :normalBias on each light",
        )
    return found
