// Opacity from a map, and the surfaces that it cuts: where a map says that there is none, no ray meets one.
//
// UsdPreviewSurface: with an opacityThreshold above 0 the surface is whole where the opacity is as much or more, and gone
// elsewhere. The border lies where the filtered map crosses the threshold, within a texel's cell it is a curve.
#pragma once

#include "shade.h"
#include "traverse.h"

namespace notabug {

template <class T>
inline bool has_map(const Scene<T>& scene, int material) {
    return scene.cutouts.map && scene.cutouts.map[material] >= 0;
}

// How much of the surface is there at (u, v); `map` must be that of the material.
template <class T>
inline T opacity_of_map(const Scene<T>& scene, int material, T u, T v, Texels texels) {
    const T said = texel(scene.textures, scene.cutouts.map[material], u, v, texels).x;
    const T least = scene.cutouts.least[material];
    if (least > 0) return said >= least ? T(1) : T(0);
    return said;
}

// The opacity of `material` at (u, v).
template <class T, class F>
inline T opacity_at(const Scene<T>& scene, int material, T u, T v, Texels texels) {
    if constexpr (F::cutouts) {
        if (has_map(scene, material)) return opacity_of_map(scene, material, u, v, texels);
    }
    return scene.secondary[material].opacity;
}

// How much of the surface of triangle `i` is there where `ray` meets it; 1 where no map says it.
template <class T>
inline T opacity_met(const Scene<T>& scene, const Options& option, const Ray<T>& ray, int i, const Met<T>& met) {
    const int material = scene.material[scene.object[i]];
    if (!has_map(scene, material)) return 1;
    Weights<T> weights = corner_weights(scene, i, met.b0, met.b1, met.b2, ray.origin + met.t * ray.direction);
    if (option.affine) {
        const Vec3<T> screen = screen_weights(scene, i, met.b0, met.b1, met.b2);
        weights.w0 = screen.x, weights.w1 = screen.y, weights.w2 = screen.z, weights.w3 = 0;
    }
    return opacity_of_map(scene, material, weights.of(scene.uv, 0), weights.of(scene.uv, 1), option.texels);
}

// The `colour` of a texture whose texels are multiplied by the map's before they are mixed, divided by what both make.
template <class T>
inline Vec3<T> unassociated(const Scene<T>& scene, int material, T u, T v, const Vec3<T>& colour, Texels texels) {
    if (!has_map(scene, material) || scene.texture[material] < 0) return colour;
    const T share = texel(scene.textures, scene.cutouts.map[material], u, v, texels).x;
    return share > 0 ? colour / share : colour;
}

// Whether there is a surface where `ray` meets triangle `i`: what `closest` and `rival` ask.
template <class T, class F>
struct Uncut {
    const Scene<T>& scene;
    const Options& option;
    const Ray<T>& ray;

    bool operator()([[maybe_unused]] int i, [[maybe_unused]] const Met<T>& met) const {
        if constexpr (F::cutouts) return opacity_met(scene, option, ray, i, met) > 0;
        else return true;
    }
};

}  // namespace notabug
