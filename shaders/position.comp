#version 460
// Positions of the vertices of a draw list, for comparison with the CPU twin (src/draw/place.rs).
#extension GL_GOOGLE_include_directive : require
#include "frame.glsl"
#include "position.glsl"

layout(local_size_x = 64) in;

// A vertex and the instance it is placed by.
struct Query { ExplicitVertex vertex; Instance instance; uint explicit_height; };

layout(set = 0, binding = 2, scalar) readonly buffer Queries { Query queries[]; };
layout(set = 0, binding = 3, scalar) writeonly buffer Answers { vec3 answers[]; };

void main() {
    uint k = gl_GlobalInvocationID.x;
    if (k >= queries.length()) return;
    Query query = queries[k];
    ivec2 at = lattice_position(query.instance, query.vertex.position);
    float height = query.explicit_height == 0
        ? sample_height(at)
        : morphed_height(query.vertex.height, query.vertex.target, query.vertex.morph);
    answers[k] = relative_position(at, height);
}
