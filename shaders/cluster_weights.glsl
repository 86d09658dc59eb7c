// Morph weights of blocks towards their parents: src/lod/clusters/refine.rs.

#include "weights.glsl"

// Weight with which the blocks in a node have morphed to it. False if the node is not split.
bool weight(Node node, out uint found) {
    found = 0;
    uint place = find(node);
    if (place == NONE) return false;
    precise float part = uintBitsToFloat(work[tree.error_margins + place]) - 1.0;
    precise float scaled = part * view.band_scale;
    if (view.band_scale != 0.0 && !is_partial(node)) found = uint(clamp(scaled, 0.0, float(ONE - 1)));
    return true;
}

uint weight_or_none(Node node) {
    uint found;
    weight(node, found);
    return found;
}

uint state_at(uint state, uint quadrant) {
    return state / (quadrant == 0 ? 1 : quadrant == 1 ? 3 : quadrant == 2 ? 9 : 27) % 3;
}
