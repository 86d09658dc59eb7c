//! What land in front hides: places held against the depth of the finished frame.

use glam::DVec4;

/// The depth that a frame left, row by row from the top; reversed, 0 where nothing was drawn.
pub struct Depths<'a> {
    /// Pixels (x, y).
    pub size: [u32; 2],
    /// One a pixel.
    pub values: &'a [f32],
}

/// How much deeper than what was drawn there a place must lie: depths are rounded.
const MARGIN: f64 = 1e-3;

/// How far the corners of a polygon are drawn towards its middle before they are looked at: on an edge its
/// neighbour may be in front.
const INWARD: f64 = 0.1;

impl Depths<'_> {
    /// Whether a polygon in clip space, inside the picture, is hidden: its middle and all its corners, drawn inward.
    pub fn hide(&self, polygon: &[DVec4]) -> bool {
        let middle = polygon.iter().sum::<DVec4>() / polygon.len() as f64;
        let inward = polygon.iter().map(|corner| corner.lerp(middle, INWARD));
        inward.chain([middle]).all(|place| self.hides(place))
    }

    /// Whether a place is deeper than all that was drawn around its pixel: at a grazing angle one pixel holds land near
    /// and far.
    fn hides(&self, place: DVec4) -> bool {
        let [w, h] = self.size.map(|n| n as i64);
        let pixel = |n: f64, count: i64| ((n / place.w + 1.0) / 2.0 * count as f64).floor() as i64;
        let (x, y) = (pixel(place.x, w), pixel(place.y, h));
        let depth = place.z / place.w;
        let around = (-1..=1).flat_map(|j| (-1..=1).map(move |i| [(x + i).clamp(0, w - 1), (y + j).clamp(0, h - 1)]));
        around.map(|[x, y]| f64::from(self.values[(y * w + x) as usize])).all(|drawn| depth < drawn * (1.0 - MARGIN))
    }
}
