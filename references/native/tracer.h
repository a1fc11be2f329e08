// The tracer in both precisions: what bindings.cpp calls. Compiled once for each in tracer32.cpp and tracer64.cpp.
#pragma once

#include "film.h"
#include "probe.h"

namespace notabug {

template <class T>
void render(const Scene<T>& scene, const Options& option, std::int64_t width, std::int64_t height,
            const std::int64_t* pixels, std::int64_t count, const Pattern& pattern, const Film& film, int threads);

// Closest triangles for many rays: index or -1, distance, and barycentric coordinates (n, 3).
template <class T>
void trace(const Scene<T>& scene, const Vec3<T>* origins, const Vec3<T>* directions, std::int64_t count,
           std::int64_t* hits, T* distances, Vec3<T>* barycentric, int threads);

// Whether each of many rays meets a triangle nearer than its distance.
template <class T>
void occluded(const Scene<T>& scene, const Vec3<T>* origins, const Vec3<T>* directions, const T* distances,
              std::int64_t count, bool* blocked, int threads);

// Everything that a scene may have; a record is made of one ray, and no time is saved by knowing less.
using Everything = Features<true, true, true, true, true>;

// What the ray through raster position (x, y) tells.
Record<double, Everything> probe(const Scene<double>& scene, const Options& option, std::int64_t width,
                                 std::int64_t height, double x, double y);

}  // namespace notabug
