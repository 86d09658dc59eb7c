//! Terrain recorded into the command buffers of a caller. [`embed`](crate::embed) joins a technique to it.

use std::sync::Arc;

use anyhow::{Context, Error, Result, ensure};
use ash::vk;

use super::device::Gpu;
use super::embedded_target::Target;
use super::frames::Recording;
use super::lent::DeviceHandles;
use super::pass::PassInput;
use super::pass_list::PassList;
use super::passes;
use super::requirements::Requirements;
use super::slot::Part;
use super::terrain::{SceneInput, Terrain};
use crate::draw::{DepthMode, DeviceGeometry, DrawList, PipelineRequirements, Submission};
use crate::height::Field;
use crate::plan::{Look, ScenePlan};
use crate::view::{Aabb, View};

/// Selects the draw lists of one field.
///
/// Ranges of indices, instances and vertices in a list, and the targets of its uploads, lie within the list and the geometry
/// that stays on the device. The renderer does not check them.
pub trait ListSource {
    /// Fills the (empty) list with the draws of a view.
    fn select(&mut self, view: &View, list: &mut DrawList);

    /// The data that stays on the device.
    fn device_geometry(&self) -> DeviceGeometry<'_>;

    /// The pipelines that the lists need.
    fn pipeline_requirements(&self) -> PipelineRequirements;
}

/// Terrain to draw, and where it is drawn.
pub struct EmbeddedDescription<'a, L> {
    /// The heights.
    pub field: Arc<Field>,
    /// The level-of-detail technique, prepared for `field`.
    pub technique: L,
    /// Colours, light and fog.
    pub look: Look,
    /// A picture draped over the terrain, if `look` shows one.
    pub overlay: Option<&'a image::RgbaImage>,
    /// The caller's attachments.
    pub target: Target,
    /// Frames whose commands may be under way at once, 1 to 16.
    pub frames_in_flight: usize,
}

/// Draws terrain into the command buffers of a caller.
///
/// All buffers, textures and pipelines are created by [`from_raw`](Self::from_raw), none during a frame. Dropping it frees
/// them: the caller first waits until the device has finished all command buffers that draw terrain.
pub struct EmbeddedTerrain<L> {
    terrain: Terrain,
    passes: PassList,
    technique: L,
    field: Arc<Field>,
    look: Look,
    target: Target,
    range: [f32; 2],
    list: DrawList,
    /// The view of the last update.
    view: Option<View>,
    /// The view that the list was selected for: that of the last update or of an earlier one.
    selected_view: Option<View>,
    /// True once the uploads of the list are recorded.
    is_uploaded: bool,
    /// The frame of the last [`Self::prepare`].
    frame_index: Option<usize>,
    gpu: Arc<Gpu>,
}

impl<L: ListSource> EmbeddedTerrain<L> {
    /// Returns the features that the caller enables when it creates its device.
    pub fn requirements(target: &Target, look: &Look) -> Requirements {
        Requirements::for_formats(target.formats(), look.wireframe)
    }

    /// Creates the renderer: pipelines, textures and buffers for `frames_in_flight` frames.
    ///
    /// Heights and textures are uploaded by submissions to `handles.queue`, which have finished when this returns. It is the
    /// only use of the queue.
    ///
    /// # Errors
    /// Names the features, formats and limits that the device lacks; or the device is out of memory or lost.
    ///
    /// # Safety
    /// - The handles are valid, belong together, and stay valid until the renderer is dropped.
    /// - The device has the features of [`Self::requirements`] enabled.
    /// - A render pass in the target is valid, and has its attachments at that subpass.
    /// - No other thread uses the queue during the call.
    /// - The lists of the technique keep what [`ListSource`] demands.
    /// - The device has finished all commands that draw the terrain before the result is dropped.
    pub unsafe fn from_raw(handles: DeviceHandles, description: EmbeddedDescription<L>) -> Result<Self> {
        let EmbeddedDescription { field, technique, look, overlay, target, frames_in_flight } = description;
        let requirements = Self::requirements(&target, &look);
        // SAFETY: the caller vouches for the handles.
        let gpu = unsafe { Gpu::lent(handles, &requirements, frames_in_flight)? };
        ensure!(overlay.is_some() || !look.colour.shows_overlay(), "the look shows an overlay, and there is none");
        let (limits, picture) = (gpu.device_limits(), overlay.map(|picture| picture.dimensions().into()));
        let plan = ScenePlan::builder(&field, &look, &limits).overlay(picture).unmeasured();
        let plan = plan.requirements(technique.pipeline_requirements()).build().map_err(anyhow::Error::msg)?;
        ensure!(
            target.depth.is_some() || plan.requirements.depth_mode == DepthMode::Painter,
            "the technique draws in any order: it needs a depth attachment"
        );
        let (scene, formats) = (SceneInput { plan: &plan, field: &field, overlay }, target.formats());
        let terrain = Terrain::new(&gpu, scene, technique.device_geometry(), formats)?;
        let passes = PassList::uploads(&gpu, &plan, &terrain, formats)?;
        let (range, list) = (field.range(), DrawList::default());
        Ok(Self {
            terrain,
            passes,
            technique,
            field,
            look,
            target,
            range,
            list,
            view: None,
            selected_view: None,
            is_uploaded: false,
            frame_index: None,
            gpu,
        })
    }

    /// Selects the terrain of a view, which [`Self::prepare`] and [`Self::draw`] then use.
    ///
    /// An update without a `prepare` after it, as in a frame that was dropped, is allowed. If its selection changes resident
    /// geometry, the next update keeps that selection and moves only the camera: its error in the new view is not bounded.
    /// After an update, `draw` needs a new `prepare`.
    pub fn update(&mut self, view: &View) {
        let is_pending = self.view.is_some() && !self.is_uploaded && !self.list.uploads.is_empty();
        (self.view, self.frame_index) = (Some(*view), None);
        if is_pending {
            return;
        }
        self.selected_view = Some(*view);
        self.list.clear();
        self.technique.select(view, &mut self.list);
        self.is_uploaded = false;
        self.terrain.overlay.see(view, self.technique.device_geometry().geometry, &self.list);
    }

    /// Writes the buffers of a frame and records its copies and barriers, outside of a render pass or dynamic rendering.
    ///
    /// `frame_index` counts from 0 to `frames_in_flight` − 1 and names the set of buffers to write.
    ///
    /// # Errors
    /// If `frame_index` is out of range, nothing was selected yet, the view or the far plane makes no sense, or the list
    /// exceeds the limits that its technique stated.
    ///
    /// # Safety
    /// - `commands` is a primary command buffer of the lent device and queue family, in the recording state.
    /// - The device has finished the commands recorded before under the same `frame_index`.
    /// - Every prepared command buffer is submitted, all to one queue, in the order of preparation.
    pub unsafe fn prepare(&mut self, commands: vk::CommandBuffer, frame_index: usize) -> Result<()> {
        let (count, view) = (self.gpu.frames_in_flight, self.view.context("nothing is selected: call update first")?);
        ensure!(frame_index < count, "frame index {frame_index}: expected less than frames_in_flight, {count}");
        self.frame_index = None;
        view.check().map_err(Error::msg)?;
        self.target.check(&view)?;
        ensure!(self.terrain.holds(&self.list), "the list exceeds its technique's limits: {:?}", self.list.size());
        ensure!(
            self.list.submission != Submission::GpuDriven,
            "the list is for selection on the GPU, not offered here"
        );
        let mut recording = Recording::of_caller(&self.gpu, commands, frame_index);
        let mut frame = self.look.after(view.time_s).frame(&self.field, &view, self.range);
        frame.camera.clip_from_relative = self.target.clip_from_relative(&view).as_mat4().to_cols_array_2d();
        if self.is_uploaded {
            self.list.uploads.clear();
        }
        let input = PassInput { view: &view, uniforms: &frame, list: &self.list, part: Part::whole(), probe: None };
        self.passes.upload(&mut recording, &mut self.terrain, &input, None)?;
        (self.is_uploaded, self.frame_index) = (true, Some(frame_index));
        Ok(())
    }

    /// Records the draws of the terrain inside the caller's render pass or dynamic rendering.
    ///
    /// It binds pipelines, descriptor set 0, vertex buffers 0 to 2 and an index buffer. It uses the viewport and the scissor
    /// that the caller has set, and writes depth. It writes linear colours, and an alpha of 1, or 0.5 on skirts.
    ///
    /// # Errors
    /// If nothing was prepared since the last update.
    ///
    /// # Safety
    /// - `commands` is of the lent device and queue family, in the recording state, inside a pass with the attachments of the
    ///   [`Target`] and one view, with viewport and scissor set.
    /// - It runs after the commands of the last [`Self::prepare`], in the same frame.
    pub unsafe fn draw(&self, commands: vk::CommandBuffer) -> Result<()> {
        let frame_index = self.frame_index.context("nothing is prepared: call prepare first")?;
        Recording::of_caller(&self.gpu, commands, frame_index).scope(passes::terrain::ROW.name, |recording| {
            self.terrain.draw_part(recording, &self.list, &Part::whole());
            Ok(())
        })
    }

    /// Returns the height of the terrain at a world position (x, z), metres; `None` outside of it and in holes.
    pub fn height_at(&self, x: f64, z: f64) -> Option<f64> {
        self.field.height_at(x, z)
    }

    /// Returns a box around the terrain, world metres.
    pub fn bounds(&self) -> Aabb {
        let [east, south] = self.field.size().map(|samples| f64::from(samples) - 1.0);
        let [low, high] = self.range.map(f64::from);
        Aabb { min: self.field.world_at(0.0, 0.0, low), max: self.field.world_at(east, south, high) }
    }

    pub(crate) fn technique(&self) -> &L {
        &self.technique
    }

    /// The last selection.
    pub(crate) fn list(&self) -> &DrawList {
        &self.list
    }

    /// The view that the list was selected for; `None` if the last update was for another one.
    pub(crate) fn view(&self) -> Option<&View> {
        self.selected_view.as_ref().filter(|_| self.selected_view == self.view)
    }

    /// Returns the number of texture tiles that the view needs and that are still being made.
    pub(crate) fn pending_textures(&self) -> usize {
        self.terrain.overlay.stats().map_or(0, |stats| stats.pending)
    }
}
