#include "tracer_inline.h"

namespace notabug {

template void render<float>(const Scene<float>&, const Options&, std::int64_t, std::int64_t, const std::int64_t*,
                         std::int64_t, const Pattern&, const Film&, int);
template void trace<float>(const Scene<float>&, const Vec3<float>*, const Vec3<float>*, std::int64_t, std::int64_t*, float*,
                         Vec3<float>*, int);
template void occluded<float>(const Scene<float>&, const Vec3<float>*, const Vec3<float>*, const float*, std::int64_t, bool*, int);

}  // namespace notabug
