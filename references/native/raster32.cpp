#include "raster_inline.h"

namespace notabug {

template void raster<float>(const Scene<float>&, const std::int64_t*, const View<float>&, const ZBufferOptions&,
                         const RasterOptions&, const ShadowMaps<float>&, std::int64_t, std::int64_t, std::int64_t,
                         double*, int);

}  // namespace notabug
