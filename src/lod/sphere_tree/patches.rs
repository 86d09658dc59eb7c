//! Patches: the triangles of a block, kept on the device until a wedge in it splits or merges.
//!
//! A block in sight that changed is built anew. Where it came out the same, nothing is sent; else its triangles are
//! uploaded whole. What a frame's uploads or the device's memory have no room for is streamed, so that nothing ever
//! waits. Vertices that fade in change with every step of the eye: their blocks are all built anew.
//!
//! Bytes sent and selection's time, medians of 200 frames over 2049 × 2049 samples 10 m apart, 30 m above ground:
//!
//! | wedges (triangles in sight) | eye | streamed | patches |
//! |---|---|---|---|
//! | 10⁴ (4 k) | 0.05 m a frame | 129 kB, 0.86 ms | 4.9 kB, 0.28 ms |
//! | | 5 m a frame | 111 kB, 0.86 ms | 46 kB, 0.56 ms |
//! | | leaps | 119 kB, 4.1 ms | 111 kB, 3.6 ms |
//! | 10⁵ (27 k) | 0.05 m a frame | 789 kB, 2.5 ms | 7.1 kB, 0.33 ms |
//! | | 5 m a frame | 717 kB, 2.9 ms | 271 kB, 1.3 ms |
//! | | leaps | 719 kB, 40 ms | 699 kB, 39 ms |
//! | 10⁶ (251 k) | 0.05 m a frame | 6.8 MB, 23 ms | 86 kB, 1.0 ms |
//! | | 5 m a frame | 5.9 MB, 22 ms | 2.8 MB, 13 ms |
//! | | leaps | 4.7 MB, 358 ms | 4.7 MB, 357 ms |
//!
//! Where nearly all blocks change (tens of metres a frame) what is copied on the device is lost: on llvmpipe 7.1 instead of
//! 5.2 ms of device time for 17 k triangles, 35 instead of 35 for 203 k.

use std::ops::Range;

use bytemuck::cast_slice;
use range_alloc::RangeAllocator;

use super::blocks::Blocks;
use super::lattice::Place;
use super::splits::Changes;
use crate::draw::{ExplicitVertex, Geometry, Limits, Upload};

/// The triangles of one draw.
#[derive(Default)]
pub struct Piece {
    /// Vertices.
    pub vertices: Vec<ExplicitVertex>,
    /// Three a triangle.
    pub indices: Vec<u32>,
}

/// The most bytes uploaded in a frame: a staging buffer of this size is made for each frame in flight.
const UPLOAD_BYTES: usize = 32 << 20;

/// The triangles of a block on the device.
struct Patch {
    /// The wedges of the block that they lie under.
    roots: Vec<[Place; 3]>,
    /// Which vertices.
    vertices: Range<u32>,
    /// Which indices.
    indices: Range<u32>,
    /// Whether a wedge of the block has changed since.
    is_stale: bool,
}

/// What blocks have on the device.
pub struct Patches {
    geometry: Geometry,
    free_vertices: RangeAllocator<u32>,
    free_indices: RangeAllocator<u32>,
    of_blocks: Vec<Option<Patch>>,
    /// Bytes that the frame may still upload.
    left: usize,
    /// Whether a block was streamed because they did not suffice.
    waits: bool,
}

impl Patches {
    /// None yet, with room for what a list may stream.
    pub fn new(blocks: usize, limits: &Limits) -> Self {
        let (vertices, indices) = (limits.vertices, limits.indices);
        Self {
            geometry: Geometry {
                vertices: vec![ExplicitVertex::default(); vertices],
                indices: vec![0; indices],
                ..Geometry::default()
            },
            free_vertices: RangeAllocator::new(0..vertices as u32),
            free_indices: RangeAllocator::new(0..indices as u32),
            of_blocks: std::iter::repeat_with(|| None).take(blocks).collect(),
            left: 0,
            waits: false,
        }
    }

    /// What is on the device.
    pub fn geometry(&self) -> &Geometry {
        &self.geometry
    }

    /// The most bytes uploaded in a frame.
    pub fn upload_bytes(&self) -> usize {
        UPLOAD_BYTES.min(bytes(self.geometry.vertices.len(), self.geometry.indices.len()))
    }

    /// Whether a block was streamed for want of uploads: it is a patch in the next frame.
    pub fn waits(&self) -> bool {
        self.waits
    }

    /// A new frame, before which these diamonds split or merged.
    pub fn begin(&mut self, changes: &Changes, fades: bool, blocks: &Blocks) {
        (self.left, self.waits) = (self.upload_bytes(), false);
        if changes.all || fades {
            self.of_blocks.iter_mut().flatten().for_each(|patch| patch.is_stale = true);
            return;
        }
        for middle in &changes.middles {
            // On a line between blocks it belongs to both sides. Larger wedges than a block's show in its roots.
            let [i, j] = [0, 1].map(|k| (middle[k] - 1).div_euclid(blocks.side)..=middle[k] / blocks.side);
            for (i, j) in j.flat_map(|j| i.clone().map(move |i| (i, j))) {
                if (0..blocks.count[0]).contains(&i) && (0..blocks.count[1]).contains(&j) {
                    let block = blocks.drawn_with((j * blocks.count[0] + i) as usize);
                    self.of_blocks[block].iter_mut().for_each(|patch| patch.is_stale = true);
                }
            }
        }
    }

    /// The first vertex and the indices of a block's patch, if it is what lies under these wedges.
    pub fn of(&self, block: usize, roots: &[[Place; 3]]) -> Option<(u32, Range<u32>)> {
        let patch = self.of_blocks[block].as_ref().filter(|patch| !patch.is_stale && patch.roots == roots)?;
        Some((patch.vertices.start, patch.indices.clone()))
    }

    /// Makes a piece the patch of a block, if there is room: says whether there was.
    pub fn keep(
        &mut self,
        (block, roots): (usize, Vec<[Place; 3]>),
        piece: &Piece,
        blocks: &Blocks,
        uploads: &mut Vec<Upload>,
    ) -> bool {
        if let Some(patch) = self.of_blocks[block].as_mut().filter(|patch| holds(&self.geometry, patch, piece)) {
            (patch.roots, patch.is_stale) = (roots, false);
            return true;
        }
        self.drop(block);
        let bytes = bytes(piece.vertices.len(), piece.indices.len());
        if bytes > self.left {
            self.waits = true;
            return false;
        }
        let Some([vertices, indices]) = self.room_for(piece, blocks) else { return false };
        self.left -= bytes;
        self.geometry.vertices[usizes(&vertices)].copy_from_slice(&piece.vertices);
        self.geometry.indices[usizes(&indices)].copy_from_slice(&piece.indices);
        uploads.push(Upload::Vertices(vertices.start, piece.vertices.clone()));
        uploads.push(Upload::Indices(indices.start, piece.indices.clone()));
        self.of_blocks[block] = Some(Patch { roots, vertices, indices, is_stale: false });
        true
    }

    fn room_for(&mut self, piece: &Piece, blocks: &Blocks) -> Option<[Range<u32>; 2]> {
        if piece.indices.is_empty() {
            return Some([0..0, 0..0]);
        }
        self.take(piece).or_else(|| {
            // Nothing in sight relies on these.
            let is_spare = |block: &usize| {
                self.of_blocks[*block].as_ref().is_some_and(|patch| patch.is_stale || !blocks.is_seen(*block))
            };
            let spare: Vec<_> = (0..self.of_blocks.len()).filter(is_spare).collect();
            spare.into_iter().for_each(|block| self.drop(block));
            self.take(piece)
        })
    }

    fn take(&mut self, piece: &Piece) -> Option<[Range<u32>; 2]> {
        let vertices = self.free_vertices.allocate_range(piece.vertices.len() as u32).ok()?;
        let Ok(indices) = self.free_indices.allocate_range(piece.indices.len() as u32) else {
            self.free_vertices.free_range(vertices);
            return None;
        };
        Some([vertices, indices])
    }

    fn drop(&mut self, block: usize) {
        if let Some(patch) = self.of_blocks[block].take().filter(|patch| !patch.indices.is_empty()) {
            self.free_vertices.free_range(patch.vertices);
            self.free_indices.free_range(patch.indices);
        }
    }
}

fn usizes(range: &Range<u32>) -> Range<usize> {
    range.start as usize..range.end as usize
}

/// Bytes of so many vertices and indices.
pub fn bytes(vertices: usize, indices: usize) -> usize {
    vertices * size_of::<ExplicitVertex>() + indices * size_of::<u32>()
}

/// Whether a piece is what a patch has on the device already.
fn holds(geometry: &Geometry, patch: &Patch, piece: &Piece) -> bool {
    let vertices = &geometry.vertices[usizes(&patch.vertices)];
    cast_slice::<_, u8>(vertices) == cast_slice::<_, u8>(&piece.vertices)
        && geometry.indices[usizes(&patch.indices)] == piece.indices
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::height::synth::{self, Kind};
    use crate::lod::sphere_tree::lattice::Lattice;

    const ROOTS: [[Place; 3]; 1] = [[[32, 0], [0, 0], [32, 32]]];

    fn blocks() -> Blocks {
        let field = synth::synth(Kind::Fractal, [129, 129], 3);
        Blocks::new(&field, &Lattice::new([128, 128]))
    }

    fn piece(vertices: usize, height: f32) -> Piece {
        let vertex = ExplicitVertex { height, ..ExplicitVertex::default() };
        Piece { vertices: vec![vertex; vertices], indices: vec![0; 3 * vertices] }
    }

    fn patches(vertices: usize) -> Patches {
        Patches::new(16, &Limits { vertices, indices: 3 * vertices, ..Limits::default() })
    }

    /// Says whether there was room, and how much was sent.
    fn keep(patches: &mut Patches, block: usize, piece: &Piece, blocks: &Blocks) -> (bool, usize) {
        let mut uploads = Vec::new();
        (patches.keep((block, ROOTS.to_vec()), piece, blocks, &mut uploads), uploads.len())
    }

    #[test]
    fn what_came_out_the_same_is_not_sent_again() {
        let (blocks, mut patches) = (blocks(), patches(100));
        let all = Changes { all: true, middles: Vec::new() };
        patches.begin(&all, false, &blocks);
        assert_eq!(keep(&mut patches, 5, &piece(40, 1.0), &blocks), (true, 2));
        assert_eq!(patches.of(5, &ROOTS), Some((0, 0..120)));
        patches.begin(&all, false, &blocks);
        assert_eq!(patches.of(5, &ROOTS), None);
        assert_eq!(keep(&mut patches, 5, &piece(40, 1.0), &blocks), (true, 0));
        patches.begin(&all, false, &blocks);
        assert_eq!(keep(&mut patches, 5, &piece(40, 2.0), &blocks), (true, 2));
        assert_eq!(patches.geometry().vertices[39].height, 2.0);
    }

    /// A diamond on the line between two blocks changes both, one inside changes its own.
    #[test]
    fn what_changed_is_stale_and_nothing_else() {
        let (blocks, mut patches) = (blocks(), patches(1000));
        patches.begin(&Changes::default(), false, &blocks);
        (0..16).for_each(|block| assert!(keep(&mut patches, block, &piece(20, 1.0), &blocks).0));
        for (middle, stale) in [([32, 8], vec![0, 1]), ([33, 33], vec![5]), ([8, 64], vec![4, 8]), ([0, 40], vec![4])] {
            patches.begin(&Changes { all: false, middles: vec![middle] }, false, &blocks);
            let found: Vec<_> = (0..16).filter(|&block| patches.of(block, &ROOTS).is_none()).collect();
            assert_eq!(found, stale, "{middle:?}");
            stale.into_iter().for_each(|block| assert!(keep(&mut patches, block, &piece(20, 1.0), &blocks).0));
        }
        assert_eq!(patches.of(5, &[]), None, "under other wedges");
    }

    /// What does not fit is streamed; what is out of sight gives way first. Nothing overlaps and nothing leaks.
    #[test]
    fn a_full_device_streams_the_rest() {
        let (mut blocks, mut patches) = (blocks(), patches(100));
        blocks.see(&(0..8).collect::<Vec<_>>());
        patches.begin(&Changes::default(), false, &blocks);
        assert!(keep(&mut patches, 9, &piece(40, 1.0), &blocks).0, "out of sight");
        assert!(keep(&mut patches, 0, &piece(40, 1.0), &blocks).0);
        patches.begin(&Changes::default(), false, &blocks);
        assert!(keep(&mut patches, 1, &piece(40, 1.0), &blocks).0);
        assert_eq!(patches.of(9, &ROOTS), None);
        assert_eq!(keep(&mut patches, 2, &piece(40, 1.0), &blocks), (false, 0));
        assert!(!patches.waits(), "it will not fit in the next frame");
        let [a, b] = [0, 1].map(|block| patches.of(block, &ROOTS).unwrap().1);
        assert!(a.end <= b.start || b.end <= a.start);
        for round in 0..100 {
            patches.begin(&Changes { all: true, middles: Vec::new() }, false, &blocks);
            assert!(keep(&mut patches, round % 8, &piece(90, round as f32), &blocks).0);
        }
    }

    #[test]
    fn a_frame_s_uploads_end_and_the_rest_waits() {
        let (blocks, mut patches) = (blocks(), patches(4 * UPLOAD_BYTES / 40));
        patches.begin(&Changes::default(), false, &blocks);
        let large = piece(UPLOAD_BYTES / 60, 1.0);
        assert!(keep(&mut patches, 0, &large, &blocks).0);
        assert_eq!((keep(&mut patches, 1, &large, &blocks), patches.waits()), ((false, 0), true));
        patches.begin(&Changes::default(), false, &blocks);
        assert_eq!((keep(&mut patches, 1, &large, &blocks), patches.waits()), ((true, 2), false));
        assert!(patches.of(0, &ROOTS).is_some());
    }
}
