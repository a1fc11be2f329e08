"""The adapters by name: each file of this folder that ends with ``register(...)``, and what a scene asks of them."""

from __future__ import annotations

import importlib
import pkgutil

import notabug.adapters
from notabug.adapters.base import Adapter
from notabug.scenes_usd.errors import SelectionError
from notabug.scenes_usd.scene import Mesh, Scene

_adapters: dict[str, Adapter] = {}


def register(adapter: Adapter) -> None:
    """Make ``adapter`` known under its name; the last line of an adapter's file."""
    _adapters[adapter.name] = adapter


def adapters() -> dict[str, Adapter]:
    """Every adapter by name, installed or not. Importing an adapter's file must not import its renderer."""
    for module in pkgutil.iter_modules(notabug.adapters.__path__):
        importlib.import_module(f"notabug.adapters.{module.name}")
    return dict(sorted(_adapters.items()))


def adapter(name: str) -> Adapter:
    """The adapter called ``name``."""
    known = adapters()
    if name not in known:
        raise SelectionError(f"no renderer called {name!r}", expected=f"one of {', '.join(known)}")
    return known[name]


def needs(scene: Scene) -> frozenset[str]:
    """The capabilities that ``scene`` asks for: what its card requires and what its content implies.

    Words: mesh, sphere, normals, uv, texture, point_light, distant_light, opacity, phong, blinn, cosine_weighted,
    coloured_highlight, mirror, transmission. A card may also require shadows; whether any fall is not looked at here,
    since that takes a picture: see ``requirements.shadows_fall``.
    """
    found = set(scene.card.requires)
    for each in scene.objects:
        if isinstance(each, Mesh):
            found.add("mesh")
            if each.normals is not None:
                found.add("normals")
        else:
            found.add("sphere")
    found.update(f"{light.kind}_light" for light in scene.lights)
    for index in {each.material for each in scene.objects}:
        material = scene.materials[index]
        if material.texture >= 0:
            found |= {"texture", "uv"}
        if any(material.specular):
            found.add(material.lobe)
            if material.cosine_weighted:
                found.add("cosine_weighted")
            if len(set(material.specular)) > 1:
                found.add("coloured_highlight")
        if any(material.mirror):
            found.add("mirror")
        if any(material.transmission):
            found.add("transmission")
        if material.opacity < 1.0:
            found.add("opacity")
    return frozenset(found)
