// The instance's fields as vertex attributes, in the order of src/draw/layout.rs.

layout(location = 8) in ivec2 in_origin;
layout(location = 9) in uint in_cells;
layout(location = 10) in int in_shift;
layout(location = 11) in uint in_rotation;
layout(location = 12) in uint in_level;
layout(location = 13) in uint in_batch;
layout(location = 14) in uint in_weights_kind;
layout(location = 15) in uvec4 in_weights_words;

Instance instance_attributes() {
    return Instance(in_origin, in_cells, in_shift, in_rotation, in_level, in_batch, in_weights_kind, in_weights_words);
}
