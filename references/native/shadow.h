// How much light reaches a point: shadow rays, what they pass through, and the shadows of a mesh's own facets.
#pragma once

#include <array>

#include "cutout.h"
#include "options.h"
#include "traverse.h"

namespace notabug {

// 1 - the opacity of `material`; without secondary rays in the scene every surface is opaque.
template <class T, class F>
inline Vec3<T> let_through(const Scene<T>& scene, int material, TransparentShadows transparent) {
    if constexpr (!F::secondary) {
        return {0, 0, 0};
    } else {
        const Coefficients<T>& c = scene.secondary[material];
        if (transparent == TransparentShadows::opaque) return {0, 0, 0};
        if (transparent == TransparentShadows::free && any_positive(c.transmission)) return {1, 1, 1};
        const T rest = T(1) - c.opacity;
        const Vec3<T> every{rest, rest, rest};
        return transparent == TransparentShadows::glass ? every + c.transmission : every;
    }
}

// 1 - the opacity of triangle `i` where the shadow ray meets it, in `through`; and in `steady` that, but a half wherever a
// map's opacity is between 0 and 1: what changes between the points of a smooth shadow is no edge.
//
// What is cut away is no surface, and casts no shadow however `transparent` surfaces do; `whole` is the fault of asking no
// map. False where no map says it.
template <class T, class F>
inline bool cut_through([[maybe_unused]] const Scene<T>& scene, [[maybe_unused]] const Options* option,
                        [[maybe_unused]] const Ray<T>& ray, [[maybe_unused]] int i, [[maybe_unused]] const Met<T>& met,
                        [[maybe_unused]] Vec3<T>& through, [[maybe_unused]] T& steady) {
    if constexpr (!F::cutouts) {
        return false;
    } else {
        const int material = scene.material[scene.object[i]];
        if (!has_map(scene, material)) return false;
        T rest = T(1) - opacity_met(scene, *option, ray, i, met);
        const bool is_cut = scene.cutouts.least[material] > 0;
        if (is_cut ? option->whole_cutouts : option->transparent_shadows == TransparentShadows::opaque) rest = 0;
        through = {rest, rest, rest};
        steady = rest > 0 && rest < 1 ? T(0.5) : rest;
        return true;
    }
}

// The facet's own g.L, g not normalised, of a triangle and the direction L.
template <class T>
inline T rises(const Triangle<T>& p, const Vec3<T>& L) {
    const Vec3<T> e = p.b - p.a, f = p.c - p.a;
    return (e.y * f.z - e.z * f.y) * L.x + (e.z * f.x - e.x * f.z) * L.y + (e.x * f.y - e.y * f.x) * L.z;
}

// Whether N.L falls along the direction L on triangle `i`, as its interpolated normals imply.
//
// A smooth surface that is hollow there meets a ray of small N.L again after 2 N.L over its curvature: the point is in
// shadow. But the facet turns its back to the light, so its shadow ray slips out behind the neighbours: a leak.
template <class T>
inline bool hollow(const Scene<T>& scene, int i, const Vec3<T>& L, T side) {
    const Triangle<T>& p = scene.points[i];
    const Vec3<T> e = p.b - p.a, f = p.c - p.a, g = cross(e, f);
    // the change of the barycentric coordinates b1 and b2 along L, times |g|^2
    const T d1 = dot(cross(L, f), g), d2 = dot(cross(e, L), g);
    const Corners& c = scene.corner[i];
    const Vec3<T>* n = scene.normal;
    const T first = dot(n[c.b] - n[c.a], L), second = dot(n[c.c] - n[c.a], L);
    return (d1 * first + d2 * second) * side < 0;
}

// Where a chord beneath a smooth surface starts: its N'.L and the facet's sagitta there.
template <class T>
struct Chord {
    T side;  // -1 where the viewer sees the mesh from behind
    T slope, depth;
};

// Whether the hit of a ray that started beneath its own facet is facet self-shadow, not a real shadow.
//
// The ray must leave the body there, and its chord of length t must stay within the sagitta: a smooth curve that leaves
// the chord's ends with the slopes N'.L deviates from it by at most t/4 times the larger slope.
template <class T>
inline bool excused(const Scene<T>& scene, int i, const Met<T>& met, const Vec3<T>& L, const Chord<T>& chord) {
    if (scene.sagitta[i] < 0 || rises(scene.points[i], L) * chord.side <= 0) return false;
    const Corners& c = scene.corner[i];
    const Vec3<T>* n = scene.normal;
    const Vec3<T> m = met.b0 * n[c.a] + met.b1 * n[c.b] + met.b2 * n[c.c];
    const T end = std::abs(m.x * L.x + m.y * L.y + m.z * L.z) / length(m);
    return met.t * std::max(chord.slope, end) <= T(4) * std::max(chord.depth, scene.sagitta[i]);
}

// A shadow ray.
//
// `triangle` and `sphere` (or -1) are what the point lies on; the sphere is never hit, nor is the triangle's face if the
// ray `leaves` it exactly. `forgive` 1 is the reference: where the facet turns its back to the light (the interpolated
// normal does not, or nobody would ask), its ray runs beneath the surface. Then hits on the same mesh are passed over
// where `excused` says so, and light into a `hollow` is held back; both count as forgiven. At a corner, where facets
// disagree, `forgive` 2 asks `excused` whichever way this one faces; 0 forgives nothing. `culled` is the fault of passing
// through faces that the ray meets from behind. Within `gap` of the start and of the last crossing there is none.
template <class T>
struct ShadowRay {
    Ray<T> ray;
    T tmin, tmax;
    int triangle, sphere;
    bool leaves;
    int forgive;
    T side, slope;
    TransparentShadows transparent;
    bool culled;
    T gap;
    GapLoses gap_loses;
    const std::uint8_t* links = nullptr;  // of the light to each object, where there are any
    const Options* option = nullptr;      // for maps of opacity

    // Whether the object casts no shadow of this light.
    template <class F>
    bool passes(int object) const {
        if constexpr (!F::emitters) return false;
        else return links && (links[object] & unshadowing);
    }
};

template <class T>
struct LightShare {
    Vec3<T> share;  // of the light that arrives
    bool forgiven;
    T steady = 0;  // the mean of the share, a half for each map of opacity that is neither 0 nor 1: see cut_through
};

// As transmittance, from one crossing to the next: of those within the gap of the last one none counts.
//
// `face` is what the ray leaves, `own` the object whose facets may be forgiven, or -1. Where the gap loses objects, the
// next crossing of one that is met within it, be it of the ray's start, does not count either, where the ray leaves it
// again.
template <class T, class F>
LightShare<T> stepped(const Scene<T>& scene, const ShadowRay<T>& shadow, int face, int own, const Chord<T>& chord) {
    const Ray<T>& ray = shadow.ray;
    const bool objects = shadow.gap_loses == GapLoses::objects;
    Vec3<T> light{1, 1, 1};
    T last = objects ? T(0) : -infinity<T>, tmin = objects ? shadow.tmin : std::max(shadow.tmin, shadow.gap);
    bool forgiven = false;
    int lost = -1;
    T steady = 1;
    while (true) {
        Hit<T> hit = closest(scene, ray, tmin, shadow.tmax, face);
        if constexpr (F::spheres) {
            const Hit<T> ball = closest_sphere(scene.spheres, ray, tmin, hit.t, shadow.sphere);
            if (ball.sphere >= 0) hit = ball;
        }
        if (hit.triangle < 0 && hit.sphere < 0) return {light, forgiven, steady};
        int owner = 0;
        if (hit.triangle >= 0) {
            owner = scene.object[hit.triangle];
            const Met<T> met{hit.t, hit.b0, hit.b1, hit.b2};
            const bool excuse = owner == own && excused(scene, hit.triangle, met, ray.direction, chord);
            if (excuse || (shadow.culled && rises(scene.points[hit.triangle], ray.direction) > 0)) {
                forgiven = forgiven || excuse;
                tmin = hit.t;
                continue;
            }
        } else {
            owner = scene.spheres.object[hit.sphere];
        }
        if (shadow.template passes<F>(owner)) {
            tmin = hit.t;
            continue;
        }
        if (objects && (hit.t - last < shadow.gap || owner == lost)) {
            lost = hit.t - last < shadow.gap ? owner : -1;
            last = tmin = hit.t;
            continue;
        }
        Vec3<T> through;
        T mapped = 1;
        const Met<T> met{hit.t, hit.b0, hit.b1, hit.b2};
        if (hit.triangle < 0 || !cut_through<T, F>(scene, shadow.option, ray, hit.triangle, met, through, mapped)) {
            through = let_through<T, F>(scene, scene.material[owner], shadow.transparent);
            if constexpr (F::cutouts) mapped = mean(through);
        }
        light = mul(light, through);
        if constexpr (F::cutouts) steady *= mapped;
        if (!any_positive(light)) return {light, false};
        last = hit.t;
        tmin = objects ? hit.t : hit.t + shadow.gap;
    }
}

// The flat faces that a ray has crossed, as many as fit: an edge between two triangles of one face is one crossing.
struct Crossed {
    std::array<std::int32_t, 16> face;
    int count = 0;

    // Whether `met` is there already; else it is added.
    bool before(std::int32_t met) {
        for (int j = 0; j < count; ++j) {
            if (face[static_cast<std::size_t>(j)] == met) return true;
        }
        if (count < static_cast<int>(face.size())) face[static_cast<std::size_t>(count++)] = met;
        return false;
    }
};

// Each crossing of a surface with opacity attenuates by 1 - opacity, or as `transparent` has it (see let_through).
template <class T, class F>
LightShare<T> transmittance(const Scene<T>& scene, const ShadowRay<T>& shadow) {
    const Ray<T>& ray = shadow.ray;
    const Vec3<T>& L = ray.direction;
    Vec3<T> light{1, 1, 1};
    T steady = 1;
    bool forgiven = false, own_mesh = false;
    int face = -1, owner = -1;
    Chord<T> chord{shadow.side, shadow.slope, 0};
    if (shadow.triangle >= 0) {
        owner = scene.object[shadow.triangle];
        chord.depth = scene.sagitta[shadow.triangle];
        if (shadow.leaves) face = scene.face[shadow.triangle];
        const bool under = shadow.forgive > 0 && chord.depth >= 0 &&
                           rises(scene.points[shadow.triangle], L) * shadow.side <= 0;
        if (under && !shadow.template passes<F>(owner) && hollow(scene, shadow.triangle, L, shadow.side)) return {{0, 0, 0}, true};
        own_mesh = under || (shadow.forgive > 1 && chord.depth >= 0);
    }
    if (shadow.gap > 0) return stepped<T, F>(scene, shadow, face, own_mesh ? owner : -1, chord);
    if (scene.triangles) {
        const Walk<T> walk(scene, ray);
        bool dark = false;
        [[maybe_unused]] Crossed crossed;
        visit_triangles(scene, walk, shadow.tmin, shadow.tmax, [&](std::int32_t i, const Met<T>& met) {
            if (!(met.t > shadow.tmin && met.t < shadow.tmax) || scene.face[i] == face) return true;
            if (shadow.culled && rises(scene.points[i], L) > 0) return true;
            if (shadow.template passes<F>(scene.object[i])) return true;
            if (own_mesh && scene.object[i] == owner && excused(scene, i, met, L, chord)) {
                forgiven = true;
                return true;
            }
            if constexpr (F::cutouts) {
                if (crossed.before(scene.face[i])) return true;
            }
            Vec3<T> through;
            T mapped = 1;
            if (!cut_through<T, F>(scene, shadow.option, ray, i, met, through, mapped)) {
                through = let_through<T, F>(scene, scene.material[scene.object[i]], shadow.transparent);
                if constexpr (F::cutouts) mapped = mean(through);
            }
            light = mul(light, through);
            if constexpr (F::cutouts) steady *= mapped;
            dark = !any_positive(light);
            return !dark;
        });
        if (dark) return {{0, 0, 0}, false};
    }
    if constexpr (F::spheres) {
        for (std::int64_t i = 0; i < scene.spheres.count; ++i) {
            if (i == shadow.sphere || shadow.template passes<F>(scene.spheres.object[i])) continue;
            const Roots<T> roots = sphere_roots(scene.spheres, i, ray);
            for (const T t : {roots.near, roots.far}) {
                if (!(shadow.tmin < t && t < shadow.tmax)) continue;
                const int material = scene.material[scene.spheres.object[i]];
                const Vec3<T> through = let_through<T, F>(scene, material, shadow.transparent);
                light = mul(light, through);
                if constexpr (F::cutouts) steady *= mean(through);
            }
            if (!any_positive(light)) return {{0, 0, 0}, false};
        }
    }
    return {light, forgiven, steady};
}

}  // namespace notabug
