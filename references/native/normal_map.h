// Normal maps: which frame their vectors are in, and what becomes of light and view that the mapped normal sees otherwise
// than the surface's own.
//
// UsdPreviewSurface says no more than that normals are in tangent space. The reference has the frame of each triangle's
// dP/du, and takes the surface for what it is: light comes from above it, and no facet reflects towards a viewer behind.
// The other values of the switches are what renderers have: see references/models/normal_maps.py.
#pragma once

#include "preview.h"

namespace notabug {

// Where a normal map is looked up: the surface's normal N on the side of the viewer, the facet's on that side, and V.
template <class T>
struct MapPoint {
    int material, triangle;
    const Weights<T>& weights;
    T u, v, side;
    Vec3<T> N, facet, V;
};

template <class T>
struct Bump {
    Vec3<T> normal;  // that shades
    Vec3<T> glossy;  // that highlights have
    bool mapped = false, black = false;
};

// The two tangents of a map's frame; false where no coordinates run along the surface.
template <class T>
bool tangents(const Scene<T>& scene, const Options& option, const MapPoint<T>& at, Vec3<T>& tangent, Vec3<T>& across) {
    const Triangle<T>& p = scene.points[at.triangle];
    const Corners& c = scene.corner[at.triangle];
    const T* uv = scene.uv;
    const Vec3<T>& N = at.N;
    const T u1 = uv[2 * c.b] - uv[2 * c.a], v1 = uv[2 * c.b + 1] - uv[2 * c.a + 1];
    const T u2 = uv[2 * c.c] - uv[2 * c.a], v2 = uv[2 * c.c + 1] - uv[2 * c.a + 1];
    const T area = u1 * v2 - u2 * v1, sign = area < 0 ? T(-1) : T(1);
    const Vec3<T> e1 = p.b - p.a, e2 = p.c - p.a;
    const Vec3<T> along = sign * (v2 * e1 - v1 * e2), up = sign * (u1 * e2 - u2 * e1);  // times |area|
    tangent = along - dot(along, N) * N;
    const T size = length(tangent);
    if (!(size > 0) || area == 0) return false;
    tangent = tangent / size;
    if (option.tangents == Tangents::cotangent) {  // Schueler 2013: the gradients of u and v, the longer one of length 1
        const Vec3<T> one = cross(e2, N), other = cross(N, e1);
        Vec3<T> du = u1 * one + u2 * other, dv = v1 * one + v2 * other;
        const T longest = std::sqrt(std::max(dot(du, du), dot(dv, dv)));
        if (!(longest > 0)) return false;
        const T turn = dot(du, tangent) < 0 ? T(-1) : T(1);
        tangent = (turn / longest) * du, across = (turn / longest) * dv;
        return true;
    }
    if (option.tangents == Tangents::interpolated && scene.tangent) tangent = at.weights.of(scene.tangent);
    across = cross(N, tangent);
    if (option.tangents == Tangents::right_handed) across = at.side * across;
    else if (dot(across, up) < 0) across = -across;  // T, B and N are no right-handed frame where coordinates are mirrored
    return true;
}

// `N` raised towards the facet's normal g until the mirror image of V leaves the facet, at the angle whose cosine is
// the lesser of .01 and .9 g.V: Cycles' ensure_valid_specular_reflection. In the plane of g and N, N' = x X + z g has
// R.g = 2 z (x V.X + z V.g) - V.g, which is that cosine where 4 a z^4 - 2 b z^2 + c = 0.
template <class T>
inline Vec3<T> raised(const Vec3<T>& g, const Vec3<T>& V, const Vec3<T>& N) {
    const T vz = dot(V, g), least = std::min(T(0.9) * vz, T(0.01));
    const Vec3<T> R = (T(2) * dot(N, V)) * N - V;
    if (!(vz > 0) || dot(g, R) >= least) return N;
    const Vec3<T> beside = N - dot(N, g) * g;
    const T size = length(beside);
    if (!(size > 0)) return N;
    const Vec3<T> X = beside / size;
    const T vx = dot(V, X), a = vx * vx + vz * vz, b = T(2) * (a + vz * least), c = (least + vz) * (least + vz);
    const T root = std::sqrt(std::max(b * b - T(4) * a * c, T(0)));
    const T z2 = T(0.25) * (vx < 0 ? b + root : b - root) / a;
    return std::sqrt(std::max(T(1) - z2, T(0))) * X + std::sqrt(std::max(z2, T(0))) * g;
}

// The normal that the material's map says at a point; the surface's own where it has none.
template <class T>
inline Bump<T> bump_at(const Scene<T>& scene, const Options& option, const MapPoint<T>& at) {
    Bump<T> made{at.N, at.N};
    const std::int32_t map = scene.previews.maps[at.material].normal;
    if (map < 0 || at.triangle < 0 || !scene.textures.info) return made;
    const Vec3<T> said = texel(scene.textures, map, at.u, at.v, option.texels);
    Vec3<T> turned = said;
    if (option.tangents != Tangents::world) {
        Vec3<T> tangent, across;
        if (!tangents(scene, option, at, tangent, across)) return made;
        // a bump is a dent from behind: there the whole mapped normal turns round, and not N alone
        const T side = option.bumps_behind ? T(1) : at.side;
        turned = (side * said.x) * tangent + (side * said.y) * across + said.z * at.N;
    }
    const T reach = length(turned);
    if (!(reach > 0)) return made;
    made.mapped = true;
    made.normal = option.raw_mapped ? turned : turned / reach;
    if (option.mapped_away == MappedAway::flip || option.mapped_away == MappedAway::black) {
        if (dot(at.N, at.V) * dot(made.normal, at.V) <= 0) {
            made.black = option.mapped_away == MappedAway::black;
            made.normal = (T(2) * dot(made.normal, at.N)) * at.N - made.normal;
        }
    }
    made.glossy = option.mapped_away == MappedAway::raised ? raised(at.facet, at.V, made.normal) : made.normal;
    return made;
}

// How much of the light along L reaches a mapped normal N' of a surface whose own is N.
//
// Estevez, Lecocq and Stein 2019, equations 2 and 3: the masking of GGX with alpha^2 = tan^2(N, N') / 8, at most 1. Chiang,
// Li and Burley 2019: -g^3 + g^2 + g of g = N.L / (N'.L N.N').
template <class T>
inline T softening(BumpLight kind, const Vec3<T>& N, const Vec3<T>& mapped, const Vec3<T>& L) {
    const T nl = dot(N, L), nm = dot(N, mapped), ml = dot(mapped, L);
    if (kind == BumpLight::tamed) {
        const T down = ml * nm;
        const T g = down > 0 ? nl / down : T(1);
        if (g >= 1) return 1;
        return g > 0 ? ((T(1) - g) * g + T(1)) * g : T(0);
    }
    const auto tan2 = [](T cosine) { return (T(1) - cosine * cosine) / (cosine * cosine); };
    const T alpha2 = nm != 0 ? std::min(T(0.125) * std::max(tan2(nm), T(0)), T(1)) : T(1);
    return T(2) / (T(1) + std::sqrt(T(1) + alpha2 * std::max(tan2(nl), T(0))));
}

// What the surface reflects whose own normal is N, with what its map makes of that.
template <class T>
inline Reflected<T> reflected_bump(const Options& option, const PreviewSurface<T>& surface, const Vec3<T>& albedo,
                                   const Bump<T>& bump, const Vec3<T>& N, const Vec3<T>& L, const Vec3<T>& V) {
    if (bump.black) return {{0, 0, 0}, {0, 0, 0}};
    Reflected<T> made = reflected(surface, albedo, bump.normal, L, V);
    if (!bump.mapped) return made;
    if (option.mapped_away == MappedAway::raised) made.specular = reflected(surface, albedo, bump.glossy, L, V).specular;
    if (option.bump_light == BumpLight::cut || option.bump_light == BumpLight::lit) return made;
    const T soft = softening(option.bump_light, N, bump.normal, L);
    made.diffuse = soft * made.diffuse;
    if (option.bump_light != BumpLight::softened_diffuse) made.specular = soft * made.specular;
    return made;
}

}  // namespace notabug
