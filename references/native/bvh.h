// A bounding volume hierarchy over triangles: binned surface-area heuristic (Wald 2007, "On fast Construction of
// SAH-based Bounding Volume Hierarchies"), flat arrays, built in float64.
#pragma once

#include <cstdint>

namespace notabug {

constexpr int leaf_size = 4;      // triangles of a leaf, unless they cannot be told apart: tested at once (see leaf.h)
constexpr int bins = 16;
constexpr int deepest = 48;       // below this depth ranges are halved: no tree is deeper than this and log2(triangles)
constexpr int stack_size = 640;   // boxes that a traversal may have to remember: of a node of eight seven wait

// Builds over the boxes lo, hi (n, 3), n > 0: permutes `order` (n), fills bounds (2n, 6), child and count (2n); returns
// the number of nodes. A node with count > 0 is a leaf of order[child .. child + count - 1]; else its children are child
// and child + 1.
std::int64_t build_hierarchy(std::int64_t n, const double* lo, const double* hi, std::int64_t* order, double* bounds,
                             std::int32_t* child, std::int32_t* count);

}  // namespace notabug
