//! The structs that the host shares with the shaders that select clusters.
//!
//! `build.rs` includes this file by path and serves [`GLSL`] to `#include "clusters.glsl"`.

use crate::draw::layout::RenderOrigin;
use crate::draw::shared::glsl::*;
use crate::draw::shared::shared;

shared! {
    const {
        /// Metric: certified error of a perspective view.
        CERTIFIED: uint = 0;
        /// Metric: the paper's error of a perspective view.
        PAPER: uint = 1;
        /// Metric: an error allows the same everywhere, as in an orthographic view.
        EVEN: uint = 2;
        /// Metric: each level begins at a distance of its own.
        DISTANCE: uint = 3;
    }

    /// A view of the quadtree, in single precision and relative to the eye.
    struct ClusterView {
        /// Origin of camera-relative positions.
        origin: RenderOrigin,
        /// Distance of neighbouring samples (x, z), metres.
        spacing: vec2,
        /// Planes of the view frustum: normal * p + w >= 0 inside.
        near_plane: vec4,
        /// See `near_plane`.
        right_plane: vec4,
        /// See `near_plane`.
        left_plane: vec4,
        /// See `near_plane`.
        upper_plane: vec4,
        /// See `near_plane`.
        lower_plane: vec4,
        /// Viewing direction, unit length.
        forward: vec3,
        /// `CERTIFIED`, `PAPER`, `EVEN` or `DISTANCE`.
        metric: uint,
        /// Near plane, metres.
        near: float,
        /// Length of the ray through a picture corner at unit depth.
        corner: float,
        /// 1 / `corner`.
        inverse_corner: float,
        /// Pixels per unit of slope (`EVEN`: per metre) over the tolerance in pixels.
        scale: float,
        /// |y| of `forward`.
        lean: float,
        /// End of the morph band, which begins at an error margin of 1.
        band_end: float,
        /// Weight per unit of error margin within the band; 0: there is no band.
        band_scale: float,
        /// 1 if nodes outside the frustum are skipped.
        culls: uint,
        /// As `scale`, for the pixels by which skirts are deeper than the gap.
        skirt_scale: float,
        /// Square of the vertical distance from the eye to the range of heights, m^2 (metric `DISTANCE`).
        above_squared: float,
    }

    /// The quadtree's constants. Offsets count words: of the table after this struct, or of the scratch after
    /// `ClusterScratch`.
    struct ClusterTree {
        /// The last sample of the field.
        last: ivec2,
        /// Samples after which the field repeats; 0: it does not.
        period: uvec2,
        /// Cells along a side of a block.
        cells: uint,
        /// Level of the root.
        root: uint,
        /// 0: no skirts. 1: the error of a block with skirts is that of its square. 2: it is the range of its heights.
        skirts: uint,
        /// Maximum number of split nodes.
        max_splits: uint,
        /// Places in the hash table of split nodes: a power of two.
        places: uint,
        /// Table: five words a level. Offset of its squares, their number (x, z), offset of its split nodes in the
        /// scratch, and the error where the end of a tiled field cuts a square.
        levels: uint,
        /// Table: seed and quarter turns of each state.
        states: uint,
        /// Table: first index and number of indices of each seed.
        ranges: uint,
        /// Number of seeds.
        seeds: uint,
        /// Scratch: for each level the number of split nodes and two sizes of indirect dispatches.
        rows: uint,
        /// Scratch: places of all split nodes.
        list: uint,
        /// Scratch: state and rank of each split node.
        clusters: uint,
        /// Scratch: ids of split nodes, by place.
        keys: uint,
        /// Scratch: error margins as bits, by place.
        error_margins: uint,
        /// Scratch: masks of the children that are blocks, by place.
        blocks: uint,
        /// Scratch: number and first instance of each seed.
        counts: uint,
    }

    /// The head of the scratch.
    struct ClusterScratch {
        /// Size of an indirect dispatch with an invocation for each split node.
        groups: uvec3,
        /// Number of split nodes.
        splits: uint,
        /// 1 if there were more than fit.
        overflow: uint,
    }
}
