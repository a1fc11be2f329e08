// How lights with a size are summed: directions from a lattice in the unit square, and what each counts for.
#pragma once

#include "gloss.h"

namespace notabug {

// A rule of about so many points in the unit square: Fibonacci's lattice (Sloan and Joe 1994, section 4.3), moved by a
// shift.
struct Lattice {
    std::int64_t points = 1, generator = 1;

    explicit Lattice(std::int64_t about) {
        std::int64_t before = 1;
        while (points < about) {
            const std::int64_t next = before + points;
            before = points, points = next;
        }
        generator = before;
    }

    template <class T>
    Unit<T> at(std::int64_t j, const Unit<double>& shift) const {
        const double n = static_cast<double>(points);
        const double a = (static_cast<double>(j) + 0.5) / n + shift.a;
        const double b = (static_cast<double>(generator * j % points) + 0.5) / n + shift.b;
        return {static_cast<T>(inside(a - std::floor(a))), static_cast<T>(inside(b - std::floor(b)))};
    }

  private:
    static double inside(double x) { return std::min(std::max(x, 1e-7), 1.0 - 1e-7); }  // of float32 too
};

// So many directions to each light, from a lattice that is moved by a shift.
struct Cubature {
    std::int64_t points = 1;
    Unit<double> shift{0, 0};

    // The same for the light `k` and the rays of a `generation`: none repeats another.
    Cubature moved(int k, int generation) const {
        const double apart = 0.6180339887498949 * k + 0.4142135623730951 * generation;
        return {points, {shift.a + apart, shift.b + 2 * apart}};
    }

    // So much finer where some of the directions follow a picture and the others the cosine.
    Cubature finer() const { return {points + points / 2, shift}; }
};

// What a direction towards a light counts for: the factors of its diffuse and its highlight's part, and the share that a
// record tells of.
template <class T>
struct Counted {
    T diffuse, specular, told;
};

// Directions towards a light with a size: spread evenly over what is seen of it, and, where there is a highlight, as many
// spread like that. Both find highlights, each counts by how likely it finds that direction (the balance heuristic: Veach
// and Guibas 1995, "Optimally Combining Sampling Techniques for Monte Carlo Rendering"). `shine` is told each direction,
// its solid angle, and what it counts for.
template <class T, class Shine>
void spread(const View_of<T>& view, const Gloss<T>& gloss, const Cubature& cubature, const Shine& shine) {
    if (!view.seen) return;
    const Lattice lattice(cubature.points);
    const Unit<double>& shift = cubature.shift;
    const T n = static_cast<T>(lattice.points), diffuse = view.e.diffuse, specular = view.e.specular;
    for (std::int64_t j = 0; j < lattice.points; ++j) {
        const Aim<T> aim = view.towards(lattice.at<T>(j, shift));
        if (!(aim.density > 0)) continue;
        const T other = gloss.any() ? gloss.density(aim.L) : T(0);
        shine(aim, T(1) / (n * aim.density), Counted<T>{diffuse, specular * aim.density / (aim.density + other), T(1) / n});
    }
    if (!gloss.any() || specular == 0) return;
    for (std::int64_t j = 0; j < lattice.points; ++j) {
        const Vec3<T> L = gloss.at(lattice.at<T>(j, {shift.b, shift.a}));
        const Aim<T> aim = view.along(L);
        const T own = gloss.density(L);
        if (!(own > 0) || !(aim.distance > 0)) continue;
        shine(aim, T(1) / (n * (aim.density + own)), Counted<T>{0, specular, 0});
    }
}

// The same points of a rectangle's side from everywhere, as old area lights have it: n x n, each for as much of its area, in
// the middles of n x n equal parts, or, by the error of one, the outermost on its edges. `shine` is told each point's number
// too.
template <class T, class Shine>
void spread_on_grid(const View_of<T>& view, int n, bool ends, const Shine& shine) {
    if (!view.seen) return;
    const T count = static_cast<T>(n) * static_cast<T>(n);
    const auto place = [&](int i) {
        return ends ? T(2 * i) / static_cast<T>(std::max(n - 1, 1)) - T(1) : T(2 * i + 1) / static_cast<T>(n) - T(1);
    };
    for (int j = 0; j < n * n; ++j) {
        const Vec3<T> point = view.e.centre + place(j % n) * view.e.x + place(j / n) * view.e.y;
        const Aim<T> aim = aim_at_point(view.at, point, view.e.normal, view.e.area);
        if (aim.density > 0)
            shine(j, aim, T(1) / (count * aim.density), Counted<T>{view.e.diffuse, view.e.specular, T(1) / count});
    }
}

}  // namespace notabug
