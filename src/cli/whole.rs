//! The default view, which shows the whole field.

use glam::{DMat3, DVec2, DVec3};

use crate::height::Field;
use crate::view::{Lens, Metric, Tolerance, View};

/// Extent of a field, and an eye that sees all of it.
pub struct Whole {
    /// World position of the field's centre at mean height, metres.
    pub centre: DVec3,
    /// Largest distance of a corner of the field's bounding box from the centre, metres.
    pub radius: f64,
    /// World position of the eye, above and to the south of the field, metres.
    pub eye: DVec3,
    /// Rotation of the eye, from eye to world axes.
    pub world_from_eye: DMat3,
}

impl Whole {
    /// Finds the view of a field for a horizontal field of view of `fov` degrees and a picture of `size` (x, y) pixels.
    /// The nearest eye is chosen for which the bounding box fills at most 94 % of the picture.
    pub fn of(field: &Field, fov: f64, size: [u32; 2]) -> Self {
        let statistics = field.statistics();
        let [w, h] = field.size().map(|n| f64::from(n - 1));
        let centre = field.world_at(w / 2.0, h / 2.0, statistics.mean);
        let corners: Vec<_> = [statistics.min, statistics.max]
            .into_iter()
            .flat_map(|y| [(0.0, 0.0), (w, 0.0), (0.0, h), (w, h)].map(|(i, j)| field.world_at(i, j, f64::from(y))))
            .collect();
        let radius = corners.iter().map(|c| c.distance(centre)).fold(0.0, f64::max);
        let direction = DVec3::new(0.35, 0.6, 1.0).normalize_or(DVec3::Y);
        let picture = DVec2::new(f64::from(size[0]), f64::from(size[1]));
        let at = |distance: f64, aside: DVec3| View {
            eye: centre + direction * distance + aside,
            world_from_eye: View::looking_along(-direction),
            lens: Lens::Perspective { fov_x: fov.to_radians() },
            size,
            near: radius * 1e-3,
            tolerance: Tolerance { px: 1.0, metric: Metric::Certified },
            time_s: 0.0,
        };
        // Corners (low, high) of the rectangle around the bounding box on the screen; `None` if part of it is behind
        // the eye.
        let outline = |view: &View| {
            let seen: Option<Vec<_>> = corners.iter().map(|&c| view.project(c).map(|p| p.pixel)).collect();
            seen.map(|s| (s.iter().copied().fold(s[0], DVec2::min), s.iter().copied().fold(s[0], DVec2::max)))
        };
        // Starts far away and approaches as long as the bounding box fits, while moving sideways to keep it centred.
        let half_angle = (fov.to_radians() / 2.0).min(picture.y / (2.0 * at(1.0, DVec3::ZERO).focal_px()));
        let mut view = at(4.0 * radius / half_angle.tan(), DVec3::ZERO);
        let mut aside = DVec3::ZERO;
        for step in 0..200 {
            let distance = 4.0 * radius / half_angle.tan() * 0.97f64.powi(step);
            let next = at(distance, aside);
            let Some((low, high)) = outline(&next) else { break };
            if !(high - low).cmple(picture * 0.94).all() {
                break;
            }
            view = next;
            let off = (low + high - picture) / 2.0 * distance / view.focal_px();
            aside += view.world_from_eye * DVec3::new(off.x, -off.y, 0.0);
        }
        Self { centre, radius, eye: view.eye, world_from_eye: view.world_from_eye }
    }
}
