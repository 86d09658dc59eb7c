//! Evaluates nodes for a view: their visibility, and their error margin, the allowed error divided by the node's error
//! ε.
//!
//! `shaders/cluster_lod.glsl` has the same functions with bit-identical results. They use single precision relative to
//! the eye, and only sums, products, comparisons and integers, which Vulkan rounds as the host does. Roots and inverses
//! are Newton steps from an integer estimate. Values are clamped away from tiny and huge ones, because a device may
//! flush subnormal numbers.
//!
//! Rounding is conservative. With u = 2⁻²⁴, coordinates are off by at most 7 u of themselves. A sum along a direction
//! is off by at most 12 u of its terms, which [`SLACK`] covers. The error margin exceeds the true one by at most 80 u
//! and twice the error of [`inverse_roots`], less than 2⁻¹⁶; [`GUARD`] subtracts four times that.
//!
//! A node inside another is visible only if the other one is, rounding included, because every step is monotonic in the
//! node's corners.
//!
//! The host evaluates the four children of a node at once, one per SIMD lane.

use glam::Vec4;

use super::layout::{CERTIFIED, ClusterView, DISTANCE, EVEN, PAPER};
use super::morph_ranges::{MorphRanges, NODE_END};
use super::tree::{Node, Squares, Tree};
use crate::draw::layout::RenderOrigin;
use crate::height::bounds::Square;
use crate::view::{Containment, Lens, Metric, View};

/// Maximum visible gap between coinciding edges after rasterisation, pixels: vertices are rounded to 1/256 of a pixel,
/// and a skirt may be seen from almost above.
const RASTER_PX: f64 = 0.125;

/// Factor on error margins, so that rounding never allows more than [`crate::view::Allowance::error`].
const GUARD: f32 = 1.0 - 1.0 / 16384.0;
/// Relative bound on the rounding of a sum along a direction.
const SLACK: f32 = 1.0 / (1 << 19) as f32;
/// Maximum absolute coordinate, metres.
const FARTHEST: f32 = 1e12;
/// Maximum depth, metres; a smaller depth allows less.
const DEEPEST: f32 = 1e10;
/// Minimum of errors and of squared lengths.
const MIN: f32 = 1e-18;
/// Minimum error, metres, unless it is 0.
const MIN_ERROR: f32 = 1e-12;
/// Error margin of a node without error.
pub const WITHOUT_ERROR: f32 = 1e30;

/// Evaluates nodes of a quadtree for one view.
pub struct LodEvaluator<'a> {
    /// The quadtree.
    pub tree: &'a Tree,
    /// The view, as uploaded to the device.
    pub view: ClusterView,
    /// Distances at which levels morph, with `morph=distance`.
    pub ranges: MorphRanges,
}

/// Four boxes relative to the eye, metres, one per lane: x, y and z.
#[derive(Clone, Copy, Debug)]
struct Extents {
    low: [Vec4; 3],
    high: [Vec4; 3],
}

/// Containment and error margin of a node; `None` if it has no data.
pub type NodeVisibility = Option<(Containment, f32)>;

impl<'a> LodEvaluator<'a> {
    /// Creates the evaluator of a view whose morph band is from error margin 1 to `band_end`. Without `culls`,
    /// invisible nodes are refined too, so that rotating the eye does not change visible ones.
    pub fn new(tree: &'a Tree, view: &View, band_end: f32, culls: bool) -> Self {
        Self { tree, view: cluster_view(tree, view, band_end, culls), ranges: MorphRanges::default() }
    }

    /// Creates the evaluator of a view in which vertices morph to the next level by their own distance.
    pub fn by_distance(tree: &'a Tree, view: &View) -> Self {
        let ranges = MorphRanges::new(tree, view);
        let base = cluster_view(tree, view, NODE_END, true);
        let view = ClusterView { metric: DISTANCE, band_scale: 0.0, above_squared: ranges.above_squared, ..base };
        Self { tree, view, ranges }
    }

    /// Returns true if vertices morph to the next level by their own distance.
    pub fn is_by_distance(&self) -> bool {
        self.view.metric == DISTANCE
    }

    /// Returns true if a node has data, and is visible if nodes are culled.
    pub fn draws(&self, node: Node) -> bool {
        self.tree.square(node).is_some()
            && (self.view.culls == 0 || self.containment(node).is_some_and(|found| found != Containment::Outside))
    }

    /// Returns the containment of a node in the frustum, `Crossing` if uncertain; `None` if it has no data.
    pub fn containment(&self, node: Node) -> Option<Containment> {
        let square = self.tree.square(node)?;
        Some(self.contained(&self.extent(node, square))[0])
    }

    /// Returns the error that corresponds to [`RASTER_PX`] in a node, metres; `None` if it has no data.
    pub fn raster_m(&self, node: Node) -> Option<f32> {
        let square = self.tree.square(node)?;
        Some(self.over(self.view.skirt_scale, &self.extent(node, square), Vec4::ONE).x)
    }

    /// Evaluates a single node.
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

    /// Evaluates the children of a node. `around` is the node's own containment, `squares` its children's data.
    #[inline]
    pub fn evaluate_children(&self, node: Node, around: Containment, squares: &Squares) -> [NodeVisibility; 4] {
        let extents = self.children(node, squares);
        // A node that no plane crosses passes its containment on to its children.
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

    /// Returns the containment of each child of a node; `Outside` for those without data.
    pub fn contained_in(&self, node: Node) -> [Containment; 4] {
        let squares = self.tree.squares(node);
        let (has_terrain, contained) = (squares.has_terrain(), self.contained(&self.children(node, &squares)));
        [0, 1, 2, 3].map(|k| if has_terrain >> k & 1 == 1 { contained[k] } else { Containment::Outside })
    }

    /// Returns the boxes around the children of a node.
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

    /// Returns the box around a node in every lane.
    fn extent(&self, node: Node, Square { range: [low, high], .. }: Square) -> Extents {
        let at = |[x, z]: [u32; 2], y: f32| {
            [Vec4::splat(self.metres(x, 0)), self.above(Vec4::splat(y)), Vec4::splat(self.metres(z, 1))]
        };
        let [first, end] = self.tree.corners(node);
        Extents { low: at(first, low), high: at(end, high) }
    }

    /// Returns the position of a sample relative to the eye along x or z, metres.
    #[inline]
    fn metres(&self, at: u32, axis: usize) -> f32 {
        let metres = (at as i32 - self.view.origin.at[axis]) as f32 * self.view.spacing[axis];
        (metres + self.view.origin.relative[axis]).clamp(-FARTHEST, FARTHEST)
    }

    /// Returns heights relative to the eye, metres.
    #[inline]
    fn above(&self, heights: Vec4) -> Vec4 {
        let above = (heights - self.view.origin.height) + self.view.origin.height_relative;
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

    /// Returns the allowed error divided by the errors of a level, never above the exact value; below 1 a node is too
    /// coarse. With `morph=distance`: the squared distance divided by that at which the morph into the level begins.
    #[inline]
    fn error_margins(&self, level: u32, extents: &Extents, errors: Vec4) -> Vec4 {
        if self.is_by_distance() {
            return self.ranges.ranges[level as usize] * squared_in_plan(extents, self.ranges.above_squared);
        }
        self.over(self.view.scale, extents, errors)
    }

    /// The same for a scale like [`ClusterView::scale`].
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

/// Returns 1 / √x, never above it and at most 5 · 10⁻⁶ below. The initial estimate is from Lomont, "Fast Inverse Square
/// Root" (2003).
#[inline]
fn inverse_roots(x: Vec4) -> Vec4 {
    let start = |x: f32| f32::from_bits(0x5f37_5a86_u32.wrapping_sub(x.to_bits() >> 1));
    let newton = |y: Vec4| y * (1.5 - (0.5 * x) * (y * y));
    newton(newton(Vec4::new(start(x.x), start(x.y), start(x.z), start(x.w))))
}

/// Returns the distances of boxes from the eye, metres.
#[inline]
fn distance(extents: &Extents) -> Vec4 {
    let away = |k: usize| extents.low[k].max(-extents.high[k]).max(Vec4::ZERO);
    let [x, y, z] = [away(0), away(1), away(2)];
    let square = ((x * x + y * y) + z * z).max(Vec4::splat(MIN));
    square * inverse_roots(square)
}

/// Returns the squared distances in plan plus a squared height, like `draw::distance::squared` at each box's nearest
/// point.
#[inline]
fn squared_in_plan(extents: &Extents, above_squared: f32) -> Vec4 {
    let away = |k: usize| extents.low[k].max(-extents.high[k]).max(Vec4::ZERO);
    let [x, z] = [away(0), away(2)];
    (x * x + z * z) + above_squared
}

/// Returns the largest horizontal distances of boxes from the eye, metres.
#[inline]
fn farthest_aside(extents: &Extents) -> Vec4 {
    let far = |k: usize| extents.low[k].abs().max(extents.high[k].abs());
    let [x, z] = [far(0), far(2)];
    let square = (x * x + z * z).max(Vec4::splat(MIN));
    square * inverse_roots(square)
}

/// Returns the minimum and the maximum of `direction · p` over each box, and the maximum sum of its terms' magnitudes.
#[inline]
fn along(direction: [f32; 3], extents: &Extents) -> [Vec4; 3] {
    let ends = |k: usize| (direction[k] * extents.low[k], direction[k] * extents.high[k]);
    let [x, y, z] = [ends(0), ends(1), ends(2)];
    let sum = |of: fn(Vec4, Vec4) -> Vec4| (of(x.0, x.1) + of(y.0, y.1)) + of(z.0, z.1);
    [sum(Vec4::min), sum(Vec4::max), sum(|a, b| a.abs().max(b.abs()))]
}

/// Converts a value to single precision, clamped so that host and device compute the same.
fn single(value: f64) -> f32 {
    if value.abs() < 1e-12 { 0.0 } else { value.clamp(-f64::from(FARTHEST), FARTHEST.into()) as f32 }
}

fn cluster_view(tree: &Tree, view: &View, band_end: f32, culls: bool) -> ClusterView {
    let origin = RenderOrigin::new(tree.origin, tree.spacing, view.eye);
    let planes = view.planes().map(|(normal, distance)| {
        let [x, y, z] = normal.to_array().map(single);
        [x, y, z, single(distance)]
    });
    let lean = view.forward().y.abs();
    let (metric, scale) = match (view.lens, view.tolerance.metric) {
        // An infinite tolerance makes every node fine enough, also in front of the eye.
        _ if view.tolerance.px == f64::INFINITY => (EVEN, 0.0),
        (Lens::Orthographic { .. }, Metric::Paper) => (EVEN, 1.0),
        (Lens::Orthographic { .. }, Metric::Certified) => (EVEN, (1.0 - lean * lean).max(0.0).sqrt()),
        (Lens::Perspective { .. }, Metric::Paper) => (PAPER, 1.0),
        (Lens::Perspective { .. }, Metric::Certified) => (CERTIFIED, 1.0),
    };
    let scale_for = |px: f64| single(scale * view.focal_px() / px);
    let corner = view.corner_ray();
    ClusterView {
        origin: RenderOrigin {
            at: origin.at,
            relative: origin.relative.map(|metres| single(metres.into())),
            height: single(origin.height.into()),
            height_relative: single(origin.height_relative.into()),
        },
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

    /// Returns a deterministic number in 0..1.
    fn random(seed: &mut u64) -> f64 {
        *seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (*seed >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Returns trees of small and of very large fields, near the origin and far from it.
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

    fn random_view(tree: &Tree, seed: &mut u64) -> View {
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

    /// Returns a node of any level, half of them near the eye.
    fn random_node(tree: &Tree, view: &View, seed: &mut u64) -> Node {
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
    fn rounding_is_conservative() {
        let mut seed = 3;
        let (mut closest, mut farthest, mut doubtful_counts) = (0.0f64, 1.0f64, [0, 0]);
        for tree in trees(&mut seed) {
            for _ in 0..200_000 {
                let view = random_view(&tree, &mut seed);
                let evaluator = LodEvaluator::new(&tree, &view, 1.0, true);
                let node = random_node(&tree, &view, &mut seed);
                let Some(square) = tree.square(node) else { continue };
                let exact = world_box(&tree, node, square.range);
                let error = 10f32.powf(6.0 * random(&mut seed) as f32 - 4.0);
                let error_margin =
                    evaluator.error_margins(node.level, &evaluator.extent(node, square), Vec4::splat(error)).x;
                let allowed = f64::from(error_margin) * f64::from(error);
                let share = allowed / view.allowed_error(&exact).min(1e12);
                assert!(share < 1.0, "{share} of the allowed error at {node:?}, {view:?}");
                closest = closest.max(share);
                // If a box is much wider than distant, the bound along the view axis is loose.
                let wide = (exact.max - exact.min).length() > 1000.0 * exact.distance(view.eye).max(view.near);
                farthest = if wide { farthest } else { farthest.min(share) };
                let (found, truly) = (evaluator.containment(node).unwrap(), view.frustum().contains(&exact));
                let doubtful = found == Containment::Crossing && truly != found;
                assert!(found == truly || doubtful, "{found:?}, truly {truly:?}: {node:?}, {view:?}");
                doubtful_counts[usize::from(doubtful)] += 1;
            }
        }
        println!("{farthest} to {closest} of the allowed error, containment in doubt: {doubtful_counts:?}");
        assert!(closest > 0.9999 && farthest > 0.99, "{farthest} to {closest} of the allowed error");
        assert!(doubtful_counts[0] > 10_000 * doubtful_counts[1], "{doubtful_counts:?} in doubt");
    }

    #[test]
    fn children_match_single_evaluation() {
        let mut seed = 5;
        let mut seen = [0; 3];
        for tree in trees(&mut seed) {
            for _ in 0..20_000 {
                let view = random_view(&tree, &mut seed);
                let evaluator = LodEvaluator::new(&tree, &view, 1.0, true);
                let node = random_node(&tree, &view, &mut seed);
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
