#version 460
// Vertices without heights, displaced by the height texture.
#extension GL_GOOGLE_include_directive : require
#include "frame.glsl"
#include "position.glsl"
#include "emit.glsl"
#include "instance.glsl"

layout(location = 0) in ivec2 in_position;

void main() {
    Instance instance = instance_attributes();
    Placed placed = placed(instance, in_position);
    emit_vertex(placed.at << frame.vertices.fraction_bits, placed.height, placed.level, instance.batch);
}
