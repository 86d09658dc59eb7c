//! Every struct that host and shaders share, declared once.
//!
//! `build.rs` includes this file by path and serves [`GLSL`] to `#include "layout.glsl"`. Only four-byte
//! scalars and their vectors occur, so scalar block layout and `#[repr(C)]` agree without padding; a test
//! holds the offsets against the compiled SPIR-V.

/// GLSL's names for the host types of the same layout (scalar block layout).
#[allow(non_camel_case_types, missing_docs)]
pub mod glsl {
    pub type uint = u32;
    pub type int = i32;
    pub type float = f32;
    pub type uvec2 = [u32; 2];
    pub type uvec3 = [u32; 3];
    pub type uvec4 = [u32; 4];
    pub type ivec2 = [i32; 2];
    pub type vec2 = [f32; 2];
    pub type vec3 = [f32; 3];
    pub type vec4 = [f32; 4];
    pub type mat4 = [[f32; 4]; 4];
}

/// One field of a shared struct: its name and its byte offset on the host.
pub type Offset = (&'static str, usize);

macro_rules! shared {
    ($($(#[$doc:meta])* struct $name:ident { $($(#[$field_doc:meta])* $field:ident: $ty:ident,)* })*) => {
        $(
            $(#[$doc])*
            #[repr(C)]
            #[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
            pub struct $name { $($(#[$field_doc])* pub $field: glsl::$ty,)* }
        )*

        /// The structs as GLSL declarations.
        pub const GLSL: &str = concat!($("struct ", stringify!($name), " {\n",
            $("    ", stringify!($ty), " ", stringify!($field), ";\n",)* "};\n\n",)*);

        /// Name, size in bytes and field offsets of each struct.
        pub fn structs() -> Vec<(&'static str, usize, Vec<Offset>)> {
            vec![$((stringify!($name), size_of::<$name>(),
                vec![$((stringify!($field), std::mem::offset_of!($name, $field)),)*]),)*]
        }
    };
}

shared! {
    /// What is the same for every vertex and fragment of a frame.
    struct Frame {
        /// From metres relative to the eye (world axes) to clip space; reversed depth.
        clip_from_relative: mat4,
        /// The lattice position nearest the eye: positions are integer differences to it, so that nothing
        /// large is ever rounded.
        render_origin: ivec2,
        /// Where the anchor lies relative to the eye (x, z), metres.
        render_origin_relative: vec2,
        /// A height near the eye's, metres, that vertices subtract before anything else.
        render_origin_height: float,
        /// Where that height lies relative to the eye (y), metres.
        render_origin_height_relative: float,
        /// Distance of neighbouring samples (x, z), metres.
        spacing: vec2,
        /// The last sample of the field, tiling included.
        last: ivec2,
        /// Samples stored (x, z): a tiled field repeats after them.
        stored: ivec2,
        /// The anchor, where it is far away back by whole repetitions: there a float has no parts of samples left.
        render_origin_stored: ivec2,
        /// Height = (stored code − zero) · scale, metres.
        height_zero: float,
        /// See `height_zero`.
        height_scale: float,
        /// Lowest and highest sample, metres: the ends of the tint.
        height_range: vec2,
        /// How far the lamp at the eye reaches in a cave, metres.
        lamp_reach: float,
        /// Towards the sun, unit length.
        sun: vec3,
        /// Fog: optical density per metre.
        fog_density: float,
        /// Size of a pixel at distance 1 m (perspective), metres; 0 in an orthographic view.
        pixel_slope: float,
        /// Size of a pixel in an orthographic view, metres; 0 in a perspective one.
        pixel_size: float,
        /// Where the anchor lies in the repetition of the ground's materials (x, z), samples.
        detail_first: vec2,
        /// Repetitions of the ground's materials a sample (x, z).
        detail_scale: vec2,
        /// Shares of the overlay's sides (x, z) from the start of a tile to the anchor.
        overlay_first: vec2,
        /// Shares of the overlay's sides a sample (x, z).
        overlay_scale: vec2,
        /// Shares after which the overlay repeats (x, z); 0: it does not.
        overlay_period: vec2,
        /// Share of the overlay's sides (x, z) at the start of a tile.
        overlay_start: vec2,
        /// Bits of corners' positions that are parts of a sample: the list's.
        fraction_bits: int,
        /// The height that heights of vertices are relative to, metres: the list's.
        height_base: float,
    }

    /// A lattice mesh placed on the field.
    struct Instance {
        /// Lattice position (finest samples) of the mesh's first corner.
        origin: ivec2,
        /// Mesh units per side: a turn maps (x, z) to (cells − z, x).
        cells: uint,
        /// Samples per mesh unit, as a power of two; −1: two units a sample, and odd positions do not occur.
        shift: int,
        /// Quarter turns about the mesh's centre, 0–3.
        rotation: uint,
        /// Level of detail, 0 the finest: for morphing, colouring and counting.
        level: uint,
        /// Which batch drew it: for colouring.
        batch: uint,
        /// How far vertices have gone to coarser levels: sixteen bytes, see `draw::weights`.
        weights: uvec4,
    }

    /// A vertex of a lattice mesh: its height is found in the height texture.
    struct LatticeVertex {
        /// Position in mesh units, 0 to `cells`.
        position: ivec2,
    }

    /// A vertex that carries its own height.
    struct ExplicitVertex {
        /// Lattice position: finest samples, or parts of them, see `Frame::fraction_bits`.
        position: ivec2,
        /// Height, metres.
        height: float,
        /// Height of the coarser shape (morph weight 1), metres.
        target: float,
        /// Where the target itself goes with the second region's weight, metres.
        second_target: float,
        /// Morph weight, 0 the finer shape and 1 the coarser one, where no region says it.
        morph: float,
        /// Regions of the instance's weights, a byte each: of the vertex, and of its target (0: none). See
        /// `draw::weights::region`.
        regions: uint,
    }

    /// Unit normals of an explicit vertex, each packed as `draw::normals::pack` says.
    struct VertexNormals {
        /// Of the finer shape.
        normal: uint,
        /// Of the coarser shape.
        target: uint,
        /// Of that to which the target goes itself.
        second_target: uint,
    }

    /// What the vertex program made of a vertex, when it is captured.
    struct Captured {
        /// Lattice position: finest samples, or parts of them, see `Frame::fraction_bits`.
        position: ivec2,
        /// Height, metres.
        height: float,
        /// Position relative to the eye, metres: what the rasteriser is given.
        relative: vec3,
    }

    /// Where the captured vertices of a part of a draw go.
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

    /// What the oracle finds in one triangle.
    struct TriangleError {
        /// Samples that the triangle counts.
        samples: uint,
        /// Sum of the counted vertical errors' squares, metres².
        squares_m: float,
        /// Sum of the counted screen errors' squares, pixels².
        squares_px: float,
        /// Largest vertical error, metres.
        largest_m: float,
        /// Largest screen error, pixels.
        largest_px: float,
    }

    /// What a view says about the nodes of clusters (`lod::clusters`), in single precision and relative to the eye.
    struct ClusterView {
        /// As in `Frame`.
        render_origin: ivec2,
        /// As in `Frame`, metres.
        render_origin_relative: vec2,
        /// As in `Frame`, metres.
        render_origin_height: float,
        /// As in `Frame`, metres.
        render_origin_height_relative: float,
        /// Distance of neighbouring samples (x, z), metres.
        spacing: vec2,
        /// Planes around what can be seen: normal · p + w ≥ 0 inside.
        near_plane: vec4,
        /// See `near_plane`.
        right_plane: vec4,
        /// See `near_plane`.
        left_plane: vec4,
        /// See `near_plane`.
        upper_plane: vec4,
        /// See `near_plane`.
        lower_plane: vec4,
        /// Unit vector that the eye looks along.
        forward: vec3,
        /// 0: certified, through a pinhole; 1: the paper's, through a pinhole; 2: the same error everywhere; 3: by
        /// distance alone, from the one where each level's way begins.
        metric: uint,
        /// Near plane, metres.
        near: float,
        /// Length of the ray through a picture corner at unit depth.
        corner: float,
        /// Its inverse.
        inverse_corner: float,
        /// Pixels per unit of slope (or per metre, metric 2) over the pixels tolerated.
        scale: float,
        /// |y| of `forward`.
        lean: float,
        /// Where the band ends that begins at 1.
        band_end: float,
        /// Weights per ratio in the band; 0: there is no band.
        band_scale: float,
        /// Whether nodes outside the planes are left as they are.
        culls: uint,
        /// As `scale`, over the pixels that skirts hang down further than the gap.
        skirt_scale: float,
        /// Square of the eye's distance from all land in height, m²: with metric 3.
        above_squared: float,
    }

    /// What does not change of the quadtree of clusters. Offsets count words after this struct.
    struct ClusterTree {
        /// The last sample of the field.
        last: ivec2,
        /// Samples after which the field repeats; 0: it does not.
        period: uvec2,
        /// Cells along a side of a block.
        cells: uint,
        /// Level of the root.
        root: uint,
        /// Whether blocks have skirts, and whether their errors are their squares': 0: no skirts; 1: they are; 2: they
        /// are not.
        skirts: uint,
        /// The most nodes that may be split.
        max_splits: uint,
        /// Places in the table of split nodes: a power of two.
        places: uint,
        /// Where the levels are: for each the offset of its squares, how many there are (x, z), the offset of its split
        /// nodes in `ClusterScratch`'s words, and the error of what the end of a tiled field cuts.
        levels: uint,
        /// Where seed and turns of each state are.
        states: uint,
        /// Where each seed's first index and number of indices are.
        ranges: uint,
        /// Seeds.
        seeds: uint,
        /// In the scratch: for each level the number of split nodes and two times groups to dispatch.
        rows: uint,
        /// In the scratch: places of all split nodes.
        list: uint,
        /// In the scratch: what each split node draws.
        clusters: uint,
        /// In the scratch: ids of split nodes, by place.
        keys: uint,
        /// In the scratch: ratios, as bits.
        error_margins: uint,
        /// In the scratch: which children are blocks.
        blocks: uint,
        /// In the scratch: instances of each seed.
        counts: uint,
    }

    /// What the selection of clusters begins its scratch with.
    struct ClusterScratch {
        /// Groups of split nodes to dispatch.
        groups: uvec3,
        /// Split nodes.
        splits: uint,
        /// Whether there were more than fit.
        overflow: uint,
    }

    /// What selection on the device says before its commands.
    struct Tally {
        /// Commands.
        draws: uint,
        /// Whether it gave up: what is drawn is coarse.
        overflow: uint,
    }

    /// What the oracle is given beside the scene.
    struct ErrorPassInput {
        /// Half the picture, pixels.
        half_size: vec2,
        /// Triangles.
        triangles: uint,
    }
}
