// Vectors of three numbers, in the precision of their template parameter.
//
// Sums run from left to right, as everywhere here: the order of operations is part of every result, to the last bit.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

namespace notabug {

template <class T>
struct Vec3 {
    T x, y, z;
};

template <class T>
inline Vec3<T> operator+(const Vec3<T>& a, const Vec3<T>& b) {
    return {a.x + b.x, a.y + b.y, a.z + b.z};
}

template <class T>
inline Vec3<T> operator-(const Vec3<T>& a, const Vec3<T>& b) {
    return {a.x - b.x, a.y - b.y, a.z - b.z};
}

template <class T>
inline Vec3<T> operator-(const Vec3<T>& a) {
    return {-a.x, -a.y, -a.z};
}

template <class T>
inline Vec3<T> operator*(T s, const Vec3<T>& a) {
    return {s * a.x, s * a.y, s * a.z};
}

template <class T>
inline Vec3<T> operator/(const Vec3<T>& a, T s) {
    return {a.x / s, a.y / s, a.z / s};
}

template <class T>
inline T dot(const Vec3<T>& a, const Vec3<T>& b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

template <class T>
inline Vec3<T> cross(const Vec3<T>& a, const Vec3<T>& b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

template <class T>
inline T length(const Vec3<T>& a) {
    return std::sqrt(dot(a, a));
}

template <class T>
inline Vec3<T> absolute(const Vec3<T>& a) {
    return {std::abs(a.x), std::abs(a.y), std::abs(a.z)};
}

// Products component by component, for colours.
template <class T>
inline Vec3<T> mul(const Vec3<T>& a, const Vec3<T>& b) {
    return {a.x * b.x, a.y * b.y, a.z * b.z};
}

// The mean of three channels; of equal ones that value itself, to the last bit.
template <class T>
inline T mean(const Vec3<T>& a) {
    return a.x + ((a.y - a.x) + (a.z - a.x)) / T(3);
}

template <class T>
inline bool any_positive(const Vec3<T>& a) {
    return a.x > 0 || a.y > 0 || a.z > 0;
}

template <class T>
struct Ray {
    Vec3<T> origin, direction;
};

template <class T>
inline Vec3<double> widened(const Vec3<T>& a) {
    return {static_cast<double>(a.x), static_cast<double>(a.y), static_cast<double>(a.z)};
}

template <class T>
constexpr T infinity = std::numeric_limits<T>::infinity();

// The integer below x. What no integer holds, infinities and NaN included, becomes the smallest one, on any machine.
template <class T>
inline std::int64_t whole(T x) {
    const T below = std::floor(x);
    if (!(std::abs(below) < T(4611686018427387904.0))) return std::numeric_limits<std::int64_t>::min();
    return static_cast<std::int64_t>(below);
}

// The nearest integer, of two the even one; beyond the integers as `whole`.
inline std::int64_t nearest(double x) { return whole(std::nearbyint(x)); }

}  // namespace notabug
