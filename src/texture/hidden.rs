//! Which land other land hides, by a picture of the nearest wedges with few samples.
//!
//! A working set of all that lies in the frustum pays for hills behind hills. What is hidden at every sample needs no
//! texels; what lies between samples is taken to be seen if any sample beside it sees as far. It is textures that are
//! chosen by this, not triangles: a sliver missed is drawn with a coarser node.

use glam::DVec2;

/// By how much land may lie behind the nearest and still be seen: it is the same surface.
const SAME: f64 = 0.01;

/// A convex outline on the screen, pixels from the picture's middle, and how near it is: a plane over the screen.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Outline {
    /// Corners in order.
    pub corners: Vec<DVec2>,
    /// Nearness at the middle and its change by pixel: 1 / depth through a pinhole, −depth in parallel projection.
    pub nearness: [f64; 3],
}

impl Outline {
    fn nearness(&self, at: DVec2) -> f64 {
        self.nearness[0] + self.nearness[1] * at.x + self.nearness[2] * at.y
    }
}

/// Nearness of what is seen at each sample.
#[derive(Clone, Debug)]
pub struct Depths {
    count: [usize; 2],
    /// Pixels between samples.
    step_px: f64,
    nearest: Vec<f64>,
}

impl Depths {
    /// For pictures of a size, with samples so many pixels apart.
    pub fn new(size: [u32; 2], step_px: f64) -> Self {
        let count = size.map(|n| (f64::from(n) / step_px).ceil() as usize);
        Self { count, step_px, nearest: vec![f64::NEG_INFINITY; count[0] * count[1]] }
    }

    /// Where a sample lies, pixels from the picture's middle.
    fn place(&self, [i, j]: [usize; 2]) -> DVec2 {
        let [w, h] = self.count.map(|n| n as f64);
        DVec2::new(i as f64 + 0.5 - w / 2.0, j as f64 + 0.5 - h / 2.0) * self.step_px
    }

    /// Calls `visit` with the samples in an outline, until it says to stop.
    fn any_in(&self, outline: &Outline, mut visit: impl FnMut(usize, DVec2) -> bool) -> bool {
        let [w, h] = self.count;
        let of_row = |j: usize| {
            let y = self.place([0, j]).y;
            let [first, end] = crossing(&outline.corners, y).map(|x| x / self.step_px + w as f64 / 2.0 - 0.5);
            let columns = first.ceil().max(0.0) as usize..((end.floor() + 1.0).max(0.0) as usize).min(w);
            (columns, y)
        };
        let lowest = outline.corners.iter().map(|at| at.y).fold(f64::INFINITY, f64::min);
        let highest = outline.corners.iter().map(|at| at.y).fold(f64::NEG_INFINITY, f64::max);
        let [first, end] = [lowest, highest].map(|y| (y / self.step_px + h as f64 / 2.0 - 0.5).max(-1.0));
        (first.ceil() as usize..((end.floor() + 1.0) as usize).min(h)).any(|j| {
            let (columns, y) = of_row(j);
            columns.into_iter().any(|i| visit(j * w + i, DVec2::new(self.place([i, j]).x, y)))
        })
    }

    /// Adds what hides.
    pub fn cover(&mut self, outline: &Outline) {
        let mut nearest = std::mem::take(&mut self.nearest);
        self.any_in(outline, |k, at| {
            nearest[k] = nearest[k].max(outline.nearness(at));
            false
        });
        self.nearest = nearest;
    }

    /// Whether any of an outline may be seen.
    pub fn sees(&self, outline: &Outline) -> bool {
        let is_seen = |k: usize, at: DVec2| outline.nearness(at) >= self.nearest[k] - SAME * self.nearest[k].abs();
        let mut is_sampled = false;
        let is_seen_at_a_sample = self.any_in(outline, |k, at| {
            is_sampled = true;
            is_seen(k, at)
        });
        is_seen_at_a_sample || !is_sampled && self.beside(outline).any(|k| is_seen(k, middle(outline)))
    }

    /// The samples around an outline's middle.
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

fn middle(outline: &Outline) -> DVec2 {
    outline.corners.iter().sum::<DVec2>() / outline.corners.len().max(1) as f64
}

/// Where a row enters and leaves a convex outline.
fn crossing(corners: &[DVec2], y: f64) -> [f64; 2] {
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
    fn what_lies_behind_is_hidden_and_what_sticks_out_is_not() {
        let mut depths = Depths::new([64, 48], 4.0);
        depths.cover(&square(DVec2::ZERO, 12.0, 0.1));
        assert!(!depths.sees(&square(DVec2::ZERO, 8.0, 0.05)));
        assert!(!depths.sees(&square(DVec2::new(1.0, 1.0), 0.5, 0.05)), "between samples");
        assert!(depths.sees(&square(DVec2::ZERO, 8.0, 0.2)), "in front");
        assert!(depths.sees(&square(DVec2::ZERO, 8.0, 0.0995)), "the same surface");
        assert!(depths.sees(&square(DVec2::new(10.0, 0.0), 8.0, 0.05)), "sticks out");
        assert!(depths.sees(&square(DVec2::new(20.0, 9.0), 0.5, 0.05)), "beside");
    }

    #[test]
    fn an_outline_has_the_samples_that_lie_in_it() {
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
            expected += usize::from(is_in(depths.place([i, j])));
        }
        assert_eq!(found, expected);
        assert!(expected > 300);
    }
}
