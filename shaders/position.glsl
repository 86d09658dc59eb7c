// Where a vertex lies: one function per source. The CPU twin is src/draw/place.rs, name by name; `precise`
// keeps the products and sums apart, as they are there.

// Layer and texel of a lattice position inside the field.
ivec3 texel(ivec2 at) {
    if (TILED) at %= frame.stored;
    if (PAGE_SHIFT == 0) return ivec3(at, 0);
    int side = 1 << PAGE_SHIFT;
    int pages = (frame.stored.x + side - 1) >> PAGE_SHIFT;
    ivec2 page = at >> PAGE_SHIFT;
    return ivec3(at & (side - 1), page.y * pages + page.x);
}

float decoded_height(float stored) {
    if (!CODED) return stored;
    precise float height = (round(stored * 65535.0) - frame.height_zero) * frame.height_scale;
    return height;
}

// The sample at a lattice position, to the bit.
float sample_height(ivec2 at) {
    return decoded_height(texelFetch(height_pages, texel(at), 0).r);
}

ivec2 lattice_position(Instance instance, ivec2 position) {
    int cells = int(instance.cells);
    ivec2 turned = position;
    if (instance.turns == 1) turned = ivec2(cells - position.y, position.x);
    else if (instance.turns == 2) turned = cells - position;
    else if (instance.turns == 3) turned = ivec2(position.y, cells - position.x);
    return min(instance.origin + (turned << instance.shift), frame.last);
}

vec3 relative_position(ivec2 at, float height) {
    precise vec2 plan = vec2(at - frame.anchor) * frame.spacing;
    precise vec2 moved = plan + frame.anchor_relative;
    precise float above = height - frame.anchor_height;
    precise float y = above + frame.anchor_height_relative;
    return vec3(moved.x, y, moved.y);
}

float morphed_height(float finer, float coarser, float weight) {
    precise float difference = coarser - finer;
    precise float part = difference * weight;
    precise float height = finer + part;
    return height;
}
