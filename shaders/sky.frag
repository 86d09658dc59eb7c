#version 460
#extension GL_GOOGLE_include_directive : require
#include "frame.glsl"
#include "sky.glsl"

layout(location = 0) in vec3 in_direction;
layout(location = 0) out vec4 out_colour;

void main() {
    // Alpha 0 marks the sky.
    out_colour = vec4(sky(normalize(in_direction)), 0.0);
}
