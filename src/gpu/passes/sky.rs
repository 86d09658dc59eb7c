//! Pass `sky`: fills the pixels without terrain. With a depth buffer it runs after the terrain, where the depth is still
//! 0. Without one it runs first, and the terrain is drawn over it.

use anyhow::Result;

use crate::gpu::frames::Recording;
use crate::gpu::pass::{Occurs, Origin, Pass, PassInput, Resource, Row};
use crate::gpu::terrain::Terrain;

/// The sky before the terrain.
pub(super) static BEHIND: Row = Row {
    name: "sky",
    reads: &[Resource::Uniforms],
    writes: &[Resource::Colour],
    occurs: Occurs::First,
    origin: Origin::Plan { is_needed: |plan| !plan.has_depth(), make: |_| Ok(Box::new(Sky(&BEHIND))) },
};

/// The sky after the terrain.
pub(super) static IN_GAPS: Row = Row {
    name: "sky",
    reads: &[Resource::Uniforms, Resource::Depth],
    writes: &[Resource::Colour],
    occurs: Occurs::Last,
    origin: Origin::Plan { is_needed: |plan| plan.has_depth(), make: |_| Ok(Box::new(Sky(&IN_GAPS))) },
};

struct Sky(&'static Row);

impl Pass for Sky {
    fn row(&self) -> &'static Row {
        self.0
    }

    fn record(&mut self, recording: &mut Recording, scene: &mut Terrain, _: &PassInput) -> Result<()> {
        scene.draw_sky(recording);
        Ok(())
    }
}
