// Lights with a size: directions towards them, spread evenly over what is seen of them, and the beam they shine in.
//
// A shape is a unit shape under an affine map: see Emitter in scenes_usd/scene.py. Directions have a density over solid
// angle; a unit square maps to them, so that a lattice in the square is a cubature of the light's integral.
#pragma once

#include "sky.h"

namespace notabug {

enum class Shape : int { none, sphere, rect, disk, cylinder, sun, dome };

// A direction towards a light, from a point: none where its density is 0.
template <class T>
struct Aim {
    Vec3<T> L{0, 0, 0};
    T distance = 0, density = 0;
};

template <class T>
struct Frame {
    Vec3<T> x, y, z;
    Vec3<T> of(T u, T v, T w) const { return u * x + v * y + w * z; }
};

// Two directions square to the unit vector z (Duff et al. 2017, "Building an Orthonormal Basis, Revisited").
template <class T>
inline Frame<T> around(const Vec3<T>& z) {
    const T sign = std::copysign(T(1), z.z), a = T(-1) / (sign + z.z), b = z.x * z.y * a;
    return {{T(1) + sign * z.x * z.x * a, sign * b, -sign * z.x}, {b, sign + z.y * z.y * a, -z.y}, z};
}

// A direction about the frame's z, whose 1 - cosine is `below`.
template <class T>
inline Vec3<T> about(const Frame<T>& frame, T turn, T below) {
    const T r = std::sqrt(std::max(below * (T(2) - below), T(0))), phi = T(2) * pi<T> * turn;
    return frame.of(r * std::cos(phi), r * std::sin(phi), T(1) - below);
}

template <class T>
inline Vec3<T> to_world(const Emitter<T>& e, const Vec3<T>& p) {
    return p.x * e.x + p.y * e.y + p.z * e.z;
}

template <class T>
inline Vec3<T> to_local(const Emitter<T>& e, const Vec3<T>& p) {
    return {dot(e.to_x, p), dot(e.to_y, p), dot(e.to_z, p)};
}

// --- spheres ----------------------------------------------------------------------------------------------------------

// 1 - the cosine of the half angle of the unit sphere seen from `o` outside of it.
template <class T>
inline T sphere_spread(const Vec3<T>& o) {
    const T square = T(1) / dot(o, o);
    return square / (T(1) + std::sqrt(std::max(T(1) - square, T(0))));
}

// The aim along the local unit direction `w`, which meets the unit sphere.
template <class T>
inline Aim<T> aim_at_sphere(const Emitter<T>& e, const Vec3<T>& o, const Vec3<T>& w) {
    const Vec3<T> along = to_world(e, w);
    const T grown = length(along), beside = T(1) - dot(cross(o, w), cross(o, w));
    const T t = -dot(o, w) - std::sqrt(std::max(beside, T(0)));
    return {along / grown, t * grown, grown * grown * grown / (e.volume * T(2) * pi<T> * sphere_spread(o))};
}

// --- rectangles -------------------------------------------------------------------------------------------------------

// A triangle on the unit sphere, for directions spread evenly over it (Arvo 1995, "Stratified Sampling of Spherical
// Triangles").
template <class T>
struct SphericalTriangle {
    Vec3<T> a, b, c;
    T alpha, area;

    SphericalTriangle(const Vec3<T>& p, const Vec3<T>& q, const Vec3<T>& r) : a(p), b(q), c(r), alpha(0), area(0) {
        const Vec3<T> ab = cross(a, b), ca = cross(c, a);
        alpha = std::atan2(std::abs(dot(a, cross(b, c))), -dot(ab, ca));  // |ab||ca| times the sine and the cosine
        area = T(2) * std::atan2(std::abs(dot(a, cross(b, c))), T(1) + dot(a, b) + dot(b, c) + dot(c, a));
    }

    static Vec3<T> square(const Vec3<T>& v, const Vec3<T>& to) {  // the unit vector of `v` square to `to`
        const Vec3<T> rest = v - dot(v, to) * to;
        const T size = length(rest);
        return size > 0 ? rest / size : rest;
    }

    Vec3<T> at(const Unit<T>& u) const {
        const T s = std::sin(u.a * area - alpha), t = std::cos(u.a * area - alpha);
        const T cosine = std::cos(alpha), sine = std::sin(alpha);
        const T p = t - cosine, v = s + sine * dot(a, b);
        const T over = (v * s + p * t) * sine;
        const T q = over != 0 ? std::min(std::max(((v * t - p * s) * cosine - v) / over, T(-1)), T(1)) : T(1);
        const Vec3<T> edge = q * a + std::sqrt(std::max(T(1) - q * q, T(0))) * square(c, a);
        const T z = T(1) - u.b * (T(1) - dot(edge, b));
        return z * b + std::sqrt(std::max(T(1) - z * z, T(0))) * square(edge, b);
    }
};

constexpr double small_rectangle = 1e-2;  // steradians: below it a rectangle's points are as good as its directions

// The rectangle as seen from a point: two triangles of its corners.
template <class T>
struct SeenRectangle {
    SphericalTriangle<T> first, second;

    SeenRectangle(const Emitter<T>& e, const Vec3<T>& from)
        : first(corner(e, from, -1, -1), corner(e, from, 1, -1), corner(e, from, 1, 1)),
          second(corner(e, from, -1, -1), corner(e, from, 1, 1), corner(e, from, -1, 1)) {}

    static Vec3<T> corner(const Emitter<T>& e, const Vec3<T>& from, T x, T y) {
        const Vec3<T> to = e.centre + x * e.x + y * e.y - from;
        return to / length(to);
    }
    T area() const { return first.area + second.area; }
    bool is_small() const { return !(area() > static_cast<T>(small_rectangle)); }
    Vec3<T> at(const Unit<T>& u) const {
        const T share = first.area / area();
        if (u.a < share) return first.at({u.a / share, u.b});
        return second.at({(u.a - share) / (T(1) - share), u.b});
    }
};

// --- all of them ------------------------------------------------------------------------------------------------------

// The aim from `at` to the point `p` of a surface whose unit normal there is `n` and of which a unit of the square covers
// `area`.
template <class T>
inline Aim<T> aim_at_point(const Vec3<T>& at, const Vec3<T>& p, const Vec3<T>& n, T area) {
    const Vec3<T> to = p - at;
    const T distance = length(to);
    if (!(distance > 0)) return {};
    const Vec3<T> L = to / distance;
    const T cosine = -dot(n, L);
    if (!(cosine > 0)) return {};
    return {L, distance, distance * distance / (cosine * area)};
}

// As aim_at_point, of the cylinder's local point (x, cos, sin), from the local place `o`.
template <class T>
inline Aim<T> aim_at_cylinder(const Emitter<T>& e, const Vec3<T>& at, const Vec3<T>& o, T x, T c, T s) {
    const T radius = std::sqrt(o.y * o.y + o.z * o.z);
    const Vec3<T> out = c * e.to_y + s * e.to_z;
    const T grown = length(out);
    return aim_at_point(at, e.centre + to_world(e, Vec3<T>{x, c, s}), out / grown,
                        T(4) * std::acos(T(1) / radius) * e.volume * grown);
}

// Whether the light can be seen from `at` at all: from outside, from its bright side.
template <class T>
inline bool faces(const Emitter<T>& e, const Vec3<T>& at) {
    switch (static_cast<Shape>(static_cast<int>(e.shape))) {
        case Shape::sphere: {
            const Vec3<T> o = to_local(e, at - e.centre);
            return dot(o, o) > T(1);
        }
        case Shape::cylinder: {
            const Vec3<T> o = to_local(e, at - e.centre);
            return o.y * o.y + o.z * o.z > T(1);
        }
        case Shape::rect:
        case Shape::disk: return dot(at - e.centre, e.normal) > 0;
        default: return true;
    }
}

// What is seen of a light from a point `at` with the normal N.
template <class T>
struct View_of {
    const Skies<T>& skies;
    const Emitter<T>& e;
    const Vec3<T>& at;
    const Vec3<T>& N;
    Vec3<T> o;
    bool seen;
    T share = 1;             // of a rectangle's first triangle
    T area = 0;              // of the rectangle's directions, 0 where its points are taken

    View_of(const Skies<T>& pictures, const Emitter<T>& emitter, const Vec3<T>& from, const Vec3<T>& normal)
        : skies(pictures), e(emitter), at(from), N(normal), o(to_local(emitter, from - emitter.centre)), seen(faces(emitter, from)) {
        if (seen && shape() == Shape::rect) {
            const SeenRectangle<T> rectangle(e, at);
            if (!rectangle.is_small()) area = rectangle.area();
        }
    }

    Shape shape() const { return static_cast<Shape>(static_cast<int>(e.shape)); }

    Aim<T> towards(const Unit<T>& u) const {
        if (!seen) return {};
        switch (shape()) {
            case Shape::sphere: return aim_at_sphere(e, o, about(around(-o / length(o)), u.a, u.b * sphere_spread(o)));
            case Shape::rect:
                if (area > 0) return along(SeenRectangle<T>(e, at).at(u));
                return aim_at_point(at, e.centre + (T(2) * u.a - T(1)) * e.x + (T(2) * u.b - T(1)) * e.y, e.normal,
                                    e.area);
            case Shape::disk: {
                const T r = std::sqrt(u.b), phi = T(2) * pi<T> * u.a;
                return aim_at_point(at, e.centre + (r * std::cos(phi)) * e.x + (r * std::sin(phi)) * e.y, e.normal, e.area);
            }
            case Shape::cylinder: {
                const T phi = std::atan2(o.z, o.y) +
                              (T(2) * u.a - T(1)) * std::acos(T(1) / std::sqrt(o.y * o.y + o.z * o.z));
                return aim_at_cylinder(e, at, o, T(2) * u.b - T(1), std::cos(phi), std::sin(phi));
            }
            case Shape::sun:
                return {about(around(-e.axis), u.a, u.b * e.spread), infinity<T>, T(1) / (T(2) * pi<T> * e.spread)};
            case Shape::dome: {
                if (e.sky >= 0) return towards_sky(u);
                const T r = std::sqrt(u.b), phi = T(2) * pi<T> * u.a, up = std::sqrt(std::max(T(1) - u.b, T(0)));
                return {around(N).of(r * std::cos(phi), r * std::sin(phi), up), infinity<T>, up / pi<T>};
            }
            default: return {};
        }
    }

    // The aim along the unit direction L, with the density that `towards` gives it; none where L misses the light.
    Aim<T> along(const Vec3<T>& L) const {
        if (!seen) return {};
        switch (shape()) {
            case Shape::sphere: {
                Vec3<T> w = to_local(e, L);
                w = w / length(w);
                if (!(dot(o, w) < 0) || dot(cross(o, w), cross(o, w)) > T(1)) return {};
                Aim<T> made = aim_at_sphere(e, o, w);
                made.L = L;
                return made;
            }
            case Shape::rect:
            case Shape::disk: {
                const T slope = dot(e.normal, L);
                if (!(slope < 0)) return {};
                const T t = dot(e.centre - at, e.normal) / slope;
                const Vec3<T> p = to_local(e, at + t * L - e.centre);
                if (shape() == Shape::disk ? p.x * p.x + p.y * p.y > T(1)
                                           : std::max(std::abs(p.x), std::abs(p.y)) > T(1) + T(16) * unit_roundoff())
                    return {};
                return {L, t, area > 0 ? T(1) / area : t * t / (-slope * e.area)};
            }
            case Shape::cylinder: {
                const Vec3<T> w = to_local(e, L);
                const T a = w.y * w.y + w.z * w.z, b = o.y * w.y + o.z * w.z, side = o.y * w.z - o.z * w.y;
                if (!(b < 0) || side * side > a) return {};
                const T t = (-b - std::sqrt(a - side * side)) / a;
                const Vec3<T> p = o + t * w;
                if (std::abs(p.x) > T(1)) return {};
                Aim<T> made = aim_at_cylinder(e, at, o, p.x, p.y, p.z);
                made.L = L;
                return made;
            }
            case Shape::sun: {
                const Vec3<T> off = L + e.axis;
                if (dot(off, off) > T(2) * e.spread) return {};
                return {L, infinity<T>, T(1) / (T(2) * pi<T> * e.spread)};
            }
            case Shape::dome: {
                const T nl = dot(N, L);
                if (e.sky >= 0) return {L, infinity<T>, sky_density(L)};
                return {L, infinity<T>, std::max(nl, T(0)) / pi<T>};
            }
            default: return {};
        }
    }

    // Of a dome with a picture: a share of the directions follows the picture, the others the cosine.
    Aim<T> towards_sky(const Unit<T>& u) const {
        const int k = static_cast<int>(e.sky);
        const T share = skies.share[k];
        Vec3<T> L;
        if (u.a < share) {
            const Vec3<T> along = to_world(e, toward_texel(skies, k, Unit<T>{u.a / share, u.b}));
            L = along / length(along);
        } else {
            const T r = std::sqrt(u.b), phi = T(2) * pi<T> * (u.a - share) / (T(1) - share);
            L = around(N).of(r * std::cos(phi), r * std::sin(phi), std::sqrt(std::max(T(1) - u.b, T(0))));
        }
        return {L, infinity<T>, sky_density(L)};
    }

    T sky_density(const Vec3<T>& L) const {
        const int k = static_cast<int>(e.sky);
        const T share = skies.share[k], even = std::max(dot(N, L), T(0)) / pi<T>;
        return share * density_of_texel(skies, k, to_local(e, L)) + (T(1) - share) * even;
    }

    static constexpr T unit_roundoff() { return std::numeric_limits<T>::epsilon(); }
};

// What the beam leaves of the light that goes along -L: UsdLux ShapingAPI.
template <class T>
inline Vec3<T> beam(const Emitter<T>& e, const Vec3<T>& L) {
    if (e.shaped == 0) return {1, 1, 1};
    const T cosine = -dot(e.axis, L), off = std::atan2(length(cross(e.axis, L)), cosine);
    if (off > e.cone) return {0, 0, 0};
    T left = 1;
    if (e.cone > e.begin && off > e.begin) {
        const T x = (off - e.begin) / (e.cone - e.begin);
        left = T(1) - x * x * (T(3) - T(2) * x);
    }
    const T focus = e.focus > 0 ? std::pow(std::abs(cosine), e.focus) : T(1);
    return {left * (e.tint.x + (T(1) - e.tint.x) * focus), left * (e.tint.y + (T(1) - e.tint.y) * focus),
            left * (e.tint.z + (T(1) - e.tint.z) * focus)};
}

// The fault of a flat light whose points send as much light to every side as straight ahead.
template <class T>
inline T uncosined(const Emitter<T>& e, const Vec3<T>& L) {
    const Shape shape = static_cast<Shape>(static_cast<int>(e.shape));
    if (shape != Shape::rect && shape != Shape::disk) return 1;
    return T(1) / std::max(-dot(e.normal, L), static_cast<T>(1e-3));
}

// What is left of the light that goes along -L: of a dome with a picture what that has there, of any other its beam.
template <class T>
inline Vec3<T> shone(const Skies<T>& skies, const Emitter<T>& e, const Vec3<T>& L) {
    return e.sky >= 0 ? sky(skies, static_cast<int>(e.sky), to_local(e, L)) : beam(e, L);
}

}  // namespace notabug
