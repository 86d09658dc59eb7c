//! Passes of a frame: one row each in [`PASSES`], in the order in which a frame records them.
//!
//! A pass is a file here, its shaders, and a row. The name in the row is the debug label, the profiler scope and the
//! name in every table. From what a row reads and writes, `PassList` derives where
//! rendering begins and ends, the barriers between passes, and the images that post-processing reads.

pub mod capture;
pub(super) mod fullscreen;
#[cfg(feature = "viewer")]
pub mod hud;
mod select;
pub mod shading_only;
mod sky;
pub(super) mod terrain;
mod textures;
mod upload;

use super::pass::Row;

/// All passes, in the order of a frame.
pub static PASSES: &[&Row] = &[
    &textures::ROW,
    &upload::ROW,
    &select::ROW,
    &sky::BEHIND,
    &terrain::ROW,
    &sky::IN_GAPS,
    &shading_only::ROW,
    #[cfg(feature = "viewer")]
    &hud::ROW,
    &capture::ROW,
];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gpu::pass::Resource;

    /// The order of the table is an order of the work: nothing is read before it is written.
    #[test]
    fn a_pass_reads_what_an_earlier_one_writes() {
        // An earlier frame leaves its depth.
        let mut written = vec![Resource::DrawnDepth];
        for row in PASSES {
            for resource in row.reads {
                let source = if let Resource::DrawnColour(_) = resource { Resource::Colour } else { *resource };
                assert!(written.contains(&source), "{}: nothing before writes {resource:?}", row.name);
            }
            written.extend(row.writes);
        }
    }

    #[test]
    fn a_name_is_one_pass() {
        for (k, row) in PASSES.iter().enumerate() {
            let same = PASSES[..k].iter().filter(|other| other.name == row.name).count();
            // The sky is drawn before the terrain or after it.
            assert_eq!(same, usize::from(std::ptr::eq(*row, &sky::IN_GAPS)), "{}", row.name);
        }
    }
}
