#version 460
// Tests the children of the split nodes of the level above `argument`, or the root: src/lod/clusters/refine.rs, descend.
#extension GL_GOOGLE_include_directive : require
#include "cluster_splits.glsl"

void refine(Node node) {
    Square known;
    if (!square(node, known)) return;
    Extent box = extent(node, known.range);
    if (view.culls != 0 && containment(box) == OUTSIDE) return;
    float allowed = error_margin(node.level, box, known.error);
    if (allowed < view.band_end) enter(node, allowed);
}

void main() {
    uint k = gl_GlobalInvocationID.x;
    if (argument < tree.root) {
        if (k / 4 >= work[row(argument + 1) + COUNT]) return;
        refine(child(node_at(place_in_level(argument + 1, k / 4)), k & 3));
        return;
    }
    // The first dispatch also sets the other two sizes of indirect dispatches to 1.
    if (k <= tree.root) {
        work[row(k) + CHILDREN + 1] = 1;
        work[row(k) + CHILDREN + 2] = 1;
        work[row(k) + NODES + 1] = 1;
        work[row(k) + NODES + 2] = 1;
    }
    if (k != 0) return;
    scratch.groups.y = 1;
    scratch.groups.z = 1;
    if (tree.root > 0) refine(Node(tree.root, uvec2(0)));
}
