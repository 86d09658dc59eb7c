// From a placed vertex to the rasteriser, the same for every source.

layout(location = 0) out vec3 out_relative;
layout(location = 1) out vec2 out_lattice;
layout(location = 2) flat out uvec2 out_level_batch;

void emit_vertex(ivec2 at, float height, Instance instance) {
    out_relative = relative_position(at, height);
    // Relative to the anchor: exact near the eye, however large the field.
    out_lattice = vec2(at - frame.anchor);
    out_level_batch = uvec2(instance.level, instance.batch);
    gl_Position = frame.clip_from_relative * vec4(out_relative, 1.0);
}
