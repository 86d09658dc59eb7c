// Outputs of the vertex shader for all sources. With CAPTURE they are also written to a buffer.

layout(location = 0) out vec3 out_relative;
layout(location = 1) out vec2 out_lattice;
layout(location = 2) flat out uvec2 out_level_batch;

#ifdef CAPTURE
layout(set = 1, binding = 0, scalar) writeonly buffer CapturedBlock { Captured captured[]; };
layout(push_constant, scalar) uniform PartBlock { CapturedPart part; };

void capture(ivec2 at, float height) {
    uint instance = uint(gl_InstanceIndex) - part.first_instance;
    uint vertex = uint(gl_VertexIndex) - part.first_vertex;
    captured[part.base + instance * part.vertices + vertex] = Captured(at, height, out_relative);
}
#endif

// `at`: lattice position in units of frame.vertices.fraction_bits.
void emit_vertex(ivec2 at, float height, uint level, uint batch) {
    out_relative = relative_position(at, height);
    // Relative to the render origin: exact near the eye however large the field is.
    out_lattice = from_render_origin(at);
    out_level_batch = uvec2(level, batch);
    gl_Position = frame.camera.clip_from_relative * vec4(out_relative, 1.0);
#ifdef CAPTURE
    capture(at, height);
#endif
}
