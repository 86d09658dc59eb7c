//! One array of bicubic patches without end, of one width, whose control points a hash tells.
//!
//! Neighbouring patches share their control points as those of a uniform cubic B-spline do: the surface has continuous
//! second derivatives. In a patch that is the Bézier form with control points ((c₀ + 4c₁ + c₂)/6, (2c₁ + c₂)/3, …).

use super::Area;
use crate::height::synth::noise;

/// The most patches along an axis of an area that are looked at one by one: of more, the ends of all control points
/// bound what lies there.
const MOST_ALONG: i64 = 3;

/// The layer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Layer {
    seed: u64,
    width_m: f64,
    /// Least and most of all control points.
    ends: [f64; 2],
}

/// Ranges over an area.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ranges {
    /// Of values.
    pub value: [f64; 2],
    /// The largest slope in any direction, per metre.
    pub slope: f64,
    /// The largest second derivative in any direction, per metre².
    pub bend: f64,
}

impl Ranges {
    /// Of values.
    pub fn width(&self) -> f64 {
        self.value[1] - self.value[0]
    }
}

/// Four coefficients of a cubic along one axis, or fewer of a derivative.
type Net<const X: usize, const Z: usize> = [[f64; X]; Z];

/// What is known of the patches of an area, per unit of width.
#[derive(Clone, Copy)]
struct Hull {
    value: [f64; 2],
    /// Largest absolute values of ∂x, ∂z, ∂xx, ∂zz, ∂xz.
    largest: [f64; 5],
}

impl Layer {
    /// Of a seed, with patches of a width, metres, and control points between two values.
    pub fn new(seed: u64, width_m: f64, ends: [f64; 2]) -> Self {
        Self { seed, width_m, ends }
    }

    /// Width of a patch, metres.
    pub fn width_m(&self) -> f64 {
        self.width_m
    }

    /// Least and most of all control points.
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

    /// The patch of a place, and where in it.
    fn patch(&self, at: [f64; 2]) -> ([i64; 2], [f64; 2]) {
        let share = at.map(|n| n / self.width_m);
        (share.map(|n| n.floor() as i64), share.map(|n| n - n.floor()))
    }

    /// Value at a place.
    pub fn value(&self, at: [f64; 2]) -> f64 {
        let (patch, [u, v]) = self.patch(at);
        along(&self.controls(patch), weights(u), weights(v))
    }

    /// Slopes at a place, per metre.
    pub fn slopes(&self, at: [f64; 2]) -> [f64; 2] {
        let (patch, [u, v]) = self.patch(at);
        let net = self.controls(patch);
        [along(&net, rates(u), weights(v)), along(&net, weights(u), rates(v))].map(|slope| slope / self.width_m)
    }

    /// Ranges over an area.
    pub fn ranges(&self, area: &Area) -> Ranges {
        let (first, last) = (self.patch(area.min).0, self.patch(area.max).0);
        let is_wide = (0..2).any(|k| last[k] - first[k] >= MOST_ALONG);
        let hull = if is_wide { self.everywhere() } else { self.over(area, first, last) };
        let [x, z, xx, zz, xz] = hull.largest;
        Ranges {
            value: hull.value,
            slope: x.hypot(z) / self.width_m,
            // The largest eigenvalue of the matrix of absolute values.
            bend: 0.5 * (xx + zz + (xx - zz).hypot(2.0 * xz)) / (self.width_m * self.width_m),
        }
    }

    /// Derivatives are differences of control points.
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

/// Their derivatives.
fn rates(t: f64) -> [f64; 4] {
    let s = 1.0 - t;
    [-s * s / 2.0, t * (3.0 * t - 4.0) / 2.0, -s * (3.0 * s - 4.0) / 2.0, t * t / 2.0]
}

/// Control points of a part of a piece of a uniform B-spline of degree N − 1, a derivative's included: its blossom at
/// the part's ends. A coefficient of a spline of degree n is the blossom at n knots in a row.
fn part<const N: usize>(coefficients: [f64; N], [a, b]: [f64; 2]) -> [f64; N] {
    let degree = N - 1;
    std::array::from_fn(|k| {
        // The blossom at degree − k times a and k times b, by de Boor's algorithm.
        let mut values = coefficients;
        for step in 0..degree {
            let t = if step < degree - k { a } else { b };
            let span = (degree - step) as f64;
            for i in 0..degree - step {
                // Knots of coefficient i: i + step − degree + 1 to i + 1.
                let share = (t - (i as f64 - (degree - step) as f64 + 1.0)) / span;
                values[i] += share * (values[i + 1] - values[i]);
            }
        }
        values[0]
    })
}

/// Least and most of the control points of a part of a net.
fn ends<const X: usize, const Z: usize>(net: &Net<X, Z>, [x, z]: [[f64; 2]; 2]) -> [f64; 2] {
    let rows = net.map(|row| part(row, x));
    let columns = (0..X).flat_map(|i| part(rows.map(|row| row[i]), z));
    columns.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], n| [low.min(n), high.max(n)])
}

fn hull(net: &Net<4, 4>, area: [[f64; 2]; 2]) -> Hull {
    let largest = |[low, high]: [f64; 2]| low.abs().max(high.abs());
    let x: Net<3, 4> = net.map(differences_4);
    let z: Net<4, 3> = std::array::from_fn(|j| std::array::from_fn(|i| net[j + 1][i] - net[j][i]));
    let xx: Net<2, 4> = x.map(differences_3);
    let zz: Net<4, 2> = std::array::from_fn(|j| std::array::from_fn(|i| z[j + 1][i] - z[j][i]));
    let xz: Net<3, 3> = z.map(differences_4);
    Hull {
        value: ends(net, area),
        largest: [ends(&x, area), ends(&z, area), ends(&xx, area), ends(&zz, area), ends(&xz, area)].map(largest),
    }
}

/// The derivative's coefficients: a uniform B-spline's are differences.
fn differences_4(row: [f64; 4]) -> [f64; 3] {
    [row[1] - row[0], row[2] - row[1], row[3] - row[2]]
}

fn differences_3(row: [f64; 3]) -> [f64; 2] {
    [row[1] - row[0], row[2] - row[1]]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn control_points_of_a_whole_piece_are_the_bezier_form() {
        let c = [3.0, -1.0, 4.0, 1.5];
        let expected = [
            (c[0] + 4.0 * c[1] + c[2]) / 6.0,
            (2.0 * c[1] + c[2]) / 3.0,
            (c[1] + 2.0 * c[2]) / 3.0,
            (c[1] + 4.0 * c[2] + c[3]) / 6.0,
        ];
        let found = part(c, [0.0, 1.0]);
        assert!((0..4).all(|k| (found[k] - expected[k]).abs() < 1e-12), "{found:?}, not {expected:?}");
    }

    #[test]
    fn a_part_shrinks_to_the_value() {
        let c = [3.0, -1.0, 4.0, 1.5];
        for k in 0..=10 {
            let t = f64::from(k) / 10.0;
            let value: f64 = (0..4).map(|i| c[i] * weights(t)[i]).sum();
            let slope: f64 = (0..4).map(|i| c[i] * rates(t)[i]).sum();
            assert!(part(c, [t, t]).iter().all(|n| (n - value).abs() < 1e-12));
            assert!(part(differences_4(c), [t, t]).iter().all(|n| (n - slope).abs() < 1e-12));
        }
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
