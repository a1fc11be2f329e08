// Domes with a picture: radiance and density by direction, and directions that are as frequent as the picture is bright.
//
// The picture is a latitude-longitude map as UsdLux takes it from OpenEXR: in the dome's own frame the upper row is +y,
// the middle of the picture +z, and longitude pi/2, towards +x, a quarter of the width from its left edge. Between the
// centres of texels it is bilinear; it goes on from the right edge to the left, and ends at the poles.
#pragma once

#include "shade.h"

namespace notabug {

template <class T>
constexpr T pi = T(3.141592653589793238462643383279502884L);

template <class T>
struct Unit {  // a point of the unit square
    T a, b;
};

// Where the dome's local direction w, of any length, lies in the picture: from its left edge, and down from its upper one.
template <class T>
inline Unit<T> place_in_sky(const Vec3<T>& w) {
    const T level = std::sqrt(w.x * w.x + w.z * w.z);
    return {T(0.5) - std::atan2(w.x, w.z) / (T(2) * pi<T>), std::atan2(level, w.y) / pi<T>};
}

// What the radiance along w is multiplied by.
template <class T>
inline Vec3<T> sky(const Skies<T>& skies, int k, const Vec3<T>& w) {
    const Unit<T> place = place_in_sky(w);
    return texel(skies.pictures, k, place.a, T(1) - place.b, Texels{});
}

// The density over solid angle of the directions that follow the picture, along w: that over the picture, which is bilinear
// between the texels' weights, by how much the sphere is stretched there.
template <class T>
inline T density_of_texel(const Skies<T>& skies, int k, const Vec3<T>& w) {
    const TextureInfo& info = skies.pictures.info[k];
    const Unit<T> place = place_in_sky(w);
    const T x = place.a * static_cast<T>(info.width) - T(0.5), y = place.b * static_cast<T>(info.height) - T(0.5);
    const std::int64_t fx = whole(x), fy = whole(y);
    const T ax = x - static_cast<T>(fx), ay = y - static_cast<T>(fy);
    const auto of = [&](std::int64_t across, std::int64_t down) {
        return skies.weight[info.first + wrapped(down, info.height, 1) * info.width + wrapped(across, info.width, 0)];
    };
    const T weight = (1 - ay) * ((1 - ax) * of(fx, fy) + ax * of(fx + 1, fy)) +
                     ay * ((1 - ax) * of(fx, fy + 1) + ax * of(fx + 1, fy + 1));
    const T level = std::sqrt(w.x * w.x + w.z * w.z) / length(w);
    const T texels = static_cast<T>(info.width) * static_cast<T>(info.height);
    return weight * texels / (T(2) * pi<T> * pi<T> * std::max(level, std::numeric_limits<T>::min()));
}

// The first of `count` cumulative shares that is above `share`.
template <class T>
inline std::int64_t chosen(const T* shares, std::int64_t count, T share) {
    return std::min<std::int64_t>(std::upper_bound(shares, shares + count, share) - shares, count - 1);
}

// How far beside the centre of the texel `j` of `count` a place lies that is as frequent as the texel weighs there: a tent,
// or, where the picture ends with the texel, the half of one and what goes on to the edge.
template <class T>
inline T beside_texel(T u, std::int64_t j, std::int64_t count, bool ends) {
    if (u < T(0.5)) return ends && j == 0 ? u - T(0.5) : std::sqrt(T(2) * u) - T(1);
    return ends && j == count - 1 ? u - T(0.5) : T(1) - std::sqrt(T(2) * (T(1) - u));
}

// A local unit direction, as frequent as density_of_texel says: a row, a texel of it, a place beside its centre.
template <class T>
inline Vec3<T> toward_texel(const Skies<T>& skies, int k, const Unit<T>& u) {
    const TextureInfo& info = skies.pictures.info[k];
    const T* rows = skies.rows + skies.info[k].rows;
    const std::int64_t y = chosen(rows, info.height, u.b);
    const T* cells = skies.cells + skies.info[k].cells + y * info.width;
    const std::int64_t x = chosen(cells, info.width, u.a);
    const auto within = [](const T* shares, std::int64_t j, T share) {
        const T before = j > 0 ? shares[j - 1] : T(0), part = shares[j] - before;
        return part > 0 ? std::min(std::max((share - before) / part, T(0)), T(1)) : T(0.5);
    };
    const T across = static_cast<T>(x) + T(0.5) + beside_texel(within(cells, x, u.a), x, info.width, false);
    const T down = static_cast<T>(y) + T(0.5) + beside_texel(within(rows, y, u.b), y, info.height, true);
    const T longitude = T(2) * pi<T> * (T(0.5) - across / static_cast<T>(info.width));
    const T angle = pi<T> * down / static_cast<T>(info.height), level = std::sin(angle);  // from the upper pole
    return {level * std::sin(longitude), std::cos(angle), level * std::cos(longitude)};
}

}  // namespace notabug
