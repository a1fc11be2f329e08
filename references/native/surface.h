// What a ray sees: the first hit, which of coincident surfaces wins it, and the surface there.
#pragma once

#include "preview.h"
#include "shade.h"
#include "shadow.h"
#include "start.h"

namespace notabug {

constexpr double coincident = 1.0 / 33554432;  // 2^-25 of the scene's size: what float32 points of one place may lie
                                               // apart; nearer, surfaces coincide

// A ray that waits to be followed.
template <class T>
struct Waiting {
    Ray<T> ray;
    Vec3<T> weight;
    int generation;    // bounces * passages + straight passages through opacity
    int face, sphere;  // what it leaves and cannot meet again, or -1
    T slope;           // N'.D where it starts
    int beneath;       // triangle that it leaves beneath, or -1
    int inside;        // object of the glass it is in, or -1
};

// The first hit of a ray.
template <class T>
struct Sight {
    Hit<T> hit;
    T between = 0;     // how far coincident surfaces may lie apart
    int blend = -1;    // material of a coincident surface that is blended with the one seen
    bool unlit = false;
};

// Whether the ray meets anything from tmin on; what is in `sight`.
template <class T, class F>
bool see(const Scene<T>& scene, const Options& option, const Waiting<T>& from, T tmin, T far, Sight<T>& sight) {
    const Ray<T>& ray = from.ray;
    const bool exact = option.start == Start::exact;
    int skip = exact ? from.face : -1;
    Hit<T>& hit = sight.hit;
    const Uncut<T, F> there{scene, option, ray};
    hit = closest(scene, ray, tmin, far, skip, there);
    while (from.beneath >= 0 && hit.triangle >= 0 && scene.object[hit.triangle] == scene.object[from.beneath]) {
        // beneath its own facet, above the smooth surface: what the ray meets there is no surface
        const T turn = rises(scene.points[from.beneath], ray.direction) <= 0 ? T(1) : T(-1);
        const Met<T> met{hit.t, hit.b0, hit.b1, hit.b2};
        if (!excused(scene, hit.triangle, met, ray.direction, {turn, from.slope, scene.sagitta[from.beneath]})) break;
        tmin = hit.t;
        skip = scene.face[hit.triangle];
        hit = closest(scene, ray, tmin, far, skip, there);
    }
    if constexpr (F::spheres) {
        const Hit<T> ball = closest_sphere(scene.spheres, ray, tmin, hit.t, exact ? from.sphere : -1);
        if (ball.sphere >= 0) hit.triangle = -1, hit.sphere = ball.sphere, hit.t = ball.t;
    }
    return hit.triangle >= 0 || hit.sphere >= 0;
}

// Of coincident surfaces the first of the scene wins; within the renderer's resolution another one may. False where the
// fault of losing both leaves a hole.
template <class T, class F>
bool settle(const Scene<T>& scene, const Options& option, const Ray<T>& ray, Sight<T>& sight) {
    Hit<T>& hit = sight.hit;
    T extent = scene.radius * static_cast<T>(coincident) + T(32) * unit<T> * hit.t;
    sight.between = extent;
    if (option.ties == Ties::nearest) return true;
    int found = 0;
    if constexpr (F::spheres) {
        found = hit.sphere >= 0 ? scene.spheres.object[hit.sphere] : scene.object[hit.triangle];
    } else {
        found = scene.object[hit.triangle];
    }
    const Uncut<T, F> there{scene, option, ray};
    const Rival<T> first = rival<T, F>(scene, ray, hit.t - extent, hit.t + extent, found, -1, Other::first, there);
    if (first.object >= 0 && first.object != found) hit = first.hit, found = first.object;
    if (option.ties == Ties::first) return true;
    const Vec3<T>& o = ray.origin;
    const T axial = hit.t * std::abs(dot(ray.direction, scene.camera.forward));
    extent += static_cast<T>(option.resolution) *
              (hit.t + scene.radius + std::abs(o.x) + std::abs(o.y) + std::abs(o.z));
    extent += static_cast<T>(option.near_resolution) * axial * hit.t;
    const Rival<T> other = rival<T, F>(scene, ray, hit.t - extent, hit.t + extent, found,
                                       hit.triangle >= 0 ? scene.face[hit.triangle] : -1,
                                       option.ties == Ties::next ? Other::next : Other::another, there);
    if (other.object < 0) return true;
    sight.between = std::max(sight.between, std::abs(other.hit.t - hit.t));
    if (option.ties == Ties::hole) return false;
    if (option.ties == Ties::blend) sight.blend = scene.material[other.object];
    if (option.ties == Ties::another || option.ties == Ties::next) hit = other.hit;
    sight.unlit = option.ties == Ties::unlit;
    return true;
}

// The surface at a hit.
template <class T>
struct Surface {
    Vec3<T> at, facet;  // the facet's normal: of unit length, on the side that its corners' order says
    Vec3<T> normal;     // the one that shades, on the side of the viewer
    T side;             // 1, or -1 where the facet is seen from behind
    T u, v, sagitta;
    int face, object;
    bool painted;
    bool turned;         // a normal that faced away was flipped, and the light it is turned to is not blocked
    Weights<T> weights;  // of the face's corners, on a mesh
};

template <class T>
void mesh_surface(const Scene<T>& scene, const Options& option, const Ray<T>& ray, const Hit<T>& hit, Surface<T>& s) {
    const int i = hit.triangle;
    s.face = scene.face[i];
    s.object = scene.object[i];
    const Triangle<T>& p = scene.points[i];
    const Vec3<T>& D = ray.direction;
    Vec3<T> g = cross(p.b - p.a, p.c - p.a);
    g = g / length(g);
    s.side = dot(g, -D) >= 0 ? T(1) : T(-1);
    if (option.refine) {  // the ray shot back at the facet's plane takes off what t was too long
        const T back = dot(s.at - p.a, g) / dot(D, g);
        s.at = s.at - back * D;
    }
    Weights<T> weights = corner_weights(scene, i, hit.b0, hit.b1, hit.b2, s.at);
    s.sagitta = scene.sagitta[i];
    s.facet = s.normal = g;
    if (s.sagitta >= 0) {
        s.normal = weights.of(scene.normal);
        const T size = length(s.normal);
        if (size == 0) s.normal = g;  // opposite normals cancel between their corners: the facet has one
        else if (option.normals == Normals::unit) s.normal = s.normal / size;
    }
    s.weights = weights;
    if (scene.textures.info) {
        if (option.affine) {
            const Vec3<T> screen = screen_weights(scene, i, hit.b0, hit.b1, hit.b2);
            weights.w0 = screen.x, weights.w1 = screen.y, weights.w2 = screen.z, weights.w3 = 0;
        }
        s.u = weights.of(scene.uv, 0);
        s.v = weights.of(scene.uv, 1);
    }
}

template <class T>
void sphere_surface(const Scene<T>& scene, const Ray<T>& ray, const Hit<T>& hit, Surface<T>& s) {
    s.object = scene.spheres.object[hit.sphere];
    const Affine<T>& to_local = scene.spheres.to_local[hit.sphere];
    const Vec3<T> n = to_local.transposed(to_local.point(s.at));  // the inverse transpose of to_world
    s.facet = s.normal = n / length(n);
    s.side = dot(s.normal, -ray.direction) < 0 ? T(-1) : T(1);
}

template <class T, class F>
Surface<T> surface(const Scene<T>& scene, const Options& option, const Ray<T>& ray, const Hit<T>& hit) {
    Surface<T> s{ray.origin + hit.t * ray.direction, {}, {0, 0, 1}, 1, 0, 0, -1, -1, 0, true, false, {}};
    if (hit.triangle >= 0) {
        mesh_surface(scene, option, ray, hit, s);
    } else if constexpr (F::spheres) {
        sphere_surface(scene, ray, hit, s);
    }
    s.normal = s.side * s.normal;
    if (dot(s.normal, -ray.direction) < 0) {
        s.turned = option.silhouette == Silhouette::flip_lit;
        if (s.turned || option.silhouette == Silhouette::flip) s.normal = -s.normal;
        s.painted = option.silhouette != Silhouette::black;
    }
    return s;
}

}  // namespace notabug
