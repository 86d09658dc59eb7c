//! The footprint of a view: what the frustum and the slab between the lowest and the highest land have in common,
//! seen from above (Finch & Bishop, §4.3). A convex polygon, rastered to pages.

use glam::{DMat3, DVec2, DVec3};

use super::pages::Grid;
use crate::view::{Aabb, View};

/// What rounding may put outside, relative to the size of what is cut.
const SLACK: f64 = 1e-9;

/// Half-spaces `normal · p ≥ offset`.
type Planes = Vec<(DVec3, f64)>;

/// The footprint of a view on a box of land: a convex polygon in plan (x, z), metres from the box's first corner,
/// counter-clockwise in x and z. Empty if the frustum misses the box.
pub fn footprint(view: &View, land: &Aabb) -> Vec<DVec2> {
    let size = (land.max - land.min).max_element().max((view.eye - land.min).abs().max_element()).max(1e-30);
    let eye = (view.eye - land.min) / size;
    let extent = (land.max - land.min) / size;
    let mut planes: Planes =
        [DVec3::X, DVec3::Y, DVec3::Z].into_iter().flat_map(|n| [(n, 0.0), (-n, -n.dot(extent))]).collect();
    planes.extend(view.planes().map(|(n, distance)| (n, n.dot(eye) - distance / size)));
    let corners = corners(&planes);
    hull(corners.iter().map(|p| DVec2::new(p.x, p.z) * size).collect())
}

/// Corners of the convex body in all half-spaces: wherever three planes meet inside the others.
fn corners(planes: &Planes) -> Vec<DVec3> {
    let mut corners = Vec::new();
    for (k, a) in planes.iter().enumerate() {
        for (l, b) in planes.iter().enumerate().skip(k + 1) {
            for c in &planes[l + 1..] {
                let normals = DMat3::from_cols(a.0, b.0, c.0).transpose();
                if normals.determinant().abs() < 1e-12 {
                    continue;
                }
                let p = normals.inverse() * DVec3::new(a.1, b.1, c.1);
                if planes.iter().all(|(n, offset)| n.dot(p) >= offset - SLACK) {
                    corners.push(p);
                }
            }
        }
    }
    corners
}

/// The convex hull, counter-clockwise.
fn hull(mut points: Vec<DVec2>) -> Vec<DVec2> {
    points.sort_by(|p, q| p.x.total_cmp(&q.x).then(p.y.total_cmp(&q.y)));
    points.dedup();
    let half = |points: &mut dyn Iterator<Item = DVec2>| {
        let mut chain: Vec<DVec2> = Vec::new();
        for p in points {
            while chain.len() > 1
                && (chain[chain.len() - 1] - chain[chain.len() - 2]).perp_dot(p - chain[chain.len() - 2]) <= 0.0
            {
                chain.pop();
            }
            chain.push(p);
        }
        chain
    };
    let (mut lower, mut upper) = (half(&mut points.iter().copied()), half(&mut points.iter().rev().copied()));
    if points.len() > 1 {
        lower.pop();
        upper.pop();
        lower.append(&mut upper);
    }
    lower
}

/// Calls `visit` for each page that a polygon (metres from the first sample) touches, row by row. A sliver more than
/// it touches, so that none is missed by rounding.
pub fn raster(polygon: &[DVec2], spacing: [f64; 2], grid: &Grid, mut visit: impl FnMut([i32; 2])) {
    let page_m = spacing.map(|s| s * f64::from(grid.side()));
    let points: Vec<DVec2> = polygon.iter().map(|p| DVec2::new(p.x / page_m[0], p.y / page_m[1])).collect();
    let margin = 1e-6;
    let ends = |low: f64, high: f64, count: u32| {
        let first = (low - margin).floor().max(0.0) as i32;
        first..((high + margin).floor() + 1.0).clamp(0.0, f64::from(count)) as i32
    };
    let span = |values: &mut dyn Iterator<Item = f64>| {
        values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], n| [low.min(n), high.max(n)])
    };
    let [low, high] = span(&mut points.iter().map(|p| p.y));
    for row in ends(low, high, grid.count[1]) {
        let [from, to] = [f64::from(row) - margin, f64::from(row + 1) + margin];
        let edges = (0..points.len()).map(|k| (points[k], points[(k + 1) % points.len()]));
        let mut crossed = edges.flat_map(|(p, q)| {
            let cut = |z: f64| ((p.y < z) != (q.y < z)).then(|| p.x + (q.x - p.x) * ((z - p.y) / (q.y - p.y)));
            let inside = (from..=to).contains(&p.y).then_some(p.x);
            [cut(from), cut(to), inside].into_iter().flatten()
        });
        let [west, east] = span(&mut crossed);
        ends(west, east, grid.count[0]).for_each(|column| visit([column, row]));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::{Containment, Lens, Metric, Tolerance};

    fn random(seed: &mut u64) -> f64 {
        *seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (*seed >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Every page with a point in sight is touched, and few others are: what is seen is found by throwing points.
    #[test]
    fn it_holds_all_that_is_in_sight() {
        let mut seed = 1;
        let (grid, spacing) = (Grid { level: 4, count: [20, 13], last: [319, 200] }, [3.0, 5.0]);
        let land = Aabb { min: DVec3::ZERO, max: DVec3::new(319.0 * 3.0, 120.0, 200.0 * 5.0) };
        let (mut touched_in_all, mut seen_in_all) = (0, 0);
        for k in 0..400 {
            let rotation = View::turned(360.0 * random(&mut seed), 180.0 * random(&mut seed) - 90.0, 30.0);
            let eye = (DVec3::new(random(&mut seed), random(&mut seed), random(&mut seed)) * 2.0 - 0.5) * land.max;
            let lens = match k % 3 {
                0 => Lens::Orthographic { width: 700.0 * random(&mut seed), far: 1e5 },
                _ => Lens::Perspective { fov_x: 0.1 + 2.0 * random(&mut seed) },
            };
            let tolerance = Tolerance { px: 1.0, metric: Metric::Certified };
            let view = View { eye, world_from_eye: rotation, lens, size: [320, 200], near: 0.1, tolerance };
            let mut touched = vec![false; 20 * 13];
            raster(&footprint(&view, &land), spacing, &grid, |at| touched[grid.index(at).unwrap()] = true);
            let frustum = view.frustum();
            let mut seen = vec![false; 20 * 13];
            for _ in 0..20_000 {
                let p = DVec3::new(random(&mut seed), random(&mut seed), random(&mut seed)) * land.max;
                if frustum.contains(&Aabb { min: p, max: p }) != Containment::Outside {
                    seen[grid.index([(p.x / 48.0) as i32, (p.z / 80.0) as i32]).unwrap()] = true;
                }
            }
            for page in 0..touched.len() {
                assert!(touched[page] || !seen[page], "view {k}: page {page}");
            }
            touched_in_all += touched.iter().filter(|t| **t).count();
            seen_in_all += seen.iter().filter(|t| **t).count();
        }
        assert!(seen_in_all > 1000 && touched_in_all < seen_in_all * 3 / 2, "{touched_in_all} for {seen_in_all}");
    }
}
