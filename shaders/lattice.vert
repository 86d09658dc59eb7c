#version 460
// Vertices without heights: displaced by the height texture.
#extension GL_GOOGLE_include_directive : require
#include "frame.glsl"
#include "position.glsl"
#include "emit.glsl"
#include "instance.glsl"

layout(location = 0) in ivec2 in_position;

void main() {
    Instance instance = instance_attributes();
    ivec2 turned = turned_position(instance, in_position);
    if (MORPH) turned = stitched_position(instance, turned);
    float height = MORPH ? lattice_height(instance, turned) : sampled_height(instance, turned);
    int level = MORPH ? vertex_level(instance, turned) : int(instance.level);
    emit_vertex(lattice_position(instance, turned), height, uint(level), instance.batch);
}
