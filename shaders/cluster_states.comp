#version 460
// Finds the state of each split node, and its rank among those with its seed: src/lod/clusters/collapse.rs, state.
#extension GL_GOOGLE_include_directive : require
#include "cluster_splits.glsl"
#include "cluster_output.glsl"

uint quadrant_state(Node node, uint blocks, uint quadrant) {
    if ((blocks >> quadrant & 1) == 1) return BLOCK;
    if (node.level < 2) return NOTHING;
    uint place = find(child(node, quadrant));
    return place != NONE && work[tree.blocks + place] == ALL ? FOUR_BLOCKS : NOTHING;
}

void main() {
    uint k = gl_GlobalInvocationID.x;
    if (k >= min(scratch.splits, tree.max_splits)) return;
    uint place = work[tree.list + k];
    Node node = node_at(place);
    uint blocks = work[tree.blocks + place];
    uint state = 0;
    // The parent draws four blocks.
    if (blocks != ALL || node.level == tree.root) {
        for (uint quadrant = 4; quadrant-- > 0;) state = 3 * state + quadrant_state(node, blocks, quadrant);
    }
    uint rank = state == 0 ? 0 : atomicAdd(work[tree.counts + 2 * seed_of(state)], 1);
    work[tree.clusters + 2 * k] = state;
    work[tree.clusters + 2 * k + 1] = rank;
}
