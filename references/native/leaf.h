// The triangles of a leaf, four side by side, and a ray against all of them: what `ray_triangle` does, to the last bit,
// without a branch for each.
#pragma once

#include "intersect.h"
#include "lanes.h"

namespace notabug {

template <class T>
struct Leaf {
    T corner[3][3][together];  // of each corner x, y, z; a place without a triangle has its three corners in one point
};

// Of four triangles the signed areas of the edges and the distances of the corners along the ray's main axis, and one bit
// for each that is hit.
template <class T>
struct MetLeaf {
    T u[together], v[together], w[together], az[together], bz[together], cz[together];
    unsigned hits;

    Met<T> at(int i, const Shear<T>& k) const { return met_at(u[i], v[i], w[i], az[i], bz[i], cz[i], k.sz); }
};

template <class T>
[[gnu::always_inline]] inline void ray_leaf(const Vec3<T>& o, const Shear<T>& k, const Leaf<T>& leaf, MetLeaf<T>& met) {
    using P = Pack<T>;
    constexpr int lanes = sizeof(P) / sizeof(T);
    const T okx = component(o, k.kx), oky = component(o, k.ky), okz = component(o, k.kz);
    met.hits = 0;
    for (int i = 0; i < together; i += lanes) {
        const auto row = [&](int corner, int axis) { return pack_of<T>(leaf.corner[corner][axis] + i); };
        const P az = row(0, k.kz) - okz, bz = row(1, k.kz) - okz, cz = row(2, k.kz) - okz;
        const P ax = (row(0, k.kx) - okx) - k.sx * az, ay = (row(0, k.ky) - oky) - k.sy * az;
        const P bx = (row(1, k.kx) - okx) - k.sx * bz, by = (row(1, k.ky) - oky) - k.sy * bz;
        const P cx = (row(2, k.kx) - okx) - k.sx * cz, cy = (row(2, k.ky) - oky) - k.sy * cz;
        const P u = cx * by - cy * bx, v = ax * cy - ay * cx, w = bx * ay - by * ax;
        const P det = u + v + w, none{};
        const unsigned below = bits_of(smaller(smaller(u, v), w) < none), above = bits_of(larger(larger(u, v), w) > none);
        met.hits |= (bits_of(det != none) & ~(below & above)) << i;
        keep(u, met.u + i), keep(v, met.v + i), keep(w, met.w + i);
        keep(az, met.az + i), keep(bz, met.bz + i), keep(cz, met.cz + i);
    }
}

}  // namespace notabug
