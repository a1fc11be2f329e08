// From a hit to radiance: interpolation of normals and uv, textures, and the reflection models.
#pragma once

#include "intersect.h"
#include "options.h"

namespace notabug {

// Four face corners and their weights at a hit; a triangle's last is unused.
template <class T>
struct Weights {
    std::int32_t c0, c1, c2, c3;
    T w0, w1, w2, w3;
    std::int32_t quad;  // or -1

    Vec3<T> of(const Vec3<T>* value) const {
        return w0 * value[c0] + w1 * value[c1] + w2 * value[c2] + w3 * value[c3];
    }
    T of(const T* uv, int axis) const {
        return w0 * uv[2 * c0 + axis] + w1 * uv[2 * c1 + axis] + w2 * uv[2 * c2 + axis] + w3 * uv[2 * c3 + axis];
    }
};

// A triangle's weights are its barycentric coordinates; a quad's follow from its inverse bilinear map at `at`.
template <class T>
inline Weights<T> corner_weights(const Scene<T>& scene, int i, T b0, T b1, T b2, const Vec3<T>& at) {
    const Corners& c = scene.corner[i];
    const std::int32_t q = scene.quads.of_triangle ? scene.quads.of_triangle[i] : -1;
    if (q < 0) return {c.a, c.b, c.c, c.c, b0, b1, b2, 0, -1};
    const PlaneFrame<T>& f = scene.quads.frame[q];
    const Vec3<T> h = at - f.origin;
    const auto [s, t] = inverse_bilinear(dot(h, f.x), dot(h, f.y), scene.quads.plane[q]);
    const std::int32_t* k = scene.quads.corners[q].corner;
    return {k[0], k[1], k[2], k[3], (1 - s) * (1 - t), s * (1 - t), s * t, (1 - s) * t, q};
}

// The fault of affine interpolation: barycentric coordinates as they are on the screen. A vertex at depth z weighs b * z
// there (Heckbert 1989, section 2.3; Blinn 1992, "Hyperbolic Interpolation").
template <class T>
inline Vec3<T> screen_weights(const Scene<T>& scene, int i, T b0, T b1, T b2) {
    const Triangle<T>& p = scene.points[i];
    const Camera<T>& c = scene.camera;
    if (c.parallel != 0) return {b0, b1, b2};
    const T z0 = dot(p.a - c.origin, c.forward);
    const T z1 = dot(p.b - c.origin, c.forward);
    const T z2 = dot(p.c - c.origin, c.forward);
    const T total = b0 * z0 + b1 * z1 + b2 * z2;
    return {b0 * z0 / total, b1 * z1 / total, b2 * z2 / total};
}

// The texel that `index` stands for on an axis of `size` texels, or -1 beyond the border of a black one.
inline std::int64_t wrapped(std::int64_t index, std::int64_t size, std::int64_t wrap) {
    if (wrap == clamps) return std::min(std::max<std::int64_t>(index, 0), size - 1);
    if (wrap == is_black) return index < 0 || index >= size ? -1 : index;
    const std::int64_t period = wrap == mirrors ? 2 * size : size;
    std::int64_t rest = index % period;
    if (rest < 0) rest += period;
    return rest < size ? rest : period - 1 - rest;
}

// Two neighbouring texels on one axis, and the share of the second.
template <class T>
struct TexelPair {
    std::int64_t a, b;
    T share;
};

// The texels on both sides of the place `x`, which counts texels from the first one's edge. What renderers do otherwise:
//
// - the border is `clamped`: the place is brought into the picture first, so that the first texel and the last do not mix;
// - the share has few bits, as that of graphics hardware;
// - negative places are `mirrored` (their absolute value) or `clamped` to the first texel; or a place is rounded to a
//   texel towards zero, not down, so that it is one too far: `truncated` where rows count from the top, `truncated_up`
//   where they do from the bottom. These are coding errors.
template <class T>
inline TexelPair<T> texel_pair(T x, std::int64_t size, std::int64_t wrap, Texels texels, int axis) {
    if (x < 0 && texels.negative == NegativeUv::mirrored) x = -x;
    if (x < 0 && texels.negative == NegativeUv::clamped) x = T(0);
    if (texels.border == TexelBorder::clamped && wrap == repeats) {
        x -= static_cast<T>(size) * std::floor(x / static_cast<T>(size));
        wrap = clamps;
    }
    x -= T(0.5);
    if (texels.filter == TexelFilter::nearest) x = std::floor(x + T(0.5));
    std::int64_t index = whole(x);
    T share = x - static_cast<T>(index);
    if (texels.negative >= NegativeUv::truncated && x < 0 && share > 0) ++index;
    if (texels.bits > 0) {
        const T steps = std::ldexp(T(1), texels.bits);
        share = ((texels.up >> axis) & 1 ? std::ceil(share * steps) : std::floor(share * steps)) / steps;
    }
    return {wrapped(index, size, wrap), wrapped(index + 1, size, wrap), share};
}

// sRGB's curve (IEC 61966-2-1).
template <class T>
inline T decoded(T x) {
    return x <= T(0.04045) ? x / T(12.92) : std::pow((x + T(0.055)) / T(1.055), T(2.4));
}

// Bilinear lookup of texture `k` at (u, v), or its nearest texel; texel centres lie at half-integers, v = 0 is the bottom
// edge. Decoding `after` the lookup is of texels that are encoded.
template <class T>
inline Vec3<T> texel(const Textures<T>& textures, int k, T u, T v, Texels texels) {
    const TextureInfo& info = textures.info[k];
    const T width = static_cast<T>(info.width), height = static_cast<T>(info.height);
    const TexelPair<T> x = texel_pair(u * width, info.width, info.wrap_s, texels, 0);
    TexelPair<T> y;
    if (texels.negative == NegativeUv::floor || texels.negative == NegativeUv::truncated) {
        y = texel_pair((1 - v) * height, info.height, info.wrap_t, texels, 1);
    } else {  // of who counts rows from the bottom; every wrap mode is the same in both directions
        y = texel_pair(v * height, info.height, info.wrap_t, texels, 1);
        for (std::int64_t* row : {&y.a, &y.b})
            if (*row >= 0) *row = info.height - 1 - *row;
    }
    const auto at = [&](std::int64_t column, std::int64_t row) {
        return column < 0 || row < 0 ? Vec3<T>{0, 0, 0} : textures.texels[info.first + row * info.width + column];
    };
    const Vec3<T> mixed = ((1 - x.share) * (1 - y.share)) * at(x.a, y.a) + (x.share * (1 - y.share)) * at(x.b, y.a) +
                          ((1 - x.share) * y.share) * at(x.a, y.b) + (x.share * y.share) * at(x.b, y.b);
    if (texels.decoding == TexelDecoding::before) return mixed;
    return {decoded(mixed.x), decoded(mixed.y), decoded(mixed.z)};
}

// The diffuse colour of `material` at (u, v).
template <class T>
inline Vec3<T> albedo(const Scene<T>& scene, int material, T u, T v, Texels texels = {}) {
    if (scene.textures.info && scene.texture[material] >= 0)
        return texel(scene.textures, scene.texture[material], u, v, texels);
    return scene.diffuse[material];
}

// The lobe's value, without its colour: max(R.V, 0)^n (Phong 1975) or max(N.H, 0)^n (Blinn 1977); unit vectors.
// `raw` > 0 is the fault of vectors that were not normalised: R of a light vector of that length, H = (L + V)/2.
template <class T>
inline T highlight(const Lobes<T>& lobes, int material, const Vec3<T>& N, const Vec3<T>& L, const Vec3<T>& V, T raw) {
    const std::int32_t kind = lobes.kind ? lobes.kind[material] : no_lobe;
    if (kind == no_lobe) return 0;
    const T nl = dot(N, L);
    T cosine;
    if (kind == phong || kind == phong_cosine) {
        cosine = T(2) * nl * dot(N, V) - dot(L, V);
        if (raw > 0) cosine *= raw;
    } else {
        const Vec3<T> H = L + V;
        cosine = dot(N, H) / (raw <= 0 ? length(H) : T(2));
    }
    if (!(cosine > 0)) return 0;  // nor where the light is straight behind, and there is no halfway vector
    if (raw <= 0) cosine = std::min(cosine, T(1));  // rounding may lift it above, and a sharp exponent out of range
    const T value = std::pow(cosine, lobes.specular[material].exponent);
    return kind > blinn ? value * nl : value;
}

// A corner of a triangle that is lit by itself, for Gouraud (1971).
template <class T>
struct LitCorner {
    Vec3<T> at, normal, view;
    T weight;
};

// Corner `k` of triangle `i`, or of its quad: position, unit normal, V towards `eye`, share of the colour. `side` is -1
// where the facet is seen from behind. A normal that faces away from the viewer is kept, flipped, or its corner painted
// black (weight 0).
template <class T>
inline LitCorner<T> lit_corner(const Scene<T>& scene, int i, int k, const Weights<T>& weights, T side,
                               const Vec3<T>& eye, Silhouette silhouette) {
    const Triangle<T>& p = scene.points[i];
    const Weights<T>& w = weights;
    const Vec3<T>& n = scene.normal[k == 0 ? w.c0 : k == 1 ? w.c1 : k == 2 ? w.c2 : w.c3];
    LitCorner<T> made{k == 0 ? p.a : k == 1 ? p.b : p.c, {}, {}, k == 0 ? w.w0 : k == 1 ? w.w1 : k == 2 ? w.w2 : w.w3};
    if (w.quad >= 0) made.at = scene.quads.points[w.quad].point[k];
    made.view = eye - made.at;
    made.view = (T(1) / length(made.view)) * made.view;
    made.normal = (side / length(n)) * n;
    if (silhouette != Silhouette::keep && dot(made.normal, made.view) < 0) {
        if (silhouette == Silhouette::black) made.weight = 0;
        made.normal = -made.normal;
    }
    return made;
}

}  // namespace notabug
