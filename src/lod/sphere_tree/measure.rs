//! Measures all diamonds in advance: their error against the samples, and the ball that contains all they cover.
//!
//! Both are nested: a diamond's error is at least its children's, and its ball contains theirs. A sphere's radius is
//! the ball's plus a term that grows with the error, so a diamond's sphere contains its children's in every view. No
//! diamond splits before its parents. P. Lindstrom and V. Pascucci, "Visualization of Large Terrains Made Easy" (2001),
//! §4, nest the spheres of vertices in the same way.

use std::sync::Arc;

use glam::DVec3;
use rayon::prelude::*;

use super::diamond_info::{DiamondInfo, SPARE};
use super::evaluated::{Evaluated, Size};
use super::lattice::{Diamond, Lattice, Place};
use super::reach::Reach;
use crate::height::Field;
use crate::height::bounds::ROUNDING;
use crate::height::progress::Progress;
use crate::height::surface::{self, Corner};
use crate::view::{Tolerance, View};

/// A field with its measured diamonds.
pub struct Measured {
    /// Heights.
    pub field: Arc<Field>,
    /// Diamonds.
    pub lattice: Lattice,
    /// Largest distance of an unsplit diamond's triangles from the samples, metres, by index; infinite if it always
    /// splits.
    errors: Vec<f32>,
    /// Radius of the ball about the middle, metres, by index.
    balls: Vec<f32>,
    /// Multiple of the radius from which vertices fade in; 1 if they do not.
    band: f32,
    /// Maximum rounding error of vertices that fade in, metres.
    rounding: f32,
    /// Replaces errors and balls for procedural terrain, which has no samples.
    evaluated: Option<Evaluated>,
}

impl Measured {
    /// Measures all diamonds, level by level in parallel. `band` is the multiple of a sphere's radius from which
    /// vertices fade in. The vertex of a diamond that extends beyond the field does not fade; its parents' spheres are
    /// larger by `band`, so that the vertices it depends on have fully faded in.
    pub fn new(field: Arc<Field>, band: f32, progress: &Progress) -> Self {
        let lattice = Lattice::new(field.size().map(|n| n as i32 - 1));
        if let Some(terrain) = field.procedural() {
            let evaluated = Some(Evaluated::new(Arc::clone(terrain), band > 1.0));
            let (errors, balls) = (Vec::new(), Vec::new());
            return Self { errors, balls, field, lattice, band, rounding: 0.0, evaluated };
        }
        let range = field.statistics();
        let rounding = if band > 1.0 { range.min.abs().max(range.max.abs()) * ROUNDING } else { 0.0 };
        let nothing = || vec![0.0; lattice.size()];
        let mut measured =
            Self { errors: nothing(), balls: nothing(), field, lattice, band, rounding, evaluated: None };
        // Each level reads all samples.
        let rows = |level: u32| (measured.lattice.count(level)[1] as u64) << level;
        progress.expect((0..measured.lattice.levels()).map(|level| 2 * rows(level)).sum());
        for level in 0..measured.lattice.levels() {
            // Sides before cells, because a cell's children are its sides.
            measured.measure_level(level, progress, |i, j| (i ^ j) & 1 == 1);
            measured.measure_level(level, progress, |i, j| i & j & 1 == 1);
        }
        measured
    }

    fn measure_level(&mut self, level: u32, progress: &Progress, is_selected: impl Fn(i32, i32) -> bool + Sync) {
        let [x_count, z_count] = self.lattice.count(level);
        let of_row = |j: i32| {
            let row = (0..x_count).filter(|&i| is_selected(i, j));
            let row = row.map(|i| self.measure([i << level, j << level])).collect::<Vec<_>>();
            progress.advance(1 << level);
            row
        };
        let rows: Vec<_> = (0..z_count).into_par_iter().map(of_row).collect();
        for (index, error, ball) in rows.into_iter().flatten() {
            self.errors[index] = error;
            self.balls[index] = ball;
        }
    }

    /// Returns the index, error and ball of a diamond whose children are measured. The ball contains all samples under
    /// its wedges, also where these collapse: a side's diamond includes the balls of the cells it overlaps.
    fn measure(&self, middle: Place) -> (usize, f32, f32) {
        let index = self.lattice.index(middle).expect("a place of the level");
        let Diamond { ends, apexes } = Diamond::around(middle);
        let centre = self.centre(middle);
        let always_splits = self.lattice.always_splits(middle);
        let sticks_out = self.lattice.sticks_out(middle);
        let (mut error, mut ball) = (if always_splits { f32::INFINITY } else { 0.0 }, 0.0f64);
        for apex in apexes.into_iter().filter(|&apex| self.lattice.contains(apex)) {
            let corners = [apex, ends[0], ends[1]];
            ball = corners.map(|at| self.centre(at).distance(centre)).into_iter().fold(ball, f64::max);
            if !always_splits {
                error = error.max(self.deviation(corners));
            }
        }
        if error > 0.0 {
            error += self.rounding;
        }
        for (at, child) in self.lattice.children(middle) {
            let growth = if !sticks_out && self.lattice.sticks_out(at) { self.band } else { 1.0 };
            error = error.max(self.errors[child] * growth);
            ball = ball.max(self.centre(at).distance(centre) + f64::from(self.balls[child] * growth));
        }
        (index, error, ((ball * (1.0 + SPARE)) as f32).next_up())
    }

    /// Returns the largest distance of a triangle from its samples, metres; 0 if it collapses.
    fn deviation(&self, corners: [Place; 3]) -> f32 {
        let [a, b, c] = corners.map(|at| {
            let [x, z] = self.lattice.on_field(at);
            Corner { x, z, y: self.field.height(x as u32, z as u32) }
        });
        match surface::doubled_area(&[a, b, c]) {
            0 => 0.0,
            area if area > 0 => surface::deviation(&self.field, &[a, b, c]),
            _ => surface::deviation(&self.field, &[a, c, b]),
        }
    }

    /// Returns the height of a vertex, metres.
    #[inline]
    pub fn height(&self, at: Place) -> f64 {
        if let (Some(evaluated), Some(index)) = (&self.evaluated, self.lattice.index(at)) {
            return evaluated.size(at, index).height;
        }
        let [x, z] = self.lattice.on_field(at);
        f64::from(self.field.height(x as u32, z as u32))
    }

    /// Returns a vertex relative to the field's first sample, metres.
    #[inline]
    fn centre(&self, at: Place) -> DVec3 {
        let [x, z] = self.lattice.on_field(at);
        let [dx, dz] = self.field.spacing;
        DVec3::new(f64::from(x) * dx, f64::from(self.field.height(x as u32, z as u32)), f64::from(z) * dz)
    }

    /// Returns a world position relative to the field's first sample, metres.
    pub fn relative(&self, point: DVec3) -> DVec3 {
        point - DVec3::new(self.field.origin[0], 0.0, self.field.origin[1])
    }

    /// Returns a diamond's data.
    #[inline]
    pub fn diamond(&self, at: Place, index: usize) -> DiamondInfo {
        if let Some(evaluated) = &self.evaluated {
            let Size { height, error, ball } = evaluated.size(at, index);
            let [x, z] = [0, 1].map(|k| f64::from(at[k]) * self.field.spacing[k]);
            return DiamondInfo { index, centre: DVec3::new(x, height, z), error, ball };
        }
        DiamondInfo { index, centre: self.centre(at), error: self.errors[index], ball: self.balls[index] }
    }

    /// Returns true if a diamond has a sphere. Returns true for every diamond of a procedural terrain.
    #[inline]
    pub fn has_sphere(&self, reach: &Reach, index: usize) -> bool {
        self.is_endless() || reach.has_sphere(self.errors[index])
    }

    /// Returns true for procedural terrain, whose diamonds are too many to store.
    #[inline]
    pub fn is_endless(&self) -> bool {
        self.evaluated.is_some()
    }

    /// Returns the view with its tolerance reduced by the rounding error of vertices; `None` if nothing is left.
    pub fn without_rounding(&self, view: &View) -> Option<View> {
        let (Some(evaluated), Some(terrain)) = (&self.evaluated, self.field.procedural()) else { return Some(*view) };
        let [low, high] = terrain.range_m();
        let px = view.tolerance.px - Reach::rounding_px(view, evaluated.rounding, high - low);
        (px > 0.0).then_some(View { tolerance: Tolerance { px, ..view.tolerance }, ..*view })
    }

    /// Precomputes the sizes of diamonds in parallel on procedural terrain.
    pub fn precompute(&self, diamonds: &[(Place, usize)]) {
        if let Some(evaluated) = &self.evaluated {
            evaluated.precompute(diamonds);
        }
    }

    /// Returns the memory for errors and balls, bytes.
    pub fn bytes(&self) -> usize {
        let evaluated = self.evaluated.as_ref().map_or(0, |evaluated| evaluated.cached() * size_of::<(u64, Size)>());
        size_of_val(self.errors.as_slice()) + size_of_val(self.balls.as_slice()) + evaluated
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::height::{Holes, Samples};

    fn field(size: [u32; 2]) -> Arc<Field> {
        let height = |k: u32| ((k * 7919) % 1009) as f32 * 0.1 + (k % size[0]) as f32;
        let heights = (0..size[0] * size[1]).map(height).collect();
        Arc::new(Field::new(Samples::F32(heights), size, [2.0, 3.0], Holes::none((size[0] * size[1]) as usize)))
    }

    /// Calls `visit` for every diamond.
    fn each(measured: &Measured, mut visit: impl FnMut(Place, DiamondInfo)) {
        for level in 0..measured.lattice.levels() {
            let [x_count, z_count] = measured.lattice.count(level);
            for (i, j) in (0..z_count).flat_map(|j| (0..x_count).map(move |i| (i, j))).filter(|(i, j)| (i | j) & 1 == 1)
            {
                let at = [i << level, j << level];
                visit(at, measured.diamond(at, measured.lattice.index(at).expect("a diamond")));
            }
        }
    }

    #[test]
    fn errors_and_balls_are_nested_at_any_size() {
        for (size, band) in [([33, 33], 1.0), ([33, 33], 1.3), ([37, 21], 1.0), ([37, 21], 1.3), ([2, 30], 1.3)] {
            let measured = Measured::new(field(size), band, &Progress::default());
            let mut children = 0;
            each(&measured, |middle, parent| {
                let out = |at| measured.lattice.sticks_out(at);
                for (at, index) in measured.lattice.children(middle) {
                    let child = measured.diamond(at, index);
                    let growth = if !out(middle) && out(at) { band } else { 1.0 };
                    let reach = child.centre.distance(parent.centre) + f64::from(child.ball) * f64::from(growth);
                    assert!(reach <= f64::from(parent.ball) && child.error * growth <= parent.error, "{parent:?}");
                    assert!(measured.lattice.parents(at).any(|(_, index)| index == parent.index), "{child:?}");
                    children += 1;
                }
            });
            // Each diamond has two parents, except at the border and the root.
            assert!(children as u32 > size[0] * size[1]);
        }
    }

    #[test]
    fn balls_contain_every_sample_under_their_wedges() {
        let progress = Progress::default();
        let mut samples = check_samples(&Measured::new(field([37, 21]), 1.0, &progress));
        assert_eq!(progress.share(), Some(1.0));
        // Steep, so that a sample outside its wedge's ball is detected, and extending beyond the field by every length.
        for (w, h) in (20..40).flat_map(|w| [(w, 21), (w, 33), (13, w)]) {
            let size = [w, h];
            let heights = (0..w * h).map(|k| if (k * 7919) % 29 == 3 { 900.0 } else { 0.0 }).collect();
            let spiky = Field::new(Samples::F32(heights), size, [2.0, 3.0], Holes::none((w * h) as usize));
            samples += check_samples(&Measured::new(Arc::new(spiky), 1.0, &Progress::default()));
        }
        assert!(samples > 5000, "{samples} samples in wedges");
    }

    /// Checks the samples under every wedge against its ball and error. Returns the number of samples.
    fn check_samples(measured: &Measured) -> usize {
        let mut samples = 0;
        each(measured, |middle, diamond| {
            let Diamond { ends, apexes } = Diamond::around(middle);
            for apex in apexes.into_iter().filter(|&at| measured.lattice.contains(at)) {
                let mut corners = [apex, ends[0], ends[1]].map(|at| {
                    let [x, z] = measured.lattice.on_field(at);
                    Corner { x, z, y: measured.height(at) as f32 }
                });
                if surface::doubled_area(&corners) < 0 {
                    corners.swap(1, 2);
                }
                if surface::doubled_area(&corners) > 0 {
                    surface::visit_samples(&corners, |x, z, y| {
                        let sample = measured.centre([x as i32, z as i32]);
                        assert!(sample.distance(diamond.centre) <= f64::from(diamond.ball), "{diamond:?}");
                        assert!((y - sample.y).abs() <= f64::from(diamond.error), "{diamond:?}");
                        samples += 1;
                    });
                }
            }
        });
        samples
    }
}
