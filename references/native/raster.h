// Pictures as a z-buffer draws them: bands of rows, layer by layer from the front.
#pragma once

#include "raster_shade.h"

namespace notabug {

// The picture (height, width, 3): each pixel the mean of grid x grid samples. Transparent surfaces are composited in the
// order of their depths.
template <class T>
void raster(const Scene<T>& scene, const std::int64_t* order, const View<T>& view, const ZBufferOptions& zbuffer,
            const RasterOptions& option, const ShadowMaps<T>& maps, std::int64_t width, std::int64_t height,
            std::int64_t grid, double* picture, int threads);

}  // namespace notabug
