// Detail textures: four repeating materials (src/texture/detail.rs), mixed by slope and height.

// Layers: grass, rock, scree, snow. Texels: brightness, hue and the slopes along both axes, with mean 0.5.
layout(set = 0, binding = 4) uniform sampler2DArray materials;

const uint GRASS = 0, ROCK = 1, SCREE = 2, SNOW = 3;
// Colours of each material at both ends of its hue.
const vec3 HUES[4][2] = {
    { vec3(0.052, 0.088, 0.024), vec3(0.205, 0.195, 0.085) },
    { vec3(0.170, 0.160, 0.155), vec3(0.360, 0.320, 0.275) },
    { vec3(0.270, 0.220, 0.165), vec3(0.470, 0.415, 0.345) },
    { vec3(0.560, 0.640, 0.770), vec3(0.780, 0.810, 0.850) },
};
// Strength of each material's brightness and slopes.
const vec2 STRENGTHS[4] = { vec2(2.2, 1.2), vec2(1.8, 1.5), vec2(1.6, 1.4), vec2(0.5, 0.7) };
// Coarse and fine octave: repetitions per period of the frame (powers of two), and their shares.
const float SCALES[2] = { 128.0, 1024.0 };
const float PARTS[2] = { 0.55, 0.6 };
// Texels along a side as a power of two.
const float SIDE = 9.0;

// Position in the period (x, height, z), mip level of the pixel's footprint, and a slowly varying noise.
struct Spot { vec3 at; float lod; float patches; };

struct Material { vec3 albedo; vec2 slope; };

// `pixel`: size of a pixel across the viewing ray, metres. `facing`: cosine between the ray and the normal. At grazing
// angles the footprint is long; the mip level is a compromise between its width and its length.
Spot spot_at(vec2 lattice, float height, float pixel, float facing) {
    vec2 plan = (lattice + frame.textures.detail_first) * frame.textures.detail_scale;
    float per_metre = frame.textures.detail_scale.x / frame.heights.spacing.x;
    float across = pixel * clamp(0.4 / max(facing, 1e-3), 1.0, 8.0);
    return Spot(vec3(plan.x, height * per_metre, plan.y), log2(max(across * per_metre, 1e-9)) + SIDE, 0.0);
}

// Difference of a texel from the mean.
vec4 material_texel(uint layer, vec2 at, float lod, float scale) {
    return textureLod(materials, vec3(at * scale, layer), lod + log2(scale)) - 128.0 / 255.0;
}

// Quasirandom offset in the unit square, far from the offsets of nearby numbers (Roberts 2018, R2 sequence).
vec2 elsewhere(float number) {
    return fract(vec2(0.7548776662, 0.5698402910) * number);
}

// A material projected along an axis. The coarse octave mixes two offsets by the patch noise, which hides the repetition.
Material material_at(uint layer, vec2 at, Spot spot) {
    float patches = 6.0 * spot.patches;
    float first = floor(patches);
    vec2 there = at * SCALES[0];
    float lod = spot.lod + log2(SCALES[0]);
    vec4 ground = mix(
        textureLod(materials, vec3(there + elsewhere(first), layer), lod),
        textureLod(materials, vec3(there + elsewhere(first + 1.0), layer), lod),
        smoothstep(0.25, 0.75, patches - first));
    vec4 found = PARTS[0] * (ground - 128.0 / 255.0) + PARTS[1] * material_texel(layer, at, spot.lod, SCALES[1]);
    float brightness = max(1.0 + 2.0 * STRENGTHS[layer].x * found.r, 0.1);
    vec3 hue = mix(HUES[layer][0], HUES[layer][1], clamp(0.5 + 1.5 * found.g, 0.0, 1.0));
    return Material(brightness * hue, STRENGTHS[layer].y * 255.0 / 64.0 * found.ba);
}

// Triplanar mapping of a material, so that it is not stretched on cliffs. Its slopes bend the normal.
vec3 material_albedo(uint layer, Spot spot, vec3 facing, float weight, inout vec3 normal) {
    vec3 sides = facing * facing;
    sides *= sides;
    sides = max(sides / (sides.x + sides.y + sides.z) - 0.12, 0.0);
    sides /= sides.x + sides.y + sides.z;
    vec3 albedo = vec3(0.0), out_of = vec3(0.0);
    if (sides.y > 0.0) {
        Material found = material_at(layer, spot.at.xz, spot);
        albedo += sides.y * found.albedo;
        out_of.xz += sides.y * found.slope;
    }
    if (sides.x > 0.0) {
        Material found = material_at(layer, spot.at.zy, spot);
        albedo += sides.x * found.albedo;
        out_of.zy += sides.x * found.slope;
    }
    if (sides.z > 0.0) {
        Material found = material_at(layer, spot.at.xy, spot);
        albedo += sides.z * found.albedo;
        out_of.xy += sides.z * found.slope;
    }
    normal -= weight * out_of;
    return weight * albedo;
}

// Shares of the materials at a height (0 to 1) and a normal whose y is `facing`; their sum is 1. `patches`: noise of mean 0.
vec4 shares(float height, float facing, float patches) {
    float rock = smoothstep(0.82, 0.64, facing + 0.5 * patches);
    float scree = smoothstep(0.92, 0.80, facing + 0.5 * patches) + smoothstep(0.45, 0.65, height + 0.6 * patches);
    float snow = smoothstep(0.62, 0.74, height + 0.5 * patches) * smoothstep(0.52, 0.72, facing + 0.3 * patches);
    scree = clamp(scree, 0.0, 1.0);
    vec4 all = vec4((1.0 - scree) * (1.0 - rock), rock, scree * (1.0 - rock), 0.0);
    all = max(vec4(all.xyz * (1.0 - snow), snow) - 0.02, 0.0);
    return all / (all.x + all.y + all.z + all.w);
}

// Albedo of the ground at a height (0 to 1). Bends the normal by the materials' slopes.
vec3 ground_albedo(Spot spot, float height, inout vec3 normal) {
    float wide = material_texel(ROCK, spot.at.xz, spot.lod, 1.0).g;
    float narrow =
        material_texel(SNOW, spot.at.zx, spot.lod, 8.0).g + material_texel(GRASS, spot.at.xz, spot.lod, 32.0).g;
    spot.patches = 0.7 * wide + 0.5 * narrow;
    vec4 share = shares(height, normal.y, spot.patches);
    vec3 facing = normal;
    vec3 albedo = vec3(0.0);
    for (uint layer = GRASS; layer <= SNOW; ++layer) {
        if (share[layer] > 0.0) albedo += material_albedo(layer, spot, facing, share[layer], normal);
    }
    normal = normalize(normal);
    // Wide lighter and darker patches.
    return albedo * (1.0 + (0.8 * wide + 0.4 * narrow) * (1.0 - share[SNOW]));
}
