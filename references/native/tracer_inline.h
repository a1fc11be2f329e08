// The bodies of tracer.h, for the file that instantiates them in one precision.
#pragma once

#include "tracer.h"

namespace notabug {

template <class T>
void render(const Scene<T>& scene, const Options& option, std::int64_t width, std::int64_t height,
            const std::int64_t* pixels, std::int64_t count, const Pattern& pattern, const Film& film, int threads) {
    const auto with = [&](auto features) {
        using F = decltype(features);
        render_pixels<T, F>(scene, option, width, height, pixels, count, pattern, film, threads);
    };
    if (scene.cutouts.map) {
        with(Features<true, true, true, true, true>{});
    } else if (scene.emitter) {
        with(Features<true, true, true, true>{});
    } else if (scene.previews.surface) {  // such scenes have coefficients too
        with(Features<true, true, true>{});
    } else if (scene.spheres.count) {
        scene.secondary ? with(Features<true, true>{}) : with(Features<true, false>{});
    } else {
        scene.secondary ? with(Features<false, true>{}) : with(Features<false, false>{});
    }
}

template <class T>
void trace(const Scene<T>& scene, const Vec3<T>* origins, const Vec3<T>* directions, std::int64_t count,
           std::int64_t* hits, T* distances, Vec3<T>* barycentric, int threads) {
    parallel(count, 1024, threads, [&](std::int64_t begin, std::int64_t end) {
        for (std::int64_t j = begin; j < end; ++j) {
            const Hit<T> hit = closest(scene, Ray<T>{origins[j], directions[j]}, T(0), infinity<T>, -1);
            hits[j] = hit.triangle;
            distances[j] = hit.t;
            barycentric[j] = {hit.b0, hit.b1, hit.b2};
        }
    });
}

template <class T>
void occluded(const Scene<T>& scene, const Vec3<T>* origins, const Vec3<T>* directions, const T* distances,
              std::int64_t count, bool* blocked, int threads) {
    parallel(count, 1024, threads, [&](std::int64_t begin, std::int64_t end) {
        for (std::int64_t j = begin; j < end; ++j) {
            blocked[j] = false;
            if (scene.triangles == 0) continue;
            const Walk<T> walk(scene, {origins[j], directions[j]});
            visit_triangles(scene, walk, T(0), distances[j], [&](std::int32_t, const Met<T>& met) {
                blocked[j] = met.t > 0 && met.t < distances[j];
                return !blocked[j];
            });
        }
    });
}

}  // namespace notabug
