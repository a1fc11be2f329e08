// Where a ray that leaves a surface starts: the rules that keep it from meeting that surface again.
//
// A hit point is off its surface by rounding. Start::exact, the reference's rule, leaves out the facet that a ray starts
// on; what renderers do is one of the others. `absolute` and `relative` pass over hits nearer than an epsilon (Haines
// 1989), `error_bound` starts at a point computed from the facet itself, and beside it by that point's own error (Pharr,
// Jakob and Humphreys 2023, Physically Based Rendering, section 6.8). `none` does nothing and shows what the others are
// there for.
#pragma once

#include "options.h"
#include "traverse.h"

namespace notabug {

template <class T>
constexpr T unit = std::numeric_limits<T>::epsilon();  // 1's distance to the next number

// The smallest distance at which a ray from `at` may meet something. `relative` is to the scene's coordinates and the
// distance to the camera, which both carry rounding.
template <class T>
inline T clearance(const Scene<T>& scene, const Options& option, const Vec3<T>& at) {
    const T size = scene.radius + std::abs(at.x) + std::abs(at.y) + std::abs(at.z);
    if (option.start == Start::exact) return T(32) * unit<T> * size;
    if (option.start == Start::absolute) return static_cast<T>(option.epsilon);
    if (option.start == Start::relative) {
        const Vec3<T> way = absolute(at - scene.camera.origin);
        return static_cast<T>(option.epsilon) * (size + way.x + way.y + way.z);
    }
    return 0;
}

template <class T>
struct Bounded {
    Vec3<T> at;
    T error;  // how far along the facet's normal a ray must start beside it
};

// The hit anew. Barycentric coordinates give a point of the facet within gamma(7) of its terms, whatever distance the ray
// has come; on a sphere the point is moved onto it, within gamma(5), and its two maps add gamma(3) each.
template <class T, class F>
inline Bounded<T> bounded(const Scene<T>& scene, const Hit<T>& hit, const Vec3<T>& at, const Vec3<T>& g) {
    const T u = unit<T> / T(2);
    if (hit.triangle >= 0) {
        const Triangle<T>& p = scene.points[hit.triangle];
        const T seven = T(7) * u / (T(1) - T(7) * u) + u;  // and the rounding of the start itself
        const Vec3<T> a = hit.b0 * p.a, b = hit.b1 * p.b, c = hit.b2 * p.c;
        const Vec3<T> terms = absolute(a) + absolute(b) + absolute(c);
        return {a + b + c, seven * dot(absolute(g), terms)};
    }
    if constexpr (!F::spheres) {
        return {at, 0};
    } else {
        const Affine<T>& w = scene.spheres.to_world[hit.sphere];
        Vec3<T> h = scene.spheres.to_local[hit.sphere].point(at);
        h = (scene.spheres.radius[hit.sphere] / length(h)) * h;
        const auto terms = [&](int row) {
            const T* m = w.m + 4 * row;
            return std::abs(m[0] * h.x) + std::abs(m[1] * h.y) + std::abs(m[2] * h.z) + std::abs(m[3]);
        };
        const T error = std::abs(g.x) * terms(0) + std::abs(g.y) * terms(1) + std::abs(g.z) * terms(2);
        return {w.point(h), T(12) * u * error};
    }
}

}  // namespace notabug
