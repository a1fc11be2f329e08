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
