#version 460
// One triangle over the picture, and the points on its rays: far + depth * near, homogeneous.
#extension GL_GOOGLE_include_directive : require
#include "frame.glsl"

layout(location = 0) out vec4 out_far;
layout(location = 1) flat out vec4 out_near;

void main() {
    vec2 corner = vec2(gl_VertexIndex & 1, gl_VertexIndex >> 1) * 4.0 - 1.0;
    mat4 relative_from_clip = inverse(frame.camera.clip_from_relative);
    out_far = relative_from_clip * vec4(corner, 0.0, 1.0);
    out_near = relative_from_clip[2];
    gl_Position = vec4(corner, 0.0, 1.0);
}
