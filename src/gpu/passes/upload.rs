//! Pass `upload`: writes a frame's uniforms and draws, and copies changed geometry to the device.

use anyhow::Result;

use crate::gpu::frames::Recording;
use crate::gpu::pass::{Occurs, Origin, Pass, PassInput, Resource, Row};
use crate::gpu::terrain::Terrain;

pub(super) static ROW: Row = Row {
    name: "upload",
    reads: &[],
    writes: &[Resource::Uniforms, Resource::Geometry],
    occurs: Occurs::Always,
    origin: Origin::Plan { is_needed: |_| true, make: |_| Ok(Box::new(Upload)) },
};

struct Upload;

impl Pass for Upload {
    fn row(&self) -> &'static Row {
        &ROW
    }

    fn prepare(&mut self, slot: usize, scene: &mut Terrain, input: &PassInput) -> bool {
        scene.write(slot, input.uniforms, input.list, &input.part);
        !input.list.uploads.is_empty()
    }

    fn record(&mut self, recording: &mut Recording, scene: &mut Terrain, input: &PassInput) -> Result<()> {
        scene.upload(recording, &input.list.uploads);
        Ok(())
    }
}
