//! Passes of a frame: one row each in [`PASSES`], in the order in which a frame records them.
//!
//! A pass is a file here, its shaders, and a row. The name in the row is the debug label, the profiler scope and the
//! name in every table. From what a row reads and writes, `PassList` derives where
//! rendering begins and ends, the barriers between passes, and the images that post-processing reads.

pub mod capture;
pub(super) mod fullscreen;
#[cfg(feature = "viewer")]
pub mod hud;
mod select;
pub mod shading_only;
mod sky;
mod terrain;
mod textures;
mod upload;

use std::sync::Arc;

use anyhow::Result;
use ash::vk;

use super::device::Gpu;
use super::frames::Recording;
use super::memory::Image;
use super::probe::{Piece, Probe};
use super::slot::Part;
use super::target::Formats;
use super::terrain::Terrain;
use crate::draw::DrawList;
use crate::draw::layout::Frame;
use crate::plan::ScenePlan;
use crate::view::View;

/// All passes, in the order of a frame.
pub static PASSES: &[&Row] = &[
    &textures::ROW,
    &upload::ROW,
    &select::ROW,
    &sky::BEHIND,
    &terrain::ROW,
    &sky::IN_GAPS,
    &shading_only::ROW,
    #[cfg(feature = "viewer")]
    &hud::ROW,
    &capture::ROW,
];

/// A resource of a frame that passes read and write.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Resource {
    /// Tiles of the virtual texture and their page table.
    Textures,
    /// The uniform buffer: camera, heights, lighting.
    Uniforms,
    /// Instances, indirect commands, streamed and resident geometry.
    Geometry,
    /// Draw commands and instances that the device finds.
    Commands,
    /// The colour attachment.
    Colour,
    /// The depth attachment, tested or written.
    Depth,
    /// The colours that earlier passes of the frame drew, as a texture of a format; `None` is the target's. A pass that
    /// reads them draws to another image.
    DrawnColour(Option<vk::Format>),
    /// The depth that an earlier frame left, as a texture.
    DrawnDepth,
    /// Vertices as the vertex shaders placed them.
    Vertices,
}

/// Parts of a frame in which a pass runs, if the frame is submitted in several.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Occurs {
    /// In the first part.
    First,
    /// In every part.
    Always,
    /// In the last part.
    Last,
}

/// The maker of a pass.
pub enum Origin {
    /// The renderer makes the pass of every scene whose plan needs it.
    Plan {
        /// Returns true if the plan needs the pass.
        is_needed: fn(&ScenePlan) -> bool,
        /// Makes the pass.
        make: fn(&MakeInput) -> Result<Box<dyn Pass>>,
    },
    /// The caller of a frame brings the pass: a target its overlay, a measurement the one pass of its frame.
    Caller,
}

/// One pass in the table.
pub struct Row {
    /// Its name in every tool.
    pub name: &'static str,
    /// Resources that it reads.
    pub reads: &'static [Resource],
    /// Resources that it writes.
    pub writes: &'static [Resource],
    /// Parts of a frame in which it runs.
    pub occurs: Occurs,
    /// Its maker.
    pub origin: Origin,
}

/// A pass made for one scene.
pub trait Pass {
    /// The row of the pass in [`PASSES`].
    fn row(&self) -> &'static Row;

    /// Writes the data of a frame for the device. Returns false if the frame has no work for the pass.
    fn prepare(&mut self, _slot: usize, _scene: &mut Terrain, _input: &PassInput) -> bool {
        true
    }

    /// Returns true if pipeline statistics of the pass are counted: for at most one pass of a frame.
    fn is_counted(&self, _input: &PassInput) -> bool {
        false
    }

    /// Records the commands. A pass that writes [`Resource::Colour`] is recorded within rendering, the others outside.
    ///
    /// # Errors
    /// If the device or a limit refuses the frame.
    fn record(&mut self, recording: &mut Recording, scene: &mut Terrain, input: &PassInput) -> Result<()>;
}

/// The frame that a pass draws.
#[derive(Clone, Copy)]
pub struct PassInput<'a> {
    /// The view.
    pub view: &'a View,
    /// Uniforms of the view.
    pub uniforms: &'a Frame,
    /// The draw list.
    pub list: &'a DrawList,
    /// The part of the list to draw.
    pub part: Part,
    /// Queries around the pieces of the list, if they are measured one by one.
    pub probe: Option<(&'a Probe, &'a [Piece])>,
}

/// The scene that a pass is made for.
pub struct MakeInput<'a> {
    /// The device.
    pub gpu: &'a Arc<Gpu>,
    /// The plan of the scene.
    pub plan: &'a ScenePlan,
    /// Layout of the scene's descriptors: set 0 of the pass.
    pub scene: vk::DescriptorSetLayout,
    /// Formats of the attachments that the pass draws to.
    pub formats: Formats,
    /// The image behind [`Resource::DrawnColour`], if the pass reads it.
    pub drawn: Option<&'a Image>,
}

impl Row {
    /// Returns true if the pass draws.
    pub fn draws(&self) -> bool {
        self.writes.contains(&Resource::Colour)
    }

    /// Returns true if the pass copies data of the host to the device.
    pub fn uploads(&self) -> bool {
        let from_host = [Resource::Textures, Resource::Uniforms, Resource::Geometry];
        self.writes.iter().any(|resource| from_host.contains(resource))
    }

    /// Returns the format of [`Resource::DrawnColour`], if the pass reads it.
    pub fn drawn_colour(&self) -> Option<Option<vk::Format>> {
        self.reads.iter().find_map(|resource| match resource {
            Resource::DrawnColour(format) => Some(*format),
            _ => None,
        })
    }

    /// Returns true if the pass reads anything that `other` writes.
    pub fn reads_from(&self, other: &Row) -> bool {
        self.reads.iter().any(|resource| other.writes.contains(resource))
    }

    /// Returns true if the pass runs in a part of a frame.
    pub fn occurs_in(&self, part: &Part) -> bool {
        match self.occurs {
            Occurs::First => part.is_first(),
            Occurs::Always => true,
            Occurs::Last => part.is_last,
        }
    }

    /// Returns true if the renderer makes the pass for a plan.
    pub fn is_needed(&self, plan: &ScenePlan) -> bool {
        matches!(self.origin, Origin::Plan { is_needed, .. } if is_needed(plan))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The order of the table is an order of the work: nothing is read before it is written.
    #[test]
    fn a_pass_reads_what_an_earlier_one_writes() {
        // An earlier frame leaves its depth.
        let mut written = vec![Resource::DrawnDepth];
        for row in PASSES {
            for resource in row.reads {
                let source = if let Resource::DrawnColour(_) = resource { Resource::Colour } else { *resource };
                assert!(written.contains(&source), "{}: nothing before writes {resource:?}", row.name);
            }
            written.extend(row.writes);
        }
    }

    #[test]
    fn a_name_is_one_pass() {
        for (k, row) in PASSES.iter().enumerate() {
            let same = PASSES[..k].iter().filter(|other| other.name == row.name).count();
            // The sky is drawn before the terrain or after it.
            assert_eq!(same, usize::from(std::ptr::eq(*row, &sky::IN_GAPS)), "{}", row.name);
        }
    }
}
