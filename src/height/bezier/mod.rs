//! Procedural terrain: an array of Bézier patches with layers of displacement, evaluated at any position, with bounds
//! for any area.
//!
//! After J. Blow, "Terrain Rendering at High Levels of Detail" (2000), §1.1: "a two-dimensional array of Bezier patches,
//! on which are layered procedurally-generated displacement maps". Here each layer is itself an array of bicubic
//! patches, half as wide as those of the layer before ([`layer`]), so that one rule bounds them all: a patch lies
//! within the hull of its control points, and so do its derivatives within that of theirs (G. Farin, "Curves and
//! Surfaces for CAGD", §4 and §5). Roughness changes slowly from place to place.
//!
//! Bounds of an area are within those of any area around it. Heights are the same on every machine: + − × ÷ and floor of
//! f64.

mod area;
pub mod layer;

use self::layer::{Layer, Ranges};

pub use self::area::Area;

/// Side of the terrain, metres.
pub const SIDE_M: f64 = 524_288.0;
/// Smallest distance of vertices, metres.
pub const SPACING_M: f64 = 1.0 / 1024.0;
/// Lattice positions along a side, [`SPACING_M`] apart.
pub const LATTICE: u32 = (SIDE_M / SPACING_M) as u32 + 1;
/// Number of displacement layers whose patches are at least 2 lattice steps wide.
pub const LAYERS: u32 = 24;
/// Width of the large patches, and heights of their control points, metres.
const PATCH_M: f64 = 65_536.0;
const RELIEF_M: [f64; 2] = [0.0, 3600.0];
/// Width of the patches of the first displacement layer and heights of their control points, ±, metres.
const FIRST_M: f64 = 16_384.0;
const FIRST_HEIGHT_M: f64 = 3600.0;
/// Ratio of the heights of a layer to those of the one before, whose patches are twice as wide: slopes hardly fade.
const GAIN: f64 = 0.47;
/// Range of the roughness, a factor of the displacement, and the width of its patches, metres.
const ROUGHNESS: [f64; 2] = [0.1, 1.0];
const ROUGHNESS_M: f64 = 131_072.0;

/// Most layers of displacement: f64 positions do not resolve the patches of further ones.
pub const MAX_LAYERS: u32 = 40;

/// Procedural terrain.
#[derive(Clone, Debug, PartialEq)]
pub struct Bezier {
    patches: Layer,
    roughness: Layer,
    displacement: Vec<Layer>,
}

/// Bounds of the terrain over an area.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Lowest and highest, metres.
    pub height_m: [f64; 2],
    /// Largest vertical distance, metres, from any right triangle in the area whose corners lie on the terrain and whose
    /// longest side is the requested one.
    pub deviation_m: f64,
    /// Largest change of height, metres, along a path in the area whose first step is the longest side over √8 and whose
    /// further steps are each shorter by √2.
    pub way_m: f64,
}

impl Bezier {
    /// Makes the terrain of a seed with `layers` layers of displacement, at most [`MAX_LAYERS`]. Each has patches half as wide
    /// as the one before.
    pub fn new(seed: u64, layers: u32) -> Self {
        let layer = |k: u32| {
            let (width_m, height_m) = (FIRST_M * 0.5f64.powi(k as i32), FIRST_HEIGHT_M * GAIN.powi(k as i32));
            Layer::new(seed.wrapping_add(2 + u64::from(k)), width_m, [-height_m, height_m])
        };
        Self {
            patches: Layer::new(seed, PATCH_M, RELIEF_M),
            roughness: Layer::new(seed.wrapping_add(1), ROUGHNESS_M, ROUGHNESS),
            displacement: (0..layers.min(MAX_LAYERS)).map(layer).collect(),
        }
    }

    /// Returns the height at a position, metres.
    pub fn height(&self, at: [f64; 2]) -> f64 {
        let displacement: f64 = self.displacement.iter().map(|layer| layer.value(at)).sum();
        self.patches.value(at) + self.roughness.value(at) * displacement
    }

    /// Returns the slopes (x, z) at a position, of the layers whose patches are at least `width_m` wide. Layers narrower
    /// than a pixel would only alias.
    pub fn slopes(&self, at: [f64; 2], width_m: f64) -> [f64; 2] {
        let (base, rough) = (self.patches.slopes(at), self.roughness.slopes(at));
        let roughness = self.roughness.value(at);
        let wide = || self.displacement.iter().filter(|layer| layer.width_m() >= width_m);
        let displacement: f64 = wide().map(|layer| layer.value(at)).sum();
        let displaced = wide().map(|layer| layer.slopes(at)).fold([0.0; 2], |sum, s| [sum[0] + s[0], sum[1] + s[1]]);
        [0, 1].map(|k| base[k] + rough[k] * displacement + roughness * displaced[k])
    }

    /// Returns bounds over an area, for triangles with this longest side, metres.
    pub fn bounds(&self, area: &Area, longest_m: f64) -> Bounds {
        let (base, rough) = (self.patches.ranges(area), self.roughness.ranges(area));
        let mut bounds =
            Bounds { height_m: base.value, deviation_m: deviation(&base, longest_m), way_m: way(&base, longest_m) };
        for layer in &self.displacement {
            let product = product(&rough, &layer.ranges(area));
            bounds.height_m = [0, 1].map(|k| bounds.height_m[k] + product.value[k]);
            bounds.deviation_m += deviation(&product, longest_m);
            bounds.way_m += way(&product, longest_m);
        }
        bounds
    }

    /// Returns bounds of all heights, metres.
    pub fn range_m(&self) -> [f64; 2] {
        let max: f64 = self.displacement.iter().map(|layer| layer.ends()[1] * ROUGHNESS[1]).sum();
        [RELIEF_M[0] - max, RELIEF_M[1] + max]
    }
}

/// Returns a bound of a function's distance from its linear interpolation over a right triangle.
///
/// It is the largest second derivative times R²/2, with R half the longest side (S. Waldron, "The error in linear
/// interpolation at the vertices of a simplex", 1998), and at most the width of the function's range.
fn deviation(ranges: &Ranges, longest_m: f64) -> f64 {
    (ranges.bend * longest_m * longest_m / 8.0).min(ranges.width())
}

/// Returns [`Bounds::way_m`] of a function: each step changes it by at most its largest slope, and by at most the width
/// of its range.
fn way(ranges: &Ranges, longest_m: f64) -> f64 {
    let (mut way, mut step) = (0.0, longest_m / 8f64.sqrt());
    while ranges.slope * step > ranges.width() {
        (way, step) = (way + ranges.width(), step * 0.5f64.sqrt());
    }
    way + ranges.slope * step / (1.0 - 0.5f64.sqrt())
}

/// Returns the ranges of a product: derivatives by the product rule, from the largest absolute values.
fn product(a: &Ranges, b: &Ranges) -> Ranges {
    let ends = [a.value[0] * b.value[0], a.value[0] * b.value[1], a.value[1] * b.value[0], a.value[1] * b.value[1]];
    let largest = |[low, high]: [f64; 2]| low.abs().max(high.abs());
    let (of_a, of_b) = (largest(a.value), largest(b.value));
    Ranges {
        value: [ends.into_iter().fold(f64::INFINITY, f64::min), ends.into_iter().fold(f64::NEG_INFINITY, f64::max)],
        slope: a.slope * of_b + of_a * b.slope,
        bend: a.bend * of_b + 2.0 * a.slope * b.slope + of_a * b.bend,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn place(dice: &mut fastrand::Rng) -> [f64; 2] {
        [dice.f64() * SIDE_M, dice.f64() * SIDE_M]
    }

    /// A right isosceles triangle in an area: its right angle and the ends of its longest side.
    fn triangle(at: [f64; 2], side_m: f64, turned: bool) -> [[f64; 2]; 3] {
        let [x, z] = at;
        if turned {
            [[x, z], [x + side_m, z + side_m], [x - side_m, z + side_m]]
        } else {
            [[x, z], [x + side_m, z], [x, z + side_m]]
        }
    }

    /// Random points over triangles of all sizes, down to the resolution of f64, lie within the bounds, and some come near
    /// them. With few layers small triangles are bounded by second derivatives alone.
    #[test]
    fn nothing_lies_beyond_its_bounds_at_any_depth() {
        for (layers, depths) in [(MAX_LAYERS, 0..47), (3, 0..19)] {
            let (terrain, mut dice) = (Bezier::new(5, layers), fastrand::Rng::with_seed(1));
            for depth in depths.step_by(2) {
                let side_m = SIDE_M / 2f64.powi(depth + 1);
                let mut shares: Vec<f64> =
                    (0..60).map(|k| found_share(&terrain, side_m, k % 2 == 0, &mut dice)).collect();
                shares.sort_by(f64::total_cmp);
                println!("{layers} layers, {side_m:.1e} m: {:.3} of the bound is found", shares[30]);
                // Below a micrometre rounding hides what is found.
                assert!(shares[59] > 0.1 || side_m < 1e-4, "depth {depth}: {} of the bound at most", shares[59]);
            }
        }
    }

    /// Returns the largest distance found from a random triangle, as a share of its bound.
    fn found_share(terrain: &Bezier, side_m: f64, turned: bool, dice: &mut fastrand::Rng) -> f64 {
        // Rounding: of the sum of the layers, and of the place where it is steep.
        const ROUNDING_M: f64 = 1e-9;
        let corners = triangle(place(dice), side_m, turned);
        let longest_m = side_m * if turned { 2.0 } else { 2f64.sqrt() };
        let ends = |k: usize, min: f64, of: fn(f64, f64) -> f64| corners.iter().map(|c| c[k]).fold(min, of);
        let area = Area {
            min: [0, 1].map(|k| ends(k, f64::INFINITY, f64::min)),
            max: [0, 1].map(|k| ends(k, f64::NEG_INFINITY, f64::max)),
        };
        let (bounds, heights) = (terrain.bounds(&area, longest_m), corners.map(|c| terrain.height(c)));
        let mut furthest = 0.0f64;
        for _ in 0..200 {
            let (mut u, mut v) = (dice.f64(), dice.f64());
            if u + v > 1.0 {
                (u, v) = (1.0 - u, 1.0 - v);
            }
            let mix = |[a, b, c]: [f64; 3]| a + u * (b - a) + v * (c - a);
            let height = terrain.height([0, 1].map(|k| mix(corners.map(|c| c[k]))));
            assert!(height >= bounds.height_m[0] - ROUNDING_M && height <= bounds.height_m[1] + ROUNDING_M);
            furthest = furthest.max((height - mix(heights)).abs() - ROUNDING_M);
        }
        assert!(furthest <= bounds.deviation_m, "{side_m} m: {furthest} m of {bounds:?}");
        furthest / bounds.deviation_m
    }

    #[test]
    fn bounds_of_a_part_are_within_those_of_the_whole() {
        let (terrain, mut dice) = (Bezier::new(9, 30), fastrand::Rng::with_seed(2));
        for _ in 0..2000 {
            let reach_m = SIDE_M * 0.5f64.powi(dice.i32(1..40));
            let (at, part) = (place(&mut dice), dice.f64());
            let shift = |dice: &mut fastrand::Rng| (2.0 * dice.f64() - 1.0) * reach_m * (1.0 - part);
            let inner = [at[0] + shift(&mut dice), at[1] + shift(&mut dice)];
            let whole = terrain.bounds(&Area::about(at, reach_m), reach_m);
            let bounds = terrain.bounds(&Area::about(inner, reach_m * part), reach_m * dice.f64());
            assert!(bounds.deviation_m <= whole.deviation_m * (1.0 + 1e-12), "{bounds:?} in {whole:?}");
            let spare = 1e-9;
            assert!(bounds.height_m[0] >= whole.height_m[0] - spare && bounds.height_m[1] <= whole.height_m[1] + spare);
            assert!(
                whole.height_m[0] >= terrain.range_m()[0] - spare && whole.height_m[1] <= terrain.range_m()[1] + spare
            );
        }
    }

    #[test]
    fn slopes_are_those_of_the_heights() {
        let (terrain, mut dice) = (Bezier::new(3, 12), fastrand::Rng::with_seed(3));
        for _ in 0..300 {
            let at = place(&mut dice);
            let slopes = terrain.slopes(at, 0.0);
            let step = 1e-3;
            let rise = [[step, 0.0], [0.0, step]]
                .map(|[x, z]| terrain.height([at[0] + x, at[1] + z]) - terrain.height([at[0] - x, at[1] - z]));
            for k in 0..2 {
                assert!((slopes[k] - rise[k] / (2.0 * step)).abs() < 1e-5, "{slopes:?}, {rise:?}");
            }
        }
    }
}
