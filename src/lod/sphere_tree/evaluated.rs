//! Sizes of diamonds of a procedural terrain, computed from its analytic bounds on demand and cached.
//!
//! Errors and balls are nested as the measured ones are ([`measure`](super::measure)), without visiting descendants.
//! All descendants of a cell's diamond of half length h lie within 3 h of its middle along the axes; those of a side's
//! within 2 h. Bounds of a part are within those of the whole, so errors are nested. The middles of parent and child
//! are h apart from a cell's and h/√2 from a side's, and steps shrink by √2. A ball whose radius is the length of all
//! following steps, plus the maximum change of height along them ([`Bounds::way_m`](crate::height::bezier::Bounds)),
//! therefore contains the children's balls.

use std::sync::{Arc, PoisonError, RwLock};

use rayon::prelude::*;

use super::by_index::ByIndex;
use super::diamond_info::SPARE;
use super::lattice::{Place, half_length};
use crate::height::bezier::{Area, Bezier, SPACING_M};
use crate::height::bounds::ROUNDING;

/// Number of cache shards, and the maximum number of diamonds in each. Shards reduce lock contention.
const PARTS: usize = 64;
const MAX_CACHED: usize = 1 << 15;

/// Error and extent of a diamond, metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Size {
    /// Height of its middle.
    pub height: f64,
    /// Largest distance from the terrain of its unsplit triangles and of all its descendants.
    pub error: f32,
    /// Radius of the ball about its middle that contains its part of the terrain and its descendants' balls.
    pub ball: f32,
}

/// Cache of the sizes of a terrain's diamonds.
pub struct Evaluated {
    terrain: Arc<Bezier>,
    /// Maximum rounding error of a vertex's height in single precision, relative to its distance from the eye.
    pub rounding: f64,
    parts: Vec<RwLock<ByIndex<Size>>>,
}

impl Evaluated {
    /// Creates an empty cache. `fades` adds the rounding error of vertices that fade in.
    pub fn new(terrain: Arc<Bezier>, fades: bool) -> Self {
        // Fading interpolates two heights, with more roundings than one conversion.
        let rounding = f64::from(if fades { ROUNDING } else { f32::EPSILON });
        Self { terrain, rounding, parts: (0..PARTS).map(|_| RwLock::default()).collect() }
    }

    fn part(&self, index: usize) -> &RwLock<ByIndex<Size>> {
        &self.parts[(index ^ index >> 20) % PARTS]
    }

    /// Returns the sizes of a diamond, computing them if they are not cached.
    pub fn size(&self, at: Place, index: usize) -> Size {
        let part = self.part(index);
        if let Some(size) = part.read().unwrap_or_else(PoisonError::into_inner).get(&(index as u64)) {
            return *size;
        }
        let size = self.compute(at);
        let mut part = part.write().unwrap_or_else(PoisonError::into_inner);
        if part.len() == MAX_CACHED {
            part.clear();
        }
        part.insert(index as u64, size);
        size
    }

    /// Computes in parallel the sizes of diamonds that are not cached.
    pub fn precompute(&self, diamonds: &[(Place, usize)]) {
        diamonds.par_iter().with_min_len(16).for_each(|&(at, index)| {
            self.size(at, index);
        });
    }

    /// Returns the number of cached diamonds.
    pub fn cached(&self) -> usize {
        self.parts.iter().map(|part| part.read().unwrap_or_else(PoisonError::into_inner).len()).sum()
    }

    fn compute(&self, at: Place) -> Size {
        let half = half_length(at);
        let is_cell = at.iter().all(|n| n & half != 0);
        let half_m = f64::from(half) * SPACING_M;
        let (reach, longest_m) = if is_cell { (3.0, 8f64.sqrt() * half_m) } else { (2.0, 2.0 * half_m) };
        let place = at.map(|n| f64::from(n) * SPACING_M);
        let bounds = self.terrain.bounds(&Area::about(place, reach * half_m), longest_m);
        let steps_m = longest_m / 8f64.sqrt() / (1.0 - 0.5f64.sqrt());
        let ball = (steps_m + bounds.way_m) * (1.0 + SPARE);
        // Corners are up to two balls further from the eye than the points between them.
        let rounding_m = 2.0 * ball * self.rounding;
        Size {
            height: self.terrain.height(place),
            error: ((bounds.deviation_m + rounding_m) as f32).next_up(),
            ball: (ball as f32).next_up(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::height::bezier::LATTICE;
    use crate::lod::sphere_tree::lattice::{Diamond, Lattice};

    fn random_place(dice: &mut fastrand::Rng, level: u32) -> Place {
        loop {
            let at = [0, 1].map(|_| dice.i32(1..(1 << (29 - level))) << level);
            if half_length(at) == 1 << level {
                return at;
            }
        }
    }

    /// Checks random diamonds from the root to the finest level.
    #[test]
    fn errors_and_balls_are_nested_at_every_depth() {
        let evaluated = Evaluated::new(Arc::new(Bezier::new(7, 24)), true);
        let (lattice, mut dice) = (Lattice::new([LATTICE as i32 - 1; 2]), fastrand::Rng::with_seed(4));
        let spot = |at: Place, size: &Size| {
            glam::DVec3::new(f64::from(at[0]) * SPACING_M, size.height, f64::from(at[1]) * SPACING_M)
        };
        for level in (0..29).flat_map(|level| std::iter::repeat_n(level, 40)) {
            let at = random_place(&mut dice, level);
            let parent = evaluated.size(at, lattice.index(at).expect("a diamond"));
            for (child_at, index) in lattice.children(at) {
                let child = evaluated.size(child_at, index);
                let reach = spot(at, &parent).distance(spot(child_at, &child)) + f64::from(child.ball);
                assert!(reach <= f64::from(parent.ball), "{at:?}: {child:?} in {parent:?}");
                assert!(child.error <= parent.error, "{at:?}: {child:?} in {parent:?}");
            }
        }
    }

    /// Checks random points of random diamonds against the error of the drawn triangle and the ball.
    #[test]
    fn the_terrain_is_within_a_diamond_s_error_at_every_depth() {
        let terrain = Arc::new(Bezier::new(7, 24));
        let (evaluated, mut dice) = (Evaluated::new(Arc::clone(&terrain), false), fastrand::Rng::with_seed(6));
        let lattice = Lattice::new([LATTICE as i32 - 1; 2]);
        for level in 0..29 {
            let mut worst = 0f64;
            for _ in 0..30 {
                let at = random_place(&mut dice, level);
                let size = evaluated.size(at, lattice.index(at).expect("a diamond"));
                let Diamond { ends, apexes } = Diamond::around(at);
                // Heights are rounded relative to an eye beside the diamond.
                let drawn = [apexes[0], ends[0], ends[1]].map(|p| {
                    let plan = p.map(|n| f64::from(n) * SPACING_M);
                    [plan[0], plan[1], size.height + f64::from((terrain.height(plan) - size.height) as f32)]
                });
                for _ in 0..100 {
                    let (mut u, mut v) = (dice.f64(), dice.f64());
                    if u + v > 1.0 {
                        (u, v) = (1.0 - u, 1.0 - v);
                    }
                    let [a, b, c] = drawn;
                    let [x, z, y] = [0, 1, 2].map(|k| a[k] + u * (b[k] - a[k]) + v * (c[k] - a[k]));
                    let height = terrain.height([x, z]);
                    assert!((height - y).abs() <= f64::from(size.error), "level {level}: {size:?}");
                    let middle = at.map(|n| f64::from(n) * SPACING_M);
                    let from_middle = (x - middle[0]).hypot(z - middle[1]).hypot(height - size.height);
                    assert!(from_middle <= f64::from(size.ball), "level {level}: {size:?}");
                    worst = worst.max((height - y).abs() / f64::from(size.error));
                }
            }
            println!("level {level}: up to {worst:.3} of the error is found");
            assert!(worst > 0.01, "level {level}: the error is {:.0} times what is found", 1.0 / worst);
        }
    }
}
