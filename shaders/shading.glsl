// Colour of a point of the drawn surface.

layout(set = 0, binding = 2) uniform usampler2DArray hole_pages;
layout(set = 0, binding = 3) uniform sampler2D overlay;

// Virtual texture: a cache of tiles and its page table. The overlay's table has a tile and a level for each page
// (src/texture/virtual_overlay.rs); the ground's is a quadtree (src/texture/page_table.rs).
layout(set = 0, binding = 6) uniform sampler2DArray maps;
layout(set = 0, binding = 7, scalar) readonly buffer MapTable { uint map_table[]; };

bool is_hole(ivec2 at) {
    return texelFetch(hole_pages, texel(clamp(at, ivec2(0), frame.heights.last)), 0).r != 0;
}

// The cell of the finest surface around a lattice position, the position in it, and true if the cell's diagonal runs from
// (0, 0) to (1, 1) (src/height/rtin.rs).
struct Cell { ivec2 at; vec2 inside; bool falling; };

Cell cell_at(vec2 lattice) {
    ivec2 at = clamp(ivec2(floor(lattice)) + frame.camera.origin.at, ivec2(0), frame.heights.last - 1);
    vec2 inside = clamp(lattice - vec2(at - frame.camera.origin.at), 0.0, 1.0);
    return Cell(at, inside, ((at.x + at.y) & 1) == 0);
}

// True if one of the three corners of the triangle has no data: then the triangle is a hole.
bool in_hole(Cell cell) {
    bool first = cell.falling ? cell.inside.y >= cell.inside.x : cell.inside.x + cell.inside.y <= 1.0;
    ivec2 p = cell.falling ? ivec2(0) : ivec2(1, 0);
    ivec2 q = cell.falling ? ivec2(1) : ivec2(0, 1);
    ivec2 r = cell.falling ? (first ? ivec2(0, 1) : ivec2(1, 0)) : (first ? ivec2(0) : ivec2(1));
    return is_hole(cell.at + p) || is_hole(cell.at + q) || is_hole(cell.at + r);
}

// Height of the finest surface.
float true_height(Cell cell, bool is_ceiling) {
    float h00 = surface_height(cell.at, is_ceiling);
    float h10 = surface_height(cell.at + ivec2(1, 0), is_ceiling);
    float h01 = surface_height(cell.at + ivec2(0, 1), is_ceiling);
    float h11 = surface_height(cell.at + ivec2(1), is_ceiling);
    vec2 p = cell.inside;
    if (cell.falling) {
        return p.x >= p.y ? h00 + p.x * (h10 - h00) + p.y * (h11 - h10) : h00 + p.y * (h01 - h00) + p.x * (h11 - h01);
    }
    return p.x + p.y <= 1.0 ? h00 + p.x * (h10 - h00) + p.y * (h01 - h00)
                            : h11 + (1.0 - p.x) * (h01 - h11) + (1.0 - p.y) * (h10 - h11);
}

float linear_height(vec2 lattice, bool is_ceiling) {
    if (FILTERED) {
        vec3 uv = vec3((lattice + vec2(frame.heights.origin_stored) + 0.5) / vec2(frame.heights.stored), 0.0);
        float stored = CEILING && is_ceiling ? textureLod(ceiling_pages, uv, 0.0).r : textureLod(height_pages, uv, 0.0).r;
        return CODED ? (stored * 65535.0 - frame.heights.zero) * frame.heights.scale : stored;
    }
    ivec2 at = clamp(ivec2(floor(lattice)) + frame.camera.origin.at, ivec2(0), frame.heights.last - 1);
    vec2 p = clamp(lattice - vec2(at - frame.camera.origin.at), 0.0, 1.0);
    float north = mix(surface_height(at, is_ceiling), surface_height(at + ivec2(1, 0), is_ceiling), p.x);
    float south = mix(surface_height(at + ivec2(0, 1), is_ceiling), surface_height(at + ivec2(1), is_ceiling), p.x);
    return mix(north, south, p.y);
}

// Size of a pixel at a point relative to the eye, metres.
float pixel_at(vec3 relative) {
    return frame.camera.pixel_slope * length(relative) + frame.camera.pixel_size;
}

// Height of a point relative to the eye, metres.
float height_of(vec3 relative) {
    return (relative.y - frame.camera.origin.height_relative) + frame.camera.origin.height;
}

// True if a point of the drawn surface is nearer to the ceiling than to the floor.
bool is_of_ceiling(vec3 relative, vec2 lattice) {
    return CEILING && 2.0 * height_of(relative) > linear_height(lattice, false) + linear_height(lattice, true);
}

// Normal from central differences. Their width grows with the size of a pixel on the ground, so that far terrain does not
// alias. The normal of a ceiling points down.
vec3 normal_at(vec3 relative, vec2 lattice) {
    bool is_ceiling = is_of_ceiling(relative, lattice);
    float pixel = pixel_at(relative);
    vec2 reach = max(vec2(1.0), pixel / frame.heights.spacing);
    vec2 last = vec2(frame.heights.last - frame.camera.origin.at);
    vec2 first = vec2(-frame.camera.origin.at);
    vec2 west = vec2(max(lattice.x - reach.x, first.x), lattice.y);
    vec2 east = vec2(min(lattice.x + reach.x, last.x), lattice.y);
    vec2 north = vec2(lattice.x, max(lattice.y - reach.y, first.y));
    vec2 south = vec2(lattice.x, min(lattice.y + reach.y, last.y));
    float slope_x = (linear_height(west, is_ceiling) - linear_height(east, is_ceiling)) / ((east.x - west.x) * frame.heights.spacing.x);
    float slope_z = (linear_height(north, is_ceiling) - linear_height(south, is_ceiling)) / ((south.y - north.y) * frame.heights.spacing.y);
    vec3 normal = normalize(vec3(slope_x, 1.0, slope_z));
    return is_ceiling ? -normal : normal;
}

// From 0 at the lowest sample to 1 at the highest.
float share_of_range(float height) {
    float low = frame.lighting.tint_range.x, high = frame.lighting.tint_range.y;
    return clamp((height - low) / (high - low), 0.0, 1.0);
}

// Hypsometric tint: green lowland, ochre slopes, grey rock, snow.
vec3 tint(float height, vec3 normal) {
    float t = share_of_range(height);
    vec3 colour = mix(vec3(0.11, 0.20, 0.07), vec3(0.27, 0.28, 0.11), smoothstep(0.0, 0.28, t));
    colour = mix(colour, vec3(0.36, 0.28, 0.18), smoothstep(0.25, 0.55, t));
    colour = mix(colour, vec3(0.34, 0.32, 0.31), smoothstep(0.5, 0.75, t));
    colour = mix(colour, vec3(0.86, 0.89, 0.93), smoothstep(0.78, 0.92, t));
    return mix(vec3(0.25, 0.22, 0.20), colour, smoothstep(0.45, 0.75, normal.y));
}

// Limestone in about ten layers from the lowest to the highest sample.
vec3 rock(float height) {
    float share = share_of_range(height);
    float layer = 0.5 + 0.5 * sin(60.0 * share + 1.3 * sin(14.5 * share));
    return mix(vec3(0.34, 0.28, 0.22), vec3(0.56, 0.50, 0.42), layer);
}

// Light of the lamp at the eye, plus ambient light. Back faces are lit too, as seen from outside the cave.
vec3 lamplight(vec3 relative, float distance, vec3 normal) {
    float facing = abs(dot(normal, relative)) / max(distance, 1e-30);
    float far = distance / max(frame.lighting.lamp_reach, 1e-30);
    vec3 around = mix(vec3(0.05, 0.045, 0.04), vec3(0.07, 0.08, 0.10), normal.y * 0.5 + 0.5);
    return vec3(1.75, 1.5, 1.15) * facing / (1.0 + far * far) + around;
}

// Well separated hues for small integers.
vec3 palette(uint k) {
    vec3 hue = fract(float(k) * 0.61803399 + vec3(0.0, 0.3333333, 0.6666667));
    return 0.15 + 0.65 * clamp(abs(hue * 6.0 - 3.0) - 1.0, 0.0, 1.0);
}

// Blue for an exact surface, green to red up to one pixel of error, white beyond.
vec3 error_colour(float px) {
    vec3 low = mix(vec3(0.02, 0.06, 0.30), vec3(0.05, 0.45, 0.10), smoothstep(0.0, 0.25, px));
    vec3 high = mix(low, vec3(0.75, 0.06, 0.02), smoothstep(0.25, 1.0, px));
    return px > 1.0 ? vec3(1.0) : high;
}

// Position on the overlay, as shares of its sides, of a lattice position relative to the render origin.
vec2 overlay_share(vec2 lattice) {
    vec2 share = lattice * frame.textures.overlay_scale + frame.textures.overlay_first;
    vec2 period = frame.textures.overlay_period;
    return share - period * floor(share / mix(period, vec2(1.0), equal(period, vec2(0.0)))) + frame.textures.overlay_start;
}

// True if the overlay covers a position; its sides may be rounded.
bool is_covered(vec2 share) {
    return !OVERLAY_ENDS || all(lessThanEqual(abs(share - 0.5), vec2(0.5 + 1e-6)));
}

// A position in a tile of a virtual texture. Neighbouring tiles share their border texels, so that linear filtering leaves
// no seam.
struct Tile { vec2 share; uint slot; uint level; };

Tile tile_at(vec2 share) {
    vec2 extent = vec2(MAP_COLUMNS, MAP_ROWS);
    uvec2 pages = uvec2(ceil(extent));
    vec2 at = clamp(share, 0.0, 1.0) * extent;
    uvec2 page = min(uvec2(at), pages - 1u);
    uint entry = map_table[page.y * pages.x + page.x];
    uint level = entry & 15u;
    return Tile((at - vec2((page >> level) << level)) / float(1u << level), entry >> 4, level);
}

// The smallest resident tile of the virtual ground around a position.
Tile ground_at(Cell cell) {
    uvec2 parts = min(uvec2(cell.inside * float(1u << MAP_SHIFT)), (1u << MAP_SHIFT) - 1u);
    uvec2 place = (uvec2(cell.at) << MAP_SHIFT) | parts;
    uint node = 0, slot = 0, level = 0;
    for (uint depth = 0; depth < 32; depth++) {
        uint own = map_table[5 * node];
        if (own != 0) {
            slot = own - 1;
            level = depth;
        }
        uvec2 part = (place >> (31 - depth)) & 1u;
        node = map_table[5 * node + 1 + part.x + 2 * part.y];
        if (node == 0) break;
    }
    return Tile(vec2(place << level) * (1.0 / 4294967296.0), slot, level);
}

vec3 texels(Tile tile) {
    float side = float(textureSize(maps, 0).x);
    return textureLod(maps, vec3((tile.share * (side - 1.0) + 0.5) / side, float(tile.slot)), 0.0).rgb;
}

// `steps`: screen-space derivatives of the lattice position along x and y.
vec3 overlay_albedo(vec2 share, vec4 steps) {
    if (MAP_COLUMNS != 0.0) return texels(tile_at(share));
    return textureGrad(overlay, share, steps.xy * frame.textures.overlay_scale, steps.zw * frame.textures.overlay_scale).rgb;
}

// Debug colour of a tile: a hue for its level, and a dark edge.
vec3 tile_colour(Tile tile) {
    vec2 edge = min(tile.share, 1.0 - tile.share);
    return palette(tile.level) * (min(edge.x, edge.y) < 0.02 ? 0.2 : 1.0);
}

// True if a lattice position lies in a hole.
bool is_open(vec2 lattice) {
    return HOLES && in_hole(cell_at(lattice));
}

// Colour of the surface at a point relative to the eye, over a lattice position relative to the render origin. `steps`:
// derivatives of that position as in `overlay_albedo`.
vec3 terrain_colour(vec3 relative, vec2 lattice, vec4 steps, vec3 normal, uvec2 level_batch) {
    Cell cell = cell_at(lattice);
    float distance = length(relative);
    float pixel = pixel_at(relative);
    float height = height_of(relative);

    bool is_overlaid = COLOUR == COLOUR_OVERLAY || COLOUR == COLOUR_MAPS;
    vec2 share = vec2(0.0);
    if (is_overlaid) {
        share = overlay_share(lattice);
        is_overlaid = is_covered(share);
    }
    vec3 albedo;
    vec3 ground = vec3(0.0);
    if (DETAIL && (COLOUR == COLOUR_HEIGHT || COLOUR == COLOUR_OVERLAY)) {
        float facing = abs(dot(relative, normal)) / max(distance, 1e-30);
        Spot spot = spot_at(lattice, height, pixel, facing);
        ground = ground_albedo(spot, share_of_range(height), normal);
    }
    if (COLOUR == COLOUR_LEVEL) albedo = palette(level_batch.x & ~SKIRT);
    else if (COLOUR == COLOUR_MAPS && MAP_COLUMNS != 0.0 && is_overlaid) albedo = tile_colour(tile_at(share));
    else if (is_overlaid) albedo = overlay_albedo(share, steps);
    else if (COLOUR == COLOUR_GROUND) albedo = texels(ground_at(cell));
    else if (COLOUR == COLOUR_NODES) albedo = tile_colour(ground_at(cell));
    else if (COLOUR == COLOUR_ERROR) albedo = error_colour(abs(height - true_height(cell, is_of_ceiling(relative, lattice))) / max(pixel, 1e-30));
    else if (COLOUR == COLOUR_BATCH) albedo = palette(level_batch.y);
    else if (DETAIL) albedo = ground;
    else albedo = CEILING ? rock(height) : tint(height, normal);
    // Detail textures only modulate the brightness of an overlay.
    if (DETAIL && COLOUR == COLOUR_OVERLAY && is_overlaid) albedo *= clamp(dot(ground, vec3(1.0)) / 0.75, 0.5, 1.6);

    vec3 colour = albedo;
    if (COLOUR == COLOUR_NORMAL) {
        colour = normal * 0.5 + 0.5;
    } else if (CEILING) {
        colour *= lamplight(relative, distance, normal);
    } else {
        float sun = max(dot(normal, frame.lighting.sun), 0.0);
        vec3 ambient = mix(vec3(0.16, 0.15, 0.14), vec3(0.28, 0.34, 0.45), normal.y * 0.5 + 0.5);
        colour *= sun * vec3(1.55, 1.42, 1.22) + ambient;
    }
    if (FOG) colour = mix(sky(relative / max(distance, 1e-30)), colour, exp(-frame.lighting.fog_density * distance));
    return colour;
}
