#version 460
// Writes the instance of each cluster with its weights: src/lod/clusters/collapse.rs, push_cluster.
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

// Adds bits to a word's byte.
void set(inout uint word, uint at, uint value) {
    word |= value << (8 * at);
}

// The byte of the seam between two quadrants; the second lies beyond this side of the first.
uint seam_weight(Node node, uint state, uint first, uint second, uint side) {
    uint found;
    if (state_at(state, first) == FOUR_BLOCKS) found = side_weight(child(node, first), side);
    else if (state_at(state, second) == FOUR_BLOCKS) found = side_weight(child(node, second), side ^ 2);
    else found = weight_or_none(node);
    return found < ONE ? found : STITCHED;
}

void set_quadrant(inout SlotWeights weights, Node node, uint state, uint quadrant) {
    bool is_fine = state_at(state, quadrant) == FOUR_BLOCKS;
    Node block = node;
    if (is_fine) block = child(node, quadrant);
    set(weights.inside, quadrant, weight_or_none(block) | (is_fine ? FINER : 0));
    uint right = quadrant & 1, lower = quadrant >> 1;
    uint x = side_weight(block, 2 * right), z = side_weight(block, 1 + 2 * lower);
    if (right == 0) set(weights.first_sides, lower, x);
    else set(weights.last_sides, lower, x);
    if (lower == 0) set(weights.first_sides, 2 + right, z);
    else set(weights.last_sides, 2 + right, z);
}

SlotWeights stitched(Node node, uint state) {
    SlotWeights weights = SlotWeights(0, 0, 0, 0);
    for (uint quadrant = 0; quadrant < 4; ++quadrant) {
        if (state_at(state, quadrant) != NOTHING) set_quadrant(weights, node, state, quadrant);
    }
    set(weights.seams, 0, seam_weight(node, state, 0, 1, 2));
    set(weights.seams, 1, seam_weight(node, state, 2, 3, 2));
    set(weights.seams, 2, seam_weight(node, state, 0, 2, 3));
    set(weights.seams, 3, seam_weight(node, state, 1, 3, 3));
    return weights;
}

// morph_ranges.rs, weights.
DistanceWeights weights_by_distance(uint level, uint state) {
    uint flags = 0;
    for (uint quadrant = 0; quadrant < 4; ++quadrant) {
        if (state_at(state, quadrant) == FOUR_BLOCKS) flags |= FINER << (8 * quadrant);
    }
    return DistanceWeights(flags, ranges[level + 1], ranges[level], view.above_squared);
}

void main() {
    uint k = gl_GlobalInvocationID.x;
    if (scratch.overflow != 0 || k >= scratch.splits) return;
    uint state = work[tree.clusters + 2 * k];
    if (state == 0) return;
    Node node = node_at(work[tree.list + k]);
    uint at = work[tree.counts + 2 * seed_of(state) + 1] + work[tree.clusters + 2 * k + 1];
    Instance instance = placed(node, node.level - 1);
    instance.rotation = rotation_of(state);
    instance.batch = at;
    if (view.metric == DISTANCE) instance = with_weights(instance, weights_by_distance(node.level - 1, state));
    else if (tree.skirts != 0) instance = with_weights(instance, hanging_skirts(node, state));
    else instance = with_weights(instance, stitched(node, state));
    instances[at] = instance;
}
