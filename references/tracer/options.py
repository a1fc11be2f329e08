"""The tracer's switches: what a model may change of the way in which the reference is drawn."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

from notabug.scenes_usd.scene import Scene


@dataclass(frozen=True, slots=True)
class Options:
    """The tracer's switches; the defaults are the reference's conventions.

    shadows : ``forgiving`` spares a smooth mesh the shadows of its own facets, ``facets`` does not; of ``planes`` a
        light behind the plane of a facet does not reach it either, whatever is in its way; ``none`` casts none.
    normals : interpolated normals are ``unit`` or left ``raw``, i.e. not normalised again.
    silhouette : an interpolated normal that faces away from the viewer is kept, flipped, or painted black; or flipped
        by a renderer without shadow rays, ``flip_lit``: the light that it is turned to is not blocked.
    affine : interpolate uv in screen space (n-gons must have been cut into triangles).
    raw_vectors : highlights are computed from vectors that were not normalised.
    uncut : highlights go on where N.L < 0.
    mirrored_highlight : a highlight seen in a mirror uses the view vector of the mirror ray, its ``own``, of the
        ``primary`` ray, or is ``lost``.
    retroreflection : a mirror ray goes back where it came from.
    unreversed : left and right are exchanged in what a mirror shows, y being up.
    transparent_shadows : a surface with opacity ``attenuate``s a shadow ray by 1 - opacity and glass blocks it, both
        are ``opaque``, or glass lets all light through, ``free``, or its share of it, ``glass``.
    whole_reflection : total internal reflection sends on all of the light, whatever mirror and transmission are.
    ties : of surfaces that float32 points cannot tell apart the ``nearest`` by rounding wins, or the ``first`` in the
        scene; or of those within ``resolution`` of it ``another`` one, the first in the scene or the ``next`` along the
        ray; or the first, and it is ``unlit`` where there is another. Unless the nearest wins, coincident surfaces do
        not shadow each other.
    resolution, near_resolution : what a renderer cannot tell apart along a ray: the first times distance and size, plus
        the second times the squared distance (a depth buffer's).
        Two faults: coincident surfaces have their ``blend``, or there is a ``hole``.
    self_reflection, self_refraction : a mirror or refracted ray that leaves the smooth surface but runs beneath its own
        facet meets the facets beside it, instead of passing them.
    counted_glass : whether a ray enters glass or leaves it follows from how often it has passed a surface of it, not
        from the side of the facet that it meets.
    gouraud : a smooth mesh is lit at the corners of its faces, and the colours are interpolated: those of a quad
        bilinearly, unless it was cut into triangles. gouraud_shadows : they are shadowed at the ``corners``, at each
        point (``pixels``), or not at all (``none``).
    falloff : a point light's irradiance falls with the ``square`` of the distance, with the distance (``linear``) or
        not at all (``none``).
    shadow_rays : end at the light, are ``unbounded``, or pass through faces that they meet from behind (``culled``).
    lost_reflection : total internal reflection sends on nothing.
    acne : light is lost where no reasonable epsilon prevents it, at hits whose relative error is ``hit_error``, or
        where an ``absolute`` epsilon is too small for it: one bit for each light, -1 for all. On spheres
        ``sphere_error`` times |O - C|^2 / r is added: what a difference of squares of that size is off by.
    shadow_gap : a shadow ray passes over what it meets within this distance of where it starts and of its last
        crossing: surfaces nearer to each other count once. gap_loses : that crossing alone (``crossings``), or the one
        where the ray leaves the same object again, too (``objects``).
    ray_gap : so does a mirror ray, a refracted one, and one that goes straight on, of where it starts.
    texels : a texture is read ``bilinear`` between its texels, or the ``nearest`` one counts.
    texel_border : where a texture repeats its last texels mix with its first (``wrapped``), or coordinates are brought
        into the picture first and its border is ``clamped``.
    texel_bits, texel_up : the weights of texels are multiples of 2^-texel_bits (0: any number), rounded down, or up
        across the picture (1), along it (2), both ways (3).
    texel_decoding : an sRGB texture is decoded ``before`` its texels are mixed, or ``after``: then texels are encoded.
    negative_uv : three faults. Negative coordinates are ``mirrored`` or ``clamped`` at 0; or a coordinate is rounded
        towards zero where it should be rounded down: ``truncated`` where rows count from the top, else
        ``truncated_up``.
    bounces, counted_passages : how many mirror and refracted rays a path may have one after the other; straight
        passages through opacity count as well, or do not.
    start : how a ray leaves a surface: see start.py. ``epsilon`` is the length of ``absolute``, and what ``relative``
        multiplies with coordinates and distance.
    refine : the ray is shot back at the facet's plane to correct the hit (Woo, Pearce and Ouellette 1996).
    offset : shadow rays of smooth meshes start this many sagittas outside the facet (Snyder and Barr 1987).
    mapped_away : where a mapped normal faces away from the viewer it is kept, and no facet reflects; it is turned about
        the surface's normal by half a turn (``flip``); the surface is ``black``; or highlights have it ``raised`` until
        its mirror image of the view leaves the facet.
    bump_light : a light behind the surface's normal does not reach a mapped normal that faces it (``cut``), or does
        where nothing is in its way (``lit``). Or the cut comes gradually: light is ``softened`` by Estevez's function,
        or that of the diffuse part alone (``softened_diffuse``), or ``tamed`` by Chiang's.
    tangents : a normal map's frame is that of each ``triangle``'s dP/du; that of tangents at the corners,
        ``interpolated``; or that of the coordinates' gradients, not square to each other (``cotangent``). Two faults:
        the second tangent is N x T, whatever side coordinates grow on (``right_handed``); the map is taken for vectors
        in ``world`` space. raw_mapped : a third: mapped normals are not normalised.
        bumps_behind : from behind N alone is turned to the viewer, so that a bump is one from both sides.
    shadow_map : what a shadow map, in the place of shadow rays, may do to the lights ``map_lights`` (one bit for each,
        -1 for all): it loses them on a surface that it holds against itself (``acne``) or against something else beside
        the point (``dark_edge``), lets them through where what is in the way is nearer than the bias (``detached``) or
        not in the way beside the point (``lit_edge``). Two faults: its comparison is ``reversed``, or it is ``moved``
        across the light by ``map_right`` and ``map_up``.
    map_cells : texels along its edge. map_width : what a distant light's map is wide; a point light's six are twice the
        distance. map_reach : how far the middle of a texel that counts may lie beside the point, in texels. map_bias :
        by how much what it holds must be nearer than the point, which is moved along its normal by map_normal_bias.
        map_error : of coordinates and size, what its depths are off by.
    light_grid : of a rectangular light n x n points stand for it, the same from everywhere: the middles of n x n equal
        parts of it; 0: it is integrated. light_grid_ends : the outermost lie on the light's edges instead.
        light_grid_shared : the light of all points is multiplied by the share of them that is seen, in the place of
        that of each by whether it is.
    light_uncosined : the fault of points of a rectangle or disk that send as much light to every side.
    shadow_lift : shadow rays start so far along the normal from where they leave.
    whole_cutouts : the fault of shadow rays that do not ask where a map cuts a surface away.
    associated : textures of surfaces with a map of opacity have texels that are multiplied by the map's, and what is
        mixed of them is divided by the opacity there, so that no colour of what is cut away bleeds in.
    """

    shadows: Literal["forgiving", "facets", "planes", "none"] = "forgiving"
    normals: Literal["unit", "raw"] = "unit"
    silhouette: Literal["keep", "flip", "black", "flip_lit"] = "keep"
    affine: bool = False
    raw_vectors: bool = False
    uncut: bool = False
    mirrored_highlight: Literal["own", "primary", "lost"] = "own"
    retroreflection: bool = False
    unreversed: bool = False
    transparent_shadows: Literal["attenuate", "opaque", "free", "glass"] = "attenuate"
    ties: Literal["nearest", "first", "another", "unlit", "blend", "hole", "next"] = "first"
    resolution: float = 0.0
    near_resolution: float = 0.0
    whole_reflection: bool = False
    self_reflection: bool = False
    self_refraction: bool = False
    counted_glass: bool = False
    gouraud: bool = False
    gouraud_shadows: Literal["corners", "pixels", "none"] = "corners"
    falloff: Literal["square", "linear", "none"] = "square"
    shadow_rays: Literal["bounded", "unbounded", "culled"] = "bounded"
    lost_reflection: bool = False
    acne: int = 0
    hit_error: float = 0.0
    start: Literal["exact", "none", "absolute", "relative", "error_bound"] = "exact"
    epsilon: float = 0.0
    refine: bool = False
    offset: float = 0.0
    shadow_gap: float = 0.0
    gap_loses: Literal["crossings", "objects"] = "crossings"
    ray_gap: float = 0.0
    sphere_error: float = 0.0
    bounces: int = 8
    counted_passages: bool = False
    texels: Literal["bilinear", "nearest"] = "bilinear"
    mapped_away: Literal["keep", "flip", "black", "raised"] = "keep"
    bump_light: Literal["cut", "lit", "softened", "softened_diffuse", "tamed"] = "cut"
    tangents: Literal["triangle", "interpolated", "cotangent", "right_handed", "world"] = "triangle"
    raw_mapped: bool = False
    bumps_behind: bool = False
    texel_border: Literal["wrapped", "clamped"] = "wrapped"
    texel_bits: int = 0
    texel_up: int = 0
    texel_decoding: Literal["before", "after"] = "before"
    negative_uv: Literal["floor", "mirrored", "clamped", "truncated", "truncated_up"] = "floor"
    shadow_map: Literal["none", "acne", "dark_edge", "detached", "lit_edge", "reversed", "moved"] = "none"
    map_lights: int = -1
    map_width: float = 1.0
    map_cells: float = 1.0
    map_reach: float = 0.0
    map_bias: float = 0.0
    map_normal_bias: float = 0.0
    map_error: float = 0.0
    map_right: float = 0.0
    map_up: float = 0.0
    light_grid: int = 0
    light_grid_ends: bool = False
    light_grid_shared: bool = False
    light_uncosined: bool = False
    shadow_lift: float = 0.0
    whole_cutouts: bool = False
    associated: bool = False

    def for_scene(self, scene: Scene) -> Options:
        """The same, without looking for the first of coincident objects where there is only one."""
        return replace(self, ties="nearest") if self.ties == "first" and len(scene.objects) < 2 else self
