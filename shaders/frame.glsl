// What every graphics and compute program here is given.
#extension GL_EXT_scalar_block_layout : require
#include "layout.glsl"

layout(set = 0, binding = 0, scalar) uniform FrameBlock { Frame frame; };
// Heights, in layers of pages: metres, or 16-bit codes over 65535.
layout(set = 0, binding = 1) uniform sampler2DArray height_pages;
// Heights of a cave's ceiling, alike.
layout(set = 0, binding = 5) uniform sampler2DArray ceiling_pages;

// Features of the scene (src/plan.rs); what a scene lacks is not in its pipeline.
layout(constant_id = 0) const bool CODED = false;
layout(constant_id = 1) const bool TILED = false;
// Side of a page as a power of two; 0: one page holds all.
layout(constant_id = 2) const uint PAGE_SHIFT = 0;
// Lattice vertices have weights: they go over to the next coarser level, or fall onto coarser sides.
layout(constant_id = 7) const bool MORPH = false;
// Lattice meshes have skirts.
layout(constant_id = 8) const bool SKIRTS = false;
// They do so by their own distance.
layout(constant_id = 10) const bool DISTANCE = false;
// The field repeats after powers of two of samples.
layout(constant_id = 11) const bool MASKED = false;
// The field is the floor of a cave.
layout(constant_id = 12) const bool CEILING = false;
