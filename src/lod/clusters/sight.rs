//! What a view says about a node: whether it is in sight, and what the tolerance allows in it over its ε.
//!
//! `shaders/cluster_sight.glsl` has the same functions, and the two agree to the bit: single precision, relative to
//! the eye, and nothing but sums, products, comparisons and integers, which Vulkan rounds as the host does. Roots and
//! inverses are Newton steps from an integer's start. Tiny and huge values are kept away: a device may flush what is
//! subnormal.
//!
//! What is rounded errs on the safe side. With u = 2⁻²⁴, coordinates are off by at most 7 u of themselves and a sum
//! along a direction by 12 u of its terms, which [`SLACK`] covers. The ratio is at most 80 u and twice what
//! [`inverse_root`] lacks above the true one, less than 2⁻¹⁶: [`GUARD`] takes four times that off.
//!
//! A node in another is in sight only if that is, rounding included: every step is monotone in the node's corners.

use glam::Vec3;

use super::tree::{Node, Tree};
use crate::draw::layout::ClusterView;
use crate::draw::place::Anchor;
use crate::height::bounds::Square;
use crate::view::{Containment, Lens, Metric, View};

/// Times the true ratio, so that rounding never allows more than [`crate::view::Allowance::error`].
const GUARD: f32 = 1.0 - 1.0 / 16384.0;
/// Of the terms of a sum along a direction: more than rounding may change it.
const SLACK: f32 = 1.0 / (1 << 19) as f32;
/// Coordinates end here, metres.
const FARTHEST: f32 = 1e12;
/// Depths end here, metres: nearer allows less.
const DEEPEST: f32 = 1e10;
/// Errors and squares of lengths begin here.
const LEAST: f32 = 1e-18;
/// Errors begin here, metres, unless they are 0.
const LEAST_ERROR: f32 = 1e-12;
/// The ratio of a node without error: never reached.
pub const WITHOUT_ERROR: f32 = 1e30;

/// See [`ClusterView::metric`].
const CERTIFIED: u32 = 0;
const PAPER: u32 = 1;
const EVEN: u32 = 2;

/// A view of a quadtree.
pub struct Sight<'a> {
    /// The quadtree.
    pub tree: &'a Tree,
    /// The view, as the device gets it too.
    pub view: ClusterView,
    planes: [(Vec3, f32); 5],
}

/// A box relative to the eye, metres.
#[derive(Clone, Copy, Debug)]
pub struct Extent {
    /// Smallest corner.
    pub low: Vec3,
    /// Largest corner.
    pub high: Vec3,
}

impl<'a> Sight<'a> {
    /// A view whose tolerance has a band from 1 to `band_end`. `culls`: nodes out of sight are left as they are; else
    /// they are not, so that no turn of the eye changes what is seen.
    pub fn new(tree: &'a Tree, view: &View, band_end: f32, culls: bool) -> Self {
        let view = cluster_view(tree, view, band_end, culls);
        let planes = [view.near_plane, view.right_plane, view.left_plane, view.upper_plane, view.lower_plane];
        Self { tree, view, planes: planes.map(|[x, y, z, w]| (Vec3::new(x, y, z), w)) }
    }

    /// Whether a node has land, in sight if that matters.
    pub fn draws(&self, node: Node) -> bool {
        let in_sight = |square: Square| {
            self.view.culls == 0 || self.containment(&self.extent(node, square.range)) != Containment::Outside
        };
        self.tree.square(node).is_some_and(in_sight)
    }

    /// The box around a node with heights in a range.
    #[inline]
    pub fn extent(&self, node: Node, [low, high]: [f32; 2]) -> Extent {
        let [first, end] = self.tree.corners(node);
        Extent { low: self.corner(first, low), high: self.corner(end, high) }
    }

    #[inline]
    fn corner(&self, at: [u32; 2], height: f32) -> Vec3 {
        let view = &self.view;
        let along = |k: usize| {
            let metres = (at[k] as i32 - view.anchor[k]) as f32 * view.spacing[k];
            metres + view.anchor_relative[k]
        };
        let above = (height - view.anchor_height) + view.anchor_height_relative;
        Vec3::new(along(0), above, along(1)).max(Vec3::splat(-FARTHEST)).min(Vec3::splat(FARTHEST))
    }

    /// How a box lies to what can be seen; `Crossing` when in doubt.
    #[inline]
    pub fn containment(&self, extent: &Extent) -> Containment {
        let mut containment = Containment::Inside;
        for (normal, w) in self.planes {
            let [least, most, size] = along(normal, extent);
            let slack = SLACK * (size + w.abs());
            if (most + w) + slack < 0.0 {
                return Containment::Outside;
            }
            if (least + w) - slack < 0.0 {
                containment = Containment::Crossing;
            }
        }
        containment
    }

    /// What the tolerance allows in a box over an error: below 1 that is too coarse. Never above the exact value.
    #[inline]
    pub fn ratio(&self, extent: &Extent, error: f32) -> f32 {
        if error == 0.0 {
            return WITHOUT_ERROR;
        }
        let view = &self.view;
        let distance = distance(extent).max(view.near);
        let (over, under) = match view.metric {
            CERTIFIED => {
                let [nearest, _, size] = along(view.forward.into(), extent);
                let depth = (nearest - SLACK * size).max(distance * view.inverse_corner).max(view.near).min(DEEPEST);
                let aside = farthest_aside(extent).min(view.corner * depth);
                (depth * depth, view.scale * aside + view.lean * depth)
            }
            PAPER => (distance.min(DEEPEST), view.scale),
            _ => (1.0, view.scale),
        };
        let root = inverse_root((under * error.max(LEAST_ERROR)).max(LEAST));
        ((GUARD * over) * root) * root
    }
}

/// 1 / √x, never above it, and at most 5 · 10⁻⁶ below. The start is that of Lomont, "Fast Inverse Square Root" (2003).
#[inline]
pub fn inverse_root(x: f32) -> f32 {
    let start = f32::from_bits(0x5f37_5a86 - (x.to_bits() >> 1));
    let newton = |y: f32| y * (1.5 - (0.5 * x) * (y * y));
    newton(newton(start))
}

/// Distance of a box from the eye.
#[inline]
fn distance(extent: &Extent) -> f32 {
    let away = extent.low.max(-extent.high).max(Vec3::ZERO);
    let square = sum(away * away).max(LEAST);
    square * inverse_root(square)
}

/// Largest horizontal distance of a box from the eye.
#[inline]
fn farthest_aside(extent: &Extent) -> f32 {
    let far = extent.low.abs().max(extent.high.abs());
    let square = (far.x * far.x + far.z * far.z).max(LEAST);
    square * inverse_root(square)
}

/// The least and the greatest `direction · p` over a box, and how great its terms may be.
#[inline]
fn along(direction: Vec3, extent: &Extent) -> [f32; 3] {
    let (a, b) = (direction * extent.low, direction * extent.high);
    [sum(a.min(b)), sum(a.max(b)), sum(a.abs().max(b.abs()))]
}

#[inline]
fn sum(terms: Vec3) -> f32 {
    (terms.x + terms.y) + terms.z
}

/// A value as both sides may compute with it.
fn single(value: f64) -> f32 {
    if value.abs() < 1e-12 { 0.0 } else { value.clamp(-f64::from(FARTHEST), FARTHEST.into()) as f32 }
}

fn cluster_view(tree: &Tree, view: &View, band_end: f32, culls: bool) -> ClusterView {
    let anchor = Anchor::new(tree.origin, tree.spacing, view.eye);
    let planes = view.planes().map(|(normal, distance)| {
        let [x, y, z] = normal.to_array().map(single);
        [x, y, z, single(distance)]
    });
    let lean = view.forward().y.abs();
    let (metric, scale) = match (view.lens, view.tolerance.metric) {
        (Lens::Orthographic { .. }, Metric::Paper) => (EVEN, 1.0),
        (Lens::Orthographic { .. }, Metric::Certified) => (EVEN, (1.0 - lean * lean).max(0.0).sqrt()),
        (Lens::Perspective { .. }, Metric::Paper) => (PAPER, 1.0),
        (Lens::Perspective { .. }, Metric::Certified) => (CERTIFIED, 1.0),
    };
    let corner = view.corner_ray();
    ClusterView {
        anchor: anchor.at,
        anchor_relative: anchor.relative.map(|metres| single(metres.into())),
        anchor_height: single(anchor.height.into()),
        anchor_height_relative: single(anchor.height_relative.into()),
        spacing: tree.spacing.map(single),
        near_plane: planes[0],
        right_plane: planes[1],
        left_plane: planes[2],
        upper_plane: planes[3],
        lower_plane: planes[4],
        forward: view.forward().to_array().map(single),
        metric,
        near: view.near.clamp(1e-9, f64::from(DEEPEST)) as f32,
        corner: corner as f32,
        inverse_corner: (1.0 / corner) as f32,
        scale: single(scale * view.focal_px() / view.tolerance.px.max(f64::MIN_POSITIVE)),
        lean: single(lean),
        band_end,
        band_scale: if band_end > 1.0 { crate::draw::weights::ONE as f32 / (band_end - 1.0) } else { 0.0 },
        culls: culls.into(),
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use glam::DVec3;

    use super::*;
    use crate::height::bounds::Measure;
    use crate::height::{Field, Holes, Samples};
    use crate::view::{Aabb, Tolerance};

    /// A deterministic number in 0..1.
    fn random(seed: &mut u64) -> f64 {
        *seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (*seed >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Trees of small and of endless fields, near the origin and far from it.
    fn trees(seed: &mut u64) -> Vec<Tree> {
        let heights = |seed: &mut u64| (0..64 * 64).map(|_| 300.0 * random(seed) as f32 - 20.0).collect();
        let mut tree = |tiles: [u32; 2], spacing: [f64; 2], origin: [f64; 2]| {
            let mut field = Field::new(Samples::F32(heights(seed)), [64, 64], spacing, Holes::none(64 * 64));
            field.origin = origin;
            let measure = Measure { cells: 8, growth: 1.0, errors: true, morph: false };
            Tree::new(&Arc::new(field.tiled(tiles)), measure, false)
        };
        vec![
            tree([1, 1], [1.0, 1.0], [0.0, 0.0]),
            tree([7813, 7813], [1.0, 1.0], [-1e5, 0.0]),
            tree([3000, 20], [30.0, 0.1], [1.0e7, -6.4e6]),
        ]
    }

    fn anywhere(tree: &Tree, seed: &mut u64) -> View {
        let near = random(seed) < 0.7;
        let mut at = |k: usize| tree.origin[k] + tree.spacing[k] * f64::from(tree.last[k]) * (1.2 * random(seed) - 0.1);
        let eye = DVec3::new(at(0), 0.0, at(1));
        let away = if near { 500.0 } else { 1e7 };
        let lens = match random(seed) {
            p if p < 0.2 => Lens::Orthographic { width: 10f64.powf(5.0 * random(seed)), far: 1e9 },
            _ => Lens::Perspective { fov_x: 0.01 + 2.9 * random(seed) },
        };
        View {
            eye: eye + DVec3::Y * away * random(seed).powi(2),
            world_from_eye: View::turned(360.0 * random(seed), 180.0 * random(seed) - 90.0, 360.0 * random(seed)),
            lens,
            size: [1280, 720],
            near: 10f64.powf(4.0 * random(seed) - 3.0),
            tolerance: Tolerance {
                px: 10f64.powf(4.0 * random(seed) - 2.0),
                metric: if random(seed) < 0.7 { Metric::Certified } else { Metric::Paper },
            },
            time_s: 0.0,
        }
    }

    fn world_box(tree: &Tree, node: Node, [low, high]: [f32; 2]) -> Aabb {
        let [first, end] = tree.corners(node);
        let at = |[i, j]: [u32; 2], y: f32| {
            let along = |k: usize, n: u32| tree.origin[k] + f64::from(n) * tree.spacing[k];
            DVec3::new(along(0, i), y.into(), along(1, j))
        };
        Aabb { min: at(first, low), max: at(end, high) }
    }

    /// A node of any level; near the eye as often as anywhere.
    fn any_node(tree: &Tree, view: &View, seed: &mut u64) -> Node {
        let level = (f64::from(tree.root().level + 1) * random(seed)) as u32;
        let near = random(seed) < 0.5;
        let at = [0, 1].map(|k| {
            let along = (view.eye[2 * k] - tree.origin[k]) / tree.spacing[k];
            let place = if near { along } else { f64::from(tree.last[k]) * random(seed) };
            (place.clamp(0.0, f64::from(tree.last[k] - 1)) as u32) / tree.bounds.side(level)
        });
        Node { level, at }
    }

    #[test]
    fn nothing_is_allowed_or_left_out_that_exact_arithmetic_does_not() {
        let mut seed = 3;
        let (mut closest, mut farthest, mut far_of_sight) = (0.0f64, 1.0f64, [0, 0]);
        for tree in trees(&mut seed) {
            for _ in 0..200_000 {
                let view = anywhere(&tree, &mut seed);
                let sight = Sight::new(&tree, &view, 1.0, true);
                let node = any_node(&tree, &view, &mut seed);
                let Some(square) = tree.square(node) else { continue };
                let (extent, exact) = (sight.extent(node, square.range), world_box(&tree, node, square.range));
                let error = 10f32.powf(6.0 * random(&mut seed) as f32 - 4.0);
                let allowed = f64::from(sight.ratio(&extent, error)) * f64::from(error);
                let share = allowed / view.allowed_error(&exact).min(1e12);
                assert!(share < 1.0, "{share} of the allowed error at {node:?}, {view:?}");
                closest = closest.max(share);
                // Where a box is much wider than it is far, a sum along the view axis is good for little.
                let wide = (exact.max - exact.min).length() > 1000.0 * exact.distance(view.eye).max(view.near);
                farthest = if wide { farthest } else { farthest.min(share) };
                let (found, truly) = (sight.containment(&extent), view.frustum().contains(&exact));
                let doubtful = found == Containment::Crossing && truly != found;
                assert!(found == truly || doubtful, "{found:?}, truly {truly:?}: {node:?}, {view:?}");
                far_of_sight[usize::from(doubtful)] += 1;
            }
        }
        println!("{farthest} to {closest} of the allowed error, in sight in doubt: {far_of_sight:?}");
        assert!(closest > 0.9999 && farthest > 0.99, "{farthest} to {closest} of the allowed error");
        assert!(far_of_sight[0] > 10_000 * far_of_sight[1], "{far_of_sight:?} in doubt");
    }

    #[test]
    fn inverse_roots_are_below_and_close() {
        for k in 0..370_000u32 {
            let x = f32::from_bits(0x2000_0000 + 3571 * k);
            let share = f64::from(inverse_root(x)) * f64::from(x).sqrt();
            assert!((1.0 - 5e-6..1.0 + 3e-7).contains(&share), "{share} of 1 / sqrt({x})");
        }
    }
}
