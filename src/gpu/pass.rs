//! A pass of a frame: its row in the table [`passes`](super::passes), and what it is made for and draws.

use std::sync::Arc;

use anyhow::Result;
use ash::vk;

use super::device::Gpu;
use super::formats::Formats;
use super::frames::Recording;
use super::memory::Image;
use super::probe::{Piece, Probe};
use super::slot::Part;
use super::terrain::Terrain;
use crate::draw::DrawList;
use crate::draw::layout::Frame;
use crate::plan::ScenePlan;
use crate::view::View;

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
    /// Errors of captured triangles.
    Errors,
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
        make: fn(&MakeInput) -> Result<Box<dyn Pass + Send>>,
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
    /// The row of the pass in [`PASSES`](super::passes::PASSES).
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
