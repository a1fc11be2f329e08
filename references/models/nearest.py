"""The convention of nearest texels: a texture is not interpolated between them."""

from __future__ import annotations

from collections.abc import Iterator

from notabug.references.models.model import Model
from notabug.scenes_usd.scene import Scene


def models(scene: Scene) -> Iterator[Model]:
    """Models of a scene with textured objects."""
    if scene.shown_textures:
        yield Model(
            name="nearest_texel",
            kind="convention",
            claim="a texture shows its nearest texel, without interpolation",
            cites="Heckbert 1989, section 2.4; OpenGL 1.1 specification, section 3.8.4: NEAREST",
            options={"texels": "nearest"},
            when=("texture_filter", "nearest"),
        )
