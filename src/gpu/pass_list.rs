//! The passes made for one scene, and the commands between them.
//!
//! Passes that draw to the same attachments share one rendering scope. A pass that samples what was drawn before ends it:
//! the passes before then draw to an image in between, and the last of them to the target.

use std::sync::Arc;

use anyhow::Result;
use ash::vk;

use super::device::Gpu;
use super::formats::{DEPTH, Formats};
use super::frames::Recording;
use super::memory::{Image, ImageInfo, barriers, image_barrier};
use super::pass::{MakeInput, Origin, Pass, PassInput, Resource, Row};
use super::passes::PASSES;
use super::target::{self, Attachments, COLOUR_SAMPLED, COLOUR_WRITTEN, DEPTH_SAMPLED, DEPTH_WRITTEN, Depth};
use super::terrain::Terrain;
use crate::plan::ScenePlan;

/// The passes of a scene, in the order of the table.
pub(super) struct PassList {
    passes: Vec<Box<dyn Pass + Send>>,
    between: Between,
    formats: Formats,
}

/// The images that post-processing passes read, one each. The last pass draws to the target.
struct Between(Vec<Image>);

impl Between {
    fn new(gpu: &Arc<Gpu>, plan: &ScenePlan, target: Formats, size: [u32; 2]) -> Result<Self> {
        let usage = vk::ImageUsageFlags::COLOR_ATTACHMENT | vk::ImageUsageFlags::SAMPLED;
        let image =
            |format| Image::new(gpu, ImageInfo { purpose: "colour between passes", size, layers: None, format, usage });
        post_formats(plan, target).map(image).collect::<Result<_>>().map(Self)
    }

    /// The image that is drawn to after `done` post-processing passes; `None` is the target.
    fn after(&self, done: usize) -> Option<&Image> {
        self.0.get(done)
    }
}

/// Formats of the colours that the post-processing passes of a plan read.
fn post_formats(plan: &ScenePlan, target: Formats) -> impl Iterator<Item = vk::Format> {
    let needed = PASSES.iter().filter(move |row| row.is_needed(plan));
    needed.filter_map(|row| row.drawn_colour()).map(move |format| format.unwrap_or(target.colour))
}

/// Formats of the attachments that the terrain is drawn to.
pub(super) fn scene_formats(plan: &ScenePlan, target: Formats) -> Formats {
    let colour = post_formats(plan, target).next().unwrap_or(target.colour);
    Formats { colour, ..target }
}

impl PassList {
    /// Makes the passes that a plan needs, for a target of these formats and this size in pixels.
    ///
    /// # Errors
    /// If the device is out of memory.
    pub fn new(gpu: &Arc<Gpu>, plan: &ScenePlan, scene: &Terrain, formats: Formats, size: [u32; 2]) -> Result<Self> {
        Self::of_rows(|_| true, gpu, plan, scene, formats, Between::new(gpu, plan, formats, size)?)
    }

    /// Makes the passes that upload, for a caller with a rendering scope of its own.
    ///
    /// # Errors
    /// If the device is out of memory.
    pub fn uploads(gpu: &Arc<Gpu>, plan: &ScenePlan, scene: &Terrain, formats: Formats) -> Result<Self> {
        Self::of_rows(Row::uploads, gpu, plan, scene, formats, Between(Vec::new()))
    }

    fn of_rows(
        is_made: fn(&Row) -> bool,
        gpu: &Arc<Gpu>,
        plan: &ScenePlan,
        scene: &Terrain,
        formats: Formats,
        between: Between,
    ) -> Result<Self> {
        let (mut passes, mut done) = (Vec::new(), 0);
        for row in PASSES {
            let Origin::Plan { make, .. } = row.origin else { continue };
            if !row.is_needed(plan) || !is_made(row) {
                continue;
            }
            let is_post = row.drawn_colour().is_some();
            let drawn = if is_post { between.after(done) } else { None };
            done += usize::from(is_post);
            let colour = between.after(done).map_or(formats.colour, |image| image.format);
            let formats = Formats { colour, depth: formats.depth.filter(|_| done == 0), ..formats };
            passes.push(make(&MakeInput { gpu, plan, scene: scene.set_layout(), formats, drawn })?);
        }
        Ok(Self { passes, between, formats })
    }

    /// Formats of the attachments of a target's overlay.
    pub fn overlay_formats(&self) -> Formats {
        Formats { depth: self.formats.depth.filter(|_| self.between.0.is_empty()), ..self.formats }
    }

    /// Returns true if the passes fit targets of this size.
    pub fn fits(&self, size: [u32; 2]) -> bool {
        self.between.0.iter().all(|image| image.size == size)
    }

    /// Records the passes that upload: all of them, or those from which `only` reads.
    ///
    /// # Errors
    /// If a pass fails.
    pub fn upload(
        &mut self,
        recording: &mut Recording,
        scene: &mut Terrain,
        input: &PassInput,
        only: Option<&dyn Pass>,
    ) -> Result<()> {
        let is_read = |row: &Row| only.is_none_or(|only| only.row().reads_from(row));
        let uploads = self.passes.iter_mut().filter(|pass| pass.row().uploads() && is_read(pass.row()));
        for pass in uploads.filter(|pass| pass.row().occurs_in(&input.part)) {
            if pass.prepare(recording.slot, scene, input) {
                record(pass.as_mut(), recording, scene, input)?;
            }
        }
        Ok(())
    }

    /// Records the other passes and the overlay of the target.
    ///
    /// # Errors
    /// If a pass fails.
    pub fn draw<'p>(
        &'p mut self,
        recording: &mut Recording,
        scene: &mut Terrain,
        input: &PassInput,
        target: Attachments,
        overlay: Option<&'p mut dyn Pass>,
    ) -> Result<()> {
        let passes = self.passes.iter_mut().filter(|pass| !pass.row().uploads());
        let passes = passes.map(|pass| -> &'p mut dyn Pass { pass.as_mut() });
        run(passes.chain(overlay), recording, scene, input, Rendering::new(target, Some(&self.between), input))
    }
}

/// Records a single pass that the caller of a frame brings.
///
/// # Errors
/// If the pass fails.
pub(super) fn draw_only(
    pass: &mut dyn Pass,
    recording: &mut Recording,
    scene: &mut Terrain,
    input: &PassInput,
    target: Attachments,
) -> Result<()> {
    run(std::iter::once(pass), recording, scene, input, Rendering::new(target, None, input))
}

fn run<'p>(
    passes: impl Iterator<Item = &'p mut dyn Pass>,
    recording: &mut Recording,
    scene: &mut Terrain,
    input: &PassInput,
    mut rendering: Rendering,
) -> Result<()> {
    for pass in passes {
        if pass.row().occurs_in(&input.part) && pass.prepare(recording.slot, scene, input) {
            rendering.enter(recording, pass.row());
            record(pass, recording, scene, input)?;
        }
    }
    rendering.finish(recording);
    Ok(())
}

fn record(pass: &mut dyn Pass, recording: &mut Recording, scene: &mut Terrain, input: &PassInput) -> Result<()> {
    let (name, is_counted) = (pass.row().name, pass.is_counted(input));
    recording.counted_scope(name, is_counted, |recording| pass.record(recording, scene, input))
}

/// The rendering scope of the pass being recorded, and the images around it.
struct Rendering<'a> {
    target: Attachments,
    between: Option<&'a Between>,
    /// Post-processing passes recorded so far.
    done: usize,
    is_open: bool,
    /// True if the frame has drawn to the current attachments.
    has_drawn: bool,
    samples_depth: bool,
}

impl<'a> Rendering<'a> {
    fn new(target: Attachments, between: Option<&'a Between>, input: &PassInput) -> Self {
        let has_drawn = !input.part.is_first();
        Self { target, between, done: 0, is_open: false, has_drawn, samples_depth: false }
    }

    /// Attachments of the passes after the post-processing passes recorded so far.
    fn attachments(&self) -> Attachments {
        let image = self.between.and_then(|between| between.after(self.done));
        let colour = image.map_or(self.target.colour, Image::attachment);
        Attachments { colour, depth: self.target.depth.filter(|_| self.done == 0 && !self.samples_depth) }
    }

    /// Begins or ends rendering so that a pass can be recorded, with the barriers that its reads need.
    fn enter(&mut self, recording: &Recording, row: &Row) {
        if !row.draws() {
            return self.close(recording);
        }
        if row.drawn_colour().is_some() {
            self.sample_colour(recording);
        }
        if row.reads.contains(&Resource::DrawnDepth) {
            self.sample_depth(recording);
        }
        if !std::mem::replace(&mut self.is_open, true) {
            let attachments = self.attachments();
            if std::mem::replace(&mut self.has_drawn, true) {
                target::resume(recording, attachments);
            } else {
                target::begin(recording, attachments);
            }
        }
    }

    /// Makes the drawn colours readable, and goes on to the next image.
    fn sample_colour(&mut self, recording: &Recording) {
        self.close(recording);
        let drawn = self.attachments().colour;
        let barrier = image_barrier(drawn.image, drawn.format, COLOUR_WRITTEN, COLOUR_SAMPLED);
        barriers(recording.gpu, recording.commands, &[barrier]);
        self.done += 1;
        self.has_drawn = false;
    }

    /// Makes the depth of the target readable until the end of the frame.
    fn sample_depth(&mut self, recording: &Recording) {
        self.close(recording);
        if let (Some(Depth { image, .. }), false) = (self.target.depth, self.samples_depth) {
            let barrier = image_barrier(image, DEPTH, DEPTH_WRITTEN, DEPTH_SAMPLED);
            barriers(recording.gpu, recording.commands, &[barrier]);
            self.samples_depth = true;
        }
    }

    fn close(&mut self, recording: &Recording) {
        if std::mem::take(&mut self.is_open) {
            target::end(recording);
        }
    }

    fn finish(mut self, recording: &Recording) {
        self.close(recording);
        if let (Some(Depth { image, .. }), true) = (self.target.depth, self.samples_depth) {
            let barrier = image_barrier(image, DEPTH, DEPTH_SAMPLED, DEPTH_WRITTEN);
            barriers(recording.gpu, recording.commands, &[barrier]);
        }
    }
}
