// UsdPreviewSurface under the light from one direction.
//
// Its specification (openusd.org, UsdPreviewSurface, "Core Nodes: Preview Surface") gives the parameters: what is reflected
// along and across the surface (F0 and F90) in each workflow, Schlick's transition between them, a roughness that "is
// usually squared before use with a GGX or Beckmann lobe", a white second lobe. How they are put together is taken from
// OpenUSD's own shader (usdShaders/shaders/previewSurface.glslfx, evaluateLight), without the constants that it adds
// against divisions by zero. It does not say which masking GGX has: Smith's (Walter et al. 2007, equation 34) is the
// reference, Heitz's (2014, equation 99) and the shader's own are conventions.
#pragma once

#include "shade.h"

namespace notabug {

// What a light of irradiance pi at normal incidence sends towards the viewer, by its part; N.L is in it.
template <class T>
struct Reflected {
    Vec3<T> diffuse, specular;  // to be multiplied by the diffuse colour; by nothing
};

// The surface at a point: its maps are looked up.
template <class T>
inline PreviewSurface<T> preview_at(const Scene<T>& scene, int material, T u, T v, Texels texels) {
    PreviewSurface<T> made = scene.previews.surface[material];
    if (!scene.textures.info) return made;
    const PreviewMaps& maps = scene.previews.maps[material];
    if (maps.metallic >= 0) made.metallic = texel(scene.textures, maps.metallic, u, v, texels).x;
    if (maps.roughness >= 0) made.roughness = texel(scene.textures, maps.roughness, u, v, texels).x;
    if (maps.emission >= 0) made.emission = texel(scene.textures, maps.emission, u, v, texels);
    return made;
}

// The normal that shades where `N` is the surface's: that of the material's map, in the frame of the triangle's dP/du,
// dP/dv and N. T is square to N, and B to both, on the side of dP/dv: so it is where coordinates are mirrored, too.
template <class T>
inline Vec3<T> mapped_normal(const Scene<T>& scene, int material, int triangle, T u, T v, const Vec3<T>& N,
                             Texels texels) {
    const std::int32_t map = scene.previews.maps[material].normal;
    if (map < 0 || triangle < 0 || !scene.textures.info) return N;
    const Triangle<T>& p = scene.points[triangle];
    const Corners& c = scene.corner[triangle];
    const T* uv = scene.uv;
    const T u1 = uv[2 * c.b] - uv[2 * c.a], v1 = uv[2 * c.b + 1] - uv[2 * c.a + 1];
    const T u2 = uv[2 * c.c] - uv[2 * c.a], v2 = uv[2 * c.c + 1] - uv[2 * c.a + 1];
    const T area = u1 * v2 - u2 * v1, sign = area < 0 ? T(-1) : T(1);
    const Vec3<T> e1 = p.b - p.a, e2 = p.c - p.a;
    const Vec3<T> along = sign * (v2 * e1 - v1 * e2), up = sign * (u1 * e2 - u2 * e1);  // times |area|
    Vec3<T> tangent = along - dot(along, N) * N;
    const T size = length(tangent);
    if (!(size > 0) || area == 0) return N;  // no coordinates run along the surface
    tangent = tangent / size;
    Vec3<T> across = cross(N, tangent);
    if (dot(across, up) < 0) across = -across;
    const Vec3<T> said = texel(scene.textures, map, u, v, texels);
    const Vec3<T> turned = said.x * tangent + said.y * across + said.z * N;
    const T reach = length(turned);
    return reach > 0 ? turned / reach : N;
}

// D G N.L / (4 N.L N.V) times pi, of unit vectors; `steep` is |N x H|, which 1 - N.H cancels in.
template <class T>
inline T ggx(T roughness, Masking masking, T nl, T nv, T nh, T steep) {
    const T alpha = roughness * roughness, square = alpha * alpha;
    const T spread = nh * nh * square + steep * steep;
    if (!(spread > 0)) return 0;  // a mirror, which sends nothing of a light without a size
    const T d = square / (spread * spread);
    T shadowed = 0;  // G / (4 N.L N.V)
    if (masking == Masking::schlick) {
        const T k = alpha / T(2);
        shadowed = T(1) / (T(4) * (nl * (T(1) - k) + k) * (nv * (T(1) - k) + k));
    } else {
        const T l = std::sqrt(square + (T(1) - square) * nl * nl), v = std::sqrt(square + (T(1) - square) * nv * nv);
        if (masking == Masking::correlated) shadowed = T(1) / (T(2) * (nl * v + nv * l));
        else shadowed = T(1) / ((nl + l) * (nv + v));
    }
    return d * shadowed * nl;
}

template <class T>
inline Reflected<T> reflected(const PreviewSurface<T>& surface, const Vec3<T>& albedo, const Vec3<T>& N,
                              const Vec3<T>& L, const Vec3<T>& V) {
    const T nl = dot(N, L), nv = dot(N, V);
    Reflected<T> made{{0, 0, 0}, {0, 0, 0}};
    if (!(nl > 0)) return made;
    Vec3<T> H = L + V;
    const T size = length(H);
    H = size > 0 ? H / size : N;
    const T nh = dot(N, H), steep = length(cross(N, H));
    const T off = T(1) - std::min(std::max(dot(V, H), T(0)), T(1)), twice = off * off;
    const T schlick = twice * twice * off;
    const T ratio = (T(1) - surface.ior) / (T(1) + surface.ior), normal = ratio * ratio;
    const Vec3<T> white{1, 1, 1};
    Vec3<T> low = surface.specular, high = white;
    T share = 1;
    if (surface.workflow == metallic_workflow) {
        const T m = surface.metallic;
        high = (T(1) - m) * white + m * albedo;
        low = ((T(1) - m) * normal + m) * high;
        share = T(1) - m;
    }
    const Vec3<T> fresnel = (T(1) - schlick) * low + schlick * high;
    made.diffuse = (share * nl) * (white - fresnel);
    if (!(nv > 0)) return made;  // seen from below: no facet reflects
    const Masking masking = static_cast<Masking>(surface.masking);
    made.specular = ggx(surface.roughness, masking, nl, nv, nh, steep) * fresnel;
    if (surface.clearcoat > 0) {
        const T coat = (T(1) - schlick) * normal + schlick;
        made.specular = made.specular + (surface.clearcoat * coat *
                                         ggx(surface.clearcoat_roughness, masking, nl, nv, nh, steep)) * white;
    }
    return made;
}

}  // namespace notabug
