#version 460
// Vertices that carry their heights and the heights to which they morph.
#extension GL_GOOGLE_include_directive : require
#include "frame.glsl"
#include "position.glsl"
#include "emit.glsl"
#include "instance.glsl"

layout(location = 0) in ivec2 in_position;
layout(location = 1) in float in_height;
layout(location = 2) in float in_target;
layout(location = 3) in float in_second_target;
layout(location = 4) in float in_morph;
layout(location = 5) in uint in_regions;
#ifdef NORMALS
layout(location = 6) in uvec3 in_normals;
layout(location = 3) out vec3 out_normal;
#endif

void main() {
    Instance instance = instance_attributes();
    ExplicitVertex vertex = ExplicitVertex(in_position, in_height, in_target, in_second_target, in_morph, in_regions);
    emit_vertex(explicit_position(instance, vertex), explicit_height(instance, vertex), instance.level, instance.batch);
#ifdef NORMALS
    out_normal = explicit_normal(instance, vertex, VertexNormals(in_normals.x, in_normals.y, in_normals.z));
#endif
}
