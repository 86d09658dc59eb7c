// Positions of vertices. The CPU reference is src/draw/place.rs, function by function; `precise` keeps products and sums
// apart, as they are there.
#include "weights.glsl"

// Texel and layer of a lattice position inside the field.
ivec3 texel(ivec2 at) {
    if (TILED) at = MASKED ? at & (frame.heights.stored - 1) : at % frame.heights.stored;
    if (PAGE_SHIFT == 0) return ivec3(at, 0);
    int side = 1 << PAGE_SHIFT;
    int pages = (frame.heights.stored.x + side - 1) >> PAGE_SHIFT;
    ivec2 page = at >> PAGE_SHIFT;
    return ivec3(at & (side - 1), page.y * pages + page.x);
}

float decoded_height(float stored) {
    if (!CODED) return stored;
    precise float height = (round(stored * 65535.0) - frame.heights.zero) * frame.heights.scale;
    return height;
}

// Exact sample at a lattice position.
float sample_height(ivec2 at) {
    return decoded_height(texelFetch(height_pages, texel(at), 0).r);
}

// Exact sample of the field, or of the ceiling over it.
float surface_height(ivec2 at, bool is_ceiling) {
    if (CEILING && is_ceiling) return decoded_height(texelFetch(ceiling_pages, texel(at), 0).r);
    return sample_height(at);
}

// Lattice position, height in metres, level of detail.
struct Placed { ivec2 at; float height; uint level; };

ivec2 turned_position(Instance instance, ivec2 position) {
    int cells = int(instance.cells);
    if (instance.rotation == 1) return ivec2(cells - position.y, position.x);
    if (instance.rotation == 2) return cells - position;
    if (instance.rotation == 3) return ivec2(position.y, cells - position.x);
    return position;
}

ivec2 scaled(Instance instance, ivec2 turned) {
    return instance.shift < 0 ? turned >> 1 : turned << instance.shift;
}

int step_at(Instance instance, ivec2 turned) {
    return 1 << (vertex_level(instance, turned) - instance.shift);
}

ivec2 even_position(Instance instance, ivec2 turned) {
    int unit = step_at(instance, turned);
    bool upright = is_upright(slot_of(instance, turned));
    return upright ? ivec2(turned.x, turned.y - (turned.y & unit)) : ivec2(turned.x - (turned.x & unit), turned.y);
}

ivec2 stitched_position(Instance instance, SlotWeights weights, ivec2 turned) {
    return is_stitched(weights, slot_of(instance, turned)) ? even_position(instance, turned) : turned;
}

ivec2 lattice_position(Instance instance, ivec2 turned) {
    return min(instance.origin + scaled(instance, turned), frame.heights.last);
}

ivec2 explicit_position(Instance instance, ExplicitVertex vertex) {
    ivec2 origin = instance.origin << frame.vertices.fraction_bits;
    return min(origin + scaled(instance, turned_position(instance, vertex.position)), frame.heights.last << frame.vertices.fraction_bits);
}

vec2 from_render_origin(ivec2 at) {
    int unit = 1 << frame.vertices.fraction_bits;
    ivec2 whole = (at >> frame.vertices.fraction_bits) - frame.camera.origin.at;
    precise vec2 part = vec2(at & (unit - 1)) * (1.0 / float(unit));
    precise vec2 samples = vec2(whole) + part;
    return samples;
}

vec2 relative_to_eye(vec2 from_render_origin) {
    precise vec2 plan = from_render_origin * frame.heights.spacing;
    precise vec2 moved = plan + frame.camera.origin.relative;
    return moved;
}

vec2 relative_plan(ivec2 at) {
    return relative_to_eye(vec2(at - frame.camera.origin.at));
}

vec3 relative_position(ivec2 at, float height) {
    vec2 plan = relative_to_eye(from_render_origin(at));
    precise float render_origin = frame.camera.origin.height - frame.vertices.height_base;
    precise float above = height - render_origin;
    precise float y = above + frame.camera.origin.height_relative;
    return vec3(plan.x, y, plan.y);
}

float morphed_height(float finer, float coarser, float weight) {
    precise float difference = coarser - finer;
    precise float part = difference * weight;
    precise float height = finer + part;
    return weight == 1.0 ? coarser : height;
}

float midpoint(float a, float b) {
    precise float sum = a + b;
    precise float middle = sum * 0.5;
    return middle;
}

float sampled_height(Instance instance, ivec2 turned) {
    return sample_height(lattice_position(instance, turned));
}

float edge_height(Instance instance, SlotWeights weights, ivec2 turned) {
    Slot slot = slot_of(instance, turned);
    bool upright = is_upright(slot);
    int along = upright ? turned.y : turned.x;
    int unit = step_at(instance, turned);
    int second_target = (along & unit) == 0 ? 1 : 0;
    int weight = clamp(int(get(weights, slot)) - second_target * int(ONE), 0, int(ONE));
    int reach = unit << second_target;
    float sampled = sampled_height(instance, turned);
    if (weight == 0 || (along & reach) == 0) return sampled;
    ivec2 apart = upright ? ivec2(0, reach) : ivec2(reach, 0);
    float target = midpoint(sampled_height(instance, turned - apart), sampled_height(instance, turned + apart));
    return morphed_height(sampled, target, unit_weight(uint(weight)));
}

float end_height(Instance instance, SlotWeights weights, ivec2 turned) {
    return is_outer(slot_of(instance, turned)) ? edge_height(instance, weights, turned) : sampled_height(instance, turned);
}

ivec2 half_edge(Instance instance, ivec2 turned, int level) {
    int unit = 1 << (level - instance.shift);
    ivec2 apart = turned & unit;
    if (apart == ivec2(unit)) {
        ivec2 cell = (instance.origin + scaled(instance, turned)) >> (level + 1);
        if (((cell.x + cell.y) & 1) == 1) apart.y = -apart.y;
    }
    return apart;
}

float lattice_height(Instance instance, SlotWeights weights, ivec2 turned) {
    Slot slot = slot_of(instance, turned);
    if (is_outer(slot)) return edge_height(instance, weights, turned);
    float sampled = sampled_height(instance, turned);
    uint weight = get(weights, slot) & ~FINER;
    ivec2 apart = half_edge(instance, turned, vertex_level(instance, turned));
    if (weight == 0 || apart == ivec2(0)) return sampled;
    float target = midpoint(end_height(instance, weights, turned - apart), end_height(instance, weights, turned + apart));
    return morphed_height(sampled, target, unit_weight(weight));
}

vec2 explicit_weights(Instance instance, ExplicitVertex vertex) {
    uint region = vertex.regions & 255;
    if (region == 0) return vec2(vertex.morph, 0.0);
    SlotWeights weights = slot_weights(instance);
    return vec2(region_weight(weights, region), region_weight(weights, (vertex.regions >> 8) & 255));
}

float explicit_height(Instance instance, ExplicitVertex vertex) {
    vec2 weights = explicit_weights(instance, vertex);
    float target = morphed_height(vertex.target, vertex.second_target, weights.y);
    return morphed_height(vertex.height, target, weights.x);
}

// Normals of vertices: src/draw/normals.rs.
vec3 unpack_normal(uint packed) {
    vec2 plan = unpackSnorm2x16(packed);
    return vec3(plan.x, sqrt(max(1.0 - dot(plan, plan), 0.0)), plan.y);
}

vec3 explicit_normal(Instance instance, ExplicitVertex vertex, VertexNormals normals) {
    vec2 weights = explicit_weights(instance, vertex);
    vec3 target = mix(unpack_normal(normals.target), unpack_normal(normals.second_target), weights.y);
    vec3 mean = mix(unpack_normal(normals.normal), target, weights.x);
    // Normals do not point down: their mean is zero only if two are horizontal and opposite.
    return dot(mean, mean) > 0.0 ? normalize(mean) : vec3(0.0, 1.0, 0.0);
}

// Meshes with skirts: src/draw/skirts.rs.
// Mesh units, quadrant, and the side that a skirt's vertex is beyond; -1 for a vertex of no skirt.
struct SkirtVertex { ivec2 at; int quadrant; int side; };

SkirtVertex skirt_vertex(Instance instance, ivec2 turned) {
    int lines = (int(instance.cells) + 1) / 2;
    ivec2 half_at = turned / lines;
    ivec2 place = turned % lines - 1;
    int last = lines - 3;
    ivec2 at = half_at * last + clamp(place, 0, last);
    int side = place.x < 0 ? 0 : place.x > last ? 2 : place.y < 0 ? 1 : place.y > last ? 3 : -1;
    return SkirtVertex(at, half_at.x + 2 * half_at.y, side);
}

int quadrant_level(Instance instance, int quadrant) {
    return int(instance.level) - (is_finer(instance, FINER << (8 * quadrant)) ? 1 : 0);
}

float skirt_depth(SkirtWeights weights, SkirtVertex vertex) {
    bool hangs = vertex.side >= 0 && ((weights.sides >> (4 * vertex.quadrant + vertex.side)) & 1) == 1;
    return hangs ? weights.depth_m : 0.0;
}

float quadrant_height(Instance instance, ivec2 at, int level, uint weight) {
    ivec2 apart = half_edge(instance, at, level);
    float sampled = sampled_height(instance, at);
    if (weight == 0 || apart == ivec2(0)) return sampled;
    float target = midpoint(sampled_height(instance, at - apart), sampled_height(instance, at + apart));
    return morphed_height(sampled, target, unit_weight(weight));
}

Placed skirted_vertex(Instance instance, SkirtWeights weights, ivec2 turned) {
    SkirtVertex vertex = skirt_vertex(instance, turned);
    int level = quadrant_level(instance, vertex.quadrant);
    uint weight = (weights.inside >> (8 * vertex.quadrant)) & 255 & ~FINER;
    precise float height = quadrant_height(instance, vertex.at, level, weight) - skirt_depth(weights, vertex);
    return Placed(lattice_position(instance, vertex.at), height, uint(level) | (vertex.side < 0 ? 0 : SKIRT));
}

// Weights by distance: src/draw/distance.rs.
uint distance_weight(Instance instance, DistanceWeights weights, ivec2 at, int level) {
    vec2 plan = relative_plan(at);
    precise vec2 squares = plan * plan;
    precise float level_squared = squares.x + squares.y;
    precise float squared = level_squared + weights.above_squared;
    precise float ratio = squared * (level == int(instance.level) ? weights.range : weights.finer_range);
    if (ratio >= MORPH_END) return ONE;
    precise float part = ratio - 1.0;
    precise float scaled = part * (2.0 * float(ONE));
    return uint(clamp(scaled, 0.0, float(ONE - 1)));
}

bool is_beside_another(Instance instance, DistanceWeights weights, ivec2 turned) {
    Slot slot = slot_of(instance, turned);
    if (slot.line == NO_LINE) return false;
    if (slot.line == SEAM) return vertex_level(instance, turned) < int(instance.level);
    return ((weights.flags >> (2 * (slot.line - 1) + slot.byte / 2)) & 1) == 0;
}

Placed distant_vertex(Instance instance, DistanceWeights weights, ivec2 turned) {
    int level = vertex_level(instance, turned);
    uint weight = distance_weight(instance, weights, lattice_position(instance, turned), level);
    if (weight == ONE && is_beside_another(instance, weights, turned)) turned = even_position(instance, turned);
    ivec2 apart = half_edge(instance, turned, level);
    ivec2 last = instance.origin + max(scaled(instance, turned - apart), scaled(instance, turned + apart));
    if (any(greaterThan(last, frame.heights.last))) weight = 0;
    float height = quadrant_height(instance, turned, level, weight);
    return Placed(lattice_position(instance, turned), height, uint(level));
}

Placed slot_vertex(Instance instance, SlotWeights weights, ivec2 turned) {
    turned = stitched_position(instance, weights, turned);
    float height = lattice_height(instance, weights, turned);
    return Placed(lattice_position(instance, turned), height, uint(vertex_level(instance, turned)));
}

// Position of a vertex of an instance's mesh. The scene's constants leave only the kinds of weights that occur: with
// DISTANCE all instances have distances.
Placed placed(Instance instance, ivec2 position) {
    ivec2 turned = turned_position(instance, position);
    if (SKIRTS && instance.weights_kind == SKIRT_WEIGHTS) {
        return skirted_vertex(instance, skirt_weights(instance), turned);
    }
    if (!MORPH) return Placed(lattice_position(instance, turned), sampled_height(instance, turned), instance.level);
    if (DISTANCE) return distant_vertex(instance, distance_weights(instance), turned);
    return slot_vertex(instance, slot_weights(instance), turned);
}
