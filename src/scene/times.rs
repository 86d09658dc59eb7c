//! Times of frames, and their medians.

use crate::gpu::frames::Timing;

/// Times of one frame, milliseconds.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Times {
    /// From the start of selection until the device has finished.
    pub frame_ms: f64,
    /// Selection.
    pub select_ms: f64,
    /// Writing the frame's data for the device and recording its uploads.
    pub upload_ms: f64,
    /// Recording the commands, those of a selection on the device included.
    pub record_ms: f64,
    /// The device, pass by pass.
    pub gpu: Timing,
}

impl Times {
    /// Returns the median of each time. The passes are those of the frame with the median device time.
    ///
    /// # Panics
    /// If there are no frames.
    pub fn median(mut frames: Vec<Times>) -> Times {
        frames.sort_by(|a, b| a.gpu.total_ms.total_cmp(&b.gpu.total_ms));
        let of = |time: fn(&Times) -> f64| median(frames.iter().map(time).collect());
        Times {
            frame_ms: of(|t| t.frame_ms),
            select_ms: of(|t| t.select_ms),
            upload_ms: of(|t| t.upload_ms),
            record_ms: of(|t| t.record_ms),
            gpu: frames[frames.len() / 2].gpu.clone(),
        }
    }
}

/// Returns the median of some values.
pub(super) fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}
