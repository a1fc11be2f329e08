// What a ray brings back: its radiance, and what tells one surface and one set of shadows from another.
#pragma once

#include <cstdint>

#include "vector.h"

namespace notabug {

// What must not be mixed within a pixel, as one number: in its lower bits, `seen_bits`, the objects, on flat facets the
// normal, and the lights whose highlights are not cut off; in the upper ones the lights that are blocked.
constexpr std::uint64_t seen_bits = (std::uint64_t(1) << 40) - 1;
constexpr std::uint64_t facing_prime = 1048573;  // of the lights that make highlights so much goes into what is seen
constexpr std::int64_t dark_prime = 8388593;     // below 2^23: of the lights that are blocked goes into the bits above

template <class T>
struct Radiance {
    Vec3<T> colour;
    std::int64_t id;  // 0 is the background
    bool spared;      // the first hit was spared facet self-shadow
    // of the lights with a size those that are all in shadow at the first hit, and those that are all seen
    std::uint64_t hidden = 0, open = 0;
};

// What is told of the first hit; this one listens to nothing. See probe.h for one that does.
struct NoRecord {
    static constexpr bool listens = false;
};

// Of the light that a surface sends towards the viewer.
template <class T>
struct Lit {
    Vec3<T> colour{0, 0, 0};
    std::uint64_t blocked = 0, facing = 0;  // one bit for each light
    std::uint64_t hidden = 0, open = 0;     // one for each with a size, as in Radiance
    bool forgiven = false;
};

// A half of what a pixel spans at the distance t: angle * t + width.
template <class T>
struct HalfPixel {
    T angle, width;
};

// A number for the point `j` of the light `k`: sums of them tell which points are blocked (the finalizer of splitmix64).
inline std::uint64_t scattered(int k, int j) {
    std::uint64_t z = (static_cast<std::uint64_t>(k) << 32) + static_cast<std::uint64_t>(j) + 0x9E3779B97F4A7C15u;
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
    return z ^ (z >> 31);
}

template <class T>
inline std::uint64_t facet_code(const Vec3<T>& g) {
    const auto part = [](T x) { return static_cast<std::uint64_t>(nearest(static_cast<double>(x) * 512)); };
    return part(g.x) + 7 * part(g.y) + 49 * part(g.z);
}

}  // namespace notabug
