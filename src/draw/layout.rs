//! The structs and constants that the host shares with the shaders of the renderer.
//!
//! `build.rs` includes this file by path and serves [`GLSL`] to `#include "layout.glsl"`.

use crate::draw::shared::glsl::*;
use crate::draw::shared::shared;

shared! {
    const {
        /// The weight of a vertex that has reached the next coarser level. A power of two: weights are exact floats.
        ONE: uint = 64;
        /// Flag of a quadrant's byte: the quadrant is one level finer than its instance.
        FINER: uint = 128;
        /// Flag of a seam's byte: one side of the seam is coarser than the other.
        STITCHED: uint = 128;
        /// Flag of a fragment's level: the fragment belongs to a skirt.
        SKIRT: uint = 0x80000000;

        /// `Instance::weights_kind`: the words are a `SlotWeights`.
        SLOT_WEIGHTS: uint = 0;
        /// `Instance::weights_kind`: the words are a `SkirtWeights`.
        SKIRT_WEIGHTS: uint = 1;
        /// `Instance::weights_kind`: the words are a `DistanceWeights`.
        DISTANCE_WEIGHTS: uint = 2;

        /// Line of a slot: the inside of a quadrant.
        NO_LINE: int = 0;
        /// Line of a slot: one of the sides x = 0 and z = 0.
        FIRST_SIDE: int = 1;
        /// Line of a slot: one of the sides x = cells and z = cells.
        LAST_SIDE: int = 2;
        /// Line of a slot: one of the seams x = cells / 2 and z = cells / 2.
        SEAM: int = 3;

        /// Squared distance at which a morph by distance ends, over that at which it begins.
        MORPH_END: float = 1.5;
    }

    /// The origin of camera-relative rendering: positions are differences to it, so that nothing large is rounded.
    struct RenderOrigin {
        /// The lattice position nearest the eye.
        at: ivec2,
        /// Offset from the eye to `at` in plan (x, z), metres.
        relative: vec2,
        /// A height near the eye's, metres, which vertices subtract before anything else.
        height: float,
        /// Offset from the eye to `height` (y), metres.
        height_relative: float,
    }

    /// The eye and its projection.
    struct Camera {
        /// From metres relative to the eye (world axes) to clip space; reversed depth.
        clip_from_relative: mat4,
        /// Origin of camera-relative positions.
        origin: RenderOrigin,
        /// Size of a pixel at distance 1 m in a perspective view, metres; 0 in an orthographic one.
        pixel_slope: float,
        /// Size of a pixel in an orthographic view, metres; 0 in a perspective one.
        pixel_size: float,
    }

    /// The lattice of samples and their encoding in the height texture.
    struct HeightMap {
        /// Distance of neighbouring samples (x, z), metres.
        spacing: vec2,
        /// The last sample, repetitions included.
        last: ivec2,
        /// Samples stored (x, z): a tiled field repeats after them.
        stored: ivec2,
        /// The render origin. If it is far away, it is moved back by whole repetitions, so that floats relative to it
        /// keep fractions of samples.
        origin_stored: ivec2,
        /// Height = (stored code - zero) * scale, metres.
        zero: float,
        /// See `zero`.
        scale: float,
    }

    /// The encoding of explicit vertices. It belongs to a draw list.
    struct VertexFormat {
        /// Binary digits of a fraction of a sample in positions.
        fraction_bits: int,
        /// The height that vertex heights are relative to, metres.
        height_base: float,
    }

    /// Light, fog and tint.
    struct Lighting {
        /// Direction towards the sun, unit length.
        sun: vec3,
        /// Optical density of the fog per metre.
        fog_density: float,
        /// Reach of the lamp at the eye in a cave, metres.
        lamp_reach: float,
        /// Lowest and highest height of the tint, metres.
        tint_range: vec2,
    }

    /// Lattice coordinates to texture coordinates.
    struct SurfaceTextures {
        /// Render origin within the repetition of the detail textures (x, z), samples.
        detail_first: vec2,
        /// Repetitions of the detail textures a sample (x, z).
        detail_scale: vec2,
        /// From the start of an overlay tile to the render origin, as shares of the overlay's sides (x, z).
        overlay_first: vec2,
        /// Shares of the overlay's sides a sample (x, z).
        overlay_scale: vec2,
        /// Shares after which the overlay repeats (x, z); 0: it does not.
        overlay_period: vec2,
        /// Share of the overlay's sides (x, z) at the start of an overlay tile.
        overlay_start: vec2,
    }

    /// Constants of a frame, for all its vertices and fragments.
    struct Frame {
        /// The eye.
        camera: Camera,
        /// The samples.
        heights: HeightMap,
        /// The draw list's vertices.
        vertices: VertexFormat,
        /// The light.
        lighting: Lighting,
        /// The overlay and the detail textures.
        textures: SurfaceTextures,
    }

    /// A lattice mesh placed on the field.
    struct Instance {
        /// Lattice position (finest samples) of the mesh's first corner.
        origin: ivec2,
        /// Mesh units per side: a quarter turn maps (x, z) to (cells - z, x).
        cells: uint,
        /// Samples per mesh unit, as a power of two. -1: two units a sample, and odd positions do not occur.
        shift: int,
        /// Quarter turns about the mesh's centre, 0 to 3.
        rotation: uint,
        /// Level of detail, 0 the finest: for morphing, colouring and counting.
        level: uint,
        /// Number of the batch that drew it: for colouring.
        batch: uint,
        /// Meaning of `weights_words`: `SLOT_WEIGHTS`, `SKIRT_WEIGHTS` or `DISTANCE_WEIGHTS`.
        weights_kind: uint,
        /// Morph weights, packed and unpacked by `draw::weights` and `weights.glsl`.
        weights_words: uvec4,
    }

    /// A weight for each quadrant, half side and half seam of a mesh, four bytes a word (see `draw::weights`).
    struct SlotWeights {
        /// Insides of quadrants 0 to 3, each with the flag `FINER`.
        inside: uint,
        /// Halves of the side x = 0, then halves of the side z = 0.
        first_sides: uint,
        /// Halves of the side x = cells, then halves of the side z = cells.
        last_sides: uint,
        /// Halves of the seam x = cells / 2, then halves of the seam z = cells / 2, each with the flag `STITCHED`.
        seams: uint,
    }

    /// A weight for each quadrant of a mesh with skirts, and its skirts.
    struct SkirtWeights {
        /// Quadrants 0 to 3, a byte each with the flag `FINER`.
        inside: uint,
        /// Sides with a skirt: bit 4 * quadrant + side.
        sides: uint,
        /// Depth of the skirts, metres.
        depth_m: float,
    }

    /// The distances at which vertices of a mesh morph (see `draw::distance`).
    struct DistanceWeights {
        /// The flag `FINER` in the byte of each quadrant. Bits 0 to 3: sides that meet their own level.
        flags: uint,
        /// 1 over the squared distance at which the instance's level begins to morph, 1/m^2.
        range: float,
        /// The same for quadrants one level finer.
        finer_range: float,
        /// Square of the vertical distance from the eye to the range of heights, m^2.
        above_squared: float,
    }

    /// A vertex of a lattice mesh: its height comes from the height texture.
    struct LatticeVertex {
        /// Position in mesh units, 0 to `cells`.
        position: ivec2,
    }

    /// A vertex that carries its own height.
    struct ExplicitVertex {
        /// Lattice position: finest samples, or fractions of them (see `VertexFormat::fraction_bits`).
        position: ivec2,
        /// Height of the finer shape (morph weight 0), metres.
        height: float,
        /// Height of the coarser shape (morph weight 1), metres.
        target: float,
        /// Height to which the target itself moves by the second region's weight, metres.
        second_target: float,
        /// Morph weight of vertices without regions, 0 to 1.
        morph: float,
        /// Regions of the instance's weights, a byte each: of the vertex, then of its target. 0: none. See
        /// `draw::weights::region`.
        regions: uint,
    }

    /// Unit normals of an explicit vertex, each packed by `draw::normals::pack`.
    struct VertexNormals {
        /// Normal of the finer shape.
        normal: uint,
        /// Normal of the coarser shape.
        target: uint,
        /// Normal of the shape to which the target moves.
        second_target: uint,
    }

    /// A captured output of the vertex shader.
    struct Captured {
        /// Lattice position: finest samples, or fractions of them (see `VertexFormat::fraction_bits`).
        position: ivec2,
        /// Height, metres.
        height: float,
        /// Position relative to the eye, metres: the input of the projection.
        relative: vec3,
    }

    /// The records that capture a part of a draw.
    struct CapturedPart {
        /// Index of its first record.
        base: uint,
        /// Its first instance.
        first_instance: uint,
        /// Its lowest vertex index.
        first_vertex: uint,
        /// Records per instance.
        vertices: uint,
    }

    /// The head of the commands that a selection on the device writes.
    struct Tally {
        /// Number of commands.
        draws: uint,
        /// 1 if the selection overflowed and drew a coarse fallback.
        overflow: uint,
    }
}
