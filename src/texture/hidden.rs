//! A coarse depth buffer that finds which wedges are hidden behind other terrain.
//!
//! A working set of everything in the frustum would load texels for hidden hills. A wedge hidden at every sample
//! needs no texels. A wedge that covers no sample counts as visible if any of the four samples around it does not
//! hide it. Only textures are chosen by this test, not triangles: a missed sliver is drawn with a coarser tile.

use glam::DVec2;

/// Relative depth tolerance: terrain at most this much behind the nearest counts as the same surface.
const SAME: f64 = 0.01;

/// A convex polygon on the screen and its depth plane. Coordinates are pixels from the image centre, y down.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Outline {
    /// Corners in order, pixels.
    pub corners: Vec<DVec2>,
    /// Nearness at the image centre and its gradient per pixel along x and y. Nearness is 1 / depth in perspective
    /// and −depth in orthographic projection.
    pub nearness: [f64; 3],
}

impl Outline {
    fn nearness(&self, at: DVec2) -> f64 {
        self.nearness[0] + self.nearness[1] * at.x + self.nearness[2] * at.y
    }
}

/// A grid of samples over the image with the nearness of the closest occluder at each.
#[derive(Clone, Debug)]
pub struct Depths {
    count: [usize; 2],
    /// Pixels between samples.
    step_px: f64,
    nearest: Vec<f64>,
}

impl Depths {
    /// Creates an empty buffer for images of `size` pixels with a sample every `step_px` pixels.
    pub fn new(size: [u32; 2], step_px: f64) -> Self {
        let count = size.map(|n| (f64::from(n) / step_px).ceil() as usize);
        Self { count, step_px, nearest: vec![f64::NEG_INFINITY; count[0] * count[1]] }
    }

    /// Returns the position of a sample, pixels from the image centre.
    fn position(&self, [i, j]: [usize; 2]) -> DVec2 {
        let [w, h] = self.count.map(|n| n as f64);
        DVec2::new(i as f64 + 0.5 - w / 2.0, j as f64 + 0.5 - h / 2.0) * self.step_px
    }

    /// Calls `visit` for each sample inside an outline until it returns true. Returns true if it did.
    fn any_in(&self, outline: &Outline, mut visit: impl FnMut(usize, DVec2) -> bool) -> bool {
        let [w, h] = self.count;
        let of_row = |j: usize| {
            let y = self.position([0, j]).y;
            let [first, end] = row_span(&outline.corners, y).map(|x| x / self.step_px + w as f64 / 2.0 - 0.5);
            let columns = first.ceil().max(0.0) as usize..((end.floor() + 1.0).max(0.0) as usize).min(w);
            (columns, y)
        };
        let lowest = outline.corners.iter().map(|at| at.y).fold(f64::INFINITY, f64::min);
        let highest = outline.corners.iter().map(|at| at.y).fold(f64::NEG_INFINITY, f64::max);
        let [first, end] = [lowest, highest].map(|y| (y / self.step_px + h as f64 / 2.0 - 0.5).max(-1.0));
        (first.ceil() as usize..((end.floor() + 1.0) as usize).min(h)).any(|j| {
            let (columns, y) = of_row(j);
            columns.into_iter().any(|i| visit(j * w + i, DVec2::new(self.position([i, j]).x, y)))
        })
    }

    /// Adds an occluder.
    pub fn add_occluder(&mut self, outline: &Outline) {
        let mut nearest = std::mem::take(&mut self.nearest);
        self.any_in(outline, |k, at| {
            nearest[k] = nearest[k].max(outline.nearness(at));
            false
        });
        self.nearest = nearest;
    }

    /// Returns true if any part of an outline may be visible.
    pub fn is_visible(&self, outline: &Outline) -> bool {
        let is_seen = |k: usize, at: DVec2| outline.nearness(at) >= self.nearest[k] - SAME * self.nearest[k].abs();
        let mut is_sampled = false;
        let is_seen_at_a_sample = self.any_in(outline, |k, at| {
            is_sampled = true;
            is_seen(k, at)
        });
        is_seen_at_a_sample || !is_sampled && self.beside(outline).any(|k| is_seen(k, middle(outline)))
    }

    /// Returns the four samples around an outline's centre.
    fn beside(&self, outline: &Outline) -> impl Iterator<Item = usize> {
        let [w, h] = self.count;
        let at = middle(outline) / self.step_px;
        let [i, j] = [at.x + w as f64 / 2.0 - 0.5, at.y + h as f64 / 2.0 - 0.5].map(f64::floor);
        let inside = |n: f64, count: usize| (n.max(0.0) as usize).min(count - 1);
        [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]]
            .into_iter()
            .map(move |[x, y]| inside(j + y, h) * w + inside(i + x, w))
    }
}

/// Returns the mean of an outline's corners.
fn middle(outline: &Outline) -> DVec2 {
    outline.corners.iter().sum::<DVec2>() / outline.corners.len().max(1) as f64
}

/// Returns the x interval in which a row crosses a convex polygon; empty (∞, −∞) if it does not.
fn row_span(corners: &[DVec2], y: f64) -> [f64; 2] {
    let edges = corners.iter().zip(corners.iter().cycle().skip(1));
    let crossed = edges.filter(|(a, b)| (a.y > y) != (b.y > y));
    let at = crossed.map(|(a, b)| a.x + (b.x - a.x) * (y - a.y) / (b.y - a.y));
    at.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| [low.min(x), high.max(x)])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square(middle: DVec2, half: f64, nearness: f64) -> Outline {
        let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
        Outline { corners: corners.map(|c| middle + DVec2::from(c) * half).to_vec(), nearness: [nearness, 0.0, 0.0] }
    }

    #[test]
    fn outlines_behind_an_occluder_are_hidden_unless_they_stick_out() {
        let mut depths = Depths::new([64, 48], 4.0);
        depths.add_occluder(&square(DVec2::ZERO, 12.0, 0.1));
        assert!(!depths.is_visible(&square(DVec2::ZERO, 8.0, 0.05)));
        assert!(!depths.is_visible(&square(DVec2::new(1.0, 1.0), 0.5, 0.05)), "between samples");
        assert!(depths.is_visible(&square(DVec2::ZERO, 8.0, 0.2)), "in front");
        assert!(depths.is_visible(&square(DVec2::ZERO, 8.0, 0.0995)), "the same surface");
        assert!(depths.is_visible(&square(DVec2::new(10.0, 0.0), 8.0, 0.05)), "sticks out");
        assert!(depths.is_visible(&square(DVec2::new(20.0, 9.0), 0.5, 0.05)), "beside");
    }

    #[test]
    fn an_outline_visits_exactly_the_samples_inside_it() {
        let depths = Depths::new([64, 48], 1.0);
        let outline = Outline {
            corners: vec![DVec2::new(-40.0, -3.2), DVec2::new(20.3, 10.7), DVec2::new(-7.9, 30.0)],
            ..Outline::default()
        };
        let (mut found, mut expected) = (0, 0);
        depths.any_in(&outline, |_, _| {
            found += 1;
            false
        });
        let is_in = |at: DVec2| {
            let c = &outline.corners;
            (0..3).all(|k| (c[(k + 1) % 3] - c[k]).perp_dot(at - c[k]) > 0.0)
        };
        for (i, j) in (0..64).flat_map(|i| (0..48).map(move |j| (i, j))) {
            expected += usize::from(is_in(depths.position([i, j])));
        }
        assert_eq!(found, expected);
        assert!(expected > 300);
    }
}
