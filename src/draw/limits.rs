//! Upper bounds of draw lists, from which buffers get their sizes.

use super::geometry::Geometry;
use super::gpu_selection::GpuSelection;

/// Upper bounds of all lists of a technique. Buffers of this size are made once.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Limits {
    /// Draws in a list.
    pub draws: usize,
    /// Instances in a list.
    pub instances: usize,
    /// Streamed explicit vertices in a list.
    pub vertices: usize,
    /// Normals of streamed vertices in a list.
    pub normals: usize,
    /// Streamed indices in a list.
    pub indices: usize,
    /// Bytes of uploads in a list.
    pub upload_bytes: usize,
}

/// Geometry of a technique that stays on the device, and the buffer sizes that its lists need.
#[derive(Clone, Copy, Debug)]
pub struct DeviceGeometry<'a> {
    /// Geometry.
    pub geometry: &'a Geometry,
    /// Upper bounds of its lists.
    pub limits: Limits,
    /// Selection on the device, if the technique has one.
    pub gpu_selection: Option<&'a GpuSelection>,
}

impl Limits {
    /// Returns true if no value of `size` exceeds these limits.
    pub fn hold(&self, size: &Limits) -> bool {
        size.draws <= self.draws
            && size.instances <= self.instances
            && size.vertices <= self.vertices
            && size.normals <= self.normals
            && size.indices <= self.indices
            && size.upload_bytes <= self.upload_bytes
    }
}
