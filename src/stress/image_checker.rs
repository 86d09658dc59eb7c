//! The interface to a device that draws cases.

use std::sync::Arc;

use super::case::Case;
use super::finding::Finding;
use super::forms::TechniqueConfig;
use crate::height::Field;
use crate::view::View;

/// Draws cases on a GPU and checks the images.
pub trait ImageChecker {
    /// Draws a case with a technique and returns the findings.
    fn check(&mut self, case: &Case, config: &TechniqueConfig) -> Vec<Finding>;

    /// Draws one view of a field; `None` if that fails.
    fn picture(&mut self, field: &Arc<Field>, config: &TechniqueConfig, view: &View) -> Option<image::RgbaImage>;

    /// Returns the reason if the device is lost and nothing more can be drawn.
    fn device_loss(&self) -> Option<String> {
        None
    }
}
