// Output buffers and states of clusters: src/lod/clusters/collapse.rs and states.rs.

layout(set = 0, binding = 3, scalar) writeonly buffer InstanceBlock { Instance instances[]; };
struct Command { uint index_count; uint instance_count; uint first_index; int vertex_offset; uint first_instance; };
layout(set = 0, binding = 4, scalar) writeonly buffer CommandBlock { Tally tally; Command commands[]; };

// Contents of a quadrant.
const uint NOTHING = 0;
const uint BLOCK = 1;
const uint FOUR_BLOCKS = 2;
// Mask of blocks in all quadrants.
const uint ALL = 15;

// Seed and quarter turns of a state.
uint seed_of(uint state) {
    return words[tree.states + state] & 255;
}

uint rotation_of(uint state) {
    return words[tree.states + state] >> 8;
}

// Instance at a node's first vertex, with two mesh units per cell of a level. Lines of skirts: src/draw/skirts.rs, cells.
Instance placed(Node node, uint level) {
    ivec2 origin = ivec2(node.at * side_of(node.level));
    uint cells = tree.skirts == 0 ? 4 * tree.cells : 4 * tree.cells + 5;
    return Instance(origin, cells, int(level) - 1, 0, level, 0, SLOT_WEIGHTS, uvec4(0));
}
