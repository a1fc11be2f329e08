#include "tracer_inline.h"

namespace notabug {

template void render<double>(const Scene<double>&, const Options&, std::int64_t, std::int64_t, const std::int64_t*,
                         std::int64_t, const Pattern&, const Film&, int);
template void trace<double>(const Scene<double>&, const Ray<double>*, std::int64_t, std::int64_t*, double*, Vec3<double>*, int);

}  // namespace notabug
