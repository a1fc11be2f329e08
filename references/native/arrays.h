// From Python's arrays and objects to the structures of the tracer: views, checked for type and shape, never copies.
#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <array>
#include <string>

#include "leaf.h"

namespace notabug {

namespace py = pybind11;

// A contiguous array of E with `columns` numbers a row; E may be a structure of T.
template <class T, class E = T>
struct Rows {
    E* data = nullptr;
    std::int64_t count = 0;
};

template <class T, class E = T>
Rows<T, E> rows(const py::handle& array, const char* what, bool write = false) {
    constexpr py::ssize_t columns = sizeof(E) / sizeof(T);
    static_assert(sizeof(E) % sizeof(T) == 0);
    if (!py::array_t<T, py::array::c_style>::check_(array))
        throw py::type_error(std::string(what) + ": expected a contiguous array of " +
                             py::str(py::dtype::of<T>()).cast<std::string>());
    const auto found = py::reinterpret_borrow<py::array>(array);
    if (found.size() % columns != 0)
        throw py::value_error(std::string(what) + ": expected " + std::to_string(columns) + " numbers a row");
    const void* data = write ? found.request(true).ptr : found.data();
    return {static_cast<E*>(const_cast<void*>(data)), static_cast<std::int64_t>(found.size() / columns)};
}

template <class T, class E = T>
Rows<T, E> field(const py::handle& owner, const char* name, bool write = false) {
    return rows<T, E>(owner.attr(name), name, write);
}

// The fields of a sequence that must be as long as another, or the code that draws would read beyond its end.
template <class T, class E = T>
E* field_of(const py::handle& owner, const char* name, std::int64_t count) {
    const auto found = field<T, E>(owner, name);
    if (found.count != count)
        throw py::value_error(std::string(name) + ": expected " + std::to_string(count) + " rows, not " +
                              std::to_string(found.count));
    return found.data;
}

// The place of a Python string among the names of an enum, in its order.
template <class E, std::size_t n>
E choice(const py::handle& options, const char* field_name, const std::array<const char*, n>& names) {
    const auto chosen = options.attr(field_name).cast<std::string>();
    for (std::size_t i = 0; i < n; ++i) {
        if (chosen == names[i]) return static_cast<E>(i);
    }
    throw py::value_error(std::string(field_name) + ": unknown: " + chosen);
}

// A Flat (references/tracer/flatten.py) as the tracer reads it.
template <class T>
Scene<T> scene_of(const py::handle& flat) {
    Scene<T> scene;
    const auto triangles = field<T, Triangle<T>>(flat, "points");
    scene.triangles = triangles.count;
    scene.points = triangles.data;
    scene.nodes = field<std::int32_t, WideNode>(flat, "nodes").data;
    const auto leaves = field<T, Leaf<T>>(flat, "leaves");
    scene.leaves = leaves.data;
    scene.first = field_of<std::int32_t>(flat, "first", leaves.count);
    scene.boxes = *field_of<double, WideFrame>(flat, "boxes", 1);
    scene.face = field_of<std::int32_t>(flat, "face", scene.triangles);
    scene.object = field_of<std::int32_t>(flat, "object", scene.triangles);
    scene.corner = field_of<std::int32_t, Corners>(flat, "corner", scene.triangles);
    scene.sagitta = field_of<T>(flat, "sagitta", scene.triangles);
    const auto normals = field<T, Vec3<T>>(flat, "normal");
    scene.normal = normals.data;
    scene.uv = field_of<T>(flat, "uv", 2 * normals.count);
    const auto owned = field<std::int32_t>(flat, "material");
    scene.material = owned.data;
    scene.objects = owned.count;
    const auto materials = field<T, Vec3<T>>(flat, "diffuse");
    scene.diffuse = materials.data;
    scene.materials = materials.count;
    scene.texture = field_of<std::int32_t>(flat, "texture", materials.count);
    const auto lights = field<T, Light<T>>(flat, "light");
    scene.light = lights.data;
    scene.lights = lights.count;
    if (const py::object emitters = flat.attr("emitters"); !emitters.is_none()) {
        scene.emitter = rows<T, Emitter<T>>(emitters, "emitters").data;
        if (rows<T, Emitter<T>>(emitters, "emitters").count != lights.count)
            throw py::value_error("emitters: not as many as there are lights");
        if (flat.attr("secondary").is_none()) throw py::value_error("emitters: expected coefficients beside them");
    }
    if (const py::object links = flat.attr("links"); !links.is_none()) {
        scene.links = field_of<std::uint8_t>(flat, "links", lights.count * scene.objects);
        if (!scene.emitter) throw py::value_error("links: expected emitters beside them");
    }
    scene.camera = *field_of<T, Camera<T>>(flat, "camera", 1);
    scene.radius = flat.attr("radius").cast<T>();
    if (const py::object quads = flat.attr("quads"); !quads.is_none()) {
        scene.quads.of_triangle = field_of<std::int32_t>(quads, "of_triangle", scene.triangles);
        const auto corners = field<std::int32_t, QuadCorners>(quads, "corners");
        scene.quads.corners = corners.data;
        scene.quads.plane = field_of<T, PlaneQuad<T>>(quads, "plane", corners.count);
        scene.quads.frame = field_of<T, PlaneFrame<T>>(quads, "frame", corners.count);
        scene.quads.points = field_of<T, QuadPoints<T>>(quads, "points", corners.count);
    }
    if (const py::object textures = flat.attr("textures"); !textures.is_none()) {
        scene.textures.texels = field<T, Vec3<T>>(textures, "texels").data;
        scene.textures.info = field<std::int64_t, TextureInfo>(textures, "info").data;
    }
    if (const py::object skies = flat.attr("skies"); !skies.is_none()) {
        const auto texels = field<T, Vec3<T>>(skies, "texels");
        const auto info = field<std::int64_t, TextureInfo>(skies, "info");
        scene.skies.pictures = {texels.data, info.data};
        scene.skies.info = field_of<std::int64_t, SkyInfo>(skies, "starts", info.count);
        scene.skies.share = field_of<T>(skies, "share", info.count);
        scene.skies.weight = field_of<T>(skies, "weight", texels.count);
        scene.skies.cells = field_of<T>(skies, "cells", texels.count);
        scene.skies.rows = field<T>(skies, "rows").data;
    }
    if (const py::object spheres = flat.attr("spheres"); !spheres.is_none()) {
        const auto radius = field<T>(spheres, "radius");
        scene.spheres.count = radius.count;
        scene.spheres.radius = radius.data;
        scene.spheres.to_local = field_of<T, Affine<T>>(spheres, "to_local", radius.count);
        scene.spheres.to_world = field_of<T, Affine<T>>(spheres, "to_world", radius.count);
        scene.spheres.object = field_of<std::int32_t>(spheres, "object", radius.count);
    }
    if (const py::object lobes = flat.attr("lobes"); !lobes.is_none()) {
        scene.lobes.specular = field_of<T, Specular<T>>(lobes, "specular", materials.count);
        scene.lobes.kind = field_of<std::int32_t>(lobes, "kind", materials.count);
    }
    if (const py::object previews = flat.attr("previews"); !previews.is_none()) {
        scene.previews.surface = field_of<T, PreviewSurface<T>>(previews, "surface", materials.count);
        scene.previews.maps = field_of<std::int32_t, PreviewMaps>(previews, "maps", materials.count);
        if (flat.attr("secondary").is_none()) throw py::value_error("previews: expected coefficients beside them");
    }
    if (const py::object cutouts = flat.attr("cutouts"); !cutouts.is_none()) {
        scene.cutouts.map = field_of<std::int32_t>(cutouts, "map", materials.count);
        scene.cutouts.least = field_of<T>(cutouts, "least", materials.count);
        if (flat.attr("secondary").is_none() || flat.attr("textures").is_none())
            throw py::value_error("cutouts: expected coefficients and textures beside them");
    }
    if (const py::object tangents = flat.attr("tangents"); !tangents.is_none()) {
        const auto found = rows<T, Vec3<T>>(tangents, "tangents");
        if (found.count != normals.count) throw py::value_error("tangents: not as many as there are normals");
        scene.tangent = found.data;
    }
    if (const py::object secondary = flat.attr("secondary"); !secondary.is_none())
        scene.secondary = field_of<T, Coefficients<T>>(secondary, "coefficients", materials.count);
    return scene;
}

// Whether the arrays of a Flat are float32; else they are float64.
inline bool is_single(const py::handle& flat) { return py::isinstance<py::array_t<float>>(flat.attr("points")); }

}  // namespace notabug
