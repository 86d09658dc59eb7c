// Hash table of the split nodes of a view (open addressing, linear probing), which all invocations fill.
// Ids are those of `Node::id` in src/lod/clusters/tree.rs.
#include "cluster_lod.glsl"

layout(local_size_x = 64) in;

layout(set = 0, binding = 2, scalar) coherent buffer ScratchBlock { ClusterScratch scratch; uint work[]; };
// The level, in programs that run level by level.
layout(push_constant, scalar) uniform ArgumentBlock { uint argument; };

const uint NONE = 0xffffffff;

// Words of a level's row.
const uint COUNT = 0;
const uint CHILDREN = 1;
const uint NODES = 4;
const uint ROW = 8;

uint row(uint level) {
    return tree.rows + ROW * level;
}

uint node_id(Node node) {
    uint above = tree.root - node.level;
    return (1u << (2 * above)) | (node.at.y << above) | node.at.x;
}

Node node_of(uint id) {
    uint above = uint(findMSB(id)) / 2;
    uint mask = (1u << above) - 1;
    return Node(tree.root - above, uvec2(id & mask, (id >> above) & mask));
}

uint first_place(uint id) {
    return ((id * 0x9e3779b1u) >> 7) & (tree.places - 1);
}

// Place of a split node in the table; NONE if the node is not split.
uint find(Node node) {
    if (any(notEqual(node.at >> (tree.root - node.level), uvec2(0)))) return NONE;
    uint id = node_id(node);
    uint place = first_place(id);
    for (uint probes = 0; probes < tree.places; ++probes) {
        uint key = work[tree.keys + place];
        if (key == id) return place;
        if (key == 0) return NONE;
        place = (place + 1) & (tree.places - 1);
    }
    return NONE;
}

// Enters a split node if it is missing, and keeps the smaller error margin.
void enter(Node node, float error_margin) {
    uint id = node_id(node);
    uint place = first_place(id);
    for (uint probes = 0; probes < tree.places; ++probes) {
        uint key = atomicCompSwap(work[tree.keys + place], 0, id);
        if (key == 0 || key == id) {
            atomicMin(work[tree.error_margins + place], floatBitsToUint(error_margin));
            if (key == 0) {
                uint k = atomicAdd(scratch.splits, 1);
                if (k >= tree.max_splits) break;
                work[tree.list + k] = place;
                atomicMax(scratch.groups.x, k / 64 + 1);
                uint level_row = row(node.level);
                uint n = atomicAdd(work[level_row + COUNT], 1);
                work[words[tree.levels + 5 * node.level + 3] + n] = place;
                atomicMax(work[level_row + CHILDREN], n / 16 + 1);
                atomicMax(work[level_row + NODES], n / 64 + 1);
            }
            return;
        }
        place = (place + 1) & (tree.places - 1);
    }
    scratch.overflow = 1;
}

// True if a node has terrain, and is in view if the selection culls.
bool draws(Node node) {
    Square known;
    return square(node, known) && (view.culls == 0 || containment(extent(node, known.range)) != OUTSIDE);
}

// Place of the k-th split node of a level.
uint place_in_level(uint level, uint k) {
    return work[words[tree.levels + 5 * level + 3] + k];
}

Node node_at(uint place) {
    return node_of(work[tree.keys + place]);
}
