//! What a view says about a node: whether it is in sight, and what the tolerance allows in it over its ε.
//!
//! `shaders/cluster_lod.glsl` has the same functions, and the two agree to the bit: single precision, relative to
//! the eye, and nothing but sums, products, comparisons and integers, which Vulkan rounds as the host does. Roots and
//! inverses are Newton steps from an integer's start. Tiny and huge values are kept away: a device may flush what is
//! subnormal.
//!
//! What is rounded errs on the safe side. With u = 2⁻²⁴, coordinates are off by at most 7 u of themselves and a sum
//! along a direction by 12 u of its terms, which [`SLACK`] covers. The ratio is at most 80 u and twice what
//! [`inverse_roots`] lacks above the true one, less than 2⁻¹⁶: [`GUARD`] takes four times that off.
//!
//! A node in another is in sight only if that is, rounding included: every step is monotone in the node's corners.
//!
//! The host looks at the four children of a node at once, a lane each.

use glam::Vec4;

use super::morph_ranges::{MorphRanges, NODE_END};
use super::tree::{Node, Squares, Tree};
use crate::draw::layout::ClusterView;
use crate::draw::place::RenderOrigin;
use crate::height::bounds::Square;
use crate::view::{Containment, Lens, Metric, View};

/// How far the rasteriser may see edges apart that are not, pixels: it rounds vertices to 1/256 of one, and a skirt may be
/// seen from almost above.
const RASTER_PX: f64 = 0.125;

/// Times the true ratio, so that rounding never allows more than [`crate::view::Allowance::error`].
const GUARD: f32 = 1.0 - 1.0 / 16384.0;
/// Of the terms of a sum along a direction: more than rounding may change it.
const SLACK: f32 = 1.0 / (1 << 19) as f32;
/// Coordinates end here, metres.
const FARTHEST: f32 = 1e12;
/// Depths end here, metres: nearer allows less.
const DEEPEST: f32 = 1e10;
/// Errors and squares of lengths begin here.
const MIN: f32 = 1e-18;
/// Errors begin here, metres, unless they are 0.
const MIN_ERROR: f32 = 1e-12;
/// The ratio of a node without error: never reached.
pub const WITHOUT_ERROR: f32 = 1e30;

/// See [`ClusterView::metric`].
const CERTIFIED: u32 = 0;
const PAPER: u32 = 1;
const EVEN: u32 = 2;
const DISTANCE: u32 = 3;

/// A view of a quadtree.
pub struct LodEvaluator<'a> {
    /// The quadtree.
    pub tree: &'a Tree,
    /// The view, as the device gets it too.
    pub view: ClusterView,
    /// What it says of levels where their distance alone counts.
    pub ranges: MorphRanges,
}

/// Four boxes relative to the eye, metres, a lane each: x, y and z.
#[derive(Clone, Copy, Debug)]
struct Extents {
    low: [Vec4; 3],
    high: [Vec4; 3],
}

/// What is looked at of one node: its containment and its ratio, or nothing if it has no land.
pub type NodeVisibility = Option<(Containment, f32)>;

impl<'a> LodEvaluator<'a> {
    /// A view whose tolerance has a band from 1 to `band_end`. `culls`: nodes out of sight are left as they are; else
    /// they are not, so that no turn of the eye changes what is seen.
    pub fn new(tree: &'a Tree, view: &View, band_end: f32, culls: bool) -> Self {
        Self { tree, view: cluster_view(tree, view, band_end, culls), ranges: MorphRanges::default() }
    }

    /// A view in which vertices go over to the next level by their own distance.
    pub fn by_distance(tree: &'a Tree, view: &View) -> Self {
        let ranges = MorphRanges::new(tree, view);
        let known = cluster_view(tree, view, NODE_END, true);
        let view = ClusterView { metric: DISTANCE, band_scale: 0.0, above_squared: ranges.above_squared, ..known };
        Self { tree, view, ranges }
    }

    /// Whether vertices go over to the next level by their own distance.
    pub fn is_by_distance(&self) -> bool {
        self.view.metric == DISTANCE
    }

    /// Whether a node has land, in sight if that matters.
    pub fn draws(&self, node: Node) -> bool {
        self.tree.square(node).is_some()
            && (self.view.culls == 0 || self.containment(node).is_some_and(|found| found != Containment::Outside))
    }

    /// How a node lies to what can be seen, `Crossing` when in doubt; `None` if it has no land.
    pub fn containment(&self, node: Node) -> Option<Containment> {
        let square = self.tree.square(node)?;
        Some(self.contained(&self.extent(node, square))[0])
    }

    /// The error, metres, that [`RASTER_PX`] allow in a node. `None` if it has no land.
    pub fn raster_m(&self, node: Node) -> Option<f32> {
        let square = self.tree.square(node)?;
        Some(self.over(self.view.skirt_scale, &self.extent(node, square), Vec4::ONE).x)
    }

    /// A node by itself.
    pub fn evaluate(&self, node: Node) -> NodeVisibility {
        let square = self.tree.square(node)?;
        let extent = self.extent(node, square);
        let error_margin = if node.level == 0 {
            WITHOUT_ERROR
        } else {
            self.error_margins(node.level, &extent, Vec4::splat(square.error)).x
        };
        Some((self.contained(&extent)[0], error_margin))
    }

    /// The children of a node that lies to what can be seen as `around` says: `squares` is what is known of them.
    #[inline]
    pub fn evaluate_children(&self, node: Node, around: Containment, squares: &Squares) -> [NodeVisibility; 4] {
        let extents = self.children(node, squares);
        // What is in a node lies no other way than that, if it is not crossed by a plane.
        let contained = if around == Containment::Crossing { self.contained(&extents) } else { [around; 4] };
        let finest = node.level == 1;
        let error_margins = match finest {
            true => Vec4::splat(WITHOUT_ERROR),
            false => self.error_margins(node.level - 1, &extents, squares.error),
        };
        let (has_terrain, error_margins) = (squares.has_terrain(), error_margins.to_array());
        let evaluate = |k: usize| (has_terrain >> k & 1 == 1).then(|| (contained[k], error_margins[k]));
        [evaluate(0), evaluate(1), evaluate(2), evaluate(3)]
    }

    /// How the children of a node lie to what can be seen; nothing without land does.
    pub fn contained_in(&self, node: Node) -> [Containment; 4] {
        let squares = self.tree.squares(node);
        let (has_terrain, contained) = (squares.has_terrain(), self.contained(&self.children(node, &squares)));
        [0, 1, 2, 3].map(|k| if has_terrain >> k & 1 == 1 { contained[k] } else { Containment::Outside })
    }

    /// The boxes around the children of a node.
    #[inline]
    fn children(&self, node: Node, squares: &Squares) -> Extents {
        let (first, side) = (self.tree.first(node), self.tree.bounds.side(node.level - 1));
        let metres = |axis: usize, n: u32| self.metres((first[axis] + n * side).min(self.tree.last[axis]), axis);
        let [x, z] = [0, 1].map(|axis| [metres(axis, 0), metres(axis, 1), metres(axis, 2)]);
        let [low, high] = squares.range.map(|heights| self.above(heights));
        Extents {
            low: [Vec4::new(x[0], x[1], x[0], x[1]), low, Vec4::new(z[0], z[0], z[1], z[1])],
            high: [Vec4::new(x[1], x[2], x[1], x[2]), high, Vec4::new(z[1], z[1], z[2], z[2])],
        }
    }

    /// The box around a node in every lane.
    fn extent(&self, node: Node, Square { range: [low, high], .. }: Square) -> Extents {
        let at = |[x, z]: [u32; 2], y: f32| {
            [Vec4::splat(self.metres(x, 0)), self.above(Vec4::splat(y)), Vec4::splat(self.metres(z, 1))]
        };
        let [first, end] = self.tree.corners(node);
        Extents { low: at(first, low), high: at(end, high) }
    }

    /// Where a sample lies relative to the eye along an axis of the plan, metres.
    #[inline]
    fn metres(&self, at: u32, axis: usize) -> f32 {
        let metres = (at as i32 - self.view.render_origin[axis]) as f32 * self.view.spacing[axis];
        (metres + self.view.render_origin_relative[axis]).clamp(-FARTHEST, FARTHEST)
    }

    /// Heights relative to the eye, metres.
    #[inline]
    fn above(&self, heights: Vec4) -> Vec4 {
        let above = (heights - self.view.render_origin_height) + self.view.render_origin_height_relative;
        above.max(Vec4::splat(-FARTHEST)).min(Vec4::splat(FARTHEST))
    }

    #[inline]
    fn contained(&self, extents: &Extents) -> [Containment; 4] {
        let view = &self.view;
        let (mut outside, mut crossing) = (0, 0);
        for [x, y, z, w] in [view.near_plane, view.right_plane, view.left_plane, view.upper_plane, view.lower_plane] {
            let [min, max, size] = along([x, y, z], extents);
            let slack = SLACK * (size + w.abs());
            outside |= ((max + w) + slack).cmplt(Vec4::ZERO).bitmask();
            crossing |= ((min + w) - slack).cmplt(Vec4::ZERO).bitmask();
        }
        [0, 1, 2, 3].map(|k| match (outside >> k & 1, crossing >> k & 1) {
            (1, _) => Containment::Outside,
            (_, 1) => Containment::Crossing,
            _ => Containment::Inside,
        })
    }

    /// What the tolerance allows over the errors of a level: below 1 they are too coarse. Never above the exact value.
    /// By distance: how far, squared, over where the way into the level begins.
    #[inline]
    fn error_margins(&self, level: u32, extents: &Extents, errors: Vec4) -> Vec4 {
        if self.is_by_distance() {
            return self.ranges.ranges[level as usize] * squared_in_plan(extents, self.ranges.above_squared);
        }
        self.over(self.view.scale, extents, errors)
    }

    /// The same for a scale as [`ClusterView::scale`].
    #[inline]
    fn over(&self, scale: f32, extents: &Extents, errors: Vec4) -> Vec4 {
        let view = &self.view;
        let near = Vec4::splat(view.near);
        let distance = distance(extents).max(near);
        let (over, under) = match view.metric {
            CERTIFIED => {
                let [nearest, _, size] = along(view.forward, extents);
                let depth = (nearest - SLACK * size).max(distance * view.inverse_corner).max(near);
                let depth = depth.min(Vec4::splat(DEEPEST));
                let aside = farthest_aside(extents).min(view.corner * depth);
                (depth * depth, scale * aside + view.lean * depth)
            }
            PAPER => (distance.min(Vec4::splat(DEEPEST)), Vec4::splat(scale)),
            _ => (Vec4::ONE, Vec4::splat(scale)),
        };
        let root = inverse_roots((under * errors.max(Vec4::splat(MIN_ERROR))).max(Vec4::splat(MIN)));
        let error_margins = ((GUARD * over) * root) * root;
        Vec4::select(errors.cmpeq(Vec4::ZERO), Vec4::splat(WITHOUT_ERROR), error_margins)
    }
}

/// 1 / √x, never above it, and at most 5 · 10⁻⁶ below. The start is that of Lomont, "Fast Inverse Square Root" (2003).
#[inline]
fn inverse_roots(x: Vec4) -> Vec4 {
    let start = |x: f32| f32::from_bits(0x5f37_5a86_u32.wrapping_sub(x.to_bits() >> 1));
    let newton = |y: Vec4| y * (1.5 - (0.5 * x) * (y * y));
    newton(newton(Vec4::new(start(x.x), start(x.y), start(x.z), start(x.w))))
}

/// Distances of boxes from the eye.
#[inline]
fn distance(extents: &Extents) -> Vec4 {
    let away = |k: usize| extents.low[k].max(-extents.high[k]).max(Vec4::ZERO);
    let [x, y, z] = [away(0), away(1), away(2)];
    let square = ((x * x + y * y) + z * z).max(Vec4::splat(MIN));
    square * inverse_roots(square)
}

/// Squares of their distances in plan, and of so much more in height: as `draw::distance::squared` at their nearest place.
#[inline]
fn squared_in_plan(extents: &Extents, above_squared: f32) -> Vec4 {
    let away = |k: usize| extents.low[k].max(-extents.high[k]).max(Vec4::ZERO);
    let [x, z] = [away(0), away(2)];
    (x * x + z * z) + above_squared
}

/// Largest horizontal distances of boxes from the eye.
#[inline]
fn farthest_aside(extents: &Extents) -> Vec4 {
    let far = |k: usize| extents.low[k].abs().max(extents.high[k].abs());
    let [x, z] = [far(0), far(2)];
    let square = (x * x + z * z).max(Vec4::splat(MIN));
    square * inverse_roots(square)
}

/// The least and the greatest `direction · p` over each box, and how great its terms may be.
#[inline]
fn along(direction: [f32; 3], extents: &Extents) -> [Vec4; 3] {
    let ends = |k: usize| (direction[k] * extents.low[k], direction[k] * extents.high[k]);
    let [x, y, z] = [ends(0), ends(1), ends(2)];
    let sum = |of: fn(Vec4, Vec4) -> Vec4| (of(x.0, x.1) + of(y.0, y.1)) + of(z.0, z.1);
    [sum(Vec4::min), sum(Vec4::max), sum(|a, b| a.abs().max(b.abs()))]
}

/// A value as both sides may compute with it.
fn single(value: f64) -> f32 {
    if value.abs() < 1e-12 { 0.0 } else { value.clamp(-f64::from(FARTHEST), FARTHEST.into()) as f32 }
}

fn cluster_view(tree: &Tree, view: &View, band_end: f32, culls: bool) -> ClusterView {
    let render_origin = RenderOrigin::new(tree.origin, tree.spacing, view.eye);
    let planes = view.planes().map(|(normal, distance)| {
        let [x, y, z] = normal.to_array().map(single);
        [x, y, z, single(distance)]
    });
    let lean = view.forward().y.abs();
    let (metric, scale) = match (view.lens, view.tolerance.metric) {
        // No tolerance is kept: every node is fine enough, in front of the eye too.
        _ if view.tolerance.px == f64::INFINITY => (EVEN, 0.0),
        (Lens::Orthographic { .. }, Metric::Paper) => (EVEN, 1.0),
        (Lens::Orthographic { .. }, Metric::Certified) => (EVEN, (1.0 - lean * lean).max(0.0).sqrt()),
        (Lens::Perspective { .. }, Metric::Paper) => (PAPER, 1.0),
        (Lens::Perspective { .. }, Metric::Certified) => (CERTIFIED, 1.0),
    };
    let scale_for = |px: f64| single(scale * view.focal_px() / px);
    let corner = view.corner_ray();
    ClusterView {
        render_origin: render_origin.at,
        render_origin_relative: render_origin.relative.map(|metres| single(metres.into())),
        render_origin_height: single(render_origin.height.into()),
        render_origin_height_relative: single(render_origin.height_relative.into()),
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
        scale: scale_for(view.tolerance.px.max(f64::MIN_POSITIVE)),
        lean: single(lean),
        band_end,
        band_scale: if band_end > 1.0 { crate::draw::weights::ONE as f32 / (band_end - 1.0) } else { 0.0 },
        culls: culls.into(),
        skirt_scale: scale_for(RASTER_PX),
        above_squared: 0.0,
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use glam::DVec3;

    use super::*;
    use crate::height::bounds::Measure;
    use crate::height::progress::Progress;
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
            Tree::new(&Arc::new(field.tiled(tiles)), measure, false, &Progress::default())
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
                let evaluator = LodEvaluator::new(&tree, &view, 1.0, true);
                let node = any_node(&tree, &view, &mut seed);
                let Some(square) = tree.square(node) else { continue };
                let exact = world_box(&tree, node, square.range);
                let error = 10f32.powf(6.0 * random(&mut seed) as f32 - 4.0);
                let error_margin =
                    evaluator.error_margins(node.level, &evaluator.extent(node, square), Vec4::splat(error)).x;
                let allowed = f64::from(error_margin) * f64::from(error);
                let share = allowed / view.allowed_error(&exact).min(1e12);
                assert!(share < 1.0, "{share} of the allowed error at {node:?}, {view:?}");
                closest = closest.max(share);
                // Where a box is much wider than it is far, a sum along the view axis is good for little.
                let wide = (exact.max - exact.min).length() > 1000.0 * exact.distance(view.eye).max(view.near);
                farthest = if wide { farthest } else { farthest.min(share) };
                let (found, truly) = (evaluator.containment(node).unwrap(), view.frustum().contains(&exact));
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
    fn children_are_seen_as_by_themselves() {
        let mut seed = 5;
        let mut seen = [0; 3];
        for tree in trees(&mut seed) {
            for _ in 0..20_000 {
                let view = anywhere(&tree, &mut seed);
                let evaluator = LodEvaluator::new(&tree, &view, 1.0, true);
                let node = any_node(&tree, &view, &mut seed);
                if node.level == 0 {
                    continue;
                }
                let alone = [0, 1, 2, 3].map(|quadrant| evaluator.evaluate(node.child(quadrant)));
                assert_eq!(
                    evaluator.evaluate_children(node, Containment::Crossing, &tree.squares(node)),
                    alone,
                    "{node:?}, {view:?}"
                );
                let outside = Containment::Outside;
                assert_eq!(
                    evaluator.contained_in(node),
                    alone.map(|evaluate| evaluate.map_or(outside, |(found, _)| found))
                );
                alone.iter().flatten().for_each(|(found, _)| seen[*found as usize] += 1);
            }
        }
        assert!(seen.iter().all(|&count| count > 1000), "{seen:?}");
    }

    #[test]
    fn inverse_roots_are_below_and_close() {
        for k in 0..370_000u32 {
            let x = f32::from_bits(0x2000_0000 + 3571 * k);
            let share = f64::from(inverse_roots(Vec4::splat(x)).x) * f64::from(x).sqrt();
            assert!((1.0 - 5e-6..1.0 + 3e-7).contains(&share), "{share} of 1 / sqrt({x})");
        }
    }
}
