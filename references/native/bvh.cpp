#include "bvh.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "vector.h"

namespace notabug {

namespace {

struct Box {
    double lo[3], hi[3];

    void clear() {
        std::fill(lo, lo + 3, infinity<double>);
        std::fill(hi, hi + 3, -infinity<double>);
    }
    void add(const double* low, const double* high) {
        for (int k = 0; k < 3; ++k) lo[k] = std::min(lo[k], low[k]), hi[k] = std::max(hi[k], high[k]);
    }
    double area() const {
        const double x = hi[0] - lo[0], y = hi[1] - lo[1], z = hi[2] - lo[2];
        return x * y + y * z + z * x;
    }
};

struct Range {
    std::int64_t node, first, last, depth;
};

struct Split {
    double cost = infinity<double>;
    int axis = -1, cut = 0;
};

struct Builder {
    const double* lo;
    const double* hi;
    std::int64_t* order;

    double centre(std::int64_t i, int axis) const { return lo[3 * i + axis] + hi[3 * i + axis]; }

    int bin(std::int64_t i, int axis, const Box& centres, double extent) const {
        const double at = bins * (centre(i, axis) - centres.lo[axis]) / extent;
        return at >= bins - 1 ? bins - 1 : at > 0 ? static_cast<int>(at) : 0;
    }

    Split best(const Range& range, const Box& centres) const {
        Split found;
        const std::int64_t size = range.last - range.first;
        for (int k = 0; k < 3 && size > 2; ++k) {
            const double extent = centres.hi[k] - centres.lo[k];
            if (!(extent > 0)) continue;
            Box box[bins];
            std::int64_t in[bins] = {};
            for (Box& each : box) each.clear();
            for (std::int64_t j = range.first; j < range.last; ++j) {
                const std::int64_t i = order[j];
                const int b = bin(i, k, centres, extent);
                ++in[b];
                box[b].add(lo + 3 * i, hi + 3 * i);
            }
            double right[bins];
            Box all;
            all.clear();
            std::int64_t n = 0;
            for (int b = bins - 1; b > 0; --b) {
                n += in[b];
                all.add(box[b].lo, box[b].hi);
                right[b] = n ? static_cast<double>(n) * all.area() : 0.0;
            }
            all.clear();
            n = 0;
            for (int b = 0; b < bins - 1; ++b) {
                n += in[b];
                all.add(box[b].lo, box[b].hi);
                if (n && n < size) {
                    const double cost = static_cast<double>(n) * all.area() + right[b + 1];
                    if (cost < found.cost) found = {cost, k, b};
                }
            }
        }
        return found;
    }

    std::int64_t partition(const Range& range, const Box& centres, const Split& split) const {
        const double extent = centres.hi[split.axis] - centres.lo[split.axis];
        std::int64_t i = range.first, j = range.last - 1;
        while (i <= j) {
            if (bin(order[i], split.axis, centres, extent) <= split.cut) {
                ++i;
            } else {
                std::swap(order[i], order[j]);
                --j;
            }
        }
        return i;
    }
};

}  // namespace

std::int64_t build_hierarchy(std::int64_t n, const double* lo, const double* hi, std::int64_t* order, double* bounds,
                             std::int32_t* child, std::int32_t* count) {
    const Builder builder{lo, hi, order};
    std::vector<Range> waiting{{0, 0, n, 0}};
    std::int64_t used = 1;
    while (!waiting.empty()) {
        const Range range = waiting.back();
        waiting.pop_back();
        Box box, centres;
        box.clear();
        centres.clear();
        for (std::int64_t j = range.first; j < range.last; ++j) {
            const std::int64_t i = order[j];
            const double centre[3] = {builder.centre(i, 0), builder.centre(i, 1), builder.centre(i, 2)};
            box.add(lo + 3 * i, hi + 3 * i);
            centres.add(centre, centre);
        }
        std::copy(box.lo, box.lo + 3, bounds + 6 * range.node);
        std::copy(box.hi, box.hi + 3, bounds + 6 * range.node + 3);
        const std::int64_t size = range.last - range.first;
        const Split split = builder.best(range, centres);
        if (split.axis < 0 || size <= leaf_size) {
            child[range.node] = static_cast<std::int32_t>(range.first);
            count[range.node] = static_cast<std::int32_t>(size);
            continue;
        }
        // an adversarial mesh: halve what is left, so that the stack of the traversal suffices
        const std::int64_t middle = range.depth >= deepest ? (range.first + range.last) / 2
                                                           : builder.partition(range, centres, split);
        child[range.node] = static_cast<std::int32_t>(used);
        count[range.node] = 0;
        waiting.push_back({used, range.first, middle, range.depth + 1});
        waiting.push_back({used + 1, middle, range.last, range.depth + 1});
        used += 2;
    }
    return used;
}

}  // namespace notabug
