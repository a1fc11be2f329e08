// The body of raster.h, for the file that instantiates it in one precision.
#pragma once

#include <vector>

#include "parallel.h"
#include "raster.h"

namespace notabug {

constexpr std::int64_t band_samples = 1 << 17;  // drawn at once, by one thread
constexpr int most_layers = 256;  // transparent surfaces behind each other; a deeper scene is drawn without the rest

// The samples of a band of rows.
template <class T>
struct Band {
    std::vector<double> depth[2];
    std::vector<std::int32_t> winner[2];
    std::vector<Vec3<T>> correct, affine, colour;
    std::vector<T> rest;  // the share of light that passes all layers so far

    explicit Band(std::size_t n) : correct(n), affine(n), colour(n, {0, 0, 0}), rest(n, T(1)) {
        for (int i = 0; i < 2; ++i) depth[i].resize(n), winner[i].resize(n);
    }
};

// Adds the radiance of each sample's winner, weighted by what is left; whether anything is left to see behind it.
template <class T>
bool add_layer(const Scene<T>& scene, const ShadowMaps<T>& maps, const RasterOptions& option,
               const std::int64_t* order, const std::int32_t* winner, Band<T>& band) {
    bool more = false;
    for (std::size_t at = 0; at < band.rest.size(); ++at) {
        if (winner[at] < 0 || band.rest[at] <= 0) continue;
        const std::int64_t i = order[winner[at]];
        const Vec3<T> colour = raster_colour(scene, maps, option, i, band.correct[at], band.affine[at]);
        const T opaque = scene.secondary ? scene.secondary[scene.material[scene.object[i]]].opacity : T(1);
        band.colour[at] = band.colour[at] + (band.rest[at] * opaque) * colour;
        band.rest[at] *= T(1) - opaque;
        more = more || band.rest[at] > 0;
    }
    return more;
}

template <class T>
void raster(const Scene<T>& scene, const std::int64_t* order, const View<T>& view, const ZBufferOptions& zbuffer,
            const RasterOptions& option, const ShadowMaps<T>& maps, std::int64_t width, std::int64_t height,
            std::int64_t grid, double* picture, int threads) {
    const std::int64_t columns = width * grid;
    const std::int64_t block = std::max<std::int64_t>(1, band_samples / (columns * grid));
    const double clear = zbuffer.form == DepthForm::reversed ? -0.0 : 1.0;
    parallel(height, block, threads, [&](std::int64_t first, std::int64_t last) {
        const std::int64_t rows = (last - first) * grid;
        Band<T> band(static_cast<std::size_t>(rows * columns));
        Behind behind;
        for (int k = 0; k < most_layers; ++k) {
            std::vector<double>& depth = band.depth[k % 2];
            std::vector<std::int32_t>& winner = band.winner[k % 2];
            std::fill(depth.begin(), depth.end(), clear);
            std::fill(winner.begin(), winner.end(), -1);
            const Layer<T> layer{columns,      height * grid,       first * grid,      rows, depth.data(),
                                 winner.data(), band.correct.data(), band.affine.data()};
            fill(scene.points, order, scene.triangles, view, zbuffer, behind, layer);
            if (!add_layer(scene, maps, option, order, winner.data(), band)) break;
            behind = {depth.data(), winner.data()};
        }
        for (std::int64_t pixel = 0; pixel < (last - first) * width; ++pixel) {
            double sum[3] = {};
            for (std::int64_t s = 0; s < grid * grid; ++s) {
                const std::int64_t row = pixel / width * grid + s / grid, column = pixel % width * grid + s % grid;
                const Vec3<double> colour = widened(band.colour[static_cast<std::size_t>(row * columns + column)]);
                sum[0] += colour.x, sum[1] += colour.y, sum[2] += colour.z;
            }
            for (int c = 0; c < 3; ++c)
                picture[3 * (first * width + pixel) + c] = sum[c] / static_cast<double>(grid * grid);
        }
    });
}

}  // namespace notabug
