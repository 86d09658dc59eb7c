//! Visibility of places, by comparison with the depth buffer of the finished frame.

use glam::DVec4;

/// The depth that a frame left, row by row from the top; reversed, 0 where nothing was drawn.
pub struct Depths<'a> {
    /// Pixels (x, y).
    pub size: [u32; 2],
    /// One a pixel.
    pub values: &'a [f32],
}

/// Smallest relative difference of depth that hides a place: depths are rounded.
const MARGIN: f64 = 1e-3;

/// Share by which the corners of a polygon are moved towards its middle before the test: on its edge a neighbour may be
/// in front.
const INWARD: f64 = 0.1;

impl Depths<'_> {
    /// Returns true if a polygon in clip space, inside the picture, is hidden: its middle and all its corners, moved inward.
    pub fn hide(&self, polygon: &[DVec4]) -> bool {
        let middle = polygon.iter().sum::<DVec4>() / polygon.len() as f64;
        let inward = polygon.iter().map(|corner| corner.lerp(middle, INWARD));
        inward.chain([middle]).all(|place| self.hides(place))
    }

    /// Returns true if a place is deeper than all drawn depths around its pixel: at a grazing angle one pixel holds near
    /// and far terrain.
    fn hides(&self, place: DVec4) -> bool {
        let [w, h] = self.size.map(|n| n as i64);
        let pixel = |n: f64, count: i64| ((n / place.w + 1.0) / 2.0 * count as f64).floor() as i64;
        let (x, y) = (pixel(place.x, w), pixel(place.y, h));
        let depth = place.z / place.w;
        let around = (-1..=1).flat_map(|j| (-1..=1).map(move |i| [(x + i).clamp(0, w - 1), (y + j).clamp(0, h - 1)]));
        around.map(|[x, y]| f64::from(self.values[(y * w + x) as usize])).all(|drawn| depth < drawn * (1.0 - MARGIN))
    }
}
