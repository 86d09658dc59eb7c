//! Sources of heights: the trait that terrain implements, whatever its samples come from.
//!
//! A source is a lattice of heights in sample steps. It has no position: [`Field`](super::Field) adds spacing, origin and
//! coordinate system. Implementations: [`Raster`], [`Tiled`](super::Tiled) and [`Procedural`](super::Procedural).

use std::fmt::Debug;
use std::sync::Arc;

use super::bezier::Bezier;
use super::raster::Raster;

/// A lattice of heights.
///
/// A call through the trait costs more than a read of a sample in memory. Loops over single samples therefore go through
/// [`Field`](super::Field), which reads the raster directly where its [coverage](Self::coverage) allows; blocks go through
/// [`Self::read`] and [`Self::range_of`].
pub trait HeightSource: Debug + Send + Sync {
    /// Returns the number of samples along (x, z), each at least 2.
    fn size(&self) -> [u32; 2];

    /// Returns the height of sample `(i, j)`, metres; always finite.
    fn height(&self, i: u32, j: u32) -> f32;

    /// Returns true if sample `(i, j)` has no data.
    fn is_hole(&self, i: u32, j: u32) -> bool;

    /// Returns the samples in memory, which the device receives.
    fn raster(&self) -> &Raster;

    /// Returns how [`Self::raster`] stands for the lattice.
    fn coverage(&self) -> Coverage;

    /// Returns a source of the same layout over another raster of the same size.
    fn with_raster(&self, raster: Raster) -> Arc<dyn HeightSource>;

    /// Appends the heights of a block, metres, row by row from the north.
    fn read(&self, block: &Block, heights: &mut Vec<f32>) {
        for j in block.along(1) {
            heights.extend(block.along(0).map(|i| self.height(i, j)));
        }
    }

    /// Returns the lowest and highest height, metres, of the samples between two lattice positions, both inclusive and
    /// holes included.
    fn range_of(&self, first: [u32; 2], last: [u32; 2]) -> [f32; 2] {
        let heights = (first[1]..=last[1]).flat_map(|j| (first[0]..=last[0]).map(move |i| self.height(i, j)));
        heights.fold([f32::INFINITY, f32::NEG_INFINITY], |[low, high], height| [low.min(height), high.max(height)])
    }

    /// Returns the lowest and highest height, metres, of everything that is drawn, holes excepted.
    fn range(&self) -> [f32; 2] {
        let statistics = self.raster().statistics();
        [statistics.min, statistics.max]
    }

    /// Returns the function that heights are evaluated from, if they are not stored.
    fn procedural(&self) -> Option<&Arc<Bezier>> {
        None
    }
}

impl HeightSource for Raster {
    fn size(&self) -> [u32; 2] {
        self.size()
    }

    fn height(&self, i: u32, j: u32) -> f32 {
        self.height(i, j)
    }

    fn is_hole(&self, i: u32, j: u32) -> bool {
        self.is_hole(i, j)
    }

    fn raster(&self) -> &Raster {
        self
    }

    fn coverage(&self) -> Coverage {
        Coverage::Whole
    }

    fn with_raster(&self, raster: Raster) -> Arc<dyn HeightSource> {
        Arc::new(raster)
    }

    fn range_of(&self, first: [u32; 2], last: [u32; 2]) -> [f32; 2] {
        self.range_of(first, last)
    }
}

/// The relation of a source's raster to its lattice.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Coverage {
    /// The raster holds the whole lattice.
    Whole,
    /// The raster repeats along both axes.
    Periodic,
    /// The raster is a coarse preview, and heights come from [`HeightSource::height`].
    Preview,
}

/// A rectangle of samples, both ends inclusive, of which every `step`-th along both axes is taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Block {
    /// Lattice position of the north-west sample.
    pub first: [u32; 2],
    /// Lattice position of the south-east sample.
    pub last: [u32; 2],
    /// Lattice steps from one sample to the next, at least 1.
    pub step: u32,
}

impl Block {
    /// Returns the lattice positions along an axis: 0 is x, 1 is z.
    pub(super) fn along(&self, axis: usize) -> impl Iterator<Item = u32> + use<> {
        (self.first[axis]..=self.last[axis]).step_by(self.step as usize)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::height::{Field, Holes, Procedural, Samples, Tiled, bezier};

    /// A raster of floats, the same as codes, a tiled one and evaluated heights.
    fn sources() -> Vec<Arc<dyn HeightSource>> {
        let heights: Vec<f32> = (0..35u32).map(|k| (k * 7919 % 101) as f32).collect();
        let raster = |samples| Raster::new(samples, [7, 5], Holes::none(35));
        let [floats, codes] = [Samples::F32(heights.clone()), Samples::F32(heights).compacted()].map(raster);
        let tiled = Tiled::new(floats.clone(), [3, 4]);
        vec![
            Arc::new(floats),
            Arc::new(codes),
            Arc::new(tiled),
            Arc::new(Procedural::new(Arc::new(bezier::Bezier::new(7, 5)))),
        ]
    }

    #[test]
    fn blocks_and_ranges_agree_with_single_heights() {
        for source in sources() {
            let size = source.size();
            for (first, last, step) in [([0, 0], [6, 4], 1), ([2, 1], [5, 4], 2), ([3, 3], [3, 3], 1)] {
                let mut heights = vec![-1.0];
                source.read(&Block { first, last, step }, &mut heights);
                let rows = (first[1]..=last[1]).step_by(step as usize);
                let at = rows.flat_map(|j| (first[0]..=last[0]).step_by(step as usize).map(move |i| (i, j)));
                let expected: Vec<f32> = at.map(|(i, j)| source.height(i, j)).collect();
                assert_eq!(heights[1..], expected, "{first:?} to {last:?} of {size:?}");
                assert_eq!(heights[0], -1.0, "appends");
                if step == 1 {
                    let low = expected.iter().copied().fold(f32::INFINITY, f32::min);
                    let high = expected.iter().copied().fold(f32::NEG_INFINITY, f32::max);
                    assert_eq!(source.range_of(first, last), [low, high], "{first:?} to {last:?} of {size:?}");
                }
            }
        }
    }

    #[test]
    fn a_field_reads_what_its_source_says() {
        for source in sources() {
            let field = Field::of(Arc::clone(&source), [1.0; 2]);
            for (i, j) in (0..5).flat_map(|j| (0..7).map(move |i| (i, j))) {
                // The north-west and the south-east corner.
                for (i, j) in [(i, j), (source.size()[0] - 1 - i, source.size()[1] - 1 - j)] {
                    assert_eq!(field.height(i, j), source.height(i, j), "({i}, {j}) of {source:?}");
                    assert_eq!(field.is_hole(i, j), source.is_hole(i, j));
                }
            }
        }
    }
}
