"""The adapters by name: each file of this folder that ends with ``register(...)``, and what a scene asks of them."""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Iterator
from dataclasses import dataclass
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path

import notabug.adapters
from notabug.adapters.base import Adapter, Declaration, Found, Quality, Render, RendererMissingError
from notabug.adapters.config import find_config, renderer_tables
from notabug.scenes_usd.errors import SelectionError
from notabug.scenes_usd.nearest import instead_of
from notabug.scenes_usd.scene import Mesh, Preview, Scene

GROUP = "notabug.adapters"
_adapters: dict[str, Adapter] = {}


def register(adapter: Adapter) -> None:
    """Make ``adapter`` known under its name; the last line of an adapter's file."""
    _adapters[adapter.name] = adapter


def adapters() -> dict[str, Adapter]:
    """Every adapter by name, installed or not: those of this folder, then plug-ins, then the configuration file's.

    Importing an adapter's file must not import its renderer.
    """
    for module in pkgutil.iter_modules(notabug.adapters.__path__):
        importlib.import_module(f"notabug.adapters.{module.name}")
    known = dict(_adapters)
    for point in entry_points(group=GROUP):
        made = _plug_in(point)
        known[made.name] = made
    from notabug.adapters.configured import configured

    tables = renderer_tables(find_config())
    return dict(sorted((known | {name: configured(name, each, known) for name, each in tables.items()}).items()))


def _plug_in(point: EntryPoint) -> Adapter:
    """The adapter of the entry point ``point``: an object, or something to call that gives one."""
    try:
        found = point.load()
        made: Adapter = found if hasattr(found, "render") and not isinstance(found, type) else found()
        for part in ("name", "capabilities", "install", "declaration", "find", "render"):
            if not hasattr(made, part):
                raise TypeError(f"it has no {part!r}")
    except Exception as error:  # somebody else's code: it must not stop the others
        return Broken(point.name, f"{point.value} cannot be loaded: {type(error).__name__}: {error}")
    return made


@dataclass(frozen=True, slots=True)
class Broken:
    """A plug-in that cannot be loaded, in the place of the adapter that it should have been: it is never found."""

    name: str
    why: str
    capabilities: frozenset[str] = frozenset()
    install: str = "correct the plug-in, or uninstall it"

    def find(self) -> Found:
        raise RendererMissingError(self.why, where=f"plug-in {self.name!r}", do=self.install)

    def declaration(self, quality: Quality) -> Declaration:
        raise NotImplementedError(str(quality))

    def render(self, scene: Scene, out: Path, quality: Quality) -> tuple[Render, ...]:
        raise NotImplementedError(f"{scene.id} {out} {quality}")


def adapter(name: str) -> Adapter:
    """The adapter called ``name``."""
    known = adapters()
    if name not in known:
        expected, meant = instead_of(name, known, see="`notabug list renderers` has all")
        raise SelectionError(f"no renderer called {name!r}", expected=expected, do=meant)
    return known[name]


def needs(scene: Scene) -> frozenset[str]:
    """The capabilities that ``scene`` asks for: what its card requires and what its content implies.

    Words: mesh, sphere, normals, uv, texture, point_light, distant_light, with a size sphere_light, rect_light,
    disk_light, cylinder_light, sun_light (distant, with an angle) and dome_light, dome_texture, light_beam,
    light_multipliers, light_link,
    opacity, opacity_map and cutout (a map with a threshold), phong, blinn, cosine_weighted, coloured_highlight, mirror,
    transmission, orthographic, aperture_offset; of a UsdPreviewSurface ggx, and
    dielectric where it is not all metal, emission, normal_map. A card may also require shadows; whether
    any fall is not looked at here, since that takes a picture: see ``requirements.shadows_fall``.
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
    if any(light.emitter is not None and light.emitter.texture is not None for light in scene.lights):
        found.add("dome_texture")
    if any(light.shaping is not None for light in scene.lights):
        found.add("light_beam")
    if any(light.is_linked for light in scene.lights):
        found.add("light_link")
    if any(light.diffuse != 1.0 or light.specular != 1.0 for light in scene.lights):
        found.add("light_multipliers")
    if scene.camera.orthographic:
        found.add("orthographic")
    if scene.camera.shift_x or scene.camera.shift_y:
        found.add("aperture_offset")
    for index in {each.material for each in scene.objects}:
        material = scene.materials[index]
        if material.textures:
            found |= {"texture", "uv"}
        if material.preview is not None:
            found.update(_preview_needs(material.preview))
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
        if material.opacity_map >= 0:
            found.add("cutout" if material.cutoff else "opacity_map")
        elif material.opacity < 1.0:
            found.add("opacity")
    return frozenset(found)


def _preview_needs(surface: Preview) -> Iterator[str]:
    """What a UsdPreviewSurface asks for beside its textures."""
    yield "ggx"
    metal = surface.metallic_map < 0 and surface.metallic == 1.0 and not surface.specular_workflow
    if not metal or surface.clearcoat:
        yield "dielectric"
    if any(surface.emission) or surface.emission_map >= 0:
        yield "emission"
    if surface.normal_map >= 0:
        yield "normal_map"
