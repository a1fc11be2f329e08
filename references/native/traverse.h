// Walks through the hierarchy: the closest hit, and what lies as near.
#pragma once

#include "bvh.h"
#include "intersect.h"

namespace notabug {

// What a ray needs at every box and triangle. For each axis `near` is the column of a box's bounds that it meets first;
// the far side is 3 columns from it.
template <class T>
struct Walk {
    Vec3<T> origin, inverse;
    Shear<T> frame;
    int near_x, near_y, near_z;

    explicit Walk(const Ray<T>& ray)
        : origin(ray.origin),
          inverse{T(1) / ray.direction.x, T(1) / ray.direction.y, T(1) / ray.direction.z},
          frame(shear(ray.direction)),
          near_x(inverse.x >= 0 ? 0 : 3),
          near_y(inverse.y >= 0 ? 1 : 4),
          near_z(inverse.z >= 0 ? 2 : 5) {}

    // Where the ray enters a box, or infinity. Written so that 0 * infinity, which is NaN, never loses a box.
    T enter(const T* box, T tmin, T tmax) const {
        T near = tmin, far = tmax;
        const T x0 = (box[near_x] - origin.x) * inverse.x, x1 = (box[3 - near_x] - origin.x) * inverse.x;
        const T y0 = (box[near_y] - origin.y) * inverse.y, y1 = (box[5 - near_y] - origin.y) * inverse.y;
        const T z0 = (box[near_z] - origin.z) * inverse.z, z1 = (box[7 - near_z] - origin.z) * inverse.z;
        near = x0 > near ? x0 : near;
        near = y0 > near ? y0 : near;
        near = z0 > near ? z0 : near;
        far = x1 < far ? x1 : far;
        far = y1 < far ? y1 : far;
        far = z1 < far ? z1 : far;
        // rounding: a few ulp more keep the test conservative (Ize 2013, "Robust BVH Ray Traversal")
        const T slack = far * T(sizeof(T) == 4 ? 1e-6 : 1e-15);
        return near <= far + slack ? near : infinity<T>;
    }
};

// A hit of a triangle or of an analytic sphere; the other is -1.
template <class T>
struct Hit {
    int triangle, sphere;
    T t, b0, b1, b2;
};

// The nearest triangle with tmin < t < tmax whose face is not `skip`.
// Of two at exactly the same t the one that comes first in the scene wins.
template <class T>
Hit<T> closest(const Scene<T>& scene, const Ray<T>& ray, T tmin, T tmax, int skip) {
    Hit<T> hit{-1, -1, tmax, 1, 1, 1};
    if (scene.triangles == 0) return hit;
    const Walk<T> walk(ray);
    std::int32_t stack[stack_size];
    int top = 0;
    std::int32_t node = 0;
    if (walk.enter(scene.bounds, tmin, hit.t) == infinity<T>) return hit;
    while (true) {
        const std::int32_t n = scene.size[node], first = scene.child[node];
        if (n) {
            for (std::int32_t i = first; i < first + n; ++i) {
                const Met<T> met = ray_triangle(ray.origin, walk.frame, scene.points[i]);
                if (met.t > tmin &&
                    (met.t < hit.t ||
                     (met.t == hit.t && hit.triangle >= 0 && scene.face[i] < scene.face[hit.triangle])) &&
                    scene.face[i] != skip) {
                    hit = {i, -1, met.t, met.b0, met.b1, met.b2};
                }
            }
        } else {
            const T t0 = walk.enter(scene.bounds + 6 * static_cast<std::int64_t>(first), tmin, hit.t);
            const T t1 = walk.enter(scene.bounds + 6 * static_cast<std::int64_t>(first + 1), tmin, hit.t);
            if (t0 <= t1) {
                if (t0 != infinity<T>) {
                    if (t1 != infinity<T>) stack[top++] = first + 1;
                    node = first;
                    continue;
                }
            } else if (t1 != infinity<T>) {
                if (t0 != infinity<T>) stack[top++] = first;
                node = first + 1;
                continue;
            }
        }
        if (top == 0) return hit;
        node = stack[--top];
    }
}

// Calls visit(triangle) for all triangles whose boxes the ray meets between tmin and tmax, until one gives false.
template <class T, class Visit>
inline void visit_triangles(const Scene<T>& scene, const Walk<T>& walk, T tmin, T tmax, Visit&& visit) {
    std::int32_t stack[stack_size];
    int top = 1;
    stack[0] = 0;
    while (top) {
        const std::int32_t node = stack[--top];
        if (walk.enter(scene.bounds + 6 * static_cast<std::int64_t>(node), tmin, tmax) == infinity<T>) continue;
        const std::int32_t n = scene.size[node], first = scene.child[node];
        if (n == 0) {
            stack[top++] = first + 1;
            stack[top++] = first;
            continue;
        }
        for (std::int32_t i = first; i < first + n; ++i) {
            if (!visit(i)) return;
        }
    }
}

// Both roots of a world-space ray against sphere `i`; an affine map keeps t.
template <class T>
inline Roots<T> sphere_roots(const Spheres<T>& spheres, std::int64_t i, const Ray<T>& ray) {
    const Affine<T>& to_local = spheres.to_local[i];
    return ray_sphere(to_local.point(ray.origin), to_local.vector(ray.direction), spheres.radius[i]);
}

// |O - C|^2 / r of sphere `i` in the world's unit: a relative error of |O - C|^2 puts a hit so much off it.
//
// An error e of the discriminant moves t by e / (2 sqrt(discriminant)), and the hit by its cosine times as much along the
// normal; both are r cos: e / (2 r), from wherever the sphere is seen.
template <class T>
inline T cancelling(const Spheres<T>& spheres, std::int64_t i, const Ray<T>& ray) {
    const Affine<T>& to_local = spheres.to_local[i];
    const Vec3<T> o = to_local.point(ray.origin);
    return dot(o, o) / (spheres.radius[i] * length(to_local.vector(ray.direction)));
}

// The nearest analytic sphere: `sphere` -1 where there is none. `skip` is left by the ray from outside and not hit again.
template <class T>
inline Hit<T> closest_sphere(const Spheres<T>& spheres, const Ray<T>& ray, T tmin, T tmax, int skip) {
    Hit<T> hit{-1, -1, tmax, 1, 1, 1};
    for (std::int64_t i = 0; i < spheres.count; ++i) {
        if (i == skip) continue;
        const Roots<T> roots = sphere_roots(spheres, i, ray);
        const T t = roots.near > tmin ? roots.near : roots.far;
        if (t > tmin && t < hit.t) hit.sphere = static_cast<int>(i), hit.t = t;
    }
    return hit;
}

// Which of the surfaces that lie as near as the one that was hit is asked for.
enum class Other {
    first,    // the first in scene order
    another,  // the first that is not the winner: also another face of one mesh, folded or with its back near
    next,     // the nearest of those, whatever their order
};

template <class T>
struct Rival {
    Hit<T> hit;
    int object;  // -1 where there is none
};

// Among the surfaces met between tmin and tmax the one that `other` asks for. `winner` is the object that was hit, `face`
// its face there. Of one object's triangles the nearest counts.
template <class T, class F>
Rival<T> rival(const Scene<T>& scene, const Ray<T>& ray, T tmin, T tmax, int winner, int face, Other other) {
    Rival<T> found{{-1, -1, tmax, 0, 0, 0}, -1};
    const bool next = other == Other::next, any = other == Other::first;
    if (scene.triangles) {
        const Walk<T> walk(ray);
        visit_triangles(scene, walk, tmin, tmax, [&](std::int32_t i) {
            const int mine = scene.object[i];
            if ((!any && scene.face[i] == face) || (!next && found.object >= 0 && mine > found.object)) return true;
            const Met<T> met = ray_triangle(ray.origin, walk.frame, scene.points[i]);
            if (met.t >= tmin && met.t <= tmax &&
                (found.object < 0 || met.t < found.hit.t || (!next && mine < found.object))) {
                found = {{i, -1, met.t, met.b0, met.b1, met.b2}, mine};
            }
            return true;
        });
    }
    if constexpr (F::spheres) {
        const Spheres<T>& spheres = scene.spheres;
        for (std::int64_t i = 0; i < spheres.count; ++i) {
            const int mine = spheres.object[i];
            if ((!any && mine == winner) || (!next && found.object >= 0 && mine >= found.object)) continue;
            const Roots<T> roots = sphere_roots(spheres, i, ray);
            for (const T t : {roots.near, roots.far}) {
                if (t >= tmin && t <= tmax && found.hit.sphere != i &&
                    (!next || found.object < 0 || t < found.hit.t)) {
                    found.hit.triangle = -1;
                    found.hit.sphere = static_cast<int>(i);
                    found.hit.t = t;
                    found.object = mine;
                }
            }
        }
    }
    return found;
}

}  // namespace notabug
