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

ivec2 turned_position(Instance instance, ivec2 position) {
    int cells = int(instance.cells);
    if (instance.turns == 1) return ivec2(cells - position.y, position.x);
    if (instance.turns == 2) return cells - position;
    if (instance.turns == 3) return ivec2(position.y, cells - position.x);
    return position;
}

ivec2 lattice_position(Instance instance, ivec2 turned) {
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

float midpoint(float a, float b) {
    precise float sum = a + b;
    precise float middle = sum * 0.5;
    return middle;
}

float sampled_height(Instance instance, ivec2 turned) {
    return sample_height(lattice_position(instance, turned));
}

bool on_edge(Instance instance, ivec2 turned) {
    return any(equal(turned, ivec2(0))) || any(equal(turned, ivec2(instance.cells)));
}

float edge_height(Instance instance, ivec2 turned) {
    int cells = int(instance.cells);
    bool upright = turned.x == 0 || turned.x == cells;
    int along = upright ? turned.y : turned.x;
    int across = upright ? turned.x : turned.y;
    int side = (upright ? 0 : 1) + (across == 0 ? 0 : 2);
    int further = 1 - ((along >> instance.level) & 1);
    float weight = clamp(instance.edge_morph[side] - float(further), 0.0, 1.0);
    int step_size = 1 << (int(instance.level) + further);
    float sampled = sampled_height(instance, turned);
    if (weight == 0.0 || (along & step_size) == 0) return sampled;
    ivec2 apart = upright ? ivec2(0, step_size) : ivec2(step_size, 0);
    float target = midpoint(sampled_height(instance, turned - apart), sampled_height(instance, turned + apart));
    return morphed_height(sampled, target, weight);
}

float end_height(Instance instance, ivec2 turned) {
    return on_edge(instance, turned) ? edge_height(instance, turned) : sampled_height(instance, turned);
}

float lattice_height(Instance instance, ivec2 turned) {
    if (on_edge(instance, turned)) return edge_height(instance, turned);
    float sampled = sampled_height(instance, turned);
    int step_size = 1 << instance.level;
    ivec2 apart = turned & step_size;
    if (instance.morph == 0.0 || apart == ivec2(0)) return sampled;
    if (apart.x == apart.y) {
        ivec2 cell = (instance.origin + (turned << instance.shift)) >> (instance.shift + instance.level + 1);
        if (((cell.x + cell.y) & 1) == 1) apart.y = -apart.y;
    }
    float target = midpoint(end_height(instance, turned - apart), end_height(instance, turned + apart));
    return morphed_height(sampled, target, instance.morph);
}
