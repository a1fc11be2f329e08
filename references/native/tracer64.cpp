#include "tracer_inline.h"

namespace notabug {

template void render<double>(const Scene<double>&, const Options&, std::int64_t, std::int64_t, const std::int64_t*,
                         std::int64_t, const Pattern&, const Film&, int);
template void trace<double>(const Scene<double>&, const Vec3<double>*, const Vec3<double>*, std::int64_t, std::int64_t*, double*,
                         Vec3<double>*, int);
template void occluded<double>(const Scene<double>&, const Vec3<double>*, const Vec3<double>*, const double*, std::int64_t, bool*, int);

}  // namespace notabug
