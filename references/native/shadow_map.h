// What a shadow map (Williams 1978) may do to a light in the place of shadow rays.
//
// A map holds, for the middle of each of its texels, the depth of what the light sees first. A point is in shadow where
// that depth is less than its own by more than a bias. The middle of a point's texel lies beside the point, by up to half
// of the texel's diagonal, and where the texels lie is the renderer's choice: so the light may be lost where any column
// of light within that reach of the point is blocked by more than the bias, and may arrive where any is not.
#pragma once

#include <array>
#include <cmath>

#include "cutout.h"
#include "options.h"

namespace notabug {

// Columns beside a point that stand for all within reach: (distance, number) of rings, the outermost a little beyond it,
// so that its polygon holds the circle. What is narrower than the rings' distance may fall between them.
struct Ring {
    double distance;
    int columns;
};
constexpr std::array<Ring, 5> rings{{{0, 1}, {0.25, 6}, {0.5, 8}, {0.75, 12}, {1.02, 16}}};
constexpr double tangent_most = 1e3;  // of the angle between a light and a surface's normal: beyond it the light grazes

// Whether something lies on `ray` between its start and `end`, both ends included.
template <class T, class F>
bool column_blocked(const Scene<T>& scene, const Options& option, const Ray<T>& ray, T end) {
    bool blocked = false;
    if (end <= 0) return false;
    if (scene.triangles) {
        const Walk<T> walk(scene, ray);
        const Uncut<T, F> there{scene, option, ray};
        visit_triangles(scene, walk, T(0), end, [&](std::int32_t i, const Met<T>& met) {
            blocked = there(i, met);
            return !blocked;
        });
    }
    if constexpr (F::spheres) {
        for (std::int64_t i = 0; i < scene.spheres.count && !blocked; ++i) {
            const Roots<T> roots = sphere_roots(scene.spheres, i, ray);
            for (const T t : {roots.near, roots.far}) blocked = blocked || (t >= 0 && t <= end);
        }
    }
    return blocked;
}

// A point as a light's map is asked for it.
template <class T, class F>
struct MappedPoint {
    const Scene<T>& scene;
    const Options& option;
    Vec3<T> at;     // moved along the normal by the normal bias
    Vec3<T> L;      // towards the light
    T distance;     // infinite for a distant light
    T cosine;       // between the light and the facet's normal
    Vec3<T> u, v;   // across the light
    T reach, slack; // from the point to the middle of its texel; what float32 cannot tell apart

    MappedPoint(const Scene<T>& scene, const Options& option, const Light<T>& light, const Vec3<T>& place,
                const Vec3<T>& normal, const Vec3<T>& facet)
        : scene(scene), option(option), at(place + static_cast<T>(option.map_normal_bias) * normal) {
        L = -light.place;
        distance = infinity<T>;
        if (light.kind == 0) {
            L = light.place - at;
            distance = length(L);
            L = L / distance;
        }
        cosine = std::abs(dot(facet, L));
        const Vec3<T> a = absolute(L);
        const Vec3<T> axis{T(a.x <= a.y && a.x <= a.z), T(a.y < a.x && a.y <= a.z), T(a.z < a.x && a.z < a.y)};
        u = cross(L, axis);
        u = u / length(u);
        v = cross(L, u);
        const T width = light.kind == 0 ? T(2) * distance : static_cast<T>(option.map_width);
        reach = static_cast<T>(option.map_reach) * width / static_cast<T>(option.map_cells);
        slack = static_cast<T>(option.map_error) * (scene.radius + a_size(at) + (light.kind == 0 ? distance : T(0)));
    }

    static T a_size(const Vec3<T>& p) { return std::abs(p.x) + std::abs(p.y) + std::abs(p.z); }

    // Whether the column `beside` the point is blocked by what is nearer to the light by more than `least` and at most
    // `most`. The depths of a point light are distances, or along the axis of a cube's face: `either` asks whether it is
    // so by one of the two, else by both.
    bool blocked(const Vec3<T>& beside, T least, T most, bool either) const {
        Vec3<T> from = at + beside, D = L;
        T end = distance;
        if (distance < infinity<T>) {
            D = (at + distance * L) - from;
            end = length(D);
            D = D / end;
            const Vec3<T> a = absolute(L);
            const Vec3<T> face{T(a.x >= a.y && a.x >= a.z), T(a.y > a.x && a.y >= a.z), T(a.z > a.x && a.z > a.y)};
            const T along = std::abs(dot(face, L)), nearer = dot(face, L) < 0 ? dot(face, beside) : -dot(face, beside);
            const T by_distance = least + (end - distance), by_axis = (least + nearer) / along;
            const T shift = either ? std::min(by_distance, by_axis) : std::max(by_distance, by_axis);
            most += shift - least;
            least = shift;
        }
        // a start behind the surface shifts the origin, so that all that counts lies before it
        return column_blocked<T, F>(scene, option, {from + least * D, D}, std::min(most, end) - least);
    }

    // Whether the point is in shadow by a map that is shifted across the light.
    bool moved() const {
        const Vec3<T> beside = static_cast<T>(option.map_right) * u + static_cast<T>(option.map_up) * v;
        return blocked(beside, static_cast<T>(option.map_bias) + slack, infinity<T>, false);
    }

    template <class Ask>
    bool any_column(Ask&& ask) const {
        for (const Ring& ring : rings) {
            for (int j = 0; j < ring.columns; ++j) {
                const double turn = 6.283185307179586 * j / ring.columns;
                const T across = reach * static_cast<T>(ring.distance * std::cos(turn));
                const T up = reach * static_cast<T>(ring.distance * std::sin(turn));
                if (ask(across * u + up * v)) return true;
            }
        }
        return false;
    }

    // Whether the map may hold this against the point, which shadow rays reach (or do not, where `lit` asks for light).
    bool may(ShadowMap what) const {
        const T bias = static_cast<T>(option.map_bias);
        const T tangent = std::sqrt(std::max(T(0), T(1) - cosine * cosine)) /
                          std::max(cosine, static_cast<T>(1.0 / tangent_most));
        const T own = T(2.1) * reach * tangent + T(2) * slack;  // so far the surface itself rises beside the point
        switch (what) {
            case ShadowMap::acne:
                return any_column([&](const Vec3<T>& beside) { return blocked(beside, bias - slack, own, true); });
            case ShadowMap::dark_edge:
                return any_column([&](const Vec3<T>& beside) {
                    return blocked(beside, std::max(bias - slack, own), infinity<T>, true);
                });
            case ShadowMap::detached:
                return !blocked({0, 0, 0}, bias + slack, infinity<T>, false);
            case ShadowMap::lit_edge:
                return blocked({0, 0, 0}, bias + slack, infinity<T>, false) &&
                       any_column([&](const Vec3<T>& beside) {
                           return !blocked(beside, bias + slack, infinity<T>, false);
                       });
            default:
                return false;
        }
    }
};

// The share of light `k`, of which shadow rays let `share` pass, as a shadow map may have it.
template <class T, class F>
Vec3<T> mapped(const Scene<T>& scene, const Options& option, int k, const Vec3<T>& at, const Vec3<T>& normal,
               const Vec3<T>& facet, const Vec3<T>& share) {
    if (!((option.map_lights >> std::min(k, 63)) & 1)) return share;
    const bool arrives = any_positive(share);
    if (option.shadow_map == ShadowMap::reversed) return arrives ? Vec3<T>{0, 0, 0} : Vec3<T>{1, 1, 1};
    if (option.shadow_map == ShadowMap::moved) {
        const MappedPoint<T, F> point(scene, option, scene.light[k], at, normal, facet);
        return point.moved() ? Vec3<T>{0, 0, 0} : Vec3<T>{1, 1, 1};
    }
    const bool darkens = option.shadow_map == ShadowMap::acne || option.shadow_map == ShadowMap::dark_edge;
    if (darkens != arrives) return share;
    const MappedPoint<T, F> point(scene, option, scene.light[k], at, normal, facet);
    if (!point.may(option.shadow_map)) return share;
    return darkens ? Vec3<T>{0, 0, 0} : Vec3<T>{1, 1, 1};
}

}  // namespace notabug
