#version 460
// Shades the terrain of a depth buffer: the fragment work of a frame without its triangles.
#extension GL_GOOGLE_include_directive : require
#include "frame.glsl"
#include "position.glsl"
#include "sky.glsl"
#include "detail.glsl"
#include "shading.glsl"

layout(set = 1, binding = 0) uniform sampler2D depths;

layout(location = 0) in vec4 in_far;
layout(location = 1) flat in vec4 in_near;
layout(location = 0) out vec4 out_colour;

void main() {
    float depth = texelFetch(depths, ivec2(gl_FragCoord.xy), 0).r;
    if (depth == 0.0) {
        vec4 ahead = in_far + 0.5 * in_near;
        out_colour = vec4(sky(normalize(ahead.xyz / ahead.w)), 0.0);
        return;
    }
    vec4 point = in_far + depth * in_near;
    vec3 relative = point.xyz / point.w;
    vec2 lattice = (relative.xz - frame.camera.origin.relative) / frame.heights.spacing;
    // At silhouettes the derivative spans two surfaces; the cost is the same.
    vec4 steps = vec4(dFdx(lattice), dFdy(lattice));
    out_colour = vec4(terrain_colour(relative, lattice, steps, normal_at(relative, lattice), uvec2(0)), 1.0);
}
