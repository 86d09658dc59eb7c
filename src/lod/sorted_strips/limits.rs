//! The technique's name and limits.

/// Name in the table of techniques.
pub const NAME: &str = "sorted-strips";
/// Most triangles of a frame, which sizes the buffers. Beyond it the tolerance is
/// scaled up.
pub const MAX_TRIANGLES: usize = 1 << 21;
/// The most pages: beyond it they are made larger.
pub const MAX_PAGES: u64 = 1 << 16;
