// The frame, the height textures and the scene's constants: inputs of all shaders of the scene.
#extension GL_EXT_scalar_block_layout : require
#include "layout.glsl"
#include "constants.glsl"

layout(set = 0, binding = 0, scalar) uniform FrameBlock { Frame frame; };
// Heights, a page a layer: metres, or 16-bit codes over 65535.
layout(set = 0, binding = 1) uniform sampler2DArray height_pages;
// Heights of a cave's ceiling in the same encoding.
layout(set = 0, binding = 5) uniform sampler2DArray ceiling_pages;
