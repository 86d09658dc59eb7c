//! Pass `select`: finds the draws of a list on the device, for techniques with a GPU-driven selection.

use anyhow::Result;

use crate::draw::Submission;
use crate::gpu::frames::Recording;
use crate::gpu::pass::{Occurs, Origin, Pass, PassInput, Resource, Row};
use crate::gpu::terrain::Terrain;

pub(super) static ROW: Row = Row {
    name: "select",
    reads: &[],
    writes: &[Resource::Commands],
    occurs: Occurs::First,
    origin: Origin::Plan { is_needed: |_| true, make: |_| Ok(Box::new(Select)) },
};

struct Select;

impl Pass for Select {
    fn row(&self) -> &'static Row {
        &ROW
    }

    fn prepare(&mut self, _: usize, _: &mut Terrain, input: &PassInput) -> bool {
        input.list.submission == Submission::GpuDriven
    }

    fn record(&mut self, recording: &mut Recording, scene: &mut Terrain, input: &PassInput) -> Result<()> {
        scene.select(recording, input.list)
    }
}
