// A hierarchy whose nodes hold eight boxes, so that a ray meets them all at once (Wald, Benthin and Boulos 2008, "Getting Rid
// of Packets"; Dammertz, Hanika and Keller 2008, "Shallow Bounding Volume Hierarchies"), made of the binary one.
//
// Boxes are in float32, rounded outwards and relative to the centre of the scene: half the memory, and four to a register
// on any processor. They only say what a ray cannot meet, so no result depends on their precision (see walk.h).
#pragma once

#include <cstdint>
#include <vector>

namespace notabug {

constexpr int wide = 8;       // boxes of a node
constexpr int together = 4;  // triangles of a leaf

struct WideNode {
    float side[6][wide];       // lower x, y, z, upper x, y, z
    std::int32_t child[wide];  // a node, or the first of a box's leaves
    std::int32_t count[wide];  // leaves, 0 where it is a node; -1 where there is no box
};
static_assert(sizeof(WideNode) == wide * 8 * 4);

// What boxes are relative to, their farthest coordinate from there, and the centre's own farthest coordinate.
struct WideFrame {
    double centre[3], reach, offset;
};

// At most `together` triangles, one after the other, that a ray is tested against at once.
struct LeafRange {
    std::int32_t first, count;
};

struct WideHierarchy {
    std::vector<WideNode> nodes;
    std::vector<LeafRange> leaves;
    WideFrame frame;
};

// The binary hierarchy of `build_hierarchy` as wide nodes, the root first. Boxes stay from left to right, so in each node
// the triangles of one come before those of the next.
WideHierarchy widen_hierarchy(const double* bounds, const std::int32_t* child, const std::int32_t* count);

}  // namespace notabug
