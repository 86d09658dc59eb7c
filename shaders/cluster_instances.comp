#version 460
// The instance of each cluster, with its weights: src/lod/clusters/collapse.rs, push_cluster.
#extension GL_GOOGLE_include_directive : require
#include "cluster_splits.glsl"
#include "cluster_output.glsl"
#include "cluster_weights.glsl"
#include "cluster_skirts.glsl"

// refine.rs, side_weight.
uint side_weight(Node node, uint side) {
    uint own = weight_or_none(node), found;
    Node other;
    if (!beyond(node, side, other)) return own;
    if (weight(other, found)) return max(own, found);
    return draws(other) ? ONE + weight_or_none(parent(other)) : own;
}

// The seam between two quadrants; the second lies beyond this side of the first.
void set_seam(Node node, uint state, uint seam, uint first, uint second, uint side) {
    uint found;
    if (state_at(state, first) == FOUR_BLOCKS) found = side_weight(child(node, first), side);
    else if (state_at(state, second) == FOUR_BLOCKS) found = side_weight(child(node, second), side ^ 2);
    else found = weight_or_none(node);
    set(3, seam, found < ONE ? found : STITCHED);
}

void set_quadrant(Node node, uint state, uint quadrant) {
    bool is_fine = state_at(state, quadrant) == FOUR_BLOCKS;
    Node block = node;
    if (is_fine) block = child(node, quadrant);
    set(0, quadrant, weight_or_none(block) | (is_fine ? FINER : 0));
    uint right = quadrant & 1, lower = quadrant >> 1;
    set(1 + right, lower, side_weight(block, 2 * right));
    set(1 + lower, 2 + right, side_weight(block, 1 + 2 * lower));
}

void stitch(Node node, uint state) {
    for (uint quadrant = 0; quadrant < 4; ++quadrant) {
        if (state_at(state, quadrant) != NOTHING) set_quadrant(node, state, quadrant);
    }
    set_seam(node, state, 0, 0, 1, 2);
    set_seam(node, state, 1, 2, 3, 2);
    set_seam(node, state, 2, 0, 2, 3);
    set_seam(node, state, 3, 1, 3, 3);
}

// src/draw/distance.rs, weights.
void weigh_by_distance(uint level, uint state) {
    for (uint quadrant = 0; quadrant < 4; ++quadrant) {
        set(0, quadrant, BY_DISTANCE | (state_at(state, quadrant) == FOUR_BLOCKS ? FINER : 0));
    }
    weights.yzw = floatBitsToUint(vec3(ranges[level + 1], ranges[level], view.above_squared));
}

void main() {
    uint k = gl_GlobalInvocationID.x;
    if (scratch.overflow != 0 || k >= scratch.splits) return;
    uint state = work[tree.clusters + 2 * k];
    if (state == 0) return;
    Node node = node_at(work[tree.list + k]);
    weights = uvec4(0);
    if (view.metric == DISTANCE) weigh_by_distance(node.level - 1, state);
    else if (tree.skirts != 0) hang_skirts(node, state);
    else stitch(node, state);
    uint at = work[tree.counts + 2 * seed_of(state) + 1] + work[tree.clusters + 2 * k + 1];
    Instance instance = placed(node, node.level - 1);
    instance.rotation = rotation_of(state);
    instance.batch = at;
    instance.weights = weights;
    instances[at] = instance;
}
