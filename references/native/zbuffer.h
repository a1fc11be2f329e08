// The z-buffer: which triangle wins each sample, at which depth, and where on it.
//
// Triangles are clipped at the near and the far plane, projected, and filled by edge functions with the top-left rule. A
// depth is computed at the vertices and interpolated linearly in window space, as depth buffers do (Akenine-Moeller,
// Haines and Hoffman, Real-Time Rendering, section 23.7), then stored in the format asked for.
#pragma once

#include "scene.h"

namespace notabug {

// Formats of a stored depth. Every one is kept as a number that grows with the distance: reversed z is negated.
enum class DepthForm { exact, fixed, float32, reversed, distance };

template <class T>
struct View {
    Vec3<T> eye, across, up, forward;  // across and up over half the window's extent (at distance 1, in perspective)
    T near, far;
};

struct ZBufferOptions {
    bool parallel = false;  // no division by the depth
    DepthForm form = DepthForm::exact;
    double steps = 0;   // 2^bits - 1, for fixed point
    bool last = false;  // of equal depths the last drawn wins (less or equal), not the first (less)
};

// The rows from `top` on of a window, and what each sample holds; the caller clears depth.
template <class T>
struct Layer {
    std::int64_t width, height, top, rows;
    double* depth;
    std::int32_t* winner;  // place in the drawing order, or -1
    Vec3<T>* correct;      // barycentric coordinates of the winner with perspective, or null: not wanted
    Vec3<T>* affine;       // ... and without
};

// The depths and winners of an earlier pass: only what comes after those is drawn (depth peeling; Everitt 2001).
struct Behind {
    const double* depth = nullptr;
    const std::int32_t* winner = nullptr;
};

// A corner of a clipped triangle: position in the view, shares of the triangle's three corners.
template <class T>
struct ClipCorner {
    Vec3<T> at, share;
};

// Keeps what has sign * z >= sign * limit (Sutherland and Hodgman 1974); gives how many corners are left.
// A new corner is always computed from the kept one to the lost one, so that two triangles agree on a common edge.
template <class T>
inline int clip(const ClipCorner<T>* source, int count, ClipCorner<T>* into, T sign, T limit) {
    int kept = 0;
    for (int j = 0; j < count; ++j) {
        const int k = j + 1 < count ? j + 1 : 0;
        const bool inside = sign * source[j].at.z >= sign * limit;
        if (inside) into[kept++] = source[j];
        if (inside != (sign * source[k].at.z >= sign * limit)) {
            const ClipCorner<T>& a = source[inside ? j : k];
            const ClipCorner<T>& b = source[inside ? k : j];
            const T t = (limit - a.at.z) / (b.at.z - a.at.z);
            into[kept] = {a.at + t * (b.at - a.at), a.share + t * (b.share - a.share)};
            into[kept++].at.z = limit;
        }
    }
    return kept;
}

// Edge functions are exact in hardware (fixed point), so here they are float64.
struct WindowPoint {
    double x, y;
};

// Twice the signed area of a, b, p; exactly the negative of what b, a, p gives, so no sample is lost or doubled.
inline double edge(const WindowPoint& a, const WindowPoint& b, double px, double py) {
    if (a.x > b.x || (a.x == b.x && a.y > b.y)) return (a.y - b.y) * (px - b.x) - (a.x - b.x) * (py - b.y);
    return (b.x - a.x) * (py - a.y) - (b.y - a.y) * (px - a.x);
}

// Whether a sample with the edge function `e` is inside; on the edge itself, if that is a top or a left one.
inline bool covers(double e, const WindowPoint& a, const WindowPoint& b) {
    if (e != 0) return e > 0;
    return b.y < a.y || (b.y == a.y && b.x > a.x);
}

// The depth of a corner before it is stored: 0 at the near plane, 1 at the far one (reversed: 1 and 0).
template <class T>
inline T corner_depth(T z, T near, T far, const ZBufferOptions& option) {
    if (option.form == DepthForm::distance) return z;
    const T scale = option.parallel ? T(1) : z;
    if (option.form == DepthForm::reversed)
        return (option.parallel ? T(1) : near) * (far - z) / ((far - near) * scale);
    return (option.parallel ? T(1) : far) * (z - near) / ((far - near) * scale);
}

// `depth` as the buffer keeps it; fixed point is rounded to the nearest of steps + 1 values.
inline double stored(double depth, const ZBufferOptions& option) {
    if (option.form == DepthForm::distance) return depth;
    const double d = std::min(std::max(depth, 0.0), 1.0);
    if (option.form == DepthForm::fixed) return std::floor(d * option.steps + 0.5) / option.steps;
    if (option.form == DepthForm::float32) return static_cast<double>(static_cast<float>(d));
    if (option.form == DepthForm::reversed) return -static_cast<double>(static_cast<float>(d));
    return d;
}

// What a corner carries into the window.
template <class T>
struct Carried {
    T inverse_w, depth;
    Vec3<T> share;
};

template <class T>
struct WindowCorner {
    WindowPoint at;
    Carried<T> carried;
};

// The sample at `at`, within [first, last].
inline std::int64_t sample_at(double at, double first, double last) {
    return static_cast<std::int64_t>(std::min(std::max(at, first), last));
}

template <class T>
void fill_triangle(const WindowCorner<T>& first, const WindowCorner<T>* second, const WindowCorner<T>* third, int k,
                   const ZBufferOptions& option, const Behind& behind, const Layer<T>& layer) {
    const double area = edge(first.at, second->at, third->at.x, third->at.y);
    if (!(std::abs(area) > 0) || std::abs(area) == infinity<double>) return;
    if (area < 0) std::swap(second, third);
    const WindowPoint &A = first.at, &B = second->at, &C = third->at;
    const Carried<T>&a = first.carried, &b = second->carried, &c = third->carried;
    // the samples about the triangle, one more on each side
    const auto width = static_cast<double>(layer.width), top = static_cast<double>(layer.top),
               end = static_cast<double>(layer.top + layer.rows);
    const std::int64_t left = sample_at(std::min({A.x, B.x, C.x}) - 1.0, 0.0, width);
    const std::int64_t right = sample_at(std::max({A.x, B.x, C.x}) + 1.0, 0.0, width);
    const std::int64_t upper = sample_at(std::min({A.y, B.y, C.y}) - 1.0, top, end);
    const std::int64_t lower = sample_at(std::max({A.y, B.y, C.y}) + 1.0, top, end);
    for (std::int64_t row = upper; row < lower; ++row) {
        const double py = static_cast<double>(row) + 0.5;
        for (std::int64_t column = left; column < right; ++column) {
            const double px = static_cast<double>(column) + 0.5;
            const double ec = edge(A, B, px, py), ea = edge(B, C, px, py), eb = edge(C, A, px, py);
            if (!(covers(ec, A, B) && covers(ea, B, C) && covers(eb, C, A))) continue;
            const double total = ea + eb + ec;
            const T sa = static_cast<T>(ea / total), sb = static_cast<T>(eb / total), sc = static_cast<T>(ec / total);
            T wa = sa * a.inverse_w, wb = sb * b.inverse_w, wc = sc * c.inverse_w;
            const T inverse = T(1) / (wa + wb + wc);
            wa = wa * inverse, wb = wb * inverse, wc = wc * inverse;
            const bool in_space = option.form == DepthForm::distance;  // linear in space, not in the window
            const T ka = in_space ? wa : sa, kb = in_space ? wb : sb, kc = in_space ? wc : sc;
            const double key = stored(static_cast<double>(ka * a.depth + kb * b.depth + kc * c.depth), option);
            const std::int64_t at = (row - layer.top) * layer.width + column;
            if (behind.depth) {
                const double before = behind.depth[at];
                if (key < before) continue;
                if (key == before && (option.last ? k >= behind.winner[at] : k <= behind.winner[at])) continue;
            }
            if (key < layer.depth[at] || (option.last && key == layer.depth[at])) {
                layer.depth[at] = key;
                layer.winner[at] = k;
                if (layer.correct) {
                    layer.correct[at] = wa * a.share + wb * b.share + wc * c.share;
                    layer.affine[at] = sa * a.share + sb * b.share + sc * c.share;
                }
            }
        }
    }
}

// Draws the triangles points[order[0]], points[order[1]] ... into the layer.
template <class T>
void fill(const Triangle<T>* points, const std::int64_t* order, std::int64_t count, const View<T>& view,
          const ZBufferOptions& option, const Behind& behind, const Layer<T>& layer) {
    for (std::int64_t k = 0; k < count; ++k) {
        const Triangle<T>& p = points[order[k]];
        ClipCorner<T> polygon[8], clipped[8];
        int lost_near = 0, lost_far = 0, corners = 3;
        for (int j = 0; j < 3; ++j) {
            const Vec3<T> to = (j == 0 ? p.a : j == 1 ? p.b : p.c) - view.eye;
            polygon[j] = {{dot(to, view.across), dot(to, view.up), dot(to, view.forward)},
                          {T(j == 0), T(j == 1), T(j == 2)}};
            lost_near += polygon[j].at.z < view.near;
            lost_far += polygon[j].at.z > view.far;
        }
        if (lost_near == 3 || lost_far == 3) continue;
        if (lost_near || lost_far) {
            corners = clip(polygon, 3, clipped, T(1), view.near);
            corners = clip(clipped, corners, polygon, T(-1), view.far);
        }
        WindowCorner<T> window[8];
        for (int j = 0; j < corners; ++j) {
            const Vec3<T>& at = polygon[j].at;
            const T w = option.parallel ? T(1) : at.z;
            window[j] = {{static_cast<double>((at.x / w + T(1)) * T(0.5) * static_cast<T>(layer.width)),
                          static_cast<double>((T(1) - at.y / w) * T(0.5) * static_cast<T>(layer.height))},
                         {T(1) / w, corner_depth(at.z, view.near, view.far, option), polygon[j].share}};
        }
        for (int j = 1; j + 1 < corners; ++j)
            fill_triangle(window[0], &window[j], &window[j + 1], static_cast<int>(k), option, behind, layer);
    }
}

}  // namespace notabug
