#version 460
// One triangle over the picture, at infinite distance.
#extension GL_GOOGLE_include_directive : require
#include "frame.glsl"

layout(location = 0) out vec3 out_direction;

void main() {
    vec2 corner = vec2(gl_VertexIndex & 1, gl_VertexIndex >> 1) * 4.0 - 1.0;
    // The near plane lies at depth 1.
    vec4 near = inverse(frame.camera.clip_from_relative) * vec4(corner, 1.0, 1.0);
    vec4 deep = inverse(frame.camera.clip_from_relative) * vec4(corner, 0.5, 1.0);
    out_direction = deep.xyz / deep.w - near.xyz / near.w;
    gl_Position = vec4(corner, 0.0, 1.0);
}
