// Statistics of the subsamples of each pixel: where in a pixel rays go through, and what is kept of their radiance.
#pragma once

#include "error.h"
#include "parallel.h"
#include "whitted.h"

namespace notabug {

constexpr int probes = 8;  // halvings of the way between two samples of a pixel

// The full-size arrays of a picture, row by row: (h, w, 3), or (h, w) from `ids` on.
struct Film {
    double* mean;
    double* variance;  // of one sample
    double* lo;
    double* hi;
    double* error;  // an estimate of the mean's
    std::int64_t* ids;      // of the first sample
    std::uint8_t* mixed;    // 1 where ids differ within the pixel, 2 where only the lights that are blocked do, or 3
    double* spared;         // share of the samples that were spared facet self-shadow
};

// Where the samples of a pixel lie: a regular grid x grid (grid > 0), the lattice whose generator is -grid (see
// envelope.lattice), or uniformly random positions drawn from `seed` (0).
//
// Towards each light with a size go `directions` from each sample.
struct Pattern {
    std::int64_t grid, samples;
    std::uint64_t seed;
    std::int64_t directions = 1;
};

// A uniform number in [0, 1) from a counter (splitmix64; Steele, Lea and Flood 2014, "Fast splittable pseudorandom number
// generators"): the same on every machine.
inline double uniform(std::uint64_t pixel, std::uint64_t sample, std::uint64_t seed, std::uint64_t axis) {
    std::uint64_t z = pixel * 0x9E3779B97F4A7C15u + sample * 0xD1B54A32D192ED03u;
    z += seed * 0x8CB92BA72F3D8DD7u + axis * 0xABC98388FB8FAC03u;
    for (int i = 0; i < 2; ++i) {
        z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
        z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
        z = z ^ (z >> 31);
    }
    return static_cast<double>(z >> 11) * 0x1p-53;
}

template <class T>
struct Place {
    T x, y;
};

template <class T>
inline Place<T> place_of(const Pattern& pattern, std::int64_t pixel, std::int64_t s) {
    const T half = 0.5;
    if (pattern.grid > 0) {
        const T cells = static_cast<T>(pattern.grid);
        return {(static_cast<T>(s % pattern.grid) + half) / cells, (static_cast<T>(s / pattern.grid) + half) / cells};
    }
    if (pattern.grid < 0) {
        const T cells = static_cast<T>(pattern.samples);
        return {(static_cast<T>(s) + half) / cells,
                (static_cast<T>((-pattern.grid * s) % pattern.samples) + half) / cells};
    }
    const auto number = static_cast<std::uint64_t>(pixel), sample = static_cast<std::uint64_t>(s);
    return {static_cast<T>(uniform(number, sample, pattern.seed, 0)),
            static_cast<T>(uniform(number, sample, pattern.seed, 1))};
}

// By how much the lattice of a sample's directions to lights is moved: evenly over the samples of a pixel, with the
// additive recurrence whose ratios are the powers of the plastic number's inverse (Roberts 2018), from a random start.
// So the samples' errors differ, and the scatter of the samples tells them.
inline Unit<double> shift_of(const Pattern& pattern, std::int64_t pixel, std::int64_t s) {
    const auto number = static_cast<std::uint64_t>(pixel), sample = static_cast<std::uint64_t>(s);
    if (pattern.grid == 0)
        return {uniform(number, sample, pattern.seed, 2), uniform(number, sample, pattern.seed, 3)};
    const double step = static_cast<double>(s);
    return {uniform(number, 0, 0, 2) + 0.7548776662466927 * step, uniform(number, 0, 0, 3) + 0.5698402909980532 * step};
}

// The camera's ray through raster position (x, y), y down, and its near and far limits.
template <class T>
struct CameraRay {
    Ray<T> ray;
    T near, far;
};

template <class T>
inline CameraRay<T> camera_ray(const Camera<T>& camera, T x, T y, std::int64_t width, std::int64_t height) {
    const T a = T(2) * x / static_cast<T>(width) - T(1) + camera.shift_x;
    const T b = T(1) - T(2) * y / static_cast<T>(height) + camera.shift_y;
    if (camera.parallel != 0)
        return {{camera.origin + a * camera.across + b * camera.up, camera.forward}, camera.near, camera.far};
    const Vec3<T> d = a * camera.across + b * camera.up + camera.forward;
    const T scale = length(d);
    return {{camera.origin, d / scale}, camera.near * scale, camera.far * scale};
}

// A half of what a pixel spans: the angle, and the width where rays are parallel.
template <class T>
inline HalfPixel<T> half_pixel(const Camera<T>& camera, std::int64_t width) {
    const T half = length(camera.across) / static_cast<T>(width);
    return camera.parallel != 0 ? HalfPixel<T>{0, half} : HalfPixel<T>{half, 0};
}

template <class Tracer, class T>
void render_pixel(const Tracer& given, const Camera<T>& camera, std::int64_t width, std::int64_t height,
                  std::int64_t pixel, const Pattern& pattern, const Film& film) {
    const std::int64_t row = pixel / width, column = pixel % width, samples = pattern.samples;
    double sum[3] = {}, squares[3] = {};
    double* lo = film.lo + 3 * pixel;
    double* hi = film.hi + 3 * pixel;
    std::int64_t first = 0, last = 0, excuses = 0, asked = 0;
    std::uint8_t differ = 0;
    std::conditional_t<Tracer::sized, Tracer, const Tracer&> tracer = given;
    if constexpr (Tracer::sized) tracer.cubature.points = pattern.directions;
    std::uint64_t hidden = 0, open = 0;
    Estimate estimate(pattern.grid, samples);
    // halfway between two samples that see other objects, `a` and `b`: to what lies hidden at their border
    Place<T> a{}, b{}, before{};
    std::int64_t at = 0, beyond = 0;
    for (std::int64_t s = 0; s < samples + asked; ++s) {
        const Place<T> here = s >= samples ? Place<T>{(a.x + b.x) * T(0.5), (a.y + b.y) * T(0.5)}
                                           : place_of<T>(pattern, pixel, s);
        const auto through = camera_ray(camera, static_cast<T>(column) + here.x, static_cast<T>(row) + here.y, width, height);
        if constexpr (Tracer::sized) tracer.cubature.shift = shift_of(pattern, pixel, s);
        const Radiance<T> found = tracer.along(through.ray, through.near, through.far);
        const Vec3<double> colour = widened(found.colour);
        const double value[3] = {colour.x, colour.y, colour.z};
        if (s == 0) {
            first = last = found.id;
            std::copy(value, value + 3, lo);
            std::copy(value, value + 3, hi);
        } else if (s < samples || (found.id != at && found.id != beyond)) {
            for (int k = 0; k < 3; ++k) lo[k] = std::min(lo[k], value[k]), hi[k] = std::max(hi[k], value[k]);
        }
        const auto same_seen = [&](std::int64_t other) {
            return (static_cast<std::uint64_t>(found.id ^ other) & seen_bits) == 0;
        };
        if (s >= samples) {
            if (found.id == at) {
                a = here;
            } else if (found.id == beyond) {
                b = here;
            } else {  // a third: thinner than the samples lie apart
                if (same_seen(at) || same_seen(beyond)) differ |= 2;
                break;
            }
            continue;
        }
        if (found.id != first) differ |= 1;
        if constexpr (Tracer::sized) {
            hidden |= found.hidden, open |= found.open;
            if (hidden & open) differ |= 2;  // all of a penumbra within the pixel: an edge
        }
        if (found.id != last && same_seen(last)) differ |= 2;
        if (pattern.grid < 0 && asked == 0 && !same_seen(last)) {
            asked = probes;
            a = before, at = last, b = here, beyond = found.id;
        }
        before = here;
        last = found.id;
        excuses += found.spared;
        estimate.add(s, value);
        const Vec3<T> square = mul(found.colour, found.colour);
        const Vec3<double> wide = widened(square);
        const double squared[3] = {wide.x, wide.y, wide.z};
        for (int k = 0; k < 3; ++k) sum[k] = sum[k] + value[k], squares[k] = squares[k] + squared[k];
    }
    const double n = static_cast<double>(samples);
    for (int k = 0; k < 3; ++k) {
        const double mean = sum[k] / n;
        film.mean[3 * pixel + k] = mean;
        film.variance[3 * pixel + k] = std::max(squares[k] / n - mean * mean, 0.0);
        film.error[3 * pixel + k] = estimate.error(k, mean);
    }
    film.ids[pixel] = first;
    film.mixed[pixel] = differ;
    film.spared[pixel] = static_cast<double>(excuses) / n;
}

// Renders the pixels numbered y * width + x into the film; the same whatever the number of threads.
template <class T, class F>
void render_pixels(const Scene<T>& scene, const Options& option, std::int64_t width, std::int64_t height,
                   const std::int64_t* pixels, std::int64_t count, const Pattern& pattern, const Film& film,
                   int threads) {
    NoRecord silent;
    const Whitted<T, F, NoRecord> tracer{scene, option, half_pixel(scene.camera, width), silent};
    parallel(count, 32, threads, [&](std::int64_t begin, std::int64_t end) {
        for (std::int64_t j = begin; j < end; ++j)
            render_pixel(tracer, scene.camera, width, height, pixels[j], pattern, film);
    });
}

}  // namespace notabug
