"""Scene: what a renderer is asked to draw, as plain arrays.

World space is right-handed and metres-free: lengths are the stage's own units, and colours are linear, scene-referred
RGB with Rec. 709 primaries. All arrays are float64 and C-contiguous, and not to be written to.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Literal

import numpy as np
import numpy.typing as npt

from notabug.scenes_usd.digest import fed
from notabug.scenes_usd.once import once
from notabug.scenes_usd.view import AS_IT_IS, View, as_text

Wrap = Literal["repeat", "clamp", "mirror", "black"]
Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int32]


@dataclass(frozen=True, slots=True)
class Card:
    """A scene's card: customData ``notabug`` on the default prim (see docs of the scene contract)."""

    artifact_class: str
    claim: str
    requires: frozenset[str] = frozenset()
    figure: str = ""
    cites: str = ""
    intent: str = ""  # path of the guide prim that the picture is meant to show; "" where meshes mean themselves


@dataclass(frozen=True, slots=True, eq=False, weakref_slot=True)
class Texture:
    """A bilinear texture.

    ``pixels`` is (h, w, 3), linear, row 0 at the top of the picture, i.e. at v = 1. ``colour_space`` is that of the
    file: ``raw`` or ``sRGB``; ``pixels`` are decoded. Beyond 0..1 an axis repeats the picture, repeats its last texel
    (``clamp``), has every second picture mirrored, or is ``black``; what is filtered at a border mixes with that.
    """

    path: Path
    pixels: Floats
    wrap_s: Wrap = "repeat"
    wrap_t: Wrap = "repeat"
    colour_space: Literal["raw", "sRGB"] = "raw"


@dataclass(frozen=True, slots=True)
class Preview:
    """What UsdPreviewSurface adds to a diffuse colour, as its specification and previewSurface.glslfx have it.

    F0 and F90 are ((1 - ior) / (1 + ior))^2 and 1, towards the diffuse colour by ``metallic``; or ``specular`` and 1
    with ``specular_workflow``. F = F0 + (F90 - F0)(1 - V.H)^5 (Schlick), D is GGX of alpha = roughness^2.
    Radiance = emission + sum over lights of shadow * E * N.L * (diffuse * (1 - F)(1 - metallic) / pi +
    D * G * F / (4 N.L N.V)), and the last term again for the clearcoat, whose F0 and F90 are those of the ior.
    Direct light only: nothing is seen in these surfaces, and what they emit lights nothing.

    ``masking`` is G: Smith's of both directions multiplied, Smith's of both as one (height-correlated), or what
    previewSurface.glslfx has, Schlick's fit with k = alpha / 2. Each ``_map`` is an index into Scene.textures that
    replaces the constant, or -1: of metallic and roughness all channels are alike; of normals the texels are vectors in
    the frame (dP/du, dP/dv, N).
    """

    specular_workflow: bool = False
    metallic: float = 0.0
    roughness: float = 0.5
    ior: float = 1.5
    clearcoat: float = 0.0
    clearcoat_roughness: float = 0.01
    specular: tuple[float, float, float] = (0.0, 0.0, 0.0)
    emission: tuple[float, float, float] = (0.0, 0.0, 0.0)
    masking: Literal["separable", "correlated", "schlick"] = "separable"
    metallic_map: int = -1
    roughness_map: int = -1
    emission_map: int = -1
    normal_map: int = -1

    @property
    def maps(self) -> tuple[int, int, int, int]:
        return self.metallic_map, self.roughness_map, self.emission_map, self.normal_map


@dataclass(frozen=True, slots=True)
class Placing:
    """A UsdTransform2d: (u, v) = (s, t) * scale, turned by ``rotation`` degrees counter-clockwise, + translation."""

    scale: tuple[float, float] = (1.0, 1.0)
    rotation: float = 0.0
    translation: tuple[float, float] = (0.0, 0.0)


CUTOFF_ROUNDED = 2.0**-21
"""Of an opacity: what four roundings to float32, of a texel, its weights and a cutoff, may move it by."""


@dataclass(frozen=True, slots=True, eq=False)
class Material:
    """Lambert plus a Phong or Blinn lobe, mirror and transmission; every colour is a (3,) tuple.

    Radiance = sum over lights of shadow * E * (diffuse * N.L + specular * lobe * [N.L if cosine_weighted]) / pi
    where N.L > 0, + mirror * L(reflected) + transmission * L(refracted).

    ``opacity_map`` replaces ``opacity``. With a ``cutoff`` the surface is whole where the map says as much or more, and
    elsewhere there is none.
    """

    path: str
    diffuse: tuple[float, float, float]
    texture: int = -1  # index into Scene.textures; replaces ``diffuse``
    specular: tuple[float, float, float] = (0.0, 0.0, 0.0)
    exponent: float = 1.0
    lobe: Literal["phong", "blinn"] = "phong"
    cosine_weighted: bool = False
    mirror: tuple[float, float, float] = (0.0, 0.0, 0.0)
    transmission: tuple[float, float, float] = (0.0, 0.0, 0.0)
    ior: float = 1.0
    opacity: float = 1.0
    preview: Preview | None = field(
        default=None, metadata={"left out": None}
    )  # of specular, mirror and glass none then
    placing: Placing | None = field(
        default=None, metadata={"left out": None}
    )  # by which the uv of its meshes are moved
    opacity_map: int = field(default=-1, metadata={"left out": -1})  # a texture of equal channels, or -1
    cutoff: float = field(
        default=0.0, metadata={"left out": 0.0}
    )  # of the map: opacityThreshold, 0 where there is none

    @property
    def fades(self) -> bool:
        """Whether what lies behind may show through the surface itself: it is clear, not cut."""
        return self.opacity < 1 or (self.opacity_map >= 0 and not self.cutoff)

    @property
    def textures(self) -> frozenset[int]:
        """The textures that it shows."""
        maps = self.preview.maps if self.preview else ()
        return frozenset({self.texture, self.opacity_map, *maps} - {-1})

    @property
    def least_opacity(self) -> float:
        """What the map must say at least where the surface is whole: the cutoff, less a rounding; 0 without one.

        Texels and the cutoff are rounded to float32, by a file or a renderer: 128 of 255 is as much as 0.5019608.
        """
        return self.cutoff * (1.0 - CUTOFF_ROUNDED)

    @property
    def is_clear(self) -> bool:
        """Whether the surface is not opaque everywhere."""
        return self.opacity < 1 or self.opacity_map >= 0

    def renumbered(self, shown: Sequence[int]) -> Material:
        """The material among the textures ``shown`` alone, by their places there."""
        places = {index: place for place, index in enumerate(shown)}
        preview = self.preview
        if preview is not None:
            metallic, roughness, emission, normal = (places.get(index, -1) for index in preview.maps)
            preview = replace(
                preview, metallic_map=metallic, roughness_map=roughness, emission_map=emission, normal_map=normal
            )
        texture, opacity_map = (places.get(index, -1) for index in (self.texture, self.opacity_map))
        return replace(self, texture=texture, opacity_map=opacity_map, preview=preview)

    @property
    def sends_on(self) -> bool:
        """Whether rays go on from the surface: it mirrors, or lets light through."""
        return any(self.mirror) or any(self.transmission) or self.is_clear


@dataclass(frozen=True, slots=True, eq=False, weakref_slot=True)
class Mesh:
    """A polygon mesh in world space.

    Attributes
    ----------
    points : (p, 3) world positions.
    counts : (f,) corners per face, each >= 3.
    corners : (c,) index into ``points`` per face corner, c = sum(counts), counter-clockwise seen from outside (the
        reader has already turned left-handed and mirrored meshes round).
    normals : (c, 3) unit normals per face corner, world space (by the inverse transpose), or None: flat facets.
    uv : (c, 2) texture coordinates per face corner, v = 0 at the bottom, or None.
    to_world : (4, 4) the prim's local-to-world matrix, row vectors (USD's convention: p_world = p_local @ to_world).
    """

    path: str
    points: Floats
    counts: Ints
    corners: Ints
    material: int
    normals: Floats | None = None
    uv: Floats | None = None
    to_world: Floats = field(default_factory=lambda: np.eye(4))

    @property
    def has_ngons(self) -> bool:
        return bool((self.counts > 3).any())


@dataclass(frozen=True, slots=True, eq=False)
class Sphere:
    """An analytic sphere of ``radius`` about the local origin; ``to_world`` (4, 4), row vectors, may be any affine."""

    path: str
    radius: float
    material: int
    to_world: Floats


@dataclass(frozen=True, slots=True)
class ShadowMap:
    """How the scene asks a renderer with shadow maps to make a light's; it moves no pixel of the reference.

    Attributes
    ----------
    resolution : texels along the map's edge.
    bias : by how much what the map holds must be nearer to the light than a point that it shadows, in the scene's unit.
    normal_bias : by how much a point is moved along its normal before the map is asked, in the scene's unit.
    """

    resolution: int
    bias: float = 0.0
    normal_bias: float = 0.0


@dataclass(frozen=True, slots=True, eq=False)
class Emitter:
    """What gives a light its size: a unit shape whose axes are the rows of ``axes`` (3, 3) in world space.

    ``sphere``: the ball of radius 1. ``rect``: |x|, |y| <= 1 at z = 0, and ``disk``: x^2 + y^2 <= 1 at z = 0, both to
    the side of -z only. ``cylinder``: y^2 + z^2 = 1, |x| <= 1, outward, without its ends. ``sun``: directions within
    ``half_angle`` (radians) of the light's. ``dome``: every direction; its radiance is multiplied by a ``texture``, if
    it has one, a latitude-longitude map: the upper row is +y, the middle +z, a quarter from the left edge +x.

    ``normalized`` and ``exposure`` are what the file says; the light's radiance has both in it already.
    """

    axes: Floats = field(default_factory=lambda: np.eye(3))
    half_angle: float = 0.0
    normalized: bool = False
    exposure: float = 0.0
    texture: Texture | None = field(default=None, metadata={"left out": None})


@dataclass(frozen=True, slots=True)
class Shaping:
    """A beam about a light's direction, as UsdLux ShapingAPI has it: ``cone`` is in degrees, beyond it nothing shines.

    Within it the radiance is multiplied by 1 - smoothstep of the angle from (1 - softness) cone to cone, and by
    lerp(tint, 1; |cosine|^focus).
    """

    cone: float = 180.0
    softness: float = 0.0
    focus: float = 0.0
    tint: tuple[float, float, float] = (0.0, 0.0, 0.0)


DELTA = ("point", "distant")  # the kinds of light without a size


@dataclass(frozen=True, slots=True, eq=False)
class Light:
    """A light, of which direct light only is drawn: it is no geometry, no ray sees it, and it casts no shadow.

    ``point``: at ``position`` with radiant ``intensity`` [W/sr] per channel: E = intensity / d^2.
    ``distant``: shining along unit ``direction`` with irradiance ``intensity`` [W/m^2] at normal incidence.
    Of every other kind ``intensity`` is the radiance [W/m^2/sr] that each of its points sends in each direction, and
    ``emitter`` its shape about ``position``; see ``Emitter``.

    ``diffuse`` and ``specular`` multiply what diffuse surfaces and highlights make of it; ``shaping`` is a beam.
    ``unlit`` are the paths of the objects that it does not light, ``unshadowing`` of those that do not block it.
    """

    path: str
    kind: Literal["point", "distant", "sphere", "rect", "disk", "cylinder", "sun", "dome"]
    intensity: tuple[float, float, float]
    position: tuple[float, float, float] = (0.0, 0.0, 0.0)
    direction: tuple[float, float, float] = (0.0, 0.0, -1.0)
    shadow_map: ShadowMap | None = field(default=None, metadata={"left out": None})
    emitter: Emitter | None = field(default=None, metadata={"left out": None})
    diffuse: float = field(default=1.0, metadata={"left out": 1.0})
    specular: float = field(default=1.0, metadata={"left out": 1.0})
    shaping: Shaping | None = field(default=None, metadata={"left out": None})
    unlit: tuple[str, ...] = field(default=(), metadata={"left out": ()})
    unshadowing: tuple[str, ...] = field(default=(), metadata={"left out": ()})

    @property
    def is_plain(self) -> bool:
        """Whether it is a point or distant light, shines alike in every direction, and on everything alike."""
        alike = self.diffuse == self.specular == 1.0 and not self.is_linked
        return self.emitter is None and alike and self.shaping is None

    @property
    def is_linked(self) -> bool:
        """Whether there is an object that it does not light, or that casts no shadow of it."""
        return bool(self.unlit or self.unshadowing)


@dataclass(frozen=True, slots=True, eq=False)
class Camera:
    """A pinhole, or an orthographic camera, looking along its local -z with +y up.

    ``to_world`` (4, 4) row vectors, rotation and translation only. The ray through raster position (x, y), y down, of a
    W x H picture goes through the local point ((2x/W - 1 + shift_x) tan_x, (1 - 2y/H + shift_y) tan_y, -1): from the
    origin, or where the camera is ``orthographic`` along -z, starting at z = 0. Pixel centres are at +0.5.
    """

    path: str
    to_world: Floats
    tan_x: float  # half the horizontal aperture over the focal length; orthographic: half the width that is seen
    tan_y: float
    near: float
    far: float
    # by how many halves of the picture its middle lies beside the axis, to the right and up
    shift_x: float = field(default=0.0, metadata={"left out": 0.0})
    shift_y: float = field(default=0.0, metadata={"left out": 0.0})
    orthographic: bool = field(default=False, metadata={"left out": False})

    def spans(self, depth: npt.NDArray[np.floating] | float) -> npt.NDArray[np.floating] | float:
        """What ``tan_x`` and ``tan_y`` are multiplied by at ``depth`` along the axis for half of what is seen."""
        return np.ones_like(depth) if self.orthographic else depth


Object = Mesh | Sphere


@dataclass(frozen=True, slots=True, eq=False, weakref_slot=True)
class Scene:
    """One stage with one choice of variants. ``objects`` keep the stage's order (ties go to the first)."""

    id: str  # "<class>/<scene>", or the file's stem for a scene outside the corpus
    path: Path
    variants: Mapping[str, str]
    card: Card
    camera: Camera
    width: int
    height: int
    objects: tuple[Object, ...]
    lights: tuple[Light, ...]
    materials: tuple[Material, ...]
    textures: tuple[Texture, ...] = ()
    intent: Mesh | None = None  # the guide mesh, when the card names one
    notes: tuple[str, ...] = ()  # what of the file the scene lacks; nothing that moves a pixel of it
    view: View = AS_IT_IS  # which picture of the stage was asked for
    left_out: tuple[str, ...] = ()  # prims that a layer of ``notabug adapt`` leaves out, for they cannot be drawn
    adapted: Literal["", "picture", "scene"] = ""  # in memory: which picture is meant, or what is drawn too

    @property
    def variant(self) -> str:
        """The choice, variants and view, as it is told and kept: see ``view.as_text``."""
        return as_text(self.variants, self.view)

    @property
    def meshes(self) -> Iterator[Mesh]:
        return (each for each in self.objects if isinstance(each, Mesh))

    @property
    def shown_textures(self) -> frozenset[int]:
        """The textures that an object shows: of a colour, of numbers or of normals."""
        return frozenset().union(*(self.materials[shape.material].textures for shape in self.objects))

    @property
    def spheres(self) -> Iterator[Sphere]:
        return (each for each in self.objects if isinstance(each, Sphere))

    def as_intended(self) -> Scene:
        """The scene with the intent in the place of what stands for it: every object under the intent's parent."""
        if self.intent is None:
            return self
        parent = self.intent.path.rsplit("/", 1)[0] + "/"
        first = next((i for i, each in enumerate(self.objects) if each.path.startswith(parent)), len(self.objects))
        kept = [each for each in self.objects if not each.path.startswith(parent)]
        kept.insert(first, self.intent)
        return replace(self, objects=tuple(kept), intent=None)

    def digest(self) -> str:
        """A hash of everything that can move a pixel: geometry, materials, lights, camera, size, texture contents.

        Places of files do not enter, so a moved checkout keeps its cache.
        """
        return _digest(self)


@once
def _digest(scene: Scene) -> str:
    parts = (scene.camera, scene.width, scene.height, scene.objects, scene.lights, scene.materials, scene.textures)
    return fed((*parts, scene.intent))
