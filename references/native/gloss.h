// Directions spread as a highlight is: where a light is larger than the highlight, these find it.
#pragma once

#include "emitter.h"
#include "preview.h"

namespace notabug {

// A GGX lobe narrower than this would be a mirror of the light: at this alpha it blurs it by 1e-4 of a radian, which no
// pixel shows.
constexpr double sharpest = 1e-4;

template <class T>
struct Gloss {
    enum Kind { none, phong_lobe, blinn_lobe, ggx_lobe };
    Kind kind = none;
    Vec3<T> N{0, 0, 1}, V{0, 0, 1};
    T exponent = 1, alpha = 1, coat = 1, coated = 0;  // coated: the share of the directions that are the clearcoat's

    bool any() const { return kind != none; }

    Vec3<T> at(const Unit<T>& u) const {
        if (kind == phong_lobe) {
            const Vec3<T> R = (T(2) * dot(N, V)) * N - V;
            return about(around(R), u.a, T(1) - std::pow(u.b, T(1) / (exponent + T(1))));
        }
        Vec3<T> H;
        if (kind == blinn_lobe) {
            H = about(around(N), u.a, T(1) - std::pow(u.b, T(1) / (exponent + T(1))));
        } else if (u.b < coated) {
            H = facet({u.a, u.b / coated}, coat);
        } else {
            H = facet({u.a, (u.b - coated) / (T(1) - coated)}, alpha);
        }
        return (T(2) * dot(V, H)) * H - V;
    }

    T density(const Vec3<T>& L) const {
        if (kind == phong_lobe) {
            const T c = T(2) * dot(N, V) * dot(N, L) - dot(V, L);
            return c > 0 ? (exponent + T(1)) / (T(2) * pi<T>) * std::pow(std::min(c, T(1)), exponent) : T(0);
        }
        Vec3<T> H = L + V;
        const T size = length(H);
        if (!(size > 0)) return 0;
        H = H / size;
        const T nh = dot(N, H), vh = dot(V, H), steep = length(cross(N, H));
        if (!(nh > 0) || !(vh > 0)) return 0;
        if (kind == blinn_lobe)
            return (exponent + T(1)) / (T(2) * pi<T>) * std::pow(std::min(nh, T(1)), exponent) / (T(4) * vh);
        T sum = (T(1) - coated) * facets(alpha, nh, steep);
        if (coated > 0) sum += coated * facets(coat, nh, steep);
        return sum;
    }

  private:
    // The normal of a facet that is seen along V (Heitz 2018, "Sampling the GGX Distribution of Visible Normals").
    Vec3<T> facet(const Unit<T>& u, T a) const {
        const Frame<T> frame = around(N);
        const Vec3<T> stretched{a * dot(frame.x, V), a * dot(frame.y, V), dot(N, V)};
        const Vec3<T> v = stretched / length(stretched);
        const T tilt = std::sqrt(v.x * v.x + v.y * v.y);
        const Vec3<T> along = tilt > 0 ? Vec3<T>{-v.y / tilt, v.x / tilt, 0} : Vec3<T>{1, 0, 0};
        const Vec3<T> up = cross(v, along);
        const T r = std::sqrt(u.b), phi = T(2) * pi<T> * u.a, x = r * std::cos(phi);
        const T half = T(0.5) * (T(1) + v.z);
        const T y = (T(1) - half) * std::sqrt(std::max(T(1) - x * x, T(0))) + half * r * std::sin(phi);
        const Vec3<T> h = x * along + y * up + std::sqrt(std::max(T(1) - x * x - y * y, T(0))) * v;
        const Vec3<T> flat{a * h.x, a * h.y, std::max(h.z, T(0))};
        const T size = length(flat);
        return size > 0 ? frame.of(flat.x / size, flat.y / size, flat.z / size) : N;
    }

    T facets(T a, T nh, T steep) const {
        const T nv = dot(N, V), square = a * a, spread = nh * nh * square + steep * steep;
        if (!(nv > 0) || !(spread > 0)) return 0;
        const T seen = T(2) * nv / (nv + std::sqrt(square + (T(1) - square) * nv * nv));
        return square / (pi<T> * spread * spread) * seen / (T(4) * nv);
    }
};

template <class T>
inline Gloss<T> gloss_of(const Scene<T>& scene, int material, const PreviewSurface<T>& preview, const Vec3<T>& N,
                         const Vec3<T>& V) {
    Gloss<T> made;
    made.N = N, made.V = V;
    if (preview.workflow != 0) {
        if (!(dot(N, V) > 0)) return made;
        made.kind = Gloss<T>::ggx_lobe;
        made.alpha = preview.roughness * preview.roughness;
        made.coat = preview.clearcoat_roughness * preview.clearcoat_roughness;
        made.coated = preview.clearcoat > 0 ? T(0.5) : T(0);
        return made;
    }
    const std::int32_t kind = scene.lobes.kind ? scene.lobes.kind[material] : no_lobe;
    if (kind == no_lobe) return made;
    made.kind = kind == phong || kind == phong_cosine ? Gloss<T>::phong_lobe : Gloss<T>::blinn_lobe;
    made.exponent = scene.lobes.specular[material].exponent;
    return made;
}

}  // namespace notabug
