//! Pass `textures`: copies the tiles of the virtual texture that a view needs and that are ready.

use anyhow::Result;

use crate::gpu::frames::Recording;
use crate::gpu::pass::{Occurs, Origin, Pass, PassInput, Resource, Row};
use crate::gpu::terrain::Terrain;
use crate::texture::tile_cache::TileUpload;

pub(super) static ROW: Row = Row {
    name: "textures",
    reads: &[],
    writes: &[Resource::Textures],
    occurs: Occurs::First,
    origin: Origin::Plan {
        is_needed: |plan| plan.ground.is_some() || plan.maps.is_some(),
        make: |_| Ok(Box::new(Textures { uploads: Vec::new() })),
    },
};

struct Textures {
    /// Tiles of the current frame.
    uploads: Vec<TileUpload>,
}

impl Pass for Textures {
    fn row(&self) -> &'static Row {
        &ROW
    }

    fn prepare(&mut self, slot: usize, scene: &mut Terrain, input: &PassInput) -> bool {
        self.uploads = scene.overlay.choose(slot, input.view);
        !self.uploads.is_empty()
    }

    fn record(&mut self, recording: &mut Recording, scene: &mut Terrain, _: &PassInput) -> Result<()> {
        scene.overlay.slots.upload(recording, &self.uploads);
        Ok(())
    }
}
