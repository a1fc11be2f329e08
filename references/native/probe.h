// One camera ray, told term by term: what is seen, with which normal and uv, and what each light adds.
//
// The record listens to the code that draws, so what it tells is what the picture shows.
#pragma once

#include <vector>

#include "whitted.h"

namespace notabug {

// One light's part at the point seen. Where the corners of a triangle are lit, cosines and shares are their means,
// weighted as the colours are.
template <class T>
struct LightRecord {
    T distance = 0, facet_cosine = 0, cosine = 0;
    Vec3<T> irradiance{0, 0, 0};  // at normal incidence
    T share = 0;                  // of the light that gets through
    bool spared = false;          // facets of its own mesh stood in the way and were forgiven
    int blocker = -1;             // object of the first thing in the way
    T blocked_at = infinity<T>;
    Vec3<T> diffuse{0, 0, 0}, specular{0, 0, 0};
    bool heard = false;
};

template <class T, class F>
struct Record {
    static constexpr bool listens = true;

    bool met = false;
    Surface<T> seen{};
    T depth = 0, view_cosine = 0;
    Vec3<T> albedo{0, 0, 0};
    std::vector<LightRecord<T>> lights;

    void surface(const Scene<T>& scene, const Ray<T>& ray, const Hit<T>& hit, const Surface<T>& s,
                 const Vec3<T>& colour) {
        met = true;
        seen = s;
        depth = hit.t * dot(ray.direction, scene.camera.forward);
        view_cosine = dot(s.normal, -ray.direction);
        albedo = colour;
        lights.assign(static_cast<std::size_t>(scene.lights), {});
    }

    void light(int k, T distance, T facet_cosine, T cosine, const Vec3<T>& irradiance, T part) {
        LightRecord<T>& each = lights[static_cast<std::size_t>(k)];
        each.heard = true;
        if (part == 0) return;
        each.distance += part * distance;
        each.facet_cosine += part * facet_cosine;
        each.cosine += part * cosine;
        each.irradiance = each.irradiance + part * irradiance;
    }

    void shadow(const Scene<T>& scene, int k, const ShadowRay<T>& ray, const LightShare<T>& through) {
        LightRecord<T>& each = lights[static_cast<std::size_t>(k)];
        each.spared = each.spared || through.forgiven;
        const int face = ray.triangle >= 0 && ray.leaves ? scene.face[ray.triangle] : -1;
        T nearest_t = std::min(ray.tmax, each.blocked_at);
        Hit<T> hit{};
        if constexpr (F::cutouts) {
            hit = closest(scene, ray.ray, ray.tmin, nearest_t, face, Uncut<T, F>{scene, *ray.option, ray.ray});
        } else {
            hit = closest(scene, ray.ray, ray.tmin, nearest_t, face);
        }
        if (hit.triangle >= 0) each.blocker = scene.object[hit.triangle], each.blocked_at = nearest_t = hit.t;
        if constexpr (F::spheres) {
            const Hit<T> ball = closest_sphere(scene.spheres, ray.ray, ray.tmin, nearest_t, ray.sphere);
            if (ball.sphere >= 0) each.blocker = scene.spheres.object[ball.sphere], each.blocked_at = ball.t;
        }
    }

    void share(int k, T part_of_light, T part) { lights[static_cast<std::size_t>(k)].share += part * part_of_light; }

    void terms(int k, const Vec3<T>& diffuse, const Vec3<T>& specular) {
        LightRecord<T>& each = lights[static_cast<std::size_t>(k)];
        each.diffuse = each.diffuse + diffuse;
        each.specular = each.specular + specular;
    }
};

}  // namespace notabug
