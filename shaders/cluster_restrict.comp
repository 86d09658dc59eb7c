#version 460
// Splits coarser neighbours of the split nodes of level `argument`, so that neighbours differ by at most one level:
// src/lod/clusters/refine.rs, restrict.
#extension GL_GOOGLE_include_directive : require
#include "cluster_splits.glsl"

void main() {
    uint k = gl_GlobalInvocationID.x;
    if (k >= work[row(argument) + COUNT]) return;
    uint place = place_in_level(argument, k);
    Node node = node_at(place);
    float error_margin = uintBitsToFloat(work[tree.error_margins + place]);
    for (uint axis = 0; axis < 2; ++axis) {
        Node other;
        if (!beyond(node, axis + 2 * (node.at[axis] & 1), other)) continue;
        if (draws(parent(other))) enter(parent(other), error_margin);
    }
}
