//! Times and counts of one frame.

/// Times and counts of one frame. `None` where the device cannot measure the value.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FrameSample {
    /// Time from the start of selection until the device has finished, milliseconds.
    pub frame_ms: f64,
    /// Host time of selecting the level of detail, milliseconds.
    pub select_ms: f64,
    /// Host time of recording commands, milliseconds.
    pub record_ms: f64,
    /// Device time of all passes, milliseconds.
    pub gpu_ms: Option<f64>,
    /// Host time of writing the frame's data for the device and recording its uploads, milliseconds.
    pub upload_ms: Option<f64>,
    /// Frame time of the shading-only baseline, milliseconds: one full-screen pass that does the same fragment work
    /// without triangles.
    pub shading_only_ms: Option<f64>,
    /// Triangles in the draw list.
    pub triangles: u64,
    /// Vertex shader invocations.
    pub vertices: Option<u64>,
    /// Draws in the draw list.
    pub draws: u64,
    /// Draw commands recorded: fewer than draws if they are submitted indirectly.
    pub commands: u64,
    /// Factor by which the tolerance was scaled so that the list fits its buffers; 1 if it fitted at once.
    pub tolerance_scale: f64,
    /// Visible instances that are coarser than the tolerance allows because finer data is not on the device yet.
    pub pending: u64,
    /// Tolerance of the frame, pixels.
    pub tolerance_px: f64,
}
