// Ray against triangle and sphere, and the inverse of a bilinear map: the three formulas everything rests on.
//
// Tested against a 50-digit oracle in tests/references/test_oracle.py.
#pragma once

#include <utility>

#include "scene.h"

namespace notabug {

// The shear that turns a direction into +z: kz is its largest axis.
// Woop, Benthin and Wald 2013, "Watertight Ray/Triangle Intersection", JCGT 2(1).
template <class T>
struct Shear {
    int kx, ky, kz;
    T sx, sy, sz;
};

template <class T>
inline T component(const Vec3<T>& v, int k) {
    return (&v.x)[k];
}

template <class T>
inline Shear<T> shear(const Vec3<T>& d) {
    const T ax = std::abs(d.x), ay = std::abs(d.y), az = std::abs(d.z);
    int kx, ky, kz;
    if (az >= ax && az >= ay) {
        kx = 0, ky = 1, kz = 2;
    } else if (ax >= ay) {
        kx = 1, ky = 2, kz = 0;
    } else {
        kx = 2, ky = 0, kz = 1;
    }
    const T c = component(d, kz);
    if (c < 0) std::swap(kx, ky);  // keeps the winding, so that the sign of the determinant tells front from back
    return {kx, ky, kz, component(d, kx) / c, component(d, ky) / c, T(1) / c};
}

// Where a ray meets a triangle, t = infinity on a miss.
template <class T>
struct Met {
    T t, b0, b1, b2;
};

// A hit from the signed areas of the edges and the distances of the corners along the main axis.
template <class T>
inline Met<T> met_at(T u, T v, T w, T az, T bz, T cz, T sz) {
    const T det = u + v + w;
    u = u / det, v = v / det, w = w / det;  // first: a product of three lengths would underflow on tiny triangles
    return {(u * az + v * bz + w * cz) * sz, u, v, w};
}

// The edge tests of two triangles that share an edge use the same products, so no ray passes between them. t is in units
// of the direction's length and may be negative: the caller bounds it.
template <class T>
inline Met<T> ray_triangle(const Vec3<T>& o, const Shear<T>& k, const Triangle<T>& p) {
    const T okx = component(o, k.kx), oky = component(o, k.ky), okz = component(o, k.kz);
    const T az = component(p.a, k.kz) - okz;
    const T bz = component(p.b, k.kz) - okz;
    const T cz = component(p.c, k.kz) - okz;
    const T ax = (component(p.a, k.kx) - okx) - k.sx * az;
    const T ay = (component(p.a, k.ky) - oky) - k.sy * az;
    const T bx = (component(p.b, k.kx) - okx) - k.sx * bz;
    const T by = (component(p.b, k.ky) - oky) - k.sy * bz;
    const T cx = (component(p.c, k.kx) - okx) - k.sx * cz;
    const T cy = (component(p.c, k.ky) - oky) - k.sy * cz;
    const T u = cx * by - cy * bx;
    const T v = ax * cy - ay * cx;
    const T w = bx * ay - by * ax;
    if (((u < 0 || v < 0 || w < 0) && (u > 0 || v > 0 || w > 0)) || u + v + w == 0) return {infinity<T>, 0, 0, 0};
    return met_at(u, v, w, az, bz, cz, k.sz);
}

template <class T>
struct Roots {
    T near, far;
};

// Both roots of a ray against the sphere of `radius` about the origin; infinite on a miss.
// Haines, Guenther and Akenine-Moeller 2019, "Precision Improvements for Ray/Sphere Intersection", Ray Tracing Gems 7:
// the discriminant from the vector between centre and ray, the roots without cancellation.
template <class T>
inline Roots<T> ray_sphere(const Vec3<T>& o, const Vec3<T>& d, T radius) {
    const T a = dot(d, d);
    const T b = -dot(o, d);
    const T c = o.x * o.x + o.y * o.y + o.z * o.z - radius * radius;
    const T s = b / a;
    const Vec3<T> l = o + s * d;
    const T discriminant = radius * radius - dot(l, l);
    if (discriminant < 0) return {infinity<T>, infinity<T>};
    const T root = std::sqrt(a * discriminant);
    const T q = b >= 0 ? b + root : b - root;
    if (q == 0) return {-root / a, root / a};
    T t0 = c / q, t1 = q / a;
    if (t0 > t1) std::swap(t0, t1);
    return {t0, t1};
}

template <class T>
struct Parameters {
    T s, t;
};

// (s, t) in [0, 1]^2 with P = (1-s)(1-t) q0 + s(1-t) q1 + st q2 + (1-s)t q3, for a convex quad.
// The quadratic in t is solved by the root that does not cancel; where the quad is a parallelogram its leading coefficient
// vanishes and the same formula gives the linear root. Results are clamped to [0, 1].
template <class T>
inline Parameters<T> inverse_bilinear(T x, T y, const PlaneQuad<T>& q) {
    const T ex = q.x[1][0] - q.x[0][0], ey = q.x[1][1] - q.x[0][1];
    const T fx = q.x[3][0] - q.x[0][0], fy = q.x[3][1] - q.x[0][1];
    const T gx = (q.x[2][0] - q.x[3][0]) - ex, gy = (q.x[2][1] - q.x[3][1]) - ey;
    const T hx = x - q.x[0][0], hy = y - q.x[0][1];
    const T a = gx * fy - gy * fx;
    const T b = ex * fy - ey * fx + hx * gy - hy * gx;
    const T c = hx * ey - hy * ex;
    const T discriminant = b * b - T(4) * a * c;
    const T root = discriminant > 0 ? std::sqrt(discriminant) : T(0);
    const T k = b >= 0 ? -(b + root) / T(2) : -(b - root) / T(2);
    T t = 0;
    if (k != 0) {
        t = c / k;
        if (a != 0) {
            const T other = k / a;
            if (std::abs(other - T(0.5)) < std::abs(t - T(0.5))) t = other;
        }
    } else if (a != 0) {
        t = -b / (T(2) * a);
    }
    t = std::min(std::max(t, T(0)), T(1));
    const T rx = ex + gx * t, ry = ey + gy * t;
    T numerator = hx - fx * t, denominator = rx;
    if (std::abs(rx) < std::abs(ry)) numerator = hy - fy * t, denominator = ry;
    const T s = denominator != 0 ? numerator / denominator : T(0);
    return {std::min(std::max(s, T(0)), T(1)), t};
}

}  // namespace notabug
