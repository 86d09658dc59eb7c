#version 460
// Error of captured triangles against the samples, one invocation a triangle. The exact CPU version is
// src/measure/geometric; the rule that assigns samples to triangles is the same, on the same integers.
#extension GL_GOOGLE_include_directive : require
#include "frame.glsl"
#include "position.glsl"

layout(local_size_x = 64) in;

layout(set = 0, binding = 2) uniform usampler2DArray hole_pages;

layout(set = 1, binding = 0, scalar) readonly buffer CapturedBlock { Captured captured[]; };
// Three records a triangle. Triangles of a ceiling are clockwise seen from above.
layout(set = 1, binding = 1, scalar) readonly buffer TriangleBlock { uvec3 triangles[]; };
layout(set = 1, binding = 2, scalar) writeonly buffer ErrorBlock { TriangleError errors[]; };
// Counted errors by the upper 12 bits of their value: 16 classes an octave. Metres, then pixels.
layout(set = 1, binding = 3, scalar) buffer HistogramBlock { uint histogram[2][4096]; };
layout(push_constant, scalar) uniform InputBlock { ErrorPassInput given; };

// Twice the signed area in plan; positive if the triangle faces up. Differences to a corner do not overflow.
int doubled_area(ivec2 a, ivec2 b, ivec2 c) {
    ivec2 p = b - a, q = c - a;
    return p.y * q.x - p.x * q.y;
}

bool owns_side(ivec2 sample_at, ivec2 p, ivec2 q, ivec2 towards) {
    int area = doubled_area(sample_at, p, q);
    if (area != 0) return area > 0;
    ivec2 along = ivec2(q.y - p.y, p.x - q.x) * towards;
    return along.x != 0 ? along.x > 0 : along.y > 0;
}

bool in_view(vec4 clip) {
    return clip.z >= 0.0 && clip.z <= clip.w && all(lessThanEqual(abs(clip.xy), vec2(clip.w)));
}

// Exact screen displacement, pixels, of moving a point vertically, without subtracting two projections.
float displacement_px(vec4 clip, float metres) {
    vec4 up = frame.camera.clip_from_relative[1];
    float end = clip.w + metres * up.w;
    if (end <= 0.0) return uintBitsToFloat(0x7f800000);
    return length(metres * (up.xy * clip.w - clip.xy * up.w) / (clip.w * end) * given.half_size);
}

void main() {
    uint k = gl_GlobalInvocationID.x;
    if (k >= given.triangles) return;
    uvec3 corners = triangles[k];
    Captured a = captured[corners.x], b = captured[corners.y], c = captured[corners.z];
    int area = doubled_area(a.position, b.position, c.position);
    bool faces_down = area < 0;
    if (faces_down) {
        b = captured[corners.z];
        c = captured[corners.y];
        area = -area;
    }
    TriangleError found = TriangleError(0, 0.0, 0.0, 0.0, 0.0);
    // Bounding box of the triangle, in whole samples.
    int unit = 1 << frame.vertices.fraction_bits;
    ivec2 first = (min(a.position, min(b.position, c.position)) + (unit - 1)) >> frame.vertices.fraction_bits;
    ivec2 last = max(a.position, max(b.position, c.position)) >> frame.vertices.fraction_bits;
    for (int z = first.y; z <= last.y; ++z) {
        for (int x = first.x; x <= last.x; ++x) {
            ivec2 at = ivec2(x, z), fine = at * unit;
            ivec3 weights = ivec3(doubled_area(fine, b.position, c.position),
                                  doubled_area(a.position, fine, c.position),
                                  doubled_area(a.position, b.position, fine));
            if (any(lessThan(weights, ivec3(0)))) continue;
            if (HOLES && texelFetch(hole_pages, texel(at), 0).r != 0) continue;
            float truth = surface_height(at, faces_down);
            // Heights relative to the sample nearly cancel, so that little is rounded.
            vec3 above = vec3(a.height, b.height, c.height) - truth;
            float metres = dot(vec3(weights), above) / float(area);
            vec3 relative = relative_position(fine, truth) + vec3(0.0, metres, 0.0);
            vec4 clip = frame.camera.clip_from_relative * vec4(relative, 1.0);
            if (!in_view(clip)) continue;
            ivec2 towards = ivec2(at.x < frame.heights.last.x ? 1 : -1, at.y < frame.heights.last.y ? 1 : -1);
            bool counts = owns_side(fine, b.position, c.position, towards)
                && owns_side(fine, c.position, a.position, towards) && owns_side(fine, a.position, b.position, towards);
            float px = displacement_px(clip, -metres);
            metres = abs(metres);
            found.largest_m = max(found.largest_m, metres);
            found.largest_px = max(found.largest_px, px);
            if (!counts) continue;
            ++found.samples;
            found.squares_m += metres * metres;
            found.squares_px += px * px;
            atomicAdd(histogram[0][floatBitsToUint(metres) >> 19], 1);
            atomicAdd(histogram[1][floatBitsToUint(px) >> 19], 1);
        }
    }
    errors[k] = found;
}
