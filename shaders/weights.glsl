// Morph weights of an instance: unpacking, packing, and slots. The host's counterpart is src/draw/weights.rs, which
// describes the encodings.

SlotWeights slot_weights(Instance instance) {
    uvec4 words = instance.weights_words;
    return SlotWeights(words.x, words.y, words.z, words.w);
}

SkirtWeights skirt_weights(Instance instance) {
    uvec4 words = instance.weights_words;
    return SkirtWeights(words.x, words.y, uintBitsToFloat(words.z));
}

DistanceWeights distance_weights(Instance instance) {
    uvec4 words = instance.weights_words;
    vec3 distances = uintBitsToFloat(words.yzw);
    return DistanceWeights(words.x, distances.x, distances.y, distances.z);
}

Instance with_weights(Instance instance, SlotWeights weights) {
    instance.weights_kind = SLOT_WEIGHTS;
    instance.weights_words = uvec4(weights.inside, weights.first_sides, weights.last_sides, weights.seams);
    return instance;
}

Instance with_weights(Instance instance, SkirtWeights weights) {
    instance.weights_kind = SKIRT_WEIGHTS;
    instance.weights_words = uvec4(weights.inside, weights.sides, floatBitsToUint(weights.depth_m), 0);
    return instance;
}

Instance with_weights(Instance instance, DistanceWeights weights) {
    vec3 distances = vec3(weights.range, weights.finer_range, weights.above_squared);
    instance.weights_kind = DISTANCE_WEIGHTS;
    instance.weights_words = uvec4(weights.flags, floatBitsToUint(distances));
    return instance;
}

// True if one of the quadrants, whose flags stand in `flags`, is one level finer than the instance.
bool is_finer(Instance instance, uint flags) {
    return (instance.weights_words.x & flags) != 0;
}

// A byte of a SlotWeights: its line, and its number in the line's word.
struct Slot { int line; int byte; };

uint get(SlotWeights weights, Slot slot) {
    uint word = slot.line == NO_LINE ? weights.inside
        : slot.line == FIRST_SIDE ? weights.first_sides
        : slot.line == LAST_SIDE ? weights.last_sides : weights.seams;
    return (word >> (8 * slot.byte)) & 255;
}

bool is_stitched(SlotWeights weights, Slot slot) {
    if (slot.line == NO_LINE) return false;
    uint weight = get(weights, slot);
    return slot.line == SEAM ? (weight & STITCHED) != 0 : weight >= ONE;
}

bool is_outer(Slot slot) {
    return slot.line == FIRST_SIDE || slot.line == LAST_SIDE;
}

bool is_upright(Slot slot) {
    return slot.byte < 2;
}

int line_of(int cells, int n) {
    return n == 0 ? FIRST_SIDE : n == cells ? LAST_SIDE : 2 * n == cells ? SEAM : NO_LINE;
}

Slot slot_of(Instance instance, ivec2 turned) {
    int cells = int(instance.cells);
    int x = line_of(cells, turned.x);
    int z = line_of(cells, turned.y);
    ivec2 halves = ivec2(greaterThanEqual(2 * turned, ivec2(cells)));
    if (x == FIRST_SIDE || x == LAST_SIDE) return Slot(x, halves.y);
    if (z == FIRST_SIDE || z == LAST_SIDE) return Slot(z, 2 + halves.x);
    if (x == SEAM) return Slot(SEAM, halves.y);
    if (z == SEAM) return Slot(SEAM, 2 + halves.x);
    return Slot(NO_LINE, halves.x + 2 * halves.y);
}

int vertex_level(Instance instance, ivec2 turned) {
    int cells = int(instance.cells);
    bvec2 first = lessThanEqual(2 * turned, ivec2(cells));
    bvec2 last = greaterThanEqual(2 * turned, ivec2(cells));
    uint touched = (first.x && first.y ? FINER : 0) | (last.x && first.y ? FINER << 8 : 0)
        | (first.x && last.y ? FINER << 16 : 0) | (last.x && last.y ? FINER << 24 : 0);
    return int(instance.level) - (is_finer(instance, touched) ? 1 : 0);
}

float unit_weight(uint weight) {
    return float(weight) * (1.0 / float(ONE));
}

float region_weight(SlotWeights weights, uint region) {
    if (region == 0) return 0.0;
    int slot = int(region - 1) & 15;
    uint stage = (region - 1) >> 4;
    uint weight = get(weights, Slot(slot / 4, slot % 4));
    return unit_weight(clamp(weight, stage * ONE, (stage + 1) * ONE) - stage * ONE);
}
