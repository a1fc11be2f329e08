#include "tracer.h"

namespace notabug {

// Without secondary rays in the scene all surfaces are opaque, and none sends any.
static const Coefficients<double>* opaque(std::vector<Coefficients<double>>& made, std::int64_t materials) {
    made.assign(static_cast<std::size_t>(materials), {1, {0, 0, 0}, {0, 0, 0}, 1});
    return made.data();
}

constexpr std::int64_t told_directions = 987;  // to each light with a size

Record<double, Everything> probe(const Scene<double>& scene, const Options& option, std::int64_t width,
                                 std::int64_t height, double x, double y) {
    std::vector<Coefficients<double>> made;
    Scene<double> whole_scene = scene;
    if (!scene.secondary) whole_scene.secondary = opaque(made, scene.materials);
    Record<double, Everything> record;
    const Whitted<double, Everything, Record<double, Everything>> tracer{whole_scene, option,
                                                                        half_pixel(scene.camera, width), record,
                                                                        Cubature{told_directions, {0, 0}}};
    const auto through = camera_ray(scene.camera, x, y, width, height);
    tracer.along(through.ray, through.near, through.far);
    return record;
}

}  // namespace notabug
