// Visibility and error of the nodes of the quadtree of clusters. The CPU reference is src/lod/clusters/lod_evaluator.rs,
// with tree.rs and height/bounds.rs, function by function and to the bit.
#extension GL_EXT_scalar_block_layout : require
#include "layout.glsl"
#include "clusters.glsl"

layout(set = 0, binding = 0, scalar) readonly buffer TreeBlock { ClusterTree tree; uint words[]; };
layout(set = 0, binding = 1, scalar) readonly buffer ViewBlock { ClusterView view; float ranges[]; };

const float GUARD = 1.0 - 1.0 / 16384.0;
const float SLACK = 1.0 / 524288.0;
const float FARTHEST = 1e12;
const float DEEPEST = 1e10;
const float MIN_SQUARE = 1e-18;
const float MIN_ERROR = 1e-12;
const float WITHOUT_ERROR = 1e30;

const int OUTSIDE = 0;
const int CROSSING = 1;
const int INSIDE = 2;

struct Node { uint level; uvec2 at; };
struct Square { float error; vec2 range; };
struct Extent { vec3 low; vec3 high; };

Node child(Node node, uint quadrant) {
    return Node(node.level - 1, 2 * node.at + uvec2(quadrant & 1, quadrant >> 1));
}

Node parent(Node node) {
    return Node(node.level + 1, node.at >> 1);
}

// Finds the node of the same level beyond a side (0 to 3: x first, z first, x last, z last). False outside the field.
bool beyond(Node node, uint side, out Node other) {
    other = node;
    uint axis = side & 1;
    if (side < 2 && node.at[axis] == 0) return false;
    other.at[axis] += side < 2 ? -1 : 1;
    return true;
}

uint side_of(uint level) {
    return tree.cells << level;
}

bool is_partial(Node node) {
    return any(greaterThan((node.at + 1) * side_of(node.level), uvec2(tree.last)));
}

// First square and number of squares that an interval touches: height/bounds.rs, Level::touched.
uvec2 touched(uint side, uint count, uint period, uint first, uint reach) {
    if (period == 0) {
        uint last = min((first + reach - 1) / side, count - 1);
        return uvec2(first / side, last + 1 - first / side);
    }
    uint at = first % period, end = first % period + reach - 1;
    if (reach >= period) return uvec2(0, count);
    if (end < period) return uvec2(at / side, end / side + 1 - at / side);
    return uvec2(at / side, min(count - at / side + (end - period) / side + 1, count));
}

Square held_square(uint at) {
    return Square(uintBitsToFloat(words[at]), uintBitsToFloat(uvec2(words[at + 1], words[at + 2])));
}

// height/bounds.rs, Bounds::square.
Square measured(Node node) {
    uint level = tree.levels + 5 * node.level;
    uint held = words[level];
    uvec2 count = uvec2(words[level + 1], words[level + 2]);
    if (tree.period == uvec2(0)) return held_square(held + 3 * (node.at.y * count.x + node.at.x));
    uint side = side_of(node.level);
    uvec2 x = touched(side, count.x, tree.period.x, node.at.x * side, side);
    uvec2 z = touched(side, count.y, tree.period.y, node.at.y * side, side);
    Square all = Square(0.0, vec2(uintBitsToFloat(0x7f7fffff), uintBitsToFloat(0xff7fffff)));
    for (uint j = z.x; j < z.x + z.y; ++j) {
        for (uint i = x.x; i < x.x + x.y; ++i) {
            Square one = held_square(held + 3 * ((j % count.y) * count.x + i % count.x));
            all = Square(max(all.error, one.error), vec2(min(all.range.x, one.range.x), max(all.range.y, one.range.y)));
        }
    }
    if (all.range.x <= all.range.y && is_partial(node)) {
        precise float height = all.range.y - all.range.x;
        all.error = max(all.error, min(uintBitsToFloat(words[level + 4]), height));
    }
    return all;
}

// Error and range of heights of a node. False if it has no terrain.
bool square(Node node, out Square known) {
    if (any(greaterThanEqual(node.at * side_of(node.level), uvec2(tree.last)))) return false;
    known = measured(node);
    return known.range.x <= known.range.y;
}

vec3 corner(uvec2 at, float height) {
    precise vec2 metres = vec2(ivec2(at) - view.origin.at) * view.spacing;
    precise vec2 moved = metres + view.origin.relative;
    precise float above = height - view.origin.height;
    precise float y = above + view.origin.height_relative;
    return min(max(vec3(moved.x, y, moved.y), -FARTHEST), FARTHEST);
}

Extent extent(Node node, vec2 range) {
    uint side = side_of(node.level);
    uvec2 first = node.at * side;
    uvec2 end = min(first + side, uvec2(tree.last));
    return Extent(corner(first, range.x), corner(end, range.y));
}

float summed(vec3 terms) {
    precise float two = terms.x + terms.y;
    precise float three = two + terms.z;
    return three;
}

vec3 along(vec3 direction, Extent extent) {
    precise vec3 a = direction * extent.low;
    precise vec3 b = direction * extent.high;
    return vec3(summed(min(a, b)), summed(max(a, b)), summed(max(abs(a), abs(b))));
}

int containment(Extent extent) {
    vec4 planes[5] =
        vec4[](view.near_plane, view.right_plane, view.left_plane, view.upper_plane, view.lower_plane);
    int found = INSIDE;
    for (int k = 0; k < 5; ++k) {
        vec3 sums = along(planes[k].xyz, extent);
        precise float size = sums.z + abs(planes[k].w);
        precise float slack = SLACK * size;
        precise float farthest = sums.y + planes[k].w;
        precise float farthest_safe = farthest + slack;
        if (farthest_safe < 0.0) return OUTSIDE;
        precise float nearest = sums.x + planes[k].w;
        precise float nearest_safe = nearest - slack;
        if (nearest_safe < 0.0) found = CROSSING;
    }
    return found;
}

float newton(float x, float y) {
    precise float half_x = 0.5 * x;
    precise float square = y * y;
    precise float product = half_x * square;
    precise float difference = 1.5 - product;
    precise float next = y * difference;
    return next;
}

float inverse_root(float x) {
    float start = uintBitsToFloat(0x5f375a86 - (floatBitsToUint(x) >> 1));
    return newton(x, newton(x, start));
}

float root(float x) {
    precise float found = x * inverse_root(x);
    return found;
}

float distance_of(Extent extent) {
    vec3 d = max(max(extent.low, -extent.high), 0.0);
    precise vec3 squares = d * d;
    return root(max(summed(squares), MIN_SQUARE));
}

float farthest_aside(Extent extent) {
    vec3 far = max(abs(extent.low), abs(extent.high));
    precise vec2 squares = far.xz * far.xz;
    precise float square = squares.x + squares.y;
    return root(max(square, MIN_SQUARE));
}

// Allowed error over an error, for a tolerance with this scale.
float allowed_over(float scale, Extent extent, float error) {
    if (error == 0.0) return WITHOUT_ERROR;
    float distance = max(distance_of(extent), view.near);
    float over = 1.0;
    float under = scale;
    if (view.metric == CERTIFIED) {
        vec3 sums = along(view.forward, extent);
        precise float slack = SLACK * sums.z;
        precise float nearest = sums.x - slack;
        precise float shallowest = distance * view.inverse_corner;
        float depth = min(max(max(nearest, shallowest), view.near), DEEPEST);
        precise float widest = view.corner * depth;
        float aside = min(farthest_aside(extent), widest);
        precise float square = depth * depth;
        precise float across = scale * aside;
        precise float down = view.lean * depth;
        precise float sum = across + down;
        over = square;
        under = sum;
    } else if (view.metric == PAPER) {
        over = min(distance, DEEPEST);
    }
    precise float product = under * max(error, MIN_ERROR);
    float r = inverse_root(max(product, MIN_SQUARE));
    precise float guarded = GUARD * over;
    precise float once = guarded * r;
    precise float twice = once * r;
    return twice;
}

float squared_in_plan(Extent extent) {
    vec2 d = max(max(extent.low, -extent.high), 0.0).xz;
    precise vec2 squares = d * d;
    precise float level_squared = squares.x + squares.y;
    precise float squared = level_squared + view.above_squared;
    return squared;
}

float error_margin(uint level, Extent extent, float error) {
    if (view.metric == DISTANCE) {
        precise float over = ranges[level] * squared_in_plan(extent);
        return over;
    }
    return allowed_over(view.scale, extent, error);
}

// True if any of the finest blocks in a node may be in view. `found`: containment of the node in the frustum.
bool is_in_view(Node node, int found) {
    if (found != CROSSING || node.level == 0) return found != OUTSIDE;
    uint top = node.level;
    Node at = child(node, 0);
    while (true) {
        Square known;
        int lies = square(at, known) ? containment(extent(at, known.range)) : OUTSIDE;
        if (lies == INSIDE || (lies == CROSSING && at.level == 0)) return true;
        if (lies == CROSSING) {
            at = child(at, 0);
            continue;
        }
        // The next node in depth-first order.
        while ((at.at.x & at.at.y & 1) == 1) {
            at = parent(at);
            if (at.level == top) return false;
        }
        uint quadrant = (at.at.x & 1) + 2 * (at.at.y & 1);
        at = child(parent(at), quadrant + 1);
    }
    return false;
}
