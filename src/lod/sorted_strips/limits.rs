//! The technique's name and limits.

/// Name in the table of techniques.
pub const NAME: &str = "sorted-strips";
/// The most triangles of a frame, whatever the tolerance: buffers are made for them. Beyond it the tolerance is
/// widened.
pub const MAX_TRIANGLES: usize = 1 << 21;
/// The most pages: beyond it they are made larger.
pub const MAX_PAGES: u64 = 1 << 16;
