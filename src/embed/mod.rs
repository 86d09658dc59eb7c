//! Terrain inside another program's Vulkan renderer.
//!
//! The caller lends its instance, device, queue and allocator, and passes command buffers. A frame has three steps:
//!
//! 1. [`TerrainRenderer::update`] selects what a view needs. It uses the CPU alone and may run on any thread.
//! 2. [`TerrainRenderer::prepare`] records copies and barriers, outside of a render pass or dynamic rendering.
//! 3. [`TerrainRenderer::draw`] records draws inside the caller's render pass or dynamic rendering, with the caller's depth
//!    buffer, viewport and scissor.
//!
//! `examples/embed.rs` is a complete program. The renderer draws no sky, keeps no global state, and destroys only what it
//! created.
//!
//! - World axes: right-handed, x east, y up, z south, metres. [`View::size`] is the viewport in pixels, which may change from
//!   frame to frame; the lens is a centred perspective or an orthographic one.
//! - Technique, look and target are fixed: another one needs another renderer. Selection runs on the CPU, also for variants
//!   that select on the GPU elsewhere.
//! - There is one pass, of colour and depth. It leaves its own pipeline, descriptor set 0, vertex and index buffers bound.
//! - Types in the interface are of `ash` 0.38, `gpu-allocator` 0.28, `image` 0.25 and `glam` 0.34.

use crate::draw::{DeviceGeometry, DrawList, PipelineRequirements};
pub use crate::gpu::embedded::{EmbeddedDescription, EmbeddedTerrain, ListSource};
pub use crate::gpu::embedded_target::{DepthTarget, Target};
pub use crate::gpu::lent::DeviceHandles;
pub use crate::gpu::requirements::{Requirements, Unsupported};
use crate::lod::{Omitted, Technique};
use crate::view::{Metric, View};

/// Terrain to draw by a technique, and where it is drawn: the fields of [`EmbeddedDescription`].
///
/// [`Entry::prepare`](crate::lod::Entry::prepare) makes a technique.
pub type TerrainDescription<'a> = EmbeddedDescription<'a, Box<dyn Technique>>;

/// Draws the terrain of a technique into the command buffers of a caller: the methods of [`EmbeddedTerrain`], and these.
pub type TerrainRenderer = EmbeddedTerrain<Box<dyn Technique>>;

/// Size and exactness of the last selection.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SelectionStats {
    /// Triangles.
    pub triangles: u64,
    /// Draws.
    pub draws: usize,
    /// Factor by which the view's tolerance was multiplied so that the selection fits its buffers. 1: the tolerance is
    /// kept. Infinite: no tolerance is kept.
    pub tolerance_scale: f64,
    /// Certified bound on the distance of any drawn point from its true place on the screen, pixels. `None` if the technique,
    /// the metric or the moment does not guarantee one, or the selection is that of an earlier view.
    pub error_bound_px: Option<f64>,
    /// Visible pieces that are coarser than the tolerance allows until finer data arrive.
    pub pending: usize,
    /// Texture tiles that the view needs and that are still being made.
    pub pending_textures: usize,
    /// Terrain further away than this in plan may be left out, metres. Infinite unless the technique was given a limit.
    pub reach_m: f64,
}

impl ListSource for Box<dyn Technique> {
    fn select(&mut self, view: &View, list: &mut DrawList) {
        self.as_mut().select(view, list);
    }

    fn device_geometry(&self) -> DeviceGeometry<'_> {
        self.as_ref().device_geometry()
    }

    fn pipeline_requirements(&self) -> PipelineRequirements {
        self.as_ref().pipeline_requirements()
    }
}

impl TerrainRenderer {
    /// Returns the size and the exactness of the last selection.
    pub fn stats(&self) -> SelectionStats {
        let list = self.list();
        let DrawList { tolerance_scale, pending, reach_m, .. } = *list;
        let tolerance = self.view().map(|view| view.tolerance).filter(|tolerance| {
            let is_certified = tolerance.metric == Metric::Certified && self.technique().keeps_tolerance();
            is_certified && pending == 0 && tolerance_scale.is_finite()
        });
        SelectionStats {
            triangles: list.triangles(),
            draws: list.draws.len(),
            tolerance_scale,
            error_bound_px: tolerance.map(|tolerance| tolerance.px * tolerance_scale),
            pending,
            pending_textures: self.pending_textures(),
            reach_m,
        }
    }

    /// Returns what the technique left out because the terrain does not need it.
    pub fn omitted(&self) -> Vec<Omitted> {
        self.technique().omitted()
    }
}
