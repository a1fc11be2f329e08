#include "raster_inline.h"

namespace notabug {

template void raster<double>(const Scene<double>&, const std::int64_t*, const View<double>&, const ZBufferOptions&,
                         const RasterOptions&, const ShadowMaps<double>&, std::int64_t, std::int64_t, std::int64_t,
                         double*, int);

}  // namespace notabug
