//! Tests whether polygons are hidden, by comparison with the depth buffer of the finished frame.

use glam::DVec4;

/// Depth buffer of a frame.
pub struct Depths<'a> {
    /// Size of the picture (x, y), pixels.
    pub size: [u32; 2],
    /// Reversed depth of each pixel, row by row from the top; 0 where nothing was drawn.
    pub values: &'a [f32],
}

/// Smallest relative difference of depth that counts as hidden. It covers the rounding of the depth buffer.
const MARGIN: f64 = 1e-3;

/// Share by which the corners of a polygon are moved towards its centre before the test, as a neighbour may be in front
/// along its edges.
const INWARD: f64 = 0.1;

impl Depths<'_> {
    /// Returns true if a polygon is hidden: its centre and all its corners, moved inward. The polygon is in clip space
    /// and lies inside the picture.
    pub fn hide(&self, polygon: &[DVec4]) -> bool {
        let middle = polygon.iter().sum::<DVec4>() / polygon.len() as f64;
        let inward = polygon.iter().map(|corner| corner.lerp(middle, INWARD));
        inward.chain([middle]).all(|place| self.hides(place))
    }

    /// Returns true if a point in clip space lies behind what was drawn at its pixel and at the eight pixels around it.
    /// One pixel is not enough, as it contains near and far terrain at grazing angles.
    fn hides(&self, place: DVec4) -> bool {
        let [w, h] = self.size.map(|n| n as i64);
        let pixel = |n: f64, count: i64| ((n / place.w + 1.0) / 2.0 * count as f64).floor() as i64;
        let (x, y) = (pixel(place.x, w), pixel(place.y, h));
        let depth = place.z / place.w;
        let around = (-1..=1).flat_map(|j| (-1..=1).map(move |i| [(x + i).clamp(0, w - 1), (y + j).clamp(0, h - 1)]));
        around.map(|[x, y]| f64::from(self.values[(y * w + x) as usize])).all(|drawn| depth < drawn * (1.0 - MARGIN))
    }
}
