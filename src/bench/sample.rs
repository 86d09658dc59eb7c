//! Measurements of one frame.

/// Measurements of one frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FrameSample {
    /// From the start of selection until the picture is done, milliseconds.
    pub frame_ms: f64,
    /// Selection, milliseconds.
    pub select_ms: f64,
    /// Recording of commands, milliseconds.
    pub record_ms: f64,
    /// The device, milliseconds.
    pub gpu_ms: Option<f64>,
    /// Copying to the device, milliseconds.
    pub upload_ms: Option<f64>,
    /// The same pose with the same fragment work in one full-screen pass, milliseconds.
    pub shading_only_ms: Option<f64>,
    /// Triangles drawn.
    pub triangles: u64,
    /// Vertices run.
    pub vertices: Option<u64>,
    /// Draws of the list.
    pub draws: u64,
    /// Draw commands recorded.
    pub commands: u64,
    /// Factor by which the tolerance grew because the list did not fit: 1 if it was kept.
    pub tolerance_scale: f64,
    /// Visible instances whose refinement is pending.
    pub pending: u64,
    /// Error allowed, pixels.
    pub tolerance_px: f64,
}
