#version 460
// Writes a command for each seed that occurs. If the root is not split, or too many nodes are, it draws the root as one
// block.
#extension GL_GOOGLE_include_directive : require
#include "cluster_splits.glsl"
#include "cluster_output.glsl"
#include "cluster_weights.glsl"

Command of_seed(uint seed, uint first, uint count) {
    uint range = tree.ranges + 2 * seed;
    return Command(words[range + 1], count, words[range], 0, first);
}

bool is_root_in_view() {
    Node root = Node(tree.root, uvec2(0));
    Square known;
    return square(root, known) && is_in_view(root, containment(extent(root, known.range)));
}

void main() {
    if (gl_GlobalInvocationID.x != 0) return;
    tally.overflow = scratch.overflow;
    if (scratch.overflow != 0 || scratch.splits == 0) {
        bool is_drawn = scratch.overflow != 0 || is_root_in_view();
        tally.draws = is_drawn ? 1 : 0;
        commands[0] = of_seed(0, 0, 1);
        Instance root = placed(Node(tree.root, uvec2(0)), tree.root);
        if (tree.skirts == 0) root.cells = 2 * tree.cells;
        else root = with_weights(root, SkirtWeights(0, 0, 0.0));
        // The root has no coarser level to morph to.
        if (view.metric == DISTANCE) {
            root = with_weights(root, DistanceWeights(0, 0.0, ranges[tree.root], view.above_squared));
        }
        instances[0] = root;
        return;
    }
    uint draws = 0, first = 0;
    for (uint seed = 0; seed < tree.seeds; ++seed) {
        uint count = work[tree.counts + 2 * seed];
        work[tree.counts + 2 * seed + 1] = first;
        if (count > 0) commands[draws++] = of_seed(seed, first, count);
        first += count;
    }
    tally.draws = draws;
}
