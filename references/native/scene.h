// A scene as the tracer and the rasteriser read it: views of the arrays that references/tracer/flatten.py makes.
//
// What a scene lacks has no pointer. Nothing here owns memory: the caller keeps the arrays for the time of a call.
#pragma once

#include "vector.h"
#include "wide.h"

namespace notabug {

template <class T>
struct Triangle {
    Vec3<T> a, b, c;
};

struct Corners {  // face corners of a triangle, into Scene::normal and Scene::uv
    std::int32_t a, b, c;
};

template <class T>
struct Light {
    T kind;          // 0 a point, else distant
    Vec3<T> place;   // position of a point, direction of a distant one
    Vec3<T> intensity;
};

enum Link : std::uint8_t { unlit = 1, unshadowing = 2 };  // the light does not reach the object; is not blocked by it

// What a light has beside its Light: size, beam and multipliers, see emitter.h.
template <class T>
struct Emitter {
    T shape;              // a Shape
    T diffuse, specular;  // what they are multiplied by
    T shaped;             // 1 where it shines in a beam
    T cone, begin;        // radians: where the beam ends, where it begins to fade
    T focus;
    Vec3<T> tint;
    T area, volume;  // of a flat shape; the determinant of x, y, z
    T spread;        // 1 - the cosine of half a sun's angle
    Vec3<T> centre, axis, normal;
    Vec3<T> x, y, z;           // of the shape, in world space
    Vec3<T> to_x, to_y, to_z;  // their inverse: local x is to_x . p
    T sky;                     // the number of a dome's picture, or -1
};

template <class T>
struct Camera {
    // across and up times the tangents of half the angles of view, or where rays are parallel half of what is seen
    Vec3<T> origin, across, up, forward;
    T near, far;
    T shift_x, shift_y;  // by how many halves of the picture its middle lies beside the axis, right and up
    T parallel;          // 1 for an orthographic camera, else 0
};

// An affine map for column vectors, row by row.
template <class T>
struct Affine {
    T m[12];

    Vec3<T> point(const Vec3<T>& p) const {
        return {m[0] * p.x + m[1] * p.y + m[2] * p.z + m[3], m[4] * p.x + m[5] * p.y + m[6] * p.z + m[7],
                m[8] * p.x + m[9] * p.y + m[10] * p.z + m[11]};
    }
    Vec3<T> vector(const Vec3<T>& p) const {
        return {m[0] * p.x + m[1] * p.y + m[2] * p.z, m[4] * p.x + m[5] * p.y + m[6] * p.z,
                m[8] * p.x + m[9] * p.y + m[10] * p.z};
    }
    Vec3<T> transposed(const Vec3<T>& p) const {
        return {m[0] * p.x + m[4] * p.y + m[8] * p.z, m[1] * p.x + m[5] * p.y + m[9] * p.z,
                m[2] * p.x + m[6] * p.y + m[10] * p.z};
    }
};

// A quad in its own plane: x, y of its four corners.
template <class T>
struct PlaneQuad {
    T x[4][2];
};

template <class T>
struct PlaneFrame {
    Vec3<T> origin, x, y;
};

struct QuadCorners {
    std::int32_t corner[4];
};

template <class T>
struct QuadPoints {
    Vec3<T> point[4];
};

template <class T>
struct Quads {
    const std::int32_t* of_triangle = nullptr;  // quad of each triangle, or -1; null where the scene has none
    const QuadCorners* corners = nullptr;
    const PlaneQuad<T>* plane = nullptr;
    const PlaneFrame<T>* frame = nullptr;
    const QuadPoints<T>* points = nullptr;
};

enum Wrap : std::int64_t { repeats = 0, clamps = 1, mirrors = 2, is_black = 3 };

struct TextureInfo {
    std::int64_t first, width, height, wrap_s, wrap_t;  // see Wrap
};

template <class T>
struct Textures {
    const Vec3<T>* texels = nullptr;
    const TextureInfo* info = nullptr;
};

struct SkyInfo {
    std::int64_t rows, cells;  // where its cumulative weights begin
};

// The pictures of domes, and how bright their texels are: see sky.h.
template <class T>
struct Skies {
    Textures<T> pictures;
    const SkyInfo* info = nullptr;
    const T* share = nullptr;   // of the directions to each dome those that follow its picture
    const T* weight = nullptr;  // of each texel: its share of those
    const T* rows = nullptr;    // cumulative: the share of all the rows down to this one
    const T* cells = nullptr;   // cumulative: the share of the row's texels down to this one
};

template <class T>
struct Spheres {
    std::int64_t count = 0;
    const T* radius = nullptr;
    const Affine<T>* to_local = nullptr;
    const Affine<T>* to_world = nullptr;
    const std::int32_t* object = nullptr;
};

template <class T>
struct Specular {
    Vec3<T> colour;
    T exponent;
};

enum Lobe : std::int32_t { no_lobe, phong, blinn, phong_cosine, blinn_cosine };

template <class T>
struct Lobes {
    const Specular<T>* specular = nullptr;
    const std::int32_t* kind = nullptr;
};

template <class T>
struct Coefficients {
    T opacity;
    Vec3<T> mirror, transmission;
    T ior;
};

constexpr int metallic_workflow = 1, specular_workflow = 2;
enum class Masking : int { separable, correlated, schlick };

// A UsdPreviewSurface with more than a diffuse colour: see preview.h.
template <class T>
struct PreviewSurface {
    T workflow;  // 0 where the material is no such surface
    T metallic, roughness, ior, clearcoat, clearcoat_roughness;
    T masking;  // a Masking
    Vec3<T> specular, emission;
};

struct PreviewMaps {  // textures, or -1
    std::int32_t metallic, roughness, emission, normal;
};

template <class T>
struct Previews {
    const PreviewSurface<T>* surface = nullptr;
    const PreviewMaps* maps = nullptr;
};

// Opacity from textures: see cutout.h.
template <class T>
struct Cutouts {
    const std::int32_t* map = nullptr;  // of each material, or -1; null where none has one
    const T* least = nullptr;           // what the map must say where the surface is whole; 0: it says how much is there
};

template <class T>
struct Leaf;

template <class T>
struct Scene {
    const WideNode* nodes = nullptr;  // of the hierarchy, the root first
    WideFrame boxes{};
    const Leaf<T>* leaves = nullptr;       // see leaf.h
    const std::int32_t* first = nullptr;   // triangle of each leaf; the others follow it

    std::int64_t triangles = 0;
    const Triangle<T>* points = nullptr;
    const std::int32_t* face = nullptr;  // of the whole scene: rays leaving a face do not hit it again
    const std::int32_t* object = nullptr;
    const Corners* corner = nullptr;
    const T* sagitta = nullptr;  // how far a facet may lie below the surface its normals imply; -1 where it is flat
    const Vec3<T>* normal = nullptr;
    const T* uv = nullptr;

    const std::int32_t* material = nullptr;  // of each object
    std::int64_t materials = 0;
    const Vec3<T>* diffuse = nullptr;        // of each material
    const std::int32_t* texture = nullptr;   // of each material, or -1
    std::int64_t lights = 0;
    const Light<T>* light = nullptr;
    const Emitter<T>* emitter = nullptr;  // of each light, where any has a size, a beam, a multiplier or links
    std::int64_t objects = 0;
    const std::uint8_t* links = nullptr;  // of each light and object, bits of Link; null where every light has all
    Camera<T> camera{};
    T radius = 0;  // of the whole scene, for error bounds

    Quads<T> quads;
    Textures<T> textures;
    Skies<T> skies;  // of domes with a picture
    Spheres<T> spheres;
    Lobes<T> lobes;
    const Coefficients<T>* secondary = nullptr;  // of each material, where any sends rays on
    Previews<T> previews;                        // of each material, where any is such a surface
    Cutouts<T> cutouts;
    const Vec3<T>* tangent = nullptr;            // of each face corner, where any surface has a normal map
};

// What a scene has, known when this is compiled: what it lacks then costs nothing.
template <bool has_spheres, bool has_secondary, bool has_previews = false, bool has_emitters = false,
          bool has_cutouts = false>
struct Features {
    static constexpr bool spheres = has_spheres;
    static constexpr bool secondary = has_secondary;
    static constexpr bool previews = has_previews;
    static constexpr bool emitters = has_emitters;
    static constexpr bool cutouts = has_cutouts;
};

}  // namespace notabug
