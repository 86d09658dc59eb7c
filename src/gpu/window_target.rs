//! The window as the target of one frame.

use anyhow::Result;

use super::frames::{Recording, Semaphores};
use super::pass::Pass;
use super::passes::hud::{Hud, Painted};
use super::screenshot::Screenshot;
use super::swapchain::{Acquired, Swapchain};
use super::target::{Attachments, Selected, Target};
use crate::draw::DrawList;

/// A window, its HUD, and a copy of the frame if one is wanted.
pub struct WindowTarget<'a, F> {
    swapchain: &'a mut Swapchain,
    hud: &'a mut Hud,
    copy: Option<&'a Screenshot>,
    lay_out: F,
    image: Option<Acquired>,
}

impl<'a, F: FnMut(&Selected, &mut DrawList) -> Painted> WindowTarget<'a, F> {
    /// Makes the target of one frame. `lay_out` lays out the HUD once the frame's list is selected.
    pub fn new(swapchain: &'a mut Swapchain, hud: &'a mut Hud, copy: Option<&'a Screenshot>, lay_out: F) -> Self {
        Self { swapchain, hud, copy, lay_out, image: None }
    }

    fn image(&self) -> &Acquired {
        self.image.as_ref().expect("a frame goes on only if it has an image")
    }
}

impl<F: FnMut(&Selected, &mut DrawList) -> Painted> Target for WindowTarget<'_, F> {
    fn acquire(&mut self, slot: usize) -> Result<bool> {
        self.image = self.swapchain.acquire(slot)?;
        Ok(self.image.is_some())
    }

    fn attachments(&self) -> Attachments {
        self.image().attachments
    }

    fn selected(&mut self, frame: &Selected, list: &mut DrawList) -> Result<()> {
        let painted = (self.lay_out)(frame, list);
        self.hud.set(painted)
    }

    fn overlay(&mut self) -> Option<&mut dyn Pass> {
        Some(self.hud)
    }

    fn finish(&self, recording: &Recording) {
        self.swapchain.finish(recording, self.image(), self.copy);
    }

    fn semaphores(&self) -> Semaphores {
        let Acquired { wait, signal, .. } = *self.image();
        Semaphores { wait: Some(wait), signal: Some(signal) }
    }

    fn present(&mut self) -> Result<()> {
        let image = *self.image();
        self.swapchain.present(&image)
    }

    fn waits(&self) -> bool {
        self.copy.is_some()
    }
}
