// From the winner of each sample to its radiance: the tracer's formulas, with a shadow map in the place of shadow rays.
//
// Everything a rasteriser knows of the world is the triangle in front and the coordinates on it.
#pragma once

#include "options.h"
#include "shade.h"
#include "zbuffer.h"

namespace notabug {

enum class Interpolation { phong, gouraud, flat };

// The maps of all lights: the distance to what each light sees first (Williams 1978).
template <class T>
struct ShadowMaps {
    const std::int64_t* first = nullptr;  // first map of each light, and one more; null: nothing casts a shadow
    const View<T>* view = nullptr;
    const bool* parallel = nullptr;
    const T* depth = nullptr;  // (maps, cells, cells)
    std::int64_t cells = 0;
    T bias = 0;  // what a surface must be farther from the light than its map says
    T normal_bias = 0;  // by how much it is moved along its normal before it is asked for
};

struct RasterOptions {
    Interpolation normals = Interpolation::phong;
    Silhouette silhouette = Silhouette::keep;
    bool affine = false;
};

// Whether the map of light `k` shows something nearer to the light than `at`, by more than the bias.
template <class T>
inline bool in_shadow(const ShadowMaps<T>& maps, std::int64_t k, Vec3<T> at, const Vec3<T>& normal) {
    if (!maps.first) return false;
    at = at + maps.normal_bias * normal;
    for (std::int64_t m = maps.first[k]; m < maps.first[k + 1]; ++m) {
        const View<T>& v = maps.view[m];
        at = at - v.eye;
        const T depth = dot(at, v.forward);
        const T w = maps.parallel[m] ? T(1) : depth;
        if (w > 0) {
            const T across = dot(at, v.across) / w, up = dot(at, v.up) / w;
            if (std::abs(across) <= 1 && std::abs(up) <= 1) {
                const T half = static_cast<T>(maps.cells) / T(2);
                const std::int64_t column = std::min(static_cast<std::int64_t>((across + 1) * half), maps.cells - 1);
                const std::int64_t row = std::min(static_cast<std::int64_t>((1 - up) * half), maps.cells - 1);
                return depth > maps.depth[(m * maps.cells + row) * maps.cells + column] + maps.bias;
            }
        }
        at = at + v.eye;
    }
    return false;
}

// Diffuse and specular light at a point, without the surface's colours.
template <class T>
struct Shade {
    Vec3<T> diffuse{0, 0, 0}, specular{0, 0, 0};
};

template <class T>
inline Shade<T> light_on(const Scene<T>& scene, const ShadowMaps<T>& maps, int material, const Vec3<T>& at,
                         const Vec3<T>& N, const Vec3<T>& V) {
    Shade<T> made;
    for (std::int64_t k = 0; k < scene.lights; ++k) {
        const Light<T>& light = scene.light[k];
        Vec3<T> L = -light.place;
        T falloff = 1;
        if (light.kind == 0) {
            L = light.place - at;
            const T square = dot(L, L);
            L = L / std::sqrt(square);
            falloff = T(1) / square;
        }
        const T nl = dot(N, L);
        if (nl <= 0 || in_shadow(maps, k, at, N)) continue;
        const T h = highlight(scene.lobes, material, N, L, V, T(0));
        const Vec3<T> e = (falloff * static_cast<T>(0.3183098861837907)) * light.intensity;
        made.diffuse = made.diffuse + nl * e;
        made.specular = made.specular + h * e;
    }
    return made;
}

// From a point towards the viewer, of any length.
template <class T>
inline Vec3<T> towards_eye(const Camera<T>& camera, const Vec3<T>& at) {
    return camera.parallel != 0 ? -camera.forward : camera.origin - at;
}

// light_on for a normal that need not be of unit length nor face the viewer.
template <class T>
inline Shade<T> lit(const Scene<T>& scene, const ShadowMaps<T>& maps, Silhouette silhouette, int material, T side,
                    const Vec3<T>& at, const Vec3<T>& normal) {
    Vec3<T> V = towards_eye(scene.camera, at);
    V = (T(1) / length(V)) * V;
    Vec3<T> N = (side / length(normal)) * normal;
    if (silhouette != Silhouette::keep && dot(N, V) < 0) {
        if (silhouette == Silhouette::black) return {};
        N = -N;
    }
    return light_on(scene, maps, material, at, N, V);
}

// The radiance of triangle `i` at the barycentric coordinates `b`, `affine` without perspective.
template <class T>
Vec3<T> raster_colour(const Scene<T>& scene, const ShadowMaps<T>& maps, const RasterOptions& option, std::int64_t i,
                      const Vec3<T>& b, const Vec3<T>& affine) {
    const int material = scene.material[scene.object[i]];
    const Triangle<T>& p = scene.points[i];
    const Corners& c = scene.corner[i];
    const Vec3<T>* n = scene.normal;
    const Vec3<T> at = b.x * p.a + b.y * p.b + b.z * p.c;
    const Vec3<T>& w = option.affine ? affine : b;
    Vec3<T> g = cross(p.b - p.a, p.c - p.a);
    const T side = dot(g, towards_eye(scene.camera, at)) >= 0 ? T(1) : T(-1);
    const bool smooth = scene.sagitta[i] >= 0 && option.normals != Interpolation::flat;
    Shade<T> made;
    const auto lit_at = [&](const Vec3<T>& point, const Vec3<T>& normal) {
        return lit(scene, maps, option.silhouette, material, side, point, normal);
    };
    if (smooth && option.normals == Interpolation::gouraud) {
        const Shade<T> x = lit_at(p.a, n[c.a]), y = lit_at(p.b, n[c.b]), z = lit_at(p.c, n[c.c]);
        made.diffuse = w.x * x.diffuse + w.y * y.diffuse + w.z * z.diffuse;
        made.specular = w.x * x.specular + w.y * y.specular + w.z * z.specular;
    } else {
        if (smooth) g = b.x * n[c.a] + b.y * n[c.b] + b.z * n[c.c];
        made = lit_at(at, g);
    }
    const T* uv = scene.uv;
    const T u = w.x * uv[2 * c.a] + w.y * uv[2 * c.b] + w.z * uv[2 * c.c];
    const T v = w.x * uv[2 * c.a + 1] + w.y * uv[2 * c.b + 1] + w.z * uv[2 * c.c + 1];
    Vec3<T> colour = mul(albedo(scene, material, u, v), made.diffuse);
    if (scene.lobes.kind) colour = colour + mul(scene.lobes.specular[material].colour, made.specular);
    return colour;
}

}  // namespace notabug
