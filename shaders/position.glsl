// Where a vertex lies: one function per source. The CPU twin is src/draw/place.rs, name by name; `precise`
// keeps the products and sums apart, as they are there.

// Layer and texel of a lattice position inside the field.
ivec3 texel(ivec2 at) {
    if (TILED) at = MASKED ? at & (frame.stored - 1) : at % frame.stored;
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

// The same of the field, or of the ceiling over it.
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

// Weights: src/draw/weights.rs.
const uint ONE = 64;
const uint FINER = 128;
const uint STITCHED = 128;

uint get(Instance instance, ivec2 slot) {
    return (instance.weights[slot.x] >> (8 * slot.y)) & 255;
}

bool is_stitched(Instance instance, ivec2 slot) {
    if (slot.x == 0) return false;
    uint weight = get(instance, slot);
    return slot.x == 3 ? (weight & STITCHED) != 0 : weight >= ONE;
}

int line(int cells, int n) {
    return n == 0 ? 1 : n == cells ? 2 : 2 * n == cells ? 3 : 0;
}

ivec2 slot(Instance instance, ivec2 turned) {
    int cells = int(instance.cells);
    int x = line(cells, turned.x);
    int z = line(cells, turned.y);
    ivec2 halves = ivec2(greaterThanEqual(2 * turned, ivec2(cells)));
    if (x == 1 || x == 2) return ivec2(x, halves.y);
    if (z == 1 || z == 2) return ivec2(z, 2 + halves.x);
    if (x == 3) return ivec2(3, halves.y);
    if (z == 3) return ivec2(3, 2 + halves.x);
    return ivec2(0, halves.x + 2 * halves.y);
}

int vertex_level(Instance instance, ivec2 turned) {
    int cells = int(instance.cells);
    bvec2 first = lessThanEqual(2 * turned, ivec2(cells));
    bvec2 last = greaterThanEqual(2 * turned, ivec2(cells));
    uint touched = (first.x && first.y ? FINER : 0) | (last.x && first.y ? FINER << 8 : 0)
        | (first.x && last.y ? FINER << 16 : 0) | (last.x && last.y ? FINER << 24 : 0);
    return int(instance.level) - ((instance.weights.x & touched) != 0 ? 1 : 0);
}

ivec2 scaled(Instance instance, ivec2 turned) {
    return instance.shift < 0 ? turned >> 1 : turned << instance.shift;
}

int step_at(Instance instance, ivec2 turned) {
    return 1 << (vertex_level(instance, turned) - instance.shift);
}

ivec2 even_position(Instance instance, ivec2 turned) {
    int unit = step_at(instance, turned);
    bool upright = slot(instance, turned).y < 2;
    return upright ? ivec2(turned.x, turned.y - (turned.y & unit)) : ivec2(turned.x - (turned.x & unit), turned.y);
}

ivec2 stitched_position(Instance instance, ivec2 turned) {
    return is_stitched(instance, slot(instance, turned)) ? even_position(instance, turned) : turned;
}

ivec2 lattice_position(Instance instance, ivec2 turned) {
    return min(instance.origin + scaled(instance, turned), frame.last);
}

ivec2 explicit_position(Instance instance, ExplicitVertex vertex) {
    ivec2 origin = instance.origin << frame.fraction_bits;
    return min(origin + scaled(instance, turned_position(instance, vertex.position)), frame.last << frame.fraction_bits);
}

vec2 from_render_origin(ivec2 at) {
    int unit = 1 << frame.fraction_bits;
    ivec2 whole = (at >> frame.fraction_bits) - frame.render_origin;
    precise vec2 part = vec2(at & (unit - 1)) * (1.0 / float(unit));
    precise vec2 samples = vec2(whole) + part;
    return samples;
}

vec2 relative_to_eye(vec2 from_render_origin) {
    precise vec2 plan = from_render_origin * frame.spacing;
    precise vec2 moved = plan + frame.render_origin_relative;
    return moved;
}

vec2 relative_plan(ivec2 at) {
    return relative_to_eye(vec2(at - frame.render_origin));
}

vec3 relative_position(ivec2 at, float height) {
    vec2 plan = relative_to_eye(from_render_origin(at));
    precise float render_origin = frame.render_origin_height - frame.height_base;
    precise float above = height - render_origin;
    precise float y = above + frame.render_origin_height_relative;
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

bool is_outer(ivec2 slot) {
    return slot.x == 1 || slot.x == 2;
}

float unit_weight(uint weight) {
    return float(weight) * (1.0 / float(ONE));
}

float edge_height(Instance instance, ivec2 turned) {
    ivec2 slot = slot(instance, turned);
    bool upright = slot.y < 2;
    int along = upright ? turned.y : turned.x;
    int unit = step_at(instance, turned);
    int second_target = (along & unit) == 0 ? 1 : 0;
    int weight = clamp(int(get(instance, slot)) - second_target * int(ONE), 0, int(ONE));
    int reach = unit << second_target;
    float sampled = sampled_height(instance, turned);
    if (weight == 0 || (along & reach) == 0) return sampled;
    ivec2 apart = upright ? ivec2(0, reach) : ivec2(reach, 0);
    float target = midpoint(sampled_height(instance, turned - apart), sampled_height(instance, turned + apart));
    return morphed_height(sampled, target, unit_weight(uint(weight)));
}

float end_height(Instance instance, ivec2 turned) {
    return is_outer(slot(instance, turned)) ? edge_height(instance, turned) : sampled_height(instance, turned);
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

float lattice_height(Instance instance, ivec2 turned) {
    ivec2 slot = slot(instance, turned);
    if (is_outer(slot)) return edge_height(instance, turned);
    float sampled = sampled_height(instance, turned);
    uint weight = get(instance, slot) & ~FINER;
    ivec2 apart = half_edge(instance, turned, vertex_level(instance, turned));
    if (weight == 0 || apart == ivec2(0)) return sampled;
    float target = midpoint(end_height(instance, turned - apart), end_height(instance, turned + apart));
    return morphed_height(sampled, target, unit_weight(weight));
}

float region_weight(Instance instance, uint region) {
    if (region == 0) return 0.0;
    uint slot = (region - 1) & 15;
    uint stage = (region - 1) >> 4;
    uint weight = get(instance, ivec2(slot / 4, slot % 4));
    return unit_weight(clamp(weight, stage * ONE, (stage + 1) * ONE) - stage * ONE);
}

vec2 explicit_weights(Instance instance, ExplicitVertex vertex) {
    uint region = vertex.regions & 255;
    if (region == 0) return vec2(vertex.morph, 0.0);
    return vec2(region_weight(instance, region), region_weight(instance, (vertex.regions >> 8) & 255));
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
    // None points down: their mean is not zero, unless two are level and opposite.
    return dot(mean, mean) > 0.0 ? normalize(mean) : vec3(0.0, 1.0, 0.0);
}

// Meshes with skirts: src/draw/skirts.rs.
const uint SKIRT = 1u << 31;

bool is_skirted(Instance instance) {
    return SKIRTS && (instance.cells & 1) == 1;
}

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
    return int(instance.level) - ((get(instance, ivec2(0, quadrant)) & FINER) != 0 ? 1 : 0);
}

float skirt_depth(Instance instance, SkirtVertex skirt_vertex) {
    if (skirt_vertex.side < 0 || ((instance.weights.y >> (4 * skirt_vertex.quadrant + skirt_vertex.side)) & 1) == 0) return 0.0;
    return uintBitsToFloat(instance.weights.z);
}

float quadrant_height(Instance instance, ivec2 at, int level, uint weight) {
    ivec2 apart = half_edge(instance, at, level);
    float sampled = sampled_height(instance, at);
    if (weight == 0 || apart == ivec2(0)) return sampled;
    float target = midpoint(sampled_height(instance, at - apart), sampled_height(instance, at + apart));
    return morphed_height(sampled, target, unit_weight(weight));
}

Placed hung_vertex(Instance instance, ivec2 turned) {
    SkirtVertex skirt_vertex = skirt_vertex(instance, turned);
    int level = quadrant_level(instance, skirt_vertex.quadrant);
    uint weight = get(instance, ivec2(0, skirt_vertex.quadrant)) & ~FINER;
    precise float height = quadrant_height(instance, skirt_vertex.at, level, weight) - skirt_depth(instance, skirt_vertex);
    return Placed(lattice_position(instance, skirt_vertex.at), height, uint(level) | (skirt_vertex.side < 0 ? 0 : SKIRT));
}

// Weights by distance: src/draw/distance.rs.
const float END = 1.5;

uint distance_weight(Instance instance, ivec2 at, int level) {
    vec2 plan = relative_plan(at);
    precise vec2 squares = plan * plan;
    precise float level_squared = squares.x + squares.y;
    precise float squared = level_squared + uintBitsToFloat(instance.weights.w);
    precise float ratio = squared * uintBitsToFloat(level == int(instance.level) ? instance.weights.y : instance.weights.z);
    if (ratio >= END) return ONE;
    precise float part = ratio - 1.0;
    precise float scaled = part * (2.0 * float(ONE));
    return uint(clamp(scaled, 0.0, float(ONE - 1)));
}

bool is_beside_another(Instance instance, ivec2 turned) {
    ivec2 slot = slot(instance, turned);
    if (slot.x == 0) return false;
    if (slot.x == 3) return vertex_level(instance, turned) < int(instance.level);
    return ((instance.weights.x >> (2 * (slot.x - 1) + slot.y / 2)) & 1) == 0;
}

Placed distant_vertex(Instance instance, ivec2 turned) {
    int level = vertex_level(instance, turned);
    uint weight = distance_weight(instance, lattice_position(instance, turned), level);
    if (weight == ONE && is_beside_another(instance, turned)) turned = even_position(instance, turned);
    ivec2 apart = half_edge(instance, turned, level);
    ivec2 last = instance.origin + max(scaled(instance, turned - apart), scaled(instance, turned + apart));
    if (any(greaterThan(last, frame.last))) weight = 0;
    float height = quadrant_height(instance, turned, level, weight);
    return Placed(lattice_position(instance, turned), height, uint(level));
}

// Where an instance draws a vertex of its mesh.
Placed placed(Instance instance, ivec2 position) {
    ivec2 turned = turned_position(instance, position);
    if (is_skirted(instance)) return hung_vertex(instance, turned);
    if (!MORPH) return Placed(lattice_position(instance, turned), sampled_height(instance, turned), instance.level);
    if (DISTANCE) return distant_vertex(instance, turned);
    turned = stitched_position(instance, turned);
    float height = lattice_height(instance, turned);
    return Placed(lattice_position(instance, turned), height, uint(vertex_level(instance, turned)));
}
