//! Pass `terrain`: draws a draw list.

use anyhow::Result;

use crate::gpu::frames::Recording;
use crate::gpu::pass::{Occurs, Origin, Pass, PassInput, Resource, Row};
use crate::gpu::terrain::Terrain;

pub(in crate::internal::gpu) static ROW: Row = Row {
    name: "terrain",
    reads: &[Resource::Uniforms, Resource::Geometry, Resource::Commands, Resource::Textures],
    writes: &[Resource::Colour, Resource::Depth],
    occurs: Occurs::Always,
    origin: Origin::Plan { is_needed: |_| true, make: |_| Ok(Box::new(DrawTerrain)) },
};

struct DrawTerrain;

impl Pass for DrawTerrain {
    fn row(&self) -> &'static Row {
        &ROW
    }

    /// Whole lists only: a part's statistics would not add up with those of the others.
    fn is_counted(&self, input: &PassInput) -> bool {
        input.part.is_whole() && input.probe.is_none()
    }

    fn record(&mut self, recording: &mut Recording, scene: &mut Terrain, input: &PassInput) -> Result<()> {
        match input.probe {
            Some((probe, pieces)) => scene.draw_probed(recording, input.list, probe, pieces),
            None => {
                scene.draw_part(recording, input.list, &input.part);
                Ok(())
            }
        }
    }
}
