"""What an adapter is: it draws a Scene with one renderer and declares what the judge must know about that renderer."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, Protocol

import numpy as np
import numpy.typing as npt

from notabug.references.models.acne import ROUNDOFF, SPHERE_C, C
from notabug.references.models.model import UNSAID
from notabug.scenes_usd.errors import NotabugError
from notabug.scenes_usd.scene import Scene

Pixels = npt.NDArray[np.float32]
Filter = Literal["point", "box", "tent", "gaussian", "unknown"]


class RendererMissingError(NotabugError):
    """The renderer is not installed: the message says how to install it."""


class RendererError(NotabugError):
    """The renderer ran and failed: no image, a crash, a time-out. ``log`` holds what it printed."""

    log: str = ""


class UnsupportedError(NotabugError):
    """The scene needs a capability that the adapter does not have."""


@dataclass(frozen=True, slots=True)
class Declaration:
    """What the judge must know about a renderer's pictures.

    Attributes
    ----------
    precision : arithmetic of the renderer's intersections.
    hit_error : by how much a hit point may be off its surface, in parts of |O| + t + |x|; below 0: by 8 roundings; 0
        where no ray starts on a surface.
    filter, radius : pixel filter and its radius in pixels (0.5 for box, 0 for point).
    quantum : the step of the output's encoding at 1.0 (1/65535 for 16-bit integers, 2**-11 relative for half floats).
    relative_quantum : True where the step scales with the value (floating-point output).
    shared_exponent : True where the step scales with the largest channel of the pixel, and may be lost whole (RGBE).
    white : the largest value that the output can hold: 1 in integer formats.
    noisy : True where another seed gives another picture, False where it does not, None where that is unknown.
    samples : of a pixel in one picture; 0 where that is unknown.
    ngon_split : how n-gons are cut before the renderer sees them: ``02`` joins corner 0 and 2, ``13`` corner 1 and 3,
        ``shorter`` the nearer pair; ``fan`` makes a fan from the first corner whatever the face's shape;
        "" where n-gons keep their bilinear map; ``unknown`` for a picture of unknown making.
    silhouette : what becomes of an interpolated normal that faces away from the viewer.
    behind_facet : whether a facet is ``lit`` by a light behind its plane that its interpolated normals face and that
        nothing hides, or ``black``. On a closed mesh the mesh itself hides such a light.
    mapped_away : what becomes of the normal that a normal map says where it faces away from the viewer: it is kept
        (``keep``), turned about the surface's by half a turn (``flip``), the surface is ``black``, or highlights have
        it ``raised`` until its mirror image of the view leaves the facet.
    bump_light : a light behind a surface does not reach a mapped normal that faces it (``cut``), or does (``lit``); or
        its part falls smoothly by Estevez's function (``softened``), of diffuse light alone (``softened_diffuse``), or
        by Chiang's (``tamed``).
    tangents : a normal map's frame is that of each ``triangle``'s dP/du, of tangents ``interpolated`` between corners,
        or of the gradients of the coordinates (``cotangent``).
    normal_level : which byte of a normal map is nought: ``127.5``, as scale 2 and bias -1 have it, or ``128``.
    depth : format of the depth buffer; near and far are the camera's. "" where there is none that can show; where it is
        ``unknown`` any of the formats, or rays, may decide which of two near surfaces is seen.
    coincident : which of surfaces in one place is seen, where rounding does not decide: the ``first`` of the scene or
        ``another``.
    opacity_shadow : at each crossing of a surface with opacity a shadow ray keeps 1 - opacity of its light
        (``attenuate``), or none (``opaque``).
    glass_shadow : at each crossing of a surface with transmission a shadow ray keeps nothing (``opaque``), the
        transmission (``attenuate``), or all of its light (``none``); it is never refracted.
    total_reflection : the weight of the mirror ray where glass reflects totally: mirror + transmission
        (``transmission``), or 1 whatever they are (``whole``).
    glass_side : whether a ray enters glass or leaves it is taken from the side of the facet that it meets
        (``facet``) or counted along the ray.
    texture_filter : how a texture is read between its texels.
    opacity_filter : a colour and the alpha of its picture are filtered each for itself (``separate``), or ``together``:
        the colours as multiplied by their alpha.
    texture_border : where a texture repeats its last texels mix with its first (``wrapped``), or are ``clamped`` before
        they are filtered.
    texture_decoding : an sRGB texture is decoded ``before`` its texels are mixed, or ``after``.
    texture_bits : the weights of texels are multiples of 2 to this power's inverse; 0 where they are not rounded.
    uv_seam : points that have several texture coordinates are ``split``, or have the ``first`` one or the ``last`` that
        a face gives them.
    lobe : the lobe of highlights: as the scene's material has it, or always the one named, at the same exponent or at
        the matching one (Phong's n is close to Blinn's 4n).
    normalised : highlights are multiplied by nothing (``no``), (n + 2)/2, (n + 8)/8 or (n + 2)/8 (``n2over8``).
    masking : which of its masking functions GGX has: Smith's of both directions multiplied (``separable``), of both as
        one (``correlated``), or Schlick's fit (``schlick``).
    interpolation : what is interpolated over smooth meshes: normals (``phong``), colours (``gouraud``) or nothing
        (``flat``).
    gouraud_shadows : where interpolated colours are shadowed: with the light at the ``corners``, at each point
        (``pixels``), or not at all (``none``).
    gouraud_meshes : which meshes are lit at their corners: ``smooth`` ones, or ``all``, flat ones with the normals of
        their faces, as OpenGL's fixed pipeline does. A quad's colours are bilinear unless ``ngon_split`` cuts it.
    highlight : highlights are cut off and weighted as the material has it, always times N.L, or not cut off.
    shadows : whether objects ``cast`` shadows; ``none`` for a renderer that shoots no shadow rays and has no shadow
        maps. Where that is ``unknown`` they do, but a normal that was turned may be lit without asking.
    shadow_algorithm : whether shadows are cast by ``rays`` or looked up in shadow maps (``map``).
    shadow_resolution : texels along a shadow map's edge; -1: as the scene's lights say, else unknown.
    shadow_width : what a distant light's map is wide, in the scene's unit; -1: no more than the diagonal of the
        scene's bounds. A point light's map has six faces of a right angle each.
    shadow_bias, shadow_normal_bias : by how much what a map holds must be nearer to the light than a point that it
        shadows, and by how much the point is moved along its normal before, both in the scene's unit; -1: as the
        scene's lights say, else unknown.
        Of shadow rays, which start on the surface where neither is said: what they meet nearer than shadow_bias is
        passed over, and they start shadow_normal_bias along the normal.
    shadow_filter : a point is in shadow or not by its ``nearest`` texel, or in part by those around it (``linear``).
    light_grid : by how many points along each side a rectangular light is drawn, the same from everywhere: the middles
        of n x n equal parts of it; 0: it is integrated, or sampled anew at each place; -1: unknown.
    light_grid_shadow : of these points, ``each`` is seen or not by itself, or the light of all of them is multiplied by
        the ``share`` of them that is seen.
    bounces : how many mirror and refracted rays it follows one after the other, 0 to 8; -1: unknown. 8 is the contract.
    bounces_count : what counts as a bounce: mirror and refracted rays (``reflections``), or straight passages through
        opacity as well (``passages``).
    crossings : of transparent surfaces that lie nearer to each other than ``epsilon``, or in one place, ``each`` is
        crossed by a ray that goes on, or one alone (``once``).
    epsilon : within which a ray passes over what it meets after it has started or crossed a surface, in the scene's
        unit; -1: unknown.
    coordinates : numbers in which the renderer holds points of the world, camera and lights: far from the origin
        ``float32`` moves them.
    subpixel_bits : 2 to this power points a pixel's edge has on which a rasteriser puts the corners of triangles; 0
        where they are not rounded.
    spheres : ``exact``, or given to the renderer as the ``mesh`` that ``adapters/spheres.py`` makes of each, and judged
        as that.
    sphere_roots : how a sphere's hits are computed: from the difference of large squares (``discriminant``), or in a
        form that does not cancel (``stable``).
    """

    precision: Literal["float32", "float64"]
    filter: Filter
    radius: float
    quantum: float
    relative_quantum: bool
    noisy: bool | None
    ngon_split: Literal["", "02", "13", "shorter", "fan", "unknown"] = ""
    silhouette: Literal["keep", "flip", "black", "unknown"] = "unknown"
    behind_facet: Literal["lit", "black", "unknown"] = "unknown"
    mapped_away: Literal["keep", "flip", "black", "raised", "unknown"] = "unknown"
    bump_light: Literal["cut", "lit", "softened", "softened_diffuse", "tamed", "unknown"] = "unknown"
    tangents: Literal["triangle", "interpolated", "cotangent", "unknown"] = "unknown"
    normal_level: Literal["127.5", "128", "unknown"] = "unknown"
    depth: Literal["", "fixed16", "fixed24", "float32", "reversed32", "unknown"] = ""
    coincident: Literal["first", "another", "unknown"] = "first"
    opacity_shadow: Literal["attenuate", "opaque", "unknown"] = "unknown"
    glass_shadow: Literal["opaque", "attenuate", "none", "unknown"] = "unknown"
    total_reflection: Literal["transmission", "whole", "unknown"] = "unknown"
    glass_side: Literal["facet", "counted", "unknown"] = "unknown"
    texture_filter: Literal["bilinear", "nearest", "unknown"] = "unknown"
    opacity_filter: Literal["separate", "together", "unknown"] = "unknown"
    texture_border: Literal["wrapped", "clamped", "unknown"] = "wrapped"
    texture_decoding: Literal["before", "after", "unknown"] = "before"
    texture_bits: int = 0
    uv_seam: Literal["split", "first", "last", "unknown"] = "split"
    lobe: Literal["authored", "phong", "blinn", "phong_matched", "blinn_matched", "unknown"] = "authored"
    masking: Literal["separable", "correlated", "schlick", "unknown"] = "unknown"
    interpolation: Literal["phong", "gouraud", "flat", "unknown"] = "phong"
    normalised: Literal["no", "n2", "n8", "n2over8", "unknown"] = "no"
    highlight: Literal["authored", "cosine", "uncut", "unknown"] = "authored"
    gouraud_shadows: Literal["corners", "pixels", "none", "unknown"] = "unknown"
    gouraud_meshes: Literal["smooth", "all", "unknown"] = "smooth"
    shadows: Literal["cast", "none", "unknown"] = "cast"
    shadow_algorithm: Literal["rays", "map", "unknown"] = "rays"
    shadow_resolution: int = -1
    shadow_width: float = -1.0
    shadow_bias: float = -1.0
    shadow_normal_bias: float = -1.0
    shadow_filter: Literal["nearest", "linear"] = "nearest"
    light_grid: int = 0
    light_grid_shadow: Literal["each", "share", "unknown"] = "unknown"
    bounces: int = 8
    bounces_count: Literal["reflections", "passages", "unknown"] = "unknown"
    crossings: Literal["each", "once", "unknown"] = "unknown"
    epsilon: float = -1.0
    coordinates: Literal["float32", "float64", "unknown"] = "unknown"
    spheres: Literal["exact", "mesh"] = "exact"
    sphere_roots: Literal["discriminant", "stable", "unknown"] = "unknown"
    subpixel_bits: int = 0
    hit_error: float = -1.0
    samples: int = 0
    white: float = math.inf
    shared_exponent: bool = False

    def __post_init__(self) -> None:
        if self.hit_error < 0:
            object.__setattr__(self, "hit_error", C * ROUNDOFF[self.precision])
        if self.shadow_resolution == 0:  # a map without texels is none that anybody could mean
            object.__setattr__(self, "shadow_resolution", -1)

    @property
    def resolves(self) -> str:
        """What decides which of two near surfaces is seen: the depth buffer, or where there is none the rays."""
        if self.depth == "unknown":
            return self.depth
        return f"depth_{self.depth}" if self.depth else f"ray_{self.precision}"

    @property
    def sphere_error(self) -> float:
        """By what share of |O - C|^2 / r a hit on a sphere may be off, beyond ``hit_error``."""
        if self.sphere_roots == "stable" or self.hit_error == 0.0:
            return 0.0
        return SPHERE_C * ROUNDOFF[self.precision]

    def says(self, feature: str) -> str:
        """What is declared of ``feature``, as text; ``unknown`` where nothing is."""
        value = getattr(self, feature)
        return UNSAID if isinstance(value, int | float) and value < 0 else f"{value}"


@dataclass(frozen=True, slots=True)
class Found:
    """An installed renderer: where it is and which version, and remarks for ``notabug doctor``.

    ``key`` is whatever else a finished result depends on: settings, the contents of a program without a version.
    """

    version: str
    where: str
    remarks: tuple[str, ...] = ()
    key: str = ""


@dataclass(frozen=True, slots=True)
class Apart:
    """Capabilities that a renderer has one by one, but not together in one scene, and ``why``."""

    words: frozenset[str]
    why: str = ""

    def __str__(self) -> str:
        return " with ".join(sorted(self.words))


@dataclass(frozen=True, slots=True)
class Quality:
    """How well to render: ``samples`` per pixel (0: the adapter's default) for each seed in ``seeds``.

    A deterministic adapter draws one picture whatever the seeds. ``threads`` 0 means all cores.
    """

    samples: int = 0
    seeds: tuple[int, ...] = (0, 1, 2, 3)
    threads: int = 0
    timeout: float = 600.0  # seconds of wall time for the whole job


@dataclass(frozen=True, slots=True)
class Render:
    """One picture that came back: a linear float32 EXR at ``image``, and how it was made."""

    image: Path
    seed: int
    samples: int
    seconds: float  # wall time of the renderer, process start included, shared equally among a job's seeds
    command: tuple[str, ...] = ()
    log: str = ""


class Adapter(Protocol):
    """Draws scenes with one renderer. An adapter is one file that ends by registering itself.

    ``capabilities`` answers a card's ``requires`` and the scene's content: see ``adapters.registry.needs``. An adapter
    may also have ``not_together``, a tuple of ``Apart``: which of them it does not have together.
    """

    @property
    def name(self) -> str: ...

    @property
    def capabilities(self) -> frozenset[str]: ...

    @property
    def install(self) -> str:
        """One line: how to get the renderer."""
        ...

    def declaration(self, quality: Quality) -> Declaration: ...

    def find(self) -> Found:
        """Where the renderer is; raises RendererMissingError with the install line where it is not."""
        ...

    def render(self, scene: Scene, out: Path, quality: Quality) -> tuple[Render, ...]:
        """Draw ``scene`` into files in the folder ``out`` (which exists), one per seed.

        Raises UnsupportedError, RendererMissingError or RendererError; never returns a picture it did not make now.
        """
        ...
