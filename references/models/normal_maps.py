"""Normal maps: frames of tangents, light and view on the other side of the mapped normal, and maps that are misread.

A mapped normal is no surface's: it may face away from the viewer though the surface does not, or face a light that
is behind the surface. UsdPreviewSurface says nothing of either, nor in which frame of tangents its vectors are, and
renderers differ. What follows from the scene says where they may: nothing changes where the map says straight up.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from notabug.references.models.model import Model
from notabug.scenes_usd.scene import Mesh, Scene, Texture
from notabug.scenes_usd.srgb import decode_srgb
from notabug.scenes_usd.triangulate import triangulate

_SPECIFICATION = "UsdPreviewSurface specification 2.6: normal"
_MIKKELSEN = "Mikkelsen 2008, Simulation of wrinkled surfaces revisited (MikkTSpace)"
_SCHUELER = "Schueler 2013, Followup: Normal mapping without precomputed tangents"
_ESTEVEZ = "Estevez, Lecocq and Stein 2019, A microfacet-based shadowing function to solve the bump terminator problem"
_SCHUESSLER = "Schuessler et al. 2017, Microfacet-based normal mapping for robust Monte Carlo path tracing, section 2"
ON_BYTES = 1e-5
"""How far what a map says may lie off the numbers that bytes give with scale 2 and bias -1: rounding of float32."""

_AWAY = (
    (
        "mapped_normal_flipped",
        "convention",
        "flip",
        "a mapped normal that faces away from the viewer is turned about the surface's own by half a turn",
        f"{_SCHUESSLER}; Mitsuba 3.7.1, normalmap: flip_invalid_normals",
    ),
    (
        "mapped_normal_raised",
        "convention",
        "raised",
        "highlights have a mapped normal that is raised until its mirror image of the view leaves the facet",
        "Keller et al. 2017, The Iray light transport simulation and rendering system; Cycles, "
        "ensure_valid_specular_reflection (Bump Map Correction)",
    ),
    (
        "mapped_normal_black",
        "limitation",
        "black",
        "a surface is black where its mapped normal faces away from the viewer",
        f"{_SCHUESSLER}; pbrt-v4, DiffuseBxDF::f (SameHemisphere); Mitsuba, normalmap without flip_invalid_normals",
    ),
)
_LIGHT = (
    (
        "bump_light_leak",
        "lit",
        "lit",
        "light from behind a surface reaches bumps whose mapped normal faces it",
        "three.js and Filament: the mapped normal's N.L alone counts; Veach 1997, section 5.3.2 (light leaks)",
    ),
    (
        "bump_terminator_softened",
        "softened",
        "softened",
        "light fades towards a surface's horizon as much as the mapped normal leans, by Estevez's shadowing function",
        f"{_ESTEVEZ}; Mitsuba 3.7.1, normalmap: use_shadowing_function",
    ),
    (
        "bump_terminator_softened",
        "softened_diffuse",
        "softened_diffuse",
        "diffuse light fades towards a surface's horizon as much as the mapped normal leans, by Estevez's function",
        f"{_ESTEVEZ}; Cycles, bump_shadowing_term",
    ),
    (
        "bump_terminator_softened",
        "tamed",
        "tamed",
        "light fades towards a surface's horizon as much as the mapped normal leans, by Chiang's shadowing function",
        "Chiang, Li and Burley 2019, Taming the shadow terminator; Cycles before 4.0, bump_shadowing_term",
    ),
)
_FRAMES = (
    (
        "tangents_interpolated",
        "interpolated",
        "a normal map's frame has tangents that are averaged at the corners and interpolated between them",
        f"{_MIKKELSEN}; glTF 2.0, section 3.7.2.1; Cycles, Filament",
    ),
    (
        "tangents_cotangent",
        "cotangent",
        "a normal map's frame has the gradients of s and t, not square to each other, the longer one of length 1",
        f"{_SCHUELER}; three.js, getTangentFrame",
    ),
)
_MISREAD = (
    ("normal_green_flipped", "the normal map's green channel is read upside down", (1.0, -1.0, 1.0)),
    ("normal_red_flipped", "the normal map's red channel is read the wrong way round", (-1.0, 1.0, 1.0)),
    ("normal_map_ignored", "the normal map is ignored", (0.0, 0.0, 1.0)),
)


def models(scene: Scene) -> Iterator[Model]:
    """Models of a scene with lights and a mesh whose normals come from a map."""
    meshes = [each for each in scene.meshes if normal_map(scene, each) >= 0]
    if not scene.lights or not meshes:
        return
    yield from _away_and_light()
    yield from _frames(meshes)
    yield from _misread(scene)


def normal_map(scene: Scene, mesh: Mesh) -> int:
    """The texture that ``mesh`` has its normals from, or -1."""
    preview = scene.materials[mesh.material].preview
    return -1 if preview is None or mesh.uv is None else preview.normal_map


def mirrored(mesh: Mesh) -> npt.NDArray[np.bool_]:
    """Of each triangle (t,) whether its texture coordinates run round it the other way than its corners."""
    assert mesh.uv is not None
    a, b, c = np.moveaxis(mesh.uv[triangulate(mesh).corner], 1, 0)
    one, other = b - a, c - a
    return np.asarray(one[:, 0] * other[:, 1] < one[:, 1] * other[:, 0])


def _away_and_light() -> Iterator[Model]:
    """What becomes of mapped normals that face away from the viewer, and of those that face a light from behind."""
    for name, kind, way, claim, cites in _AWAY:
        yield Model(
            name=name,
            kind="limitation" if kind == "limitation" else "convention",
            claim=claim,
            cites=cites,
            options={"mapped_away": way},
            when=("mapped_away", way),
        )
    for name, value, way, claim, cites in _LIGHT:
        yield Model(
            name=name,
            kind="limitation",
            claim=claim,
            cites=cites,
            options={"bump_light": way},
            when=("bump_light", value),
        )


def _frames(meshes: list[Mesh]) -> Iterator[Model]:
    for name, way, claim, cites in _FRAMES:
        yield Model(
            name=name, kind="convention", claim=claim, cites=cites, options={"tangents": way}, when=("tangents", way)
        )
    yield Model(
        name="bumps_behind",
        kind="convention",
        claim="from behind only the surface's normal is turned to the viewer: a bump is one from both sides",
        cites="OpenUSD, previewSurface.glslfx with a frame of screen-space gradients; the reference turns the whole "
        "mapped normal, so that a bump is a dent from behind, as Cycles, Filament, Mitsuba, pbrt-v4 and three.js do",
        options={"bumps_behind": True},
    )
    if any(mirrored(each).any() for each in meshes):
        yield Model(
            name="tangent_handedness",
            kind="fault",
            claim="the second tangent is N x T also where texture coordinates are mirrored: bumps are dents there",
            cites=f"{_MIKKELSEN}; glTF 2.0, section 3.7.2.1: the sign in TANGENT.w",
            options={"tangents": "right_handed"},
        )
    yield Model(
        name="normal_map_in_world_space",
        kind="fault",
        claim="the normal map's vectors are taken for directions in the scene, not in the frame of the tangents",
        cites=_SPECIFICATION,
        options={"tangents": "world"},
    )
    yield Model(
        name="mapped_normal_not_normalised",
        kind="fault",
        claim="the normal map's vectors are used without being normalised",
        cites=f"{_SPECIFICATION}; Phong 1975",
        options={"raw_mapped": True},
    )


def _misread(scene: Scene) -> Iterator[Model]:
    """A map's numbers that are read as others."""
    for name, claim, factors in _MISREAD:
        yield _read_as(name, claim, lambda texture, factors=factors: texture.pixels * factors)  # type: ignore[misc]
    yield _read_as(
        "normal_unscaled",
        "the normal map is used from 0 to 1, without scale 2 and bias -1",
        lambda texture: (texture.pixels + 1.0) / 2.0,
        "; UsdUVTexture: scale, bias",
    )
    used = [scene.textures[index] for index in _maps(scene)]
    if any(each.colour_space == "raw" for each in used):
        yield _read_as(
            "normal_map_as_srgb",
            "the normal map is decoded as sRGB, though it is raw",
            lambda texture: 2.0 * decode_srgb(np.clip((texture.pixels + 1.0) / 2.0, 0.0, 1.0)) - 1.0,
            "; UsdUVTexture: sourceColorSpace",
        )
    if all(of_bytes(each) for each in used):
        yield replace(
            _read_as(
                "normal_map_level",
                "128 of a normal map's bytes is nought: (byte - 128) / 127, where scale 2 and bias -1 give .0039",
                lambda texture: (127.5 * texture.pixels - 0.5) / 127.0,
            ),
            kind="convention",
            cites=f"{_SCHUELER}: map * 255 / 127 - 128 / 127; the specification's scale and bias are the reference",
            when=("normal_level", "128"),
        )


def of_bytes(texture: Texture) -> bool:
    """Whether all that ``texture`` says is what bytes say with scale 2 and bias -1."""
    texels = 127.5 * (texture.pixels + 1.0)
    return bool(np.abs(texels - np.round(texels)).max(initial=0.0) <= 127.5 * ON_BYTES)


def _read_as(name: str, claim: str, read: Callable[[Texture], npt.NDArray[np.float64]], more: str = "") -> Model:
    """The fault of reading every normal map by ``read``."""

    def edit(scene: Scene) -> Scene:
        which = _maps(scene)
        changed = (
            replace(each, pixels=read(each)) if index in which else each for index, each in enumerate(scene.textures)
        )
        return replace(scene, textures=tuple(changed)) if which else scene

    return Model(name=name, kind="fault", claim=claim, cites=f"{_SPECIFICATION}{more}", edit=edit)


def _maps(scene: Scene) -> set[int]:
    """The textures of ``scene`` that are normal maps."""
    return {each.preview.normal_map for each in scene.materials if each.preview is not None} - {-1}
