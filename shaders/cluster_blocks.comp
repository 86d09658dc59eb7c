#version 460
// Finds the children of each split node that are blocks in view: src/lod/clusters/refine.rs, Split::blocks.
#extension GL_GOOGLE_include_directive : require
#include "cluster_splits.glsl"

bool is_block(Node node) {
    if (node.level > 0 && find(node) != NONE) return false;
    Square known;
    return square(node, known) && is_in_view(node, containment(extent(node, known.range)));
}

void main() {
    uint k = gl_GlobalInvocationID.x;
    if (k >= min(scratch.splits, tree.max_splits)) return;
    uint place = work[tree.list + k];
    Node node = node_at(place);
    uint blocks = 0;
    for (uint quadrant = 0; quadrant < 4; ++quadrant) {
        if (is_block(child(node, quadrant))) blocks |= 1u << quadrant;
    }
    work[tree.blocks + place] = blocks;
}
