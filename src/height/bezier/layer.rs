//! An endless array of bicubic patches of one width, whose control points come from a hash.
//!
//! Neighbouring patches share their control points as those of a uniform cubic B-spline do: the surface has continuous
//! second derivatives. In a patch that is the Bézier form with control points ((c₀ + 4c₁ + c₂)/6, (2c₁ + c₂)/3, …).

use super::area::Area;
use crate::height::synth::noise;

/// Most patches along an axis of an area that are bounded one by one; larger areas get the range of all control points.
const MAX_ALONG: i64 = 3;

/// One layer of patches.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Layer {
    seed: u64,
    width_m: f64,
    /// Smallest and largest control point.
    ends: [f64; 2],
}

/// Ranges of values and derivatives over an area.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ranges {
    /// Lowest and highest value.
    pub value: [f64; 2],
    /// The largest slope in any direction, per metre.
    pub slope: f64,
    /// The largest second derivative in any direction, per metre².
    pub bend: f64,
}

impl Ranges {
    /// Returns the width of the range of values.
    pub fn width(&self) -> f64 {
        self.value[1] - self.value[0]
    }
}

/// Rows of control points, four of a cubic along an axis or fewer of a derivative.
type Net<const X: usize, const Z: usize> = [[f64; X]; Z];

/// Bounds of the patches of an area, for patches of width 1.
#[derive(Clone, Copy)]
struct Hull {
    value: [f64; 2],
    /// Largest absolute values of ∂x, ∂z, ∂xx, ∂zz, ∂xz.
    largest: [f64; 5],
}

impl Layer {
    /// Makes the layer of a seed, with patches of this width, metres, and control points between two values.
    pub fn new(seed: u64, width_m: f64, ends: [f64; 2]) -> Self {
        Self { seed, width_m, ends }
    }

    /// Width of a patch, metres.
    pub fn width_m(&self) -> f64 {
        self.width_m
    }

    /// Returns the smallest and largest control point.
    pub fn ends(&self) -> [f64; 2] {
        self.ends
    }

    fn control(&self, x: i64, z: i64) -> f64 {
        let [low, high] = self.ends;
        low + (high - low) * (0.5 + 0.5 * noise::white(x, z, self.seed))
    }

    /// The sixteen B-spline coefficients of a patch, row by row.
    fn controls(&self, [x, z]: [i64; 2]) -> Net<4, 4> {
        [-1, 0, 1, 2].map(|dz| [-1, 0, 1, 2].map(|dx| self.control(x + dx, z + dz)))
    }

    /// Returns the patch at a place, and the position in it.
    fn patch(&self, at: [f64; 2]) -> ([i64; 2], [f64; 2]) {
        let share = at.map(|n| n / self.width_m);
        (share.map(|n| n.floor() as i64), share.map(|n| n - n.floor()))
    }

    /// Returns the value at a place.
    pub fn value(&self, at: [f64; 2]) -> f64 {
        let (patch, [u, v]) = self.patch(at);
        along(&self.controls(patch), weights(u), weights(v))
    }

    /// Returns the slopes at a place, per metre.
    pub fn slopes(&self, at: [f64; 2]) -> [f64; 2] {
        let (patch, [u, v]) = self.patch(at);
        let net = self.controls(patch);
        [along(&net, rates(u), weights(v)), along(&net, weights(u), rates(v))].map(|slope| slope / self.width_m)
    }

    /// Returns the ranges over an area.
    pub fn ranges(&self, area: &Area) -> Ranges {
        let (first, last) = (self.patch(area.min).0, self.patch(area.max).0);
        let is_wide = (0..2).any(|k| last[k] - first[k] >= MAX_ALONG);
        let hull = if is_wide { self.everywhere() } else { self.over(area, first, last) };
        let [x, z, xx, zz, xz] = hull.largest;
        Ranges {
            value: hull.value,
            slope: x.hypot(z) / self.width_m,
            // The largest eigenvalue of the matrix of absolute values.
            bend: 0.5 * (xx + zz + (xx - zz).hypot(2.0 * xz)) / (self.width_m * self.width_m),
        }
    }

    /// Returns bounds that hold everywhere: derivatives are differences of control points.
    fn everywhere(&self) -> Hull {
        let width = self.ends[1] - self.ends[0];
        Hull { value: self.ends, largest: [width, width, 2.0 * width, 2.0 * width, 2.0 * width] }
    }

    fn over(&self, area: &Area, first: [i64; 2], last: [i64; 2]) -> Hull {
        let patches = (first[1]..=last[1]).flat_map(|z| (first[0]..=last[0]).map(move |x| [x, z]));
        let hulls = patches.map(|patch| {
            let part = [0, 1].map(|k| {
                let share = |n: f64| (n / self.width_m - patch[k] as f64).clamp(0.0, 1.0);
                [share(area.min[k]), share(area.max[k])]
            });
            hull(&self.controls(patch), part)
        });
        hulls.reduce(Hull::union).unwrap_or_else(|| self.everywhere())
    }
}

impl Hull {
    fn union(self, other: Hull) -> Hull {
        let value = [self.value[0].min(other.value[0]), self.value[1].max(other.value[1])];
        Hull { value, largest: std::array::from_fn(|k| self.largest[k].max(other.largest[k])) }
    }
}

/// Sum of a net's coefficients with weights along both axes.
fn along(net: &Net<4, 4>, x: [f64; 4], z: [f64; 4]) -> f64 {
    let row = |row: &[f64; 4]| row[0] * x[0] + row[1] * x[1] + row[2] * x[2] + row[3] * x[3];
    row(&net[0]) * z[0] + row(&net[1]) * z[1] + row(&net[2]) * z[2] + row(&net[3]) * z[3]
}

/// The uniform cubic B-spline's weights.
fn weights(t: f64) -> [f64; 4] {
    let s = 1.0 - t;
    [s * s * s / 6.0, (4.0 + t * t * (3.0 * t - 6.0)) / 6.0, (4.0 + s * s * (3.0 * s - 6.0)) / 6.0, t * t * t / 6.0]
}

/// Returns the derivatives of the uniform cubic B-spline's weights.
fn rates(t: f64) -> [f64; 4] {
    let s = 1.0 - t;
    [-s * s / 2.0, t * (3.0 * t - 4.0) / 2.0, -s * (3.0 * s - 4.0) / 2.0, t * t / 2.0]
}

/// The Bézier control points of a piece of a uniform cubic B-spline.
fn bezier_form([a, b, c, d]: [f64; 4]) -> [f64; 4] {
    [(a + 4.0 * b + c) / 6.0, (2.0 * b + c) / 3.0, (b + 2.0 * c) / 3.0, (b + 4.0 * c + d) / 6.0]
}

/// Control points of a part of a Bézier curve: its blossom at degree − k times the part's start and k times its end, by
/// de Casteljau's algorithm.
fn part<const N: usize>(points: [f64; N], [start, end]: [f64; 2]) -> [f64; N] {
    let degree = N - 1;
    std::array::from_fn(|k| {
        let mut values = points;
        for step in 0..degree {
            let t = if step < degree - k { start } else { end };
            for i in 0..degree - step {
                values[i] += t * (values[i + 1] - values[i]);
            }
        }
        values[0]
    })
}

/// Control points of the derivative of a cubic, and of a quadratic, curve.
fn derivative_3([a, b, c, d]: [f64; 4]) -> [f64; 3] {
    [3.0 * (b - a), 3.0 * (c - b), 3.0 * (d - c)]
}

fn derivative_2([a, b, c]: [f64; 3]) -> [f64; 2] {
    [2.0 * (b - a), 2.0 * (c - b)]
}

/// Returns the transposed net.
fn turned<const X: usize, const Z: usize>(net: &Net<X, Z>) -> Net<Z, X> {
    std::array::from_fn(|i| std::array::from_fn(|j| net[j][i]))
}

/// Returns the smallest and largest control point of a part of a net.
fn ends<const X: usize, const Z: usize>(net: &Net<X, Z>, [x, z]: [[f64; 2]; 2]) -> [f64; 2] {
    let rows = net.map(|row| part(row, x));
    let columns = (0..X).flat_map(|i| part(rows.map(|row| row[i]), z));
    columns.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], n| [low.min(n), high.max(n)])
}

fn hull(coefficients: &Net<4, 4>, area: [[f64; 2]; 2]) -> Hull {
    let largest = |[low, high]: [f64; 2]| low.abs().max(high.abs());
    let net = turned(&turned(&coefficients.map(bezier_form)).map(bezier_form));
    let x: Net<3, 4> = net.map(derivative_3);
    // Turned: rows along z.
    let z: Net<3, 4> = turned(&net).map(derivative_3);
    let xx: Net<2, 4> = x.map(derivative_2);
    let zz: Net<2, 4> = z.map(derivative_2);
    let xz: Net<3, 3> = turned(&x).map(derivative_3);
    let across = [area[1], area[0]];
    let derivatives = [ends(&x, area), ends(&z, across), ends(&xx, area), ends(&zz, across), ends(&xz, across)];
    Hull { value: ends(&net, area), largest: derivatives.map(largest) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_part_shrinks_to_the_value_and_the_slope() {
        let c = [3.0, -1.0, 4.0, 1.5];
        let points = bezier_form(c);
        assert_eq!(part(points, [0.0, 1.0]), points);
        for k in 0..=10 {
            let t = f64::from(k) / 10.0;
            let value: f64 = (0..4).map(|i| c[i] * weights(t)[i]).sum();
            let slope: f64 = (0..4).map(|i| c[i] * rates(t)[i]).sum();
            assert!(part(points, [t, t]).iter().all(|n| (n - value).abs() < 1e-12));
            assert!(part(derivative_3(points), [t, t]).iter().all(|n| (n - slope).abs() < 1e-12));
        }
    }

    /// Values and second derivatives found in a patch are in the hull of its part, and come near its ends.
    #[test]
    fn a_hull_holds_what_is_found_and_little_more() {
        let (layer, area) = (Layer::new(4, 16.0, [-3.0, 5.0]), Area { min: [3.0, 5.0], max: [9.0, 14.0] });
        let ranges = layer.ranges(&area);
        let (mut found, mut bend) = ([f64::INFINITY, f64::NEG_INFINITY], 0.0f64);
        for (x, z) in
            (0..=60).flat_map(|i| (0..=60).map(move |j| (3.0 + 0.1 * f64::from(i), 5.0 + 0.15 * f64::from(j))))
        {
            let value = layer.value([x, z]);
            found = [found[0].min(value), found[1].max(value)];
            let at = |dx: f64, dz: f64| layer.value([x + dx, z + dz]);
            for [dx, dz] in [[1e-3, 0.0], [0.0, 1e-3], [7e-4, 7e-4], [7e-4, -7e-4]] {
                let second = (at(dx, dz) + at(-dx, -dz) - 2.0 * value) / (dx * dx + dz * dz);
                bend = bend.max(second.abs());
            }
        }
        assert!(ranges.value[0] <= found[0] && found[1] <= ranges.value[1]);
        assert!(ranges.width() < 1.5 * (found[1] - found[0]), "{ranges:?}, {found:?}");
        assert!(bend <= ranges.bend + 1e-6 && ranges.bend < 3.0 * bend, "{ranges:?}, {bend}");
    }

    #[test]
    fn neighbouring_patches_meet_with_their_slopes() {
        let layer = Layer::new(4, 16.0, [-3.0, 5.0]);
        for (x, z) in (-5..5).flat_map(|x| (-5..5).map(move |z| (f64::from(x) * 16.0, f64::from(z) * 7.0))) {
            let [before, after] = [x - 1e-9, x + 1e-9].map(|x| (layer.value([x, z]), layer.slopes([x, z])));
            assert!((before.0 - after.0).abs() < 1e-7);
            assert!((0..2).all(|k| (before.1[k] - after.1[k]).abs() < 1e-7));
        }
    }
}
