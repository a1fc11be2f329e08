"""The benchmark's pictures by POV-Ray and Mitsuba: the same faults, given to the renderer as a changed scene.

Their models are separate code, so what fits our own renderer only by sharing a mistake with it does not fit them. They
all are on the evaluation side.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
import numpy.typing as npt

from notabug.adapters.base import Adapter, Quality, RendererMissingError, UnsupportedError
from notabug.adapters.registry import adapters
from notabug.bench.verdict.catalogue import FAULTS
from notabug.bench.verdict.design import Group, Label, Size, number
from notabug.bench.verdict.evaluate import around, fault_of, said, scene_of, shows
from notabug.metrics.judge import judge
from notabug.scenes_usd.picture import read_picture
from notabug.scenes_usd.scene import Scene

Floats = npt.NDArray[np.floating]

RENDERERS = ("povray", "mitsuba")
_RIGHT: dict[tuple[str, str], npt.NDArray[np.float64]] = {}
QUALITY = Quality(samples=0, seeds=(0, 1, 2, 3))
INJECTED = (  # fault, strength, scene
    ("light_gain", 1.02, "terminator/sphere"),
    ("light_colour", 1.05, "mirror/corner"),
    ("light_moved", 0.05, "terminator/sphere"),
    ("light_up_axis", 1.0, "mirror/corner"),
    ("albedo", 1.05, "terminator/sphere"),
    ("flat_normals", 1.0, "terminator/sphere"),
    ("normals_flipped", 1.0, "terminator/bowl"),
    ("normals_swapped", 1.0, "terminator/sphere"),
    ("normals_by_matrix", 1.0, "terminator/sphere"),
    ("geometry_mirrored", 1.0, "terminator/bowl"),
    ("object_missing", 1.0, "mirror/corner"),
    ("materials_exchanged", 1.0, "mirror/corner"),
    ("exponent", 1.3, "phong/floor_lobes"),
    ("specular_gain", 1.1, "mirror/corner"),
    ("specular_missing", 1.0, "mirror/corner"),
    ("diffuse_missing", 1.0, "phong/floor_lobes"),
    ("ior", 1.1, "acne/glass_slab"),
    ("swapped_uv", 1.0, "texture/uneven_quad"),
    ("flipped_v", 1.0, "texture/perspective_floor"),
    ("shifted_uv", 1.0, "texture/uneven_quad"),
    ("texture_decoded", 1.0, "texture/perspective_floor"),
    ("field_of_view", 1.01, "terminator/sphere"),
    ("aspect", 1.333, "mirror/corner"),
    ("pixel_shift", 0.5, "mirror/corner"),
)
LIMITED = (  # what renderers show at their defaults: limitation, renderer, scene
    ("facet_self_shadow", "povray", "terminator/sphere"),
    ("facet_self_shadow", "mitsuba", "terminator/sphere"),
    ("facet_self_shadow", "povray", "terminator/spacing"),
    ("facet_self_shadow", "mitsuba", "terminator/bowl"),
    ("quad_split_02", "povray", "texture/uneven_quad"),
    ("quad_split_02", "mitsuba", "texture/uneven_quad"),
    ("facet_self_reflection", "povray", "terminator/mirror_sphere"),
    ("facet_self_reflection", "mitsuba", "terminator/mirror_sphere"),
    ("coincident_surfaces", "povray", "visibility/coincident_spheres"),
    ("coincident_surfaces", "mitsuba", "visibility/coincident_spheres"),
    ("coarse_uv", "povray", "texture/simplified"),
    ("coarse_uv", "mitsuba", "texture/simplified"),
)
CLEAN = ("calibration/card", "texture/perspective_floor", "separation/cutoff", "mirror/corner", "phong/floor_lobes")


def renderer_groups(size: Size) -> list[Group]:
    """Every picture of the renderers that are installed; with the quick size a few of them."""
    found = []
    for name in RENDERERS:
        try:
            adapters()[name].find()
        except (RendererMissingError, KeyError):
            continue

        def group(label: Label, fault: str, kind: str, strength: float, scene: str, name: str = name) -> Group:
            return Group(label, fault, kind, strength, scene, (), 0, "evaluation", (name,), size.side)

        kinds = {each.name: each.group for each in FAULTS}
        found += [group("bug", fault, kinds[fault], s, scene) for fault, s, scene in INJECTED]
        found += [group("limitation", each, "renderer", 1.0, scene) for each, who, scene in LIMITED if who == name]
        found += [group("clean", "", "clean", 0.0, scene) for scene in CLEAN]
    found.sort(key=lambda each: number("order", each.key()))
    drawn = found[:10] if size.name == "quick" else found
    return sorted(drawn, key=lambda each: (each.conditions, each.setting()))


def expose_renderer(group: Group) -> list[dict[str, object]]:
    """The record of one picture; none where the renderer cannot draw the scene."""
    (name,) = group.conditions
    adapter = adapters()[name]
    fault = fault_of(group)
    scene = drawn = scene_of(group)
    if fault is not None:
        model = fault.model(scene, group.strength, group.draw("which"))
        if model is not None:
            drawn = model.edit(scene)
    try:
        pictures, spent = _taken(adapter, drawn)
    except UnsupportedError:
        return []
    visible = True
    if fault is not None:
        if group.name == "pixel_shift":  # half a pixel, by the mean of two neighbours
            pictures = [(picture + _moved(picture)) / 2 for picture in pictures]
        # with the same seeds: where a renderer turns normals by itself, the same
        mean, right = np.mean(pictures, axis=0), _right(adapter, scene)
        visible = shows(mean, right, np.zeros_like(mean), around(right))
    verdict = judge(pictures, scene, adapter.declaration(QUALITY), perceive=False).verdict
    return [
        {
            **group.as_dict(),
            "condition": name,
            "renderer": name,
            "repeat": 0,
            "shows": visible,
            "right": sorted(fault.right) if fault else [group.name],
            "named": group.label == "bug",
            **said(verdict),
            "twin": False,
            "seconds": 0.0,
            "samples": spent * scene.width * scene.height,
            "gates": {},
            "sequential": None,
        }
    ]


def _right(adapter: Adapter, scene: Scene) -> npt.NDArray[np.float64]:
    """The picture (h, w, 3) without the fault, by the mean of the seeds; many faults are of one scene."""
    key = adapter.name, scene.digest()
    if key not in _RIGHT:
        pictures, _ = _taken(adapter, scene)
        _RIGHT[key] = np.asarray(np.mean(pictures, axis=0), np.float64)
    return _RIGHT[key]


def _taken(adapter: Adapter, scene: Scene) -> tuple[list[Floats], int]:
    """The pictures of ``scene`` by every seed, and the samples that each of their pixels took together."""
    with tempfile.TemporaryDirectory(prefix="notabug-") as scratch:
        made = adapter.render(scene, Path(scratch), QUALITY)
        return [read_picture(each.image).pixels for each in made], sum(each.samples for each in made)


def _moved(picture: Floats) -> Floats:
    return np.pad(picture, ((0, 0), (1, 0), (0, 0)), mode="edge")[:, :-1]
