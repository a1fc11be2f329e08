// The module notabug.references._native: what Python calls. Its types are in references/_native.pyi.
#include <pybind11/stl.h>

#include <cstring>

#include "arrays.h"
#include "bvh.h"
#include "switches.h"
#include "raster.h"
#include "tracer.h"

namespace notabug {

namespace {

// --- the tracer -----------------------------------------------------------------------------------------------------

template <class T>
void render_as(const py::handle& flat, const Options& option, std::int64_t width, std::int64_t height,
               const Rows<std::int64_t>& pixels, const Pattern& pattern, const Film& film, int threads) {
    const Scene<T> scene = scene_of<T>(flat);
    const py::gil_scoped_release released;
    render<T>(scene, option, width, height, pixels.data, pixels.count, pattern, film, threads);
}

void render_film(const py::object& flat, const py::object& options, std::int64_t width, std::int64_t height,
                 const py::object& pixels, std::int64_t grid, std::int64_t samples, std::uint64_t seed,
                 const py::object& into, int threads, std::int64_t directions) {
    const auto size = width * height;
    const auto colours = [&](const char* name) {
        const auto found = field<double>(into, name, true);
        if (found.count != 3 * size) throw py::value_error(std::string(name) + ": not of the picture's size");
        return found.data;
    };
    const auto numbers = [&]<class E>(const char* name, E) {
        const auto found = field<E>(into, name, true);
        if (found.count != size) throw py::value_error(std::string(name) + ": not of the picture's size");
        return found.data;
    };
    const Film film{colours("mean"), colours("variance"), colours("lo"), colours("hi"), colours("error"),
                    numbers("ids", std::int64_t()), numbers("mixed", std::uint8_t()), numbers("spared", double())};
    const auto chosen = rows<std::int64_t>(pixels, "pixels");
    for (std::int64_t i = 0; i < chosen.count; ++i) {
        if (chosen.data[i] < 0 || chosen.data[i] >= size) throw py::value_error("pixels: outside the picture");
    }
    const Pattern pattern{grid, grid > 0 ? grid * grid : samples, seed, directions};
    const auto as = is_single(flat) ? render_as<float> : render_as<double>;
    as(flat, options_of(options), width, height, chosen, pattern, film, threads);
}

template <class T>
py::tuple trace_as(const py::object& flat, const py::object& origins, const py::object& directions, int threads) {
    const Scene<T> scene = scene_of<T>(flat);
    const auto from = rows<T, Vec3<T>>(origins, "origins"), along = rows<T, Vec3<T>>(directions, "directions");
    if (from.count != along.count) throw py::value_error("origins and directions: not equally many");
    py::array_t<std::int64_t> hits(from.count);
    py::array_t<T> distances(from.count), barycentric({static_cast<py::ssize_t>(from.count), py::ssize_t(3)});
    std::int64_t* hit = hits.mutable_data();
    T* distance = distances.mutable_data();
    auto* weights = reinterpret_cast<Vec3<T>*>(barycentric.mutable_data());
    {
        const py::gil_scoped_release released;
        trace<T>(scene, from.data, along.data, from.count, hit, distance, weights, threads);
    }
    return py::make_tuple(hits, distances, barycentric);
}

py::tuple trace_rays(const py::object& flat, const py::object& origins, const py::object& directions, int threads) {
    return is_single(flat) ? trace_as<float>(flat, origins, directions, threads)
                           : trace_as<double>(flat, origins, directions, threads);
}

template <class T>
py::array_t<bool> occluded_as(const py::object& flat, const py::object& origins, const py::object& directions,
                              const py::object& distances, int threads) {
    const Scene<T> scene = scene_of<T>(flat);
    const auto from = rows<T, Vec3<T>>(origins, "origins"), along = rows<T, Vec3<T>>(directions, "directions");
    const auto far = rows<T>(distances, "distances");
    if (from.count != along.count || from.count != far.count)
        throw py::value_error("origins, directions and distances: not equally many");
    py::array_t<bool> made(from.count);
    bool* blocked = made.mutable_data();
    {
        const py::gil_scoped_release released;
        occluded<T>(scene, from.data, along.data, far.data, from.count, blocked, threads);
    }
    return made;
}

py::tuple numbers_of(const Vec3<double>& v) { return py::make_tuple(v.x, v.y, v.z); }

py::object probe_ray(const py::object& flat, const py::object& options, std::int64_t width, std::int64_t height,
                     double x, double y) {
    const auto record = probe(scene_of<double>(flat), options_of(options), width, height, x, y);
    if (!record.met) return py::none();
    const Surface<double>& seen = record.seen;
    py::dict made;
    made["object"] = seen.object;
    made["face"] = seen.face;
    made["position"] = numbers_of(seen.at);
    made["depth"] = record.depth;
    made["normal"] = numbers_of(seen.normal);
    made["facet_normal"] = numbers_of(seen.side * seen.facet);
    made["view_cosine"] = record.view_cosine;
    made["uv"] = py::make_tuple(seen.u, seen.v);
    made["albedo"] = numbers_of(record.albedo);
    py::list lights;
    for (const LightRecord<double>& each : record.lights) {
        if (!each.heard) continue;
        py::dict light;
        light["distance"] = each.distance;
        light["geometric_cosine"] = each.facet_cosine;
        light["cosine"] = each.cosine;
        light["irradiance"] = numbers_of(each.irradiance);
        light["share"] = each.share;
        light["spared"] = each.spared;
        light["blocker"] = each.blocker;
        light["blocked_at"] = each.blocked_at;
        light["diffuse"] = numbers_of(each.diffuse);
        light["specular"] = numbers_of(each.specular);
        lights.append(light);
    }
    made["lights"] = lights;
    return made;
}

py::tuple build(const py::object& lo, const py::object& hi) {
    const auto low = rows<double, Vec3<double>>(lo, "lo"), high = rows<double, Vec3<double>>(hi, "hi");
    const std::int64_t n = low.count;
    if (n != high.count || n == 0) throw py::value_error("lo and hi: not equally many, or none");
    py::array_t<double> bounds({static_cast<py::ssize_t>(2 * n), py::ssize_t(6)});
    py::array_t<std::int32_t> child(2 * n), count(2 * n);
    py::array_t<std::int64_t> order(n);
    for (std::int64_t i = 0; i < n; ++i) order.mutable_at(i) = i;
    const std::int64_t used = build_hierarchy(n, &low.data->x, &high.data->x, order.mutable_data(),
                                              bounds.mutable_data(), child.mutable_data(), count.mutable_data());
    const py::slice part(0, static_cast<py::ssize_t>(used), 1);
    return py::make_tuple(bounds[part].attr("copy")(), child[part].attr("copy")(), count[part].attr("copy")(), order);
}

py::tuple widen(const py::object& bounds, const py::object& child, const py::object& count) {
    struct Box {
        double side[6];
    };
    const auto box = rows<double, Box>(bounds, "bounds");
    const auto below = rows<std::int32_t>(child, "child"), triangles = rows<std::int32_t>(count, "count");
    if (box.count == 0 || box.count != below.count || box.count != triangles.count)
        throw py::value_error("bounds, child and count: not equally many, or none");
    const WideHierarchy made = widen_hierarchy(box.data->side, below.data, triangles.data);
    const auto copied = [](const auto& from, auto number) {
        const auto each = static_cast<py::ssize_t>(sizeof(from[0]) / sizeof number);
        py::array_t<decltype(number)> to({static_cast<py::ssize_t>(from.size()), each});
        std::memcpy(to.mutable_data(), from.data(), from.size() * sizeof(from[0]));
        return to;
    };
    return py::make_tuple(copied(made.nodes, std::int32_t()), copied(made.leaves, std::int32_t()),
                          copied(std::vector<WideFrame>{made.frame}, double())[py::int_(0)]);
}

// --- the rasteriser -------------------------------------------------------------------------------------------------

template <class T>
void fill_as(const py::object& points, const Rows<std::int64_t>& order, const py::object& view,
             const ZBufferOptions& option, std::int64_t width, std::int64_t height, double* depth,
             std::int32_t* winner) {
    const auto triangles = rows<T, Triangle<T>>(points, "points");
    const auto from = rows<T, View<T>>(view, "view");
    const Layer<T> layer{width, height, 0, height, depth, winner, nullptr, nullptr};
    const py::gil_scoped_release released;
    fill(triangles.data, order.data, order.count, *from.data, option, {}, layer);
}

void fill_depth(const py::object& points, const py::object& order, const py::object& view, bool parallel,
                const std::string& form, bool last, const py::object& depth, const py::object& winner) {
    const auto size = py::reinterpret_borrow<py::array>(depth);
    const auto into = rows<double>(depth, "depth", true);
    const auto winners = rows<std::int32_t>(winner, "winner", true);
    if (size.ndim() != 2 || into.count != winners.count) throw py::value_error("depth and winner: not of one shape");
    const auto as = py::isinstance<py::array_t<float>>(points) ? fill_as<float> : fill_as<double>;
    as(points, rows<std::int64_t>(order, "order"), view, zbuffer_of(form, last, parallel), size.shape(1),
       size.shape(0), into.data, winners.data);
}

template <class T>
ShadowMaps<T> maps_of(const py::handle& from, std::int64_t lights) {
    ShadowMaps<T> to;
    if (from.is_none()) return to;
    to.first = field_of<std::int64_t>(from, "first", lights + 1);
    const auto views = field<T, View<T>>(from, "frame");
    to.view = views.data;
    to.parallel = field_of<bool>(from, "parallel", views.count);
    const auto depth = py::reinterpret_borrow<py::array>(from.attr("depth"));
    to.cells = depth.shape(1);
    to.depth = field_of<T>(from, "depth", views.count * to.cells * to.cells);
    to.bias = from.attr("bias").cast<T>();
    to.normal_bias = from.attr("normal_bias").cast<T>();
    return to;
}

template <class T>
void raster_as(const py::object& flat, const Rows<std::int64_t>& order, const py::object& view, const py::object& maps,
               const ZBufferOptions& zbuffer, const RasterOptions& option, std::int64_t width, std::int64_t height,
               std::int64_t grid, double* picture, int threads) {
    const Scene<T> scene = scene_of<T>(flat);
    const ShadowMaps<T> shadows = maps_of<T>(maps, scene.lights);
    const auto from = rows<T, View<T>>(view, "view");
    if (order.count != scene.triangles) throw py::value_error("order: not as many as there are triangles");
    ZBufferOptions drawing = zbuffer;
    drawing.parallel = scene.camera.parallel != 0;
    const py::gil_scoped_release released;
    raster<T>(scene, order.data, *from.data, drawing, option, shadows, width, height, grid, picture, threads);
}

void raster_picture(const py::object& flat, const py::object& order, const py::object& view, const py::object& maps,
                    const py::object& options, std::int64_t grid, const py::object& picture, int threads) {
    RasterOptions option;
    option.normals = choice<Interpolation, 3>(options, "normals", {"phong", "gouraud", "flat"});
    option.silhouette = choice<Silhouette, 3>(options, "silhouette", {"keep", "flip", "black"});
    option.affine = options.attr("affine").cast<bool>();
    const bool last = options.attr("tie").cast<std::string>() == "less_equal";
    const auto zbuffer = zbuffer_of(options.attr("depth").cast<std::string>(), last, false);
    const auto size = py::reinterpret_borrow<py::array>(picture);
    const auto into = rows<double>(picture, "picture", true);
    if (size.ndim() != 3 || size.shape(2) != 3) throw py::value_error("picture: expected (height, width, 3)");
    const auto as = is_single(flat) ? raster_as<float> : raster_as<double>;
    as(flat, rows<std::int64_t>(order, "order"), view, maps, zbuffer, option, size.shape(1), size.shape(0), grid,
       into.data, threads);
}

// --- the formulas, one at a time, for the oracle's tests --------------------------------------------------------------

template <class T>
py::tuple ray_triangle_as(const py::object& origin, const py::object& direction, const py::object& corners) {
    const auto o = rows<T, Vec3<T>>(origin, "origin"), d = rows<T, Vec3<T>>(direction, "direction");
    const Met<T> met = ray_triangle(*o.data, shear(*d.data), *rows<T, Triangle<T>>(corners, "corners").data);
    return py::make_tuple(met.t, met.b0, met.b1, met.b2);
}

template <class T>
py::tuple ray_sphere_as(const py::object& origin, const py::object& direction, double radius) {
    const auto o = rows<T, Vec3<T>>(origin, "origin"), d = rows<T, Vec3<T>>(direction, "direction");
    const Roots<T> roots = ray_sphere(*o.data, *d.data, static_cast<T>(radius));
    return py::make_tuple(roots.near, roots.far);
}

template <class T>
py::tuple inverse_bilinear_as(const py::object& point, const py::object& quad) {
    const auto p = rows<T>(point, "point");
    const auto found = inverse_bilinear(p.data[0], p.data[1], *rows<T, PlaneQuad<T>>(quad, "quad").data);
    return py::make_tuple(found.s, found.t);
}

bool single(const py::object& array) { return py::isinstance<py::array_t<float>>(array); }

}  // namespace

}  // namespace notabug

PYBIND11_MODULE(_native, m) {
    using namespace notabug;
    m.doc() = "The ray tracer and the rasteriser: see references/native.";
    m.attr("SOURCES") = NOTABUG_SOURCES;
    m.attr("COMPILER") = __VERSION__;
    m.attr("STACK") = stack_size;
    m.def("render", &render_film, py::arg("flat"), py::arg("options"), py::arg("width"), py::arg("height"),
          py::arg("pixels"), py::arg("grid"), py::arg("samples"), py::arg("seed"), py::arg("into"),
          py::arg("threads"), py::arg("directions") = 1);
    m.def("trace", &trace_rays, py::arg("flat"), py::arg("origins"), py::arg("directions"), py::arg("threads") = 0);
    m.def("occluded", [](const py::object& flat, const py::object& origins, const py::object& directions,
                         const py::object& distances, int threads) {
        return (is_single(flat) ? occluded_as<float> : occluded_as<double>)(flat, origins, directions, distances, threads);
    }, py::arg("flat"), py::arg("origins"), py::arg("directions"), py::arg("distances"), py::arg("threads") = 0);
    m.def("probe", &probe_ray, py::arg("flat"), py::arg("options"), py::arg("width"), py::arg("height"), py::arg("x"),
          py::arg("y"));
    m.def("build", &build, py::arg("lo"), py::arg("hi"));
    m.def("widen", &widen, py::arg("bounds"), py::arg("child"), py::arg("count"));
    m.def("fill", &fill_depth, py::arg("points"), py::arg("order"), py::arg("view"), py::arg("parallel"),
          py::arg("form"), py::arg("last"), py::arg("depth"), py::arg("winner"));
    m.def("raster", &raster_picture, py::arg("flat"), py::arg("order"), py::arg("view"), py::arg("maps"),
          py::arg("options"), py::arg("grid"), py::arg("picture"), py::arg("threads"));
    m.def("main_axis", [](const py::object& direction) {
        return single(direction) ? shear(*rows<float, Vec3<float>>(direction, "direction").data).kz
                                 : shear(*rows<double, Vec3<double>>(direction, "direction").data).kz;
    });
    m.def("ray_triangle", [](const py::object& o, const py::object& d, const py::object& corners) {
        return single(corners) ? ray_triangle_as<float>(o, d, corners) : ray_triangle_as<double>(o, d, corners);
    });
    m.def("ray_sphere", [](const py::object& o, const py::object& d, double radius) {
        return single(o) ? ray_sphere_as<float>(o, d, radius) : ray_sphere_as<double>(o, d, radius);
    });
    m.def("inverse_bilinear", [](const py::object& point, const py::object& quad) {
        return single(quad) ? inverse_bilinear_as<float>(point, quad) : inverse_bilinear_as<double>(point, quad);
    });
}
