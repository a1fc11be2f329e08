// What a ray needs at every box and triangle, and which of a node's boxes it enters.
//
// Boxes are met in float32, and every distance is widened by what rounding may have moved it: a box that the ray meets is
// never lost (after Ize 2013, "Robust BVH Ray Traversal", JCGT 2(2)); one that it just misses may be entered.
#pragma once

#include "bvh.h"
#include "leaf.h"

namespace notabug {

constexpr float single_slack = 0x1p-20f;  // sixteen roundings to float32; six are made
constexpr float far_away = 8.0f;          // times the reach of the boxes: beyond, a ray is followed from where it is near
constexpr float least_slope = 1e-18f;     // of a direction's component, times the largest: in place of zero

// `x` as a bound in float32, widened towards `sign`; finite, for a NaN would lose boxes.
inline float bound(double x, double sign) {
    constexpr double most = std::numeric_limits<float>::max();
    const double wider = x + sign * std::abs(x) * 0x1p-22;
    return static_cast<float>(wider < most ? (wider > -most ? wider : -most) : most);
}

template <class T>
struct Walk {
    Vec3<T> origin;
    Shear<T> frame;
    double start = 0;                     // where on the ray the boxes' distances begin
    Lanes inverse[3], entry[3], exit[3];  // a plane at x is entered at x * inverse - entry, left at x * inverse - exit
    std::size_t near[3], far[3];          // the side of a box that the ray meets first along each axis, and the other

    Walk(const Scene<T>& scene, const Ray<T>& ray) : origin(ray.origin), frame(shear(ray.direction)) {
        const double* c = scene.boxes.centre;
        Vec3<double> from = widened(ray.origin) - Vec3<double>{c[0], c[1], c[2]};
        const auto reach = static_cast<float>(scene.boxes.reach);
        const float away = farthest(from);
        float here = away;
        if (away > far_away * reach) {
            const Vec3<double> along = widened(ray.direction);
            start = -dot(from, along) / dot(along, along);
            from = from + start * along;
            here = farthest(from);
        }
        // the last term: by how much the test of a triangle, in T, may find a hit outside its box
        const float slack = single_slack * (reach + here) + 16 * static_cast<float>(std::numeric_limits<T>::epsilon()) *
                                                                (away + reach + static_cast<float>(scene.boxes.offset));
        const float d[3] = {static_cast<float>(ray.direction.x), static_cast<float>(ray.direction.y),
                            static_cast<float>(ray.direction.z)};
        const float o[3] = {static_cast<float>(from.x), static_cast<float>(from.y), static_cast<float>(from.z)};
        const float least = least_slope * std::max({std::abs(d[0]), std::abs(d[1]), std::abs(d[2])});
        for (int k = 0; k < 3; ++k) {
            const float slope = std::max(std::abs(d[k]), least);
            const bool back = std::signbit(d[k]);
            const float inv = 1.0f / (back ? -slope : slope);
            const float at = o[k] * inv, pad = slack * std::abs(inv);
            inverse[k] = all_lanes(inv);
            entry[k] = all_lanes(at + pad);
            exit[k] = all_lanes(at - pad);
            near[k] = static_cast<std::size_t>(back ? k + 3 : k);
            far[k] = static_cast<std::size_t>(back ? k : k + 3);
        }
    }

    static float farthest(const Vec3<double>& a) {
        return static_cast<float>(std::max({std::abs(a.x), std::abs(a.y), std::abs(a.z)}));
    }

    float least(T t) const { return bound(static_cast<double>(t) - start, -1.0); }  // t for the boxes, rounded down
    float most(T t) const { return bound(static_cast<double>(t) - start, 1.0); }    // and up

    // One bit for each box of `node` that the ray enters between tmin and tmax, and where. What is NaN, 0 * infinity, counts
    // for nothing.
    [[gnu::always_inline]] unsigned enter(const WideNode& node, Lanes tmin, Lanes tmax, float* entered) const {
        unsigned met = 0;
        for (int i = 0; i < wide; i += 4) {
            Lanes first = tmin, last = tmax;
            const auto cut = [&](int k) {
                first = larger(pack_of<float>(node.side[near[k]] + i) * inverse[k] - entry[k], first);
                last = smaller(pack_of<float>(node.side[far[k]] + i) * inverse[k] - exit[k], last);
            };
            cut(0), cut(1), cut(2);
            keep(first, entered + i);
            met |= bits_of(first <= last) << i;
        }
        return met;
    }
};

}  // namespace notabug
