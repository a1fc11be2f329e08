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

inline std::int64_t wrapped(std::int64_t index, std::int64_t size, std::int64_t clamp) {
    if (clamp) return std::min(std::max<std::int64_t>(index, 0), size - 1);
    const std::int64_t rest = index % size;
    return rest < 0 ? rest + size : rest;
}

// Bilinear lookup of texture `k` at (u, v), or its nearest texel; texel centres lie at half-integers, v = 0 is the bottom
// edge.
template <class T>
inline Vec3<T> texel(const Textures<T>& textures, int k, T u, T v, Texels texels) {
    const TextureInfo& info = textures.info[k];
    T x = u * static_cast<T>(info.width) - T(0.5);
    T y = (1 - v) * static_cast<T>(info.height) - T(0.5);
    if (texels == Texels::nearest) x = std::floor(x + T(0.5)), y = std::floor(y + T(0.5));
    const std::int64_t fx = whole(x), fy = whole(y);
    const T ax = x - static_cast<T>(fx), ay = y - static_cast<T>(fy);
    const std::int64_t x0 = wrapped(fx, info.width, info.wrap_s), x1 = wrapped(fx + 1, info.width, info.wrap_s);
    const std::int64_t y0 = wrapped(fy, info.height, info.wrap_t), y1 = wrapped(fy + 1, info.height, info.wrap_t);
    const Vec3<T>* below = textures.texels + info.first + y0 * info.width;
    const Vec3<T>* above = textures.texels + info.first + y1 * info.width;
    return ((1 - ax) * (1 - ay)) * below[x0] + (ax * (1 - ay)) * below[x1] + ((1 - ax) * ay) * above[x0] +
           (ax * ay) * above[x1];
}

// The diffuse colour of `material` at (u, v).
template <class T>
inline Vec3<T> albedo(const Scene<T>& scene, int material, T u, T v, Texels texels = Texels::bilinear) {
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
