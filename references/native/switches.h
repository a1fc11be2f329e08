// From the options of Python's objects to those of the tracer and of the depth buffer.
#pragma once

#include "arrays.h"
#include "options.h"
#include "raster.h"

namespace notabug {

inline Texels texels_of(const py::handle& from) {
    Texels to;
    to.filter = choice<TexelFilter, 2>(from, "texels", {"bilinear", "nearest"});
    to.border = choice<TexelBorder, 2>(from, "texel_border", {"wrapped", "clamped"});
    to.negative = choice<NegativeUv, 5>(
        from, "negative_uv", {"floor", "mirrored", "clamped", "truncated", "truncated_up"});
    to.decoding = choice<TexelDecoding, 2>(from, "texel_decoding", {"before", "after"});
    to.bits = from.attr("texel_bits").cast<int>();
    to.up = from.attr("texel_up").cast<int>();
    return to;
}

inline Options options_of(const py::handle& from) {
    Options to;
    to.shadows = choice<Shadows, 4>(from, "shadows", {"forgiving", "facets", "planes", "none"});
    to.normals = choice<Normals, 2>(from, "normals", {"unit", "raw"});
    to.silhouette = choice<Silhouette, 4>(from, "silhouette", {"keep", "flip", "black", "flip_lit"});
    to.affine = from.attr("affine").cast<bool>();
    to.raw_vectors = from.attr("raw_vectors").cast<bool>();
    to.uncut = from.attr("uncut").cast<bool>();
    to.mirrored_highlight =
        choice<MirroredHighlight, 3>(from, "mirrored_highlight", {"own", "primary", "lost"});
    to.retroreflection = from.attr("retroreflection").cast<bool>();
    to.unreversed = from.attr("unreversed").cast<bool>();
    to.transparent_shadows =
        choice<TransparentShadows, 4>(from, "transparent_shadows", {"attenuate", "opaque", "free", "glass"});
    to.ties = choice<Ties, 7>(from, "ties", {"nearest", "first", "another", "unlit", "blend", "hole", "next"});
    to.resolution = from.attr("resolution").cast<double>();
    to.near_resolution = from.attr("near_resolution").cast<double>();
    to.whole_reflection = from.attr("whole_reflection").cast<bool>();
    to.self_reflection = from.attr("self_reflection").cast<bool>();
    to.self_refraction = from.attr("self_refraction").cast<bool>();
    to.counted_glass = from.attr("counted_glass").cast<bool>();
    to.gouraud = from.attr("gouraud").cast<bool>();
    to.gouraud_shadows = choice<GouraudShadows, 3>(from, "gouraud_shadows", {"corners", "pixels", "none"});
    to.falloff = choice<Falloff, 3>(from, "falloff", {"square", "linear", "none"});
    to.shadow_rays = choice<ShadowRays, 3>(from, "shadow_rays", {"bounded", "unbounded", "culled"});
    to.lost_reflection = from.attr("lost_reflection").cast<bool>();
    to.acne = from.attr("acne").cast<std::int64_t>();
    to.hit_error = from.attr("hit_error").cast<double>();
    to.start = choice<Start, 5>(from, "start", {"exact", "none", "absolute", "relative", "error_bound"});
    to.epsilon = from.attr("epsilon").cast<double>();
    to.refine = from.attr("refine").cast<bool>();
    to.offset = from.attr("offset").cast<double>();
    to.shadow_gap = from.attr("shadow_gap").cast<double>();
    to.gap_loses = choice<GapLoses, 2>(from, "gap_loses", {"crossings", "objects"});
    to.ray_gap = from.attr("ray_gap").cast<double>();
    to.sphere_error = from.attr("sphere_error").cast<double>();
    to.bounces = from.attr("bounces").cast<int>();
    to.counted_passages = from.attr("counted_passages").cast<bool>();
    to.mapped_away = choice<MappedAway, 4>(from, "mapped_away", {"keep", "flip", "black", "raised"});
    to.bump_light =
        choice<BumpLight, 5>(from, "bump_light", {"cut", "lit", "softened", "softened_diffuse", "tamed"});
    to.tangents = choice<Tangents, 5>(
        from, "tangents", {"triangle", "interpolated", "cotangent", "right_handed", "world"});
    to.raw_mapped = from.attr("raw_mapped").cast<bool>();
    to.bumps_behind = from.attr("bumps_behind").cast<bool>();
    to.texels = texels_of(from);
    to.shadow_map = choice<ShadowMap, 7>(
        from, "shadow_map", {"none", "acne", "dark_edge", "detached", "lit_edge", "reversed", "moved"});
    to.map_lights = from.attr("map_lights").cast<std::int64_t>();
    to.map_width = from.attr("map_width").cast<double>();
    to.map_cells = from.attr("map_cells").cast<double>();
    to.map_reach = from.attr("map_reach").cast<double>();
    to.map_bias = from.attr("map_bias").cast<double>();
    to.map_normal_bias = from.attr("map_normal_bias").cast<double>();
    to.map_error = from.attr("map_error").cast<double>();
    to.map_right = from.attr("map_right").cast<double>();
    to.map_up = from.attr("map_up").cast<double>();
    to.light_grid = from.attr("light_grid").cast<int>();
    to.light_grid_ends = from.attr("light_grid_ends").cast<bool>();
    to.light_grid_shared = from.attr("light_grid_shared").cast<bool>();
    to.light_uncosined = from.attr("light_uncosined").cast<bool>();
    to.shadow_lift = from.attr("shadow_lift").cast<double>();
    to.whole_cutouts = from.attr("whole_cutouts").cast<bool>();
    to.associated = from.attr("associated").cast<bool>();
    return to;
}

inline ZBufferOptions zbuffer_of(const std::string& form, bool last, bool parallel) {
    ZBufferOptions to;
    to.last = last;
    to.parallel = parallel;
    if (form == "exact") {
        to.form = DepthForm::exact;
    } else if (form == "fixed16" || form == "fixed24") {
        to.form = DepthForm::fixed;
        to.steps = form == "fixed16" ? 0xFFFF : 0xFFFFFF;
    } else if (form == "float32") {
        to.form = DepthForm::float32;
    } else if (form == "reversed32") {
        to.form = DepthForm::reversed;
    } else if (form == "distance") {
        to.form = DepthForm::distance;
    } else {
        throw py::value_error("depth: unknown format: " + form);
    }
    return to;
}

}  // namespace notabug
