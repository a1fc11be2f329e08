// The tracer's switches, as notabug.references.tracer.envelope.Options describes them.
//
// A new switch is one line here and one in `options_of` of switches.h.
#pragma once

#include <cstdint>

namespace notabug {

enum class Shadows { forgiving, facets, planes, none };
enum class Normals { unit, raw };
enum class Silhouette { keep, flip, black, flip_lit };
enum class MirroredHighlight { own, primary, lost };
enum class TransparentShadows { attenuate, opaque, free, glass };
enum class Ties { nearest, first, another, unlit, blend, hole, next };
enum class GouraudShadows { corners, pixels, none };
enum class GapLoses { crossings, objects };
enum class TexelFilter { bilinear, nearest };
enum class TexelBorder { wrapped, clamped };
enum class NegativeUv { floor, mirrored, clamped, truncated, truncated_up };
enum class TexelDecoding { before, after };
enum class Start { exact, none, absolute, relative, error_bound };
enum class Falloff { square, linear, none };
enum class ShadowRays { bounded, unbounded, culled };
enum class MappedAway { keep, flip, black, raised };
enum class BumpLight { cut, lit, softened, softened_diffuse, tamed };
enum class Tangents { triangle, interpolated, cotangent, right_handed, world };
enum class ShadowMap { none, acne, dark_edge, detached, lit_edge, reversed, moved };

// How textures are looked up: see shade.h.
struct Texels {
    TexelFilter filter = TexelFilter::bilinear;
    TexelBorder border = TexelBorder::wrapped;
    NegativeUv negative = NegativeUv::floor;
    TexelDecoding decoding = TexelDecoding::before;
    int bits = 0;  // of the weights; 0: as many as the number has
    int up = 0;    // which weights are rounded up, else down: 1 across, 2 along, 3 both
};

struct Options {
    Shadows shadows = Shadows::forgiving;
    Normals normals = Normals::unit;
    Silhouette silhouette = Silhouette::keep;
    bool affine = false;
    bool raw_vectors = false;
    bool uncut = false;
    MirroredHighlight mirrored_highlight = MirroredHighlight::own;
    bool retroreflection = false;
    bool unreversed = false;
    TransparentShadows transparent_shadows = TransparentShadows::attenuate;
    Ties ties = Ties::first;
    double resolution = 0.0;
    double near_resolution = 0.0;
    bool whole_reflection = false;
    bool self_reflection = false;
    bool self_refraction = false;
    bool counted_glass = false;
    bool gouraud = false;
    GouraudShadows gouraud_shadows = GouraudShadows::corners;
    Falloff falloff = Falloff::square;
    ShadowRays shadow_rays = ShadowRays::bounded;
    bool lost_reflection = false;
    std::int64_t acne = 0;  // one bit for each light
    double hit_error = 0.0;
    Start start = Start::exact;
    double epsilon = 0.0;
    bool refine = false;
    double offset = 0.0;
    double shadow_gap = 0.0;
    GapLoses gap_loses = GapLoses::crossings;
    double ray_gap = 0.0;
    double sphere_error = 0.0;
    int bounces = 8;
    bool counted_passages = false;
    Texels texels;
    MappedAway mapped_away = MappedAway::keep;
    BumpLight bump_light = BumpLight::cut;
    Tangents tangents = Tangents::triangle;
    bool raw_mapped = false;
    bool bumps_behind = false;  // what is a bump from the front is one from behind, too
    ShadowMap shadow_map = ShadowMap::none;
    std::int64_t map_lights = -1;  // one bit for each light
    double map_width = 1.0;
    double map_cells = 1.0;
    double map_reach = 0.0;
    double map_bias = 0.0;
    double map_normal_bias = 0.0;
    double map_error = 0.0;
    double map_right = 0.0;
    double map_up = 0.0;
    int light_grid = 0;
    bool light_grid_ends = false;
    bool light_grid_shared = false;
    bool light_uncosined = false;
    double shadow_lift = 0.0;
    bool whole_cutouts = false;
    bool associated = false;
};

}  // namespace notabug
