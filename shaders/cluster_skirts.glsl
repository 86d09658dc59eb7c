// Sides with skirts and their depth. The CPU reference is src/lod/clusters/skirts.rs, function by function and to the bit.

const float UP = 1.0 + 1.0 / 8388608.0;
const float ROUNDING = 8.0 / 8388608.0;

struct Edge { uint level; uint weight; float error_m; };

// Error and height range of a node, metres, rounded up: tree.rs, deviation.
vec2 deviation(Square known) {
    precise float height = known.range.y - known.range.x;
    precise float apart = height * UP;
    return vec2(tree.skirts == 1 ? known.error : apart, apart);
}

vec2 deviation(Node node) {
    return deviation(measured(node));
}

Edge edge(Node block) {
    Node node = parent(block);
    float own = deviation(block).x;
    uint found = node.level > tree.root ? 0 : weight_or_none(node);
    if (found == 0) return Edge(block.level, 0, own);
    precise float difference = deviation(node).x - own;
    precise float part = difference * (float(found) / float(ONE));
    precise float error_m = own + part;
    return Edge(block.level, found, error_m);
}

// Edge of the mesh that is drawn at a node: of the node, its parent or the blocks in it. False if nothing is drawn.
bool edge_at(Node node, out Edge found) {
    found = Edge(0, 0, 0.0);
    if (node.level == tree.root) return false;
    uint weight_there;
    if (node.level > 0 && weight(node, weight_there)) {
        bool is_any = false;
        for (uint quadrant = 0; quadrant < 4; ++quadrant) {
            Node block = child(node, quadrant);
            Square known;
            if (!square(block, known)) continue;
            Edge one = edge(block);
            found = Edge(one.level, one.weight, max(found.error_m, one.error_m));
            is_any = true;
        }
        return is_any;
    }
    Node block = parent(node);
    if (weight(block, weight_there)) block = node;
    if (!draws(block)) return false;
    found = edge(block);
    return true;
}

// Bound of the gap between a block and its neighbour beyond a side, plus a margin for the rasteriser, metres. Negative
// if there is no gap.
float gap_m(Node block, uint side) {
    Node other;
    Edge theirs;
    Square known;
    if (!beyond(block, side, other) || !edge_at(other, theirs)) return -1.0;
    Edge own = edge(block);
    if ((own.level == theirs.level && own.weight == theirs.weight) || !square(block, known)) return -1.0;
    precise float both = own.error_m + theirs.error_m;
    precise float rounding = ROUNDING * max(abs(known.range.x), abs(known.range.y));
    precise float gap = min(both, deviation(known).y) + rounding;
    float cell_m = max(view.spacing.x, view.spacing.y) * float(1u << block.level);
    precise float depth = gap + min(allowed_over(view.skirt_scale, extent(block, known.range), 1.0), cell_m);
    precise float rounded = depth * UP;
    return rounded;
}

SkirtWeights hanging_skirts(Node node, uint state) {
    SkirtWeights weights = SkirtWeights(0, 0, 0.0);
    for (uint quadrant = 0; quadrant < 4; ++quadrant) {
        uint holds = state_at(state, quadrant);
        for (uint k = 0; k < (holds == BLOCK ? 1 : holds == FOUR_BLOCKS ? 4 : 0); ++k) {
            Node block = child(node, quadrant);
            if (holds == FOUR_BLOCKS) block = child(block, k);
            weights.inside |= (edge(block).weight | (holds == FOUR_BLOCKS ? FINER : 0)) << (8 * quadrant);
            for (uint side = 0; side < 4; ++side) {
                float gap = gap_m(block, side);
                if (gap < 0.0) continue;
                weights.sides |= 1u << (4 * quadrant + side);
                weights.depth_m = max(weights.depth_m, gap);
            }
        }
    }
    return weights;
}
