// Radiance along a ray: lights with shadow rays, and Whitted's recursion (1980, "An improved illumination model for
// shaded display", CACM 23(6)) as a stack of rays that wait.
#pragma once

#include "normal_map.h"
#include "radiance.h"
#include "shadow_map.h"
#include "spread.h"
#include "surface.h"

namespace notabug {

constexpr int waiting_rays = 64;  // that may wait: three a hit, one of them followed at once
constexpr int passages = 64;      // straight passages through opacity a path may have; they are no bounces

// One camera ray with all that follows from it.
template <class T, class F, class Record>
struct Whitted {
    const Scene<T>& scene;
    const Options& option;
    HalfPixel<T> half_pixel;
    Record& record;
    Cubature cubature{};
    static constexpr bool sized = F::emitters;

    // Where rays leave a surface from: `at`, moved by `beside` along the facet's normal to the side that they go to.
    struct Departure {
        Vec3<T> at;
        T beside, clear;
    };

    // A light as seen from a point.
    struct Seen {
        Vec3<T> L;
        T distance, end, falloff;
    };

    Seen look(const Light<T>& light, const Vec3<T>& at) const {
        if (light.kind != 0) return {-light.place, infinity<T>, infinity<T>, 1};
        const Vec3<T> to = light.place - at;
        const T distance = length(to);
        if (distance == 0) return {{0, 0, 0}, 0, 0, 0};  // a light in the very point that it would light
        T falloff = T(1) / (distance * distance);
        if (option.falloff == Falloff::linear) falloff = T(1) / distance;
        if (option.falloff == Falloff::none) falloff = 1;
        return {to / distance, distance, option.shadow_rays == ShadowRays::unbounded ? infinity<T> : distance, falloff};
    }

    // Whether the hit's own error loses the light: it lifts the hit off or sinks it in, and the light meets the surface
    // again at error / N.L. An epsilon of more than half a pixel's footprint would detach shadows that are real.
    bool acne(int k, const Ray<T>& ray, const Hit<T>& hit, const Vec3<T>& at, T steep) const {
        if (!((option.acne >> std::min(k, 63)) & 1)) return false;
        const Vec3<T> o = absolute(ray.origin), x = absolute(at);
        const T reach = o.x + o.y + o.z + hit.t + x.x + x.y + x.z;
        T error = static_cast<T>(option.hit_error) * reach;
        if constexpr (F::spheres) {
            if (hit.sphere >= 0)
                error += static_cast<T>(option.sphere_error) * cancelling(scene.spheres, hit.sphere, ray);
        }
        const T limit = option.start == Start::absolute ? static_cast<T>(option.epsilon)  // the renderer's own prevents
                                                        : half_pixel.angle * hit.t + half_pixel.width;
        return error > steep * limit;
    }

    Lit<T> lights(const Waiting<T>& from, const Sight<T>& sight, const Surface<T>& s, const Departure& start,
                  int material, const Vec3<T>& colour, const Vec3<T>& primary_view, bool primary) const {
        Lit<T> lit;
        const Ray<T>& ray = from.ray;
        const Hit<T>& hit = sight.hit;
        const bool gouraud = option.gouraud && s.sagitta >= 0;
        const bool exact = option.start == Start::exact;
        // shadows are those of the point itself, not of the corners
        const bool here = !gouraud || option.gouraud_shadows == GouraudShadows::pixels;
        const bool shadows = option.shadows != Shadows::none && !s.turned &&
                             !(gouraud && option.gouraud_shadows == GouraudShadows::none);
        const T lift = static_cast<T>(option.offset) * std::max(s.sagitta, T(0))  // Snyder and Barr 1987
                       + static_cast<T>(option.shadow_lift);
        const Vec3<T>& g = s.facet;
        Vec3<T> at = s.at, N = s.normal, V = -ray.direction, leave = start.at;
        T part = 1;
        PreviewSurface<T> preview{}, softest{};  // no such surface
        [[maybe_unused]] bool shadowed = false, lighted = false;  // of the light's directions any
        [[maybe_unused]] Bump<T> bump{N, N};
        // of a light whose points share their shadows (light_grid_shared): how many are seen is `asking`ed first, then known
        [[maybe_unused]] bool asking = false;
        [[maybe_unused]] T visible = 0, known = -1;
        if constexpr (F::previews) {
            if (scene.previews.surface && scene.previews.surface[material].workflow != 0) {
                preview = preview_at(scene, material, s.u, s.v, option.texels);
                lit.colour = preview.emission;
                if constexpr (F::emitters) {  // see gloss.h
                    softest = preview;
                    softest.roughness = std::max(preview.roughness, std::sqrt(static_cast<T>(sharpest)));
                    softest.clearcoat_roughness = std::max(preview.clearcoat_roughness, std::sqrt(static_cast<T>(sharpest)));
                }
                bump = bump_at(scene, option, {material, hit.triangle, s.weights, s.u, s.v, s.side, N, s.side * g, V});
            }
        }
        const int count = static_cast<int>(scene.lights);
        const int turns = s.painted || gouraud ? count * (!gouraud ? 1 : s.weights.quad >= 0 ? 4 : 3) : 0;
        for (int turn = 0; turn < turns; ++turn) {
            const int k = turn % count;
            if constexpr (F::emitters) {
                if (scene.links && (scene.links[k * scene.objects + s.object] & unlit)) continue;
            }
            if (gouraud) {  // the same light at the facet's corners, as seen from where the ray started
                const LitCorner<T> c = lit_corner(scene, hit.triangle, turn / count, s.weights, s.side, ray.origin,
                                                  option.silhouette);
                at = c.at, N = c.normal, V = c.view, part = c.weight, bump = {N, N};
                if (!here) leave = at;
            }
            const Light<T>& light = scene.light[k];
            // what one direction adds; `sized`: the light has a size, and this is one of its directions
            const auto shine = [&](const Seen& to, [[maybe_unused]] const Counted<T>& counts, auto sized) {
                const T nl = dot(N, to.L), gl = dot(g, to.L);
                if constexpr (Record::listens) {
                    if (primary && counts.told > 0 && !(sized() && asking))
                        record.light(k, to.distance, gl * s.side, nl, (to.falloff / counts.told) * light.intensity,
                                     part * counts.told);
                }
                const bool behind_bump = nl <= 0 && bump.mapped && option.bump_light == BumpLight::lit;
                const bool asks = sized() && asking;
                if (nl <= 0 && !asks && !(option.uncut && scene.lobes.kind) && !behind_bump) return;
                // a highlight ends abruptly where N.L = 0; diffuse light does not
                if (!sized() && scene.lobes.kind && !gouraud) lit.facing |= std::uint64_t(1) << (k & 63);
                const T steep = std::abs(gl);
                const bool behind = option.shadows == Shadows::planes && gl * s.side <= 0;
                const bool dark = sight.unlit || behind || acne(k, ray, hit, at, steep);
                Vec3<T> share{1, 1, 1};
                T told = 1;
                if (dark) {
                    share = {0, 0, 0};
                } else if (sized() && known >= 0) {
                    share = {known, known, known};
                } else if (shadows && (nl > 0 || behind_bump || asks)) {
                    // behind, an uncut highlight belongs to a shader without shadows
                    T begin = start.clear;
                    if (option.ties != Ties::nearest)  // what coincides with this surface does not shadow it
                        begin += T(4) * sight.between / std::max(steep, static_cast<T>(0.001));
                    const Seen aim = !sized() && gouraud && here ? look(light, s.at) : to;
                    const T slope = gouraud && here ? std::max(dot(s.normal, aim.L), T(0)) : nl;
                    const T outside = dot(g, aim.L) * s.side;
                    const T beside = outside > 0 ? start.beside : -start.beside;
                    // from inside a ball its other side is met
                    const int ball = outside > 0 && s.side > 0 && exact ? hit.sphere : -1;
                    const int forgive = option.shadows == Shadows::forgiving && !behind_bump ? (here ? 1 : 2) : 0;
                    const ShadowRay<T> shadow{{leave + beside * g + lift * N, aim.L},
                                              begin,
                                              aim.end,
                                              hit.triangle,
                                              ball,
                                              exact,
                                              forgive,
                                              s.side,
                                              slope,
                                              option.transparent_shadows,
                                              option.shadow_rays == ShadowRays::culled,
                                              static_cast<T>(option.shadow_gap),
                                              option.gap_loses,
                                              scene.links ? scene.links + k * scene.objects : nullptr,
                                              F::cutouts ? &option : nullptr};
                    const LightShare<T> through = transmittance<T, F>(scene, shadow);
                    share = through.share;
                    if constexpr (F::cutouts) told = through.steady;
                    if (!sized() && option.shadow_map != ShadowMap::none) {
                        share = mapped<T, F>(scene, option, k, s.at, N, g, share);
                        if constexpr (F::cutouts) told = mean(share);
                    }
                    lit.forgiven = lit.forgiven || through.forgiven;
                    if constexpr (Record::listens) {
                        if (primary && !asks) record.shadow(scene, k, shadow, through);
                    }
                }
                if constexpr (Record::listens) {
                    if (primary && counts.told > 0 && !asks) record.share(k, mean(share), part * counts.told);
                }
                if constexpr (decltype(sized)::value) {
                    shadowed = shadowed || mean(share) < 1, lighted = lighted || any_positive(share);
                    visible += mean(share);
                    if (asking) return;
                }
                if (!any_positive(share)) {
                    if (!sized() && here) lit.blocked |= std::uint64_t(1) << (k & 63);
                    return;
                }
                if constexpr (!F::cutouts) told = mean(share);
                if (!sized() && mean(share) < 1 && here)  // the border of a transparent shadow is an edge too
                    lit.blocked += std::uint64_t(65536) * static_cast<std::uint64_t>(k + 1) *
                                   static_cast<std::uint64_t>(nearest(static_cast<double>(told) * 1000));
                const bool mirrored = from.generation >= passages;
                const Vec3<T> e = part * (static_cast<T>(0.3183098861837907) * (to.falloff * share));
                // the fault of one view vector for all rays: the camera's
                const bool wrong = mirrored && option.mirrored_highlight == MirroredHighlight::primary;
                T raw = 0;
                if (option.raw_vectors) raw = light.kind == 0 ? to.distance : T(1);
                T h = highlight(scene.lobes, material, N, to.L, wrong ? primary_view : V, raw);
                if (mirrored && option.mirrored_highlight == MirroredHighlight::lost) h = 0;
                Vec3<T> E = mul(e, light.intensity);
                if constexpr (F::emitters) {
                    if (scene.emitter) E = mul(E, shone(scene.skies, scene.emitter[k], to.L));
                }
                const T lambert = std::max(nl, T(0));
                Vec3<T> diffuse{E.x * colour.x * lambert, E.y * colour.y * lambert, E.z * colour.z * lambert};
                Vec3<T> specular{0, 0, 0};
                if constexpr (F::previews) {
                    if (preview.workflow != 0) {
                        const PreviewSurface<T>& look_of = sized() ? softest : preview;
                        const Vec3<T>& view = wrong ? primary_view : V;
                        const Reflected<T> part_of = reflected_bump(option, look_of, colour, bump, N, to.L, view);
                        diffuse = mul(E, mul(colour, part_of.diffuse));
                        if (!mirrored || option.mirrored_highlight != MirroredHighlight::lost)
                            specular = mul(E, part_of.specular);
                        if constexpr (F::emitters) specular = counts.specular * specular;
                        lit.colour = lit.colour + specular;
                    }
                }
                if constexpr (F::emitters) diffuse = counts.diffuse * diffuse;
                lit.colour = lit.colour + diffuse;
                if (scene.lobes.kind && preview.workflow == 0) {
                    const Vec3<T>& tint = scene.lobes.specular[material].colour;
                    specular = {E.x * h * tint.x, E.y * h * tint.y, E.z * h * tint.z};
                    if constexpr (F::emitters) specular = counts.specular * specular;
                    lit.colour = lit.colour + specular;
                }
                if constexpr (Record::listens) {
                    if (primary) record.terms(k, diffuse, specular);
                }
            };
            if constexpr (F::emitters) {
                if (scene.emitter) {
                    const Emitter<T>& e = scene.emitter[k];
                    if (static_cast<Shape>(static_cast<int>(e.shape)) == Shape::none) {
                        shine(look(light, at), {e.diffuse, e.specular, 1}, std::false_type{});
                    } else {
                        shadowed = lighted = false;
                        const bool wrong = from.generation >= passages &&
                                           option.mirrored_highlight == MirroredHighlight::primary;
                        const Vec3<T>& view = wrong ? primary_view : V;
                        const bool bounded = option.shadow_rays != ShadowRays::unbounded;
                        const auto along = [&](const Aim<T>& aim, T weight, const Counted<T>& counts) {
                            const T end = bounded ? aim.distance : infinity<T>;
                            const T sent = option.light_uncosined ? uncosined(e, aim.L) : T(1);
                            shine(Seen{aim.L, aim.distance, end, sent * weight}, counts, std::true_type{});
                        };
                        const View_of<T> seen_of(scene.skies, e, at, N);
                        if (option.light_grid > 0 && seen_of.shape() == Shape::rect) {
                            const auto points = [&](auto told) {
                                spread_on_grid(seen_of, option.light_grid, option.light_grid_ends,
                                               [&](int j, const Aim<T>& aim, T weight, const Counted<T>& counts) {
                                                   shadowed = false;
                                                   along(aim, weight, counts);
                                                   if (told() && here && shadowed) lit.blocked += scattered(k, j);
                                               });
                            };
                            if (!option.light_grid_shared) {
                                points(std::true_type{});
                                continue;
                            }
                            visible = 0, asking = true;
                            points(std::true_type{});
                            asking = false, known = visible / static_cast<T>(option.light_grid * option.light_grid);
                            points(std::false_type{});
                            known = -1;
                            continue;
                        }
                        const Cubature moved = cubature.moved(k, from.generation);
                        spread(seen_of, gloss_of(scene, material, softest, bump.normal, view),
                               e.sky >= 0 ? moved.finer() : moved, along);
                        if (here && lighted && !shadowed) lit.open |= std::uint64_t(1) << (k & 63);
                        if (here && shadowed && !lighted) lit.hidden |= std::uint64_t(1) << (k & 63);
                    }
                    continue;
                }
            }
            shine(look(light, at), {1, 1, 1}, std::false_type{});
        }
        return lit;
    }

    // The mirror, refracted and straight rays that leave a surface of `opacity`; pushed onto `rays` of which `n` wait.
    int send(const Waiting<T>& from, const Hit<T>& hit, const Surface<T>& s, const Departure& start,
             const Coefficients<T>& c, T opacity, Waiting<T>* rays, int n) const {
        const Vec3<T>& D = from.ray.direction;
        const Vec3<T>& N = s.normal;
        const Vec3<T>& g = s.facet;
        const Vec3<T> V = -D;
        const int depth = from.generation / passages;
        const T nv = dot(N, V);
        Vec3<T> R = (T(2) * nv) * N - V;
        if (option.unreversed) {
            const T flat = N.x * N.x + N.z * N.z;
            if (flat > 0) {
                const T swing = T(2) * (R.x * N.z - R.z * N.x) / flat;  // along y x N
                R.x = R.x - swing * N.z, R.z = R.z + swing * N.x;
            }
        } else if (option.retroreflection) {
            R = V;
        }
        Vec3<T> mirror = c.mirror;
        const int passed = from.generation % passages;
        const bool goes_on = depth + (option.counted_passages ? passed : 0) < option.bounces;
        if (goes_on && any_positive(c.transmission)) {
            const bool enters = option.counted_glass ? from.inside != s.object : s.side > 0;
            const T eta = enters ? T(1) / c.ior : c.ior;
            const T k2 = T(1) - eta * eta * (T(1) - nv * nv);
            if (k2 < 0) {  // total internal reflection: the ray goes on as a mirror ray
                if (!option.lost_reflection) mirror = mirror + c.transmission;
                if (option.whole_reflection) mirror = {1, 1, 1};
            } else if (n < waiting_rays) {
                const Vec3<T> refracted = (eta * nv - std::sqrt(k2)) * N - eta * V;
                // N' and the facet disagree about whether it has come through
                const bool low = s.sagitta >= 0 && !option.self_refraction && dot(g, refracted) * s.side > 0;
                rays[n++] = {{start.at - start.beside * g, refracted},
                             mul(from.weight, c.transmission),
                             from.generation + passages,
                             s.face,
                             -1,
                             -dot(N, refracted),
                             low ? hit.triangle : -1,
                             enters ? s.object : -1};
            }
        }
        if (goes_on && any_positive(mirror) && n < waiting_rays) {
            const bool rising = dot(g, R) * s.side > 0;
            const bool low = s.sagitta >= 0 && !option.self_reflection && !rising;
            rays[n++] = {{start.at + (rising ? start.beside : -start.beside) * g, R},
                         mul(from.weight, mirror),
                         from.generation + passages,
                         s.face,
                         rising && s.side > 0 ? hit.sphere : -1,
                         nv,
                         low && nv > 0 ? hit.triangle : -1,
                         from.inside};
        }
        if (opacity < 1 && n < waiting_rays && passed < passages - 1 && (goes_on || !option.counted_passages)) {
            rays[n++] = {{start.at - start.beside * g, D},
                         (T(1) - opacity) * from.weight,
                         from.generation + 1,
                         s.face,
                         -1,
                         0,
                         -1,
                         from.inside};
        }
        return n;
    }

    Radiance<T> along(const Ray<T>& camera_ray, T near, T far) const {
        Waiting<T> rays[waiting_rays];
        rays[0] = {camera_ray, {1, 1, 1}, 0, -1, -1, 0, -1, -1};
        const Vec3<T> primary_view = -camera_ray.direction;
        Radiance<T> made{{0, 0, 0}, 0, false};
        std::uint64_t seen = 0, dark = 0;
        int n = 1;
        while (n) {
            const Waiting<T> from = rays[--n];
            T tmin = near;
            if (from.generation)
                tmin = std::max(clearance(scene, option, from.ray.origin), static_cast<T>(option.ray_gap));
            Sight<T> sight;
            if (!see<T, F>(scene, option, from, tmin, far, sight)) continue;
            if (!settle<T, F>(scene, option, from.ray, sight)) continue;
            const Hit<T>& hit = sight.hit;
            const Surface<T> s = surface<T, F>(scene, option, from.ray, hit);
            const int material = scene.material[s.object];
            Vec3<T> colour = albedo(scene, material, s.u, s.v, option.texels);
            if constexpr (F::cutouts) {
                if (option.associated) colour = unassociated(scene, material, s.u, s.v, colour, option.texels);
            }
            if (sight.blend >= 0) colour = T(0.5) * (colour + albedo(scene, sight.blend, s.u, s.v, option.texels));
            Departure start{s.at, 0, clearance(scene, option, s.at)};
            if (option.start == Start::error_bound) {
                const Bounded<T> better = bounded<T, F>(scene, hit, s.at, s.facet);
                start.at = better.at, start.beside = better.error;
            }
            start.beside *= s.side;
            const bool primary = from.generation == 0;
            if constexpr (Record::listens) {
                if (primary) record.surface(scene, from.ray, hit, s, colour);
            }
            const Lit<T> lit = lights(from, sight, s, start, material, colour, primary_view, primary);
            T opaque = 1;
            if constexpr (F::secondary) opaque = opacity_at<T, F>(scene, material, s.u, s.v, option.texels);
            made.colour = made.colour + mul(opaque * from.weight, lit.colour);
            seen = seen * 31 + static_cast<std::uint64_t>(s.object + 1) + facing_prime * lit.facing;
            dark = dark * 31 + lit.blocked;
            if (s.sagitta <= 0 && hit.triangle >= 0) seen += 67108864 * facet_code(s.facet);
            if (primary) made.spared = lit.forgiven;
            if constexpr (F::emitters) {
                if (primary) made.hidden = lit.hidden, made.open = lit.open;
            }
            if constexpr (F::secondary) n = send(from, hit, s, start, scene.secondary[material], opaque, rays, n);
        }
        const std::int64_t rest = (static_cast<std::int64_t>(dark) % dark_prime + dark_prime) % dark_prime;
        made.id = static_cast<std::int64_t>((seen & seen_bits) | (static_cast<std::uint64_t>(rest) << 40));
        return made;
    }
};

}  // namespace notabug
