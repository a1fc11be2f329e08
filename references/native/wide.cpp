#include "wide.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace notabug {

namespace {

double area(const double* box) {
    const double x = box[3] - box[0], y = box[4] - box[1], z = box[5] - box[2];
    return x * y + y * z + z * x;
}

float below(double x) {
    const float near = static_cast<float>(x);
    return near > x ? std::nextafter(near, -std::numeric_limits<float>::infinity()) : near;
}

float above(double x) { return -below(-x); }

WideNode empty() {
    WideNode node;
    for (int k = 0; k < 6; ++k)
        std::fill(node.side[k], node.side[k] + wide, (k < 3 ? 1 : -1) * std::numeric_limits<float>::infinity());
    std::fill(node.child, node.child + wide, 0);
    std::fill(node.count, node.count + wide, -1);
    return node;
}

// The binary nodes that a wide node stands for: of those below `top` the largest inner one is opened until there are
// enough. Returns how many there are.
int opened(const double* bounds, const std::int32_t* child, const std::int32_t* count, std::int32_t top,
           std::int32_t* found) {
    found[0] = top;
    int n = 1;
    while (n < wide) {
        int largest = -1;
        for (int i = 0; i < n; ++i) {
            if (count[found[i]] == 0 &&
                (largest < 0 || area(bounds + 6 * std::int64_t(found[i])) > area(bounds + 6 * std::int64_t(found[largest]))))
                largest = i;
        }
        if (largest < 0) break;
        std::copy_backward(found + largest + 1, found + n, found + n + 1);
        const std::int32_t first = child[found[largest]];
        found[largest] = first, found[largest + 1] = first + 1;
        ++n;
    }
    return n;
}

}  // namespace

WideHierarchy widen_hierarchy(const double* bounds, const std::int32_t* child, const std::int32_t* count) {
    WideHierarchy made{{empty()}, {}, {}};
    WideFrame& frame = made.frame;
    frame.reach = frame.offset = 0;
    for (int k = 0; k < 3; ++k) {
        frame.centre[k] = bounds[k] + (bounds[3 + k] - bounds[k]) / 2;
        frame.reach = std::max({frame.reach, bounds[3 + k] - frame.centre[k], frame.centre[k] - bounds[k]});
        frame.offset = std::max(frame.offset, std::abs(frame.centre[k]));
    }
    struct Job {
        std::int32_t binary;
        std::size_t node;
    };
    std::vector<Job> waiting{{0, 0}};
    while (!waiting.empty()) {
        const Job job = waiting.back();
        waiting.pop_back();
        std::int32_t found[wide];
        const int n = opened(bounds, child, count, job.binary, found);
        for (int i = 0; i < n; ++i) {
            const double* box = bounds + 6 * std::int64_t(found[i]);
            WideNode& node = made.nodes[job.node];
            for (int k = 0; k < 3; ++k) {
                node.side[k][i] = below(box[k] - frame.centre[k]);
                node.side[3 + k][i] = above(box[3 + k] - frame.centre[k]);
            }
            const std::int32_t first = child[found[i]], triangles = count[found[i]];
            node.count[i] = (triangles + together - 1) / together;
            node.child[i] = static_cast<std::int32_t>(triangles ? made.leaves.size() : made.nodes.size());
            for (std::int32_t j = 0; j < triangles; j += together)
                made.leaves.push_back({first + j, std::min(triangles - j, std::int32_t(together))});
            if (triangles == 0) {
                waiting.push_back({found[i], made.nodes.size()});
                made.nodes.push_back(empty());
            }
        }
    }
    return made;
}

}  // namespace notabug
