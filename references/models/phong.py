"""Phong versus Phong: two reflection models and three interpolations under one name."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Literal

import numpy as np

from notabug.references.models.model import Model, edit_materials, edit_meshes, in_strengths
from notabug.scenes_usd.scene import Material, Mesh, Scene
from notabug.scenes_usd.triangulate import split_ngons

_PAPER = "Woo, Pearce and Ouellette 1996, Phong versus Phong"


def models(scene: Scene) -> Iterator[Model]:
    """Models of a scene with lights and interpolated normals, or with highlights."""
    if scene.lights and any(True for _ in scene.meshes):
        yield from _interpolations(scene)
    shiny = [material for material in scene.materials if any(material.specular)]
    if not shiny:
        return
    for lobe in ("phong", "blinn"):
        if any(each.lobe != lobe for each in shiny):
            yield Model(
                name=f"lobe_{lobe}",
                kind="limitation",
                claim=f"highlights have {lobe.capitalize()}'s lobe at the same exponent",
                cites=f"{_PAPER}; Phong 1975; Blinn 1977",
                edit=lambda scene, lobe=lobe: with_lobe(scene, lobe),  # type: ignore[misc]
                when=("lobe", lobe),
            )
            yield Model(
                name=f"lobe_{lobe}_matched",
                kind="limitation",
                claim=f"highlights have {lobe.capitalize()}'s lobe at the exponent that Fisher and Woo match",
                cites=f"{_PAPER}; Fisher and Woo 1994, R.E versus N.H specular highlights, Graphics Gems IV",
                edit=lambda scene, lobe=lobe: with_lobe(scene, f"{lobe}_matched"),  # type: ignore[misc]
                when=("lobe", f"{lobe}_matched"),
            )
    for name, rule, factor in (
        ("n2", "(n + 2)/2", lambda n: (n + 2) / 2),
        ("n8", "(n + 8)/8", lambda n: (n + 8) / 8),
        ("n2over8", "(n + 2)/8", lambda n: (n + 2) / 8),
    ):
        yield Model(
            name=f"lobe_normalised_{name}",
            kind="limitation",
            claim=f"highlights are normalised by {rule}",
            cites="Lewis 1994, Making shaders more physically plausible; Akenine-Moeller et al. 2018, section 9.8",
            edit=_shiny(lambda each, factor=factor: scaled(each, factor(each.exponent))),  # type: ignore[misc]
            when=("normalised", name),
        )
    yield in_strengths(
        lambda strength: Model(
            name="exponent",
            kind="fault",
            claim=f"the exponent of every highlight is {strength:.3g} times too large",
            cites=_PAPER,
            edit=_shiny(lambda each: replace(each, exponent=each.exponent * strength)),
            read=True,
        ),
        1.3,
        neutral=1.0,
    )
    if any(each.lobe == "phong" for each in shiny):
        yield Model(
            name="reflection_of_unnormalised_light",
            kind="fault",
            claim="R is computed from a light vector that was not normalised",
            cites="Phong 1975",
            options={"raw_vectors": True},
        )
    if any(each.lobe == "blinn" for each in shiny):
        yield Model(
            name="halfway_not_normalised",
            kind="fault",
            claim="the halfway vector is not normalised",
            cites="Blinn 1977",
            options={"raw_vectors": True},
        )


def _interpolations(scene: Scene) -> Iterator[Model]:
    """What else than normals may be interpolated over meshes.

    Gouraud's colours may be lit, and a quad cut, in several ways; a renderer has one of each.
    """
    every = list(scene.meshes)
    smooth = [each for each in every if each.normals is not None]
    for meshes in (smooth, every) if 0 < len(smooth) < len(every) else (every,):
        everywhere = len(meshes) > len(smooth)
        ways = [cut for cut in CUTS if not cut or any((each.counts > 3).any() for each in meshes)]
        which = () if len(smooth) == len(every) else (("gouraud_meshes", "all" if everywhere else "smooth"),)
        for name, shadows in GOURAUD.items():
            yield from (_gouraud(name, shadows, cut, which, everywhere=everywhere, cuts=len(ways) > 1) for cut in ways)
    if smooth:
        yield Model(
            name="flat_interpolation",
            kind="limitation",
            claim="nothing is interpolated: smooth meshes are lit by the normals of their facets",
            cites=f"{_PAPER}; Bouknight 1970",
            edit=lambda scene: edit_meshes(scene, lambda mesh: replace(mesh, normals=None)),
            when=("interpolation", "flat"),
        )


GOURAUD = {
    "gouraud_interpolation": "corners",
    "gouraud_pixel_shadows": "pixels",
    "gouraud_unshadowed": "none",
}
"""The models of colours lit at corners, by where they are shadowed: ``Declaration.gouraud_shadows``."""
CUTS: tuple[Literal["", "02", "13"], ...] = ("", "02", "13")
"""What becomes of a quad's four colours: ``Declaration.ngon_split``, bilinear first."""
_SHADOWED = {
    "corners": "shadowed there",
    "pixels": "shadowed at each point",
    "none": "not shadowed",
}


def _gouraud(
    name: str,
    shadows: str,
    cut: Literal["", "02", "13"],
    which: tuple[tuple[str, str], ...],
    *,
    everywhere: bool,
    cuts: bool,
) -> Model:
    """Meshes with normals, or ``everywhere`` all, lit at their corners.

    ``which`` is what must be declared where it shows that flat meshes are lit so, too. ``cuts``: it shows whether quads
    are cut.
    """

    def lit_at_corners(mesh: Mesh) -> Mesh:
        if mesh.normals is None:
            if not everywhere:
                return mesh
            mesh = faceted(mesh)
        return split_ngons(mesh, cut) if cut else mesh

    what = "all meshes" if everywhere else "smooth meshes"
    how = f"linearly in triangles cut along corners {cut[0]} and {cut[1]}" if cut else "over each face"
    return Model(
        name=name,
        kind="limitation",
        claim=f"{what} are lit at the corners of their faces and {_SHADOWED[shadows]}, and the colours are interpolated"
        f" {how}",
        cites=f"{_PAPER}; Gouraud 1971; OpenGL 1.1 specification, sections 2.13 and 3.5",
        edit=lambda scene: edit_meshes(scene, lit_at_corners),
        options={"gouraud": True, "gouraud_shadows": shadows},
        when=("interpolation", "gouraud"),
        also=(
            ("gouraud_shadows", shadows),
            *which,
            *((("ngon_split", cut),) if cuts else ()),
        ),
    )


def faceted(mesh: Mesh) -> Mesh:
    """``mesh``, which has no normals, with those of its faces at every corner (Newell 1972: any polygon has one)."""
    p = mesh.points[mesh.corners]
    start = np.repeat(np.cumsum(mesh.counts) - mesh.counts, mesh.counts)
    following = start + (np.arange(len(p)) - start + 1) % np.repeat(mesh.counts, mesh.counts)
    area = np.add.reduceat(np.cross(p - p[start], p[following] - p[start]), np.cumsum(mesh.counts) - mesh.counts)
    normal = area / np.maximum(np.linalg.norm(area, axis=1, keepdims=True), 1e-300)
    return replace(mesh, normals=np.ascontiguousarray(np.repeat(normal, mesh.counts, axis=0)))


def matched(material: Material, lobe: str) -> Material:
    """``material`` with the other lobe at a matching exponent: Phong's n is close to Blinn's 4n (Fisher and Woo)."""
    if material.lobe == lobe:
        return material
    factor = 4.0 if lobe == "blinn" else 0.25
    return replace(material, lobe=lobe, exponent=material.exponent * factor)  # type: ignore[arg-type]


def with_lobe(scene: Scene, lobe: str) -> Scene:
    """``scene`` as a renderer draws it that has one lobe only; ``lobe`` as in an adapter's declaration."""
    if lobe == "authored":
        return scene
    kind, _, at = lobe.partition("_")
    if at:
        return _shiny(lambda each: matched(each, kind))(scene)
    return _shiny(lambda each: replace(each, lobe=kind))(scene)  # type: ignore[arg-type]


def scaled(material: Material, factor: float) -> Material:
    """``material`` with its highlight ``factor`` times as bright."""
    r, g, b = material.specular
    return replace(material, specular=(r * factor, g * factor, b * factor))


def _shiny(change: Callable[[Material], Material]) -> Callable[[Scene], Scene]:
    return lambda scene: edit_materials(scene, lambda each: change(each) if any(each.specular) else each)
