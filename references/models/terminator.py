"""The terminator problem: planar facets that shadow, reflect and refract in the place of a smooth surface."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from notabug.references.models.model import Edit, Model, edit_meshes
from notabug.scenes_usd.scene import Scene

_PAPER = "Woo, Pearce and Ouellette 1996, table 1 and figure 3"


def models(scene: Scene) -> Iterator[Model]:
    """Models of a scene with lights, or with interpolated normals and lights, mirrors or glass."""
    yield from _secondary(scene)
    if not scene.lights:
        return
    yield Model(
        name="unshadowed",
        kind="limitation",
        claim="no surface casts a shadow: the renderer shoots no shadow rays",
        cites="Crow 1977, Shadow algorithms for computer graphics: a depth buffer alone has none",
        options={"shadows": "none"},
        when=("shadows", "none"),
        strict=True,
    )
    yield Model(
        name="no_shadow",
        kind="fault",
        claim="surfaces cast no shadow, all or some of them",
        cites="Whitted 1980, section 2",
        options={"shadows": "none"},
        local=True,
    )
    if len(scene.objects) > 2:  # of two only one can cast a shadow on the other: no surface then casts one, `no_shadow`
        for shape in scene.objects:
            yield Model(
                name="shadow_of_one_missing",
                kind="fault",
                claim=f"{shape.path} casts no shadow, other objects do",
                cites="Whitted 1980, section 2",
                edit=_casting_no_shadow(shape.path),
            )
    if all(each.normals is None for each in scene.meshes):
        return
    yield Model(
        name="facet_self_shadow",
        kind="limitation",
        rule="partial",
        claim="flat facets shadow the smooth surface that their normals imply, or leak light into its hollows",
        cites=f"{_PAPER}; Snyder and Barr 1987",
        options={"shadows": "facets"},
    )
    yield Model(
        name="facet_self_shadow",
        kind="limitation",
        rule="partial",
        claim="flat facets shadow the smooth surface that their normals imply, and are dark where the light stands "
        "behind their plane",
        cites=f"{_PAPER}; Pharr, Jakob and Humphreys 2016, section 9.1 (BSDF::f sorts by the geometric normal)",
        options={"shadows": "planes"},
        when=("behind_facet", "black"),
    )
    for silhouette, switch, what in (
        ("flip", "flip", "turned towards the viewer"),
        ("flip", "flip_lit", "turned towards the viewer, and lit without a shadow ray"),
        ("black", "black", "painted black"),
    ):
        yield Model(
            name=f"silhouette_{silhouette}",
            kind="convention",
            claim=f"an interpolated normal that faces away from the viewer is {what}",
            cites="Veach 1997, section 5.3 (shading normals)",
            options={"silhouette": switch},
            when=("silhouette", silhouette),
            also=(("shadows", "none" if switch == "flip_lit" else "cast"),) if silhouette == "flip" else (),
        )
    yield Model(
        name="flat_normals",
        kind="fault",
        claim="the facets' own normals are used instead of the interpolated ones",
        cites="Phong 1975",
        edit=lambda scene: edit_meshes(scene, lambda mesh: replace(mesh, normals=None)),
    )
    yield Model(
        name="normals_not_normalised",
        kind="fault",
        claim="interpolated normals are used without being normalised again",
        cites="Phong 1975",
        options={"normals": "raw"},
    )


def _casting_no_shadow(path: str) -> Edit:
    """An edit after which the object of that path blocks the light of none."""

    def edit(scene: Scene) -> Scene:
        return replace(
            scene, lights=tuple(replace(light, unshadowing=(*light.unshadowing, path)) for light in scene.lights)
        )

    return edit


def _secondary(scene: Scene) -> Iterator[Model]:
    """Reflection and refraction at smooth meshes, which the problem extends to."""
    smooth = [scene.materials[each.material] for each in scene.meshes if each.normals is not None]
    if any(any(each.mirror) or any(each.transmission) for each in smooth):
        yield Model(
            name="facet_self_reflection",
            kind="limitation",
            claim="rays reflected above the smooth surface run into the flat facets that stand for it",
            cites=_PAPER,
            options={"self_reflection": True},
        )
    if any(any(each.transmission) for each in smooth):
        yield Model(
            name="facet_self_refraction",
            kind="limitation",
            claim="rays refracted through the smooth surface have not passed its flat facets and meet the next ones",
            cites=_PAPER,
            options={"self_refraction": True},
        )
