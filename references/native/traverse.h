// Walks through the hierarchy: the closest hit, and what lies as near.
#pragma once

#include <bit>
#include <tuple>

#include "walk.h"

namespace notabug {

// A hit of a triangle or of an analytic sphere; the other is -1.
template <class T>
struct Hit {
    int triangle, sphere;
    T t, b0, b1, b2;
};

// Whether triangle `i` wins over `held` where both are met at exactly the same t: the face that comes first in the scene
// does, and of one face the triangle whose corners come first.
template <class T>
inline bool comes_first(const Scene<T>& scene, int i, int held) {
    if (held < 0) return false;
    if (scene.face[i] != scene.face[held]) return scene.face[i] < scene.face[held];
    const Corners &a = scene.corner[i], &b = scene.corner[held];
    return std::tie(a.a, a.b, a.c) < std::tie(b.a, b.b, b.c);
}

// That there is a surface wherever a triangle is met.
struct Everywhere {
    template <class T>
    bool operator()(int, const Met<T>&) const {
        return true;
    }
};

// The nearest triangle with tmin < t < tmax whose face is not `skip`, and that is `there` where it is met.
// Of two at exactly the same t the one that comes first in the scene wins.
template <class T, class There = Everywhere>
Hit<T> closest(const Scene<T>& scene, const Ray<T>& ray, T tmin, T tmax, int skip, const There& there = {}) {
    Hit<T> hit{-1, -1, tmax, 1, 1, 1};
    if (scene.triangles == 0) return hit;
    const Walk<T> walk(scene, ray);
    const Lanes least = all_lanes(walk.least(tmin));
    float most = walk.most(tmax);
    std::int32_t child[stack_size], count[stack_size];
    float since[stack_size];
    int top = 0;
    std::int32_t at = 0, leaves = 0;
    while (true) {
        if (leaves) {
            for (std::int32_t leaf = at; leaf < at + leaves; ++leaf) {
                MetLeaf<T> met;
                ray_leaf(ray.origin, walk.frame, scene.leaves[leaf], met);
                for (unsigned hits = met.hits; hits; hits &= hits - 1) {
                    const int lane = std::countr_zero(hits), i = scene.first[leaf] + lane;
                    const Met<T> here = met.at(lane, walk.frame);
                    if (here.t > tmin && here.t <= hit.t && (here.t < hit.t || comes_first(scene, i, hit.triangle)) &&
                        scene.face[i] != skip && there(i, here)) {
                        hit = {i, -1, here.t, here.b0, here.b1, here.b2};
                        most = walk.most(hit.t);
                    }
                }
            }
        } else {
            const WideNode& node = scene.nodes[at];
            float entered[wide];
            unsigned met = walk.enter(node, least, all_lanes(most), entered);
            if (met) {
                int best = std::countr_zero(met);
                met &= met - 1;
                while (met) {
                    const int other = std::countr_zero(met);
                    met &= met - 1;
                    const bool nearer = entered[other] < entered[best];
                    const int later = nearer ? best : other;
                    best = nearer ? other : best;
                    child[top] = node.child[later], count[top] = node.count[later], since[top] = entered[later];
                    ++top;
                }
                at = node.child[best], leaves = node.count[best];
                continue;
            }
        }
        do {
            if (top == 0) return hit;
            --top;
        } while (since[top] > most);
        at = child[top], leaves = count[top];
    }
}

// Calls visit(triangle, where it is met) for all triangles that the ray meets between tmin and tmax, in their order, until
// one gives false. Both ends count.
template <class T, class Visit>
inline void visit_triangles(const Scene<T>& scene, const Walk<T>& walk, T tmin, T tmax, Visit&& visit) {
    const Lanes least = all_lanes(walk.least(tmin)), most = all_lanes(walk.most(tmax));
    std::int32_t child[stack_size], count[stack_size];
    int top = 0;
    std::int32_t at = 0, leaves = 0;
    while (true) {
        if (leaves) {
            for (std::int32_t leaf = at; leaf < at + leaves; ++leaf) {
                MetLeaf<T> met;
                ray_leaf(walk.origin, walk.frame, scene.leaves[leaf], met);
                for (unsigned hits = met.hits; hits; hits &= hits - 1) {
                    const int lane = std::countr_zero(hits);
                    const Met<T> here = met.at(lane, walk.frame);
                    if (here.t >= tmin && here.t <= tmax && !visit(scene.first[leaf] + lane, here)) return;
                }
            }
        } else {
            const WideNode& node = scene.nodes[at];
            float entered[wide];
            unsigned met = walk.enter(node, least, most, entered);
            while (met) {  // the last box first, so that the first one is followed first
                const int i = std::bit_width(met) - 1;
                met ^= 1u << i;
                child[top] = node.child[i], count[top] = node.count[i];
                ++top;
            }
        }
        if (top == 0) return;
        --top;
        at = child[top], leaves = count[top];
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
// its face there. Of one object's triangles the nearest counts that is `there`.
template <class T, class F, class There>
Rival<T> rival(const Scene<T>& scene, const Ray<T>& ray, T tmin, T tmax, int winner, int face, Other other,
               const There& there) {
    Rival<T> found{{-1, -1, tmax, 0, 0, 0}, -1};
    const bool next = other == Other::next, any = other == Other::first;
    if (scene.triangles) {
        const Walk<T> walk(scene, ray);
        visit_triangles(scene, walk, tmin, tmax, [&](std::int32_t i, const Met<T>& met) {
            const int mine = scene.object[i];
            if ((!any && scene.face[i] == face) || (!next && found.object >= 0 && mine > found.object)) return true;
            if ((found.object < 0 || met.t < found.hit.t || (!next && mine < found.object)) && there(i, met)) {
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
