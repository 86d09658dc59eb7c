#version 460
// Positions of the vertices of a draw list, for comparison with the CPU reference (src/draw/place.rs).
#extension GL_GOOGLE_include_directive : require
#include "frame.glsl"
#include "position.glsl"

layout(local_size_x = 64) in;

// A vertex and its instance.
struct Query { ExplicitVertex vertex; VertexNormals normals; Instance instance; uint explicit_height; };

struct Answer { vec3 position; vec3 normal; };

layout(set = 0, binding = 2, scalar) readonly buffer Queries { Query queries[]; };
layout(set = 0, binding = 3, scalar) writeonly buffer Answers { Answer answers[]; };

void main() {
    uint k = gl_GlobalInvocationID.x;
    if (k >= queries.length()) return;
    Query query = queries[k];
    ExplicitVertex vertex = query.vertex;
    if (query.explicit_height == 0) {
        Placed placed = placed(query.instance, vertex.position);
        answers[k] = Answer(relative_position(placed.at << frame.vertices.fraction_bits, placed.height), vec3(0.0));
    } else {
        float height = explicit_height(query.instance, vertex);
        vec3 position = relative_position(explicit_position(query.instance, vertex), height);
        answers[k] = Answer(position, explicit_normal(query.instance, vertex, query.normals));
    }
}
