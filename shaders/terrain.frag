#version 460
// Shades a fragment of the terrain.
#extension GL_GOOGLE_include_directive : require
#include "frame.glsl"
#include "position.glsl"
#include "sky.glsl"
#include "detail.glsl"
#include "shading.glsl"

layout(location = 0) in vec3 in_relative;
layout(location = 1) in vec2 in_lattice;
layout(location = 2) flat in uvec2 in_level_batch;
#ifdef NORMALS
layout(location = 3) in vec3 in_normal;
#endif
layout(location = 0) out vec4 out_colour;

void main() {
    // Derivatives need all four pixels of a quad, so they come before the discard.
    vec4 steps = vec4(dFdx(in_lattice), dFdy(in_lattice));
    if (is_open(in_lattice)) discard;
    // Alpha 0.5 marks skirts.
    bool is_skirt = SKIRTS && (in_level_batch.x & SKIRT) != 0;
#ifdef NORMALS
    vec3 normal = normalize(in_normal);
#else
    vec3 normal = normal_at(in_relative, in_lattice);
#endif
    out_colour = vec4(terrain_colour(in_relative, in_lattice, steps, normal, in_level_batch), is_skirt ? 0.5 : 1.0);
}
