//! The terrain as the camera needs it: extent, height of the ground, and human scale.

use std::sync::Arc;

use glam::{DVec2, DVec3};

use crate::height::Field;

/// Terrain with a shorter diagonal, metres, is a model: lengths in human scale shrink with it.
const MODEL_M: f64 = 20.0;

/// A field with its extent, computed once.
#[derive(Clone, Debug)]
pub struct Site {
    field: Arc<Field>,
    /// North-west corner (x, z), metres.
    low: DVec2,
    /// South-east corner (x, z), metres.
    high: DVec2,
    centre: DVec3,
    radius: f64,
}

impl Site {
    /// Computes the extent of a field.
    pub fn new(field: &Arc<Field>) -> Self {
        let [w, h] = field.size().map(|n| f64::from(n - 1));
        let [bottom, top] = field.range().map(f64::from);
        let (first, last) = (field.world_at(0.0, 0.0, bottom), field.world_at(w, h, top));
        Self {
            field: Arc::clone(field),
            low: DVec2::new(first.x, first.z),
            high: DVec2::new(last.x, last.z),
            centre: (first + last) / 2.0,
            radius: first.distance(last) / 2.0,
        }
    }

    /// Returns the diagonal of the terrain's bounding box, metres.
    pub fn diagonal(&self) -> f64 {
        2.0 * self.radius
    }

    /// Returns the maximum distance of the camera from the terrain, metres.
    pub fn reach(&self) -> f64 {
        2.0 * self.diagonal()
    }

    /// Returns the factor for lengths in human scale: 1, or less for models.
    pub fn scale(&self) -> f64 {
        (self.low.distance(self.high) / MODEL_M).min(1.0)
    }

    /// Returns a distance from a point beyond which there is no terrain, metres.
    pub fn farthest(&self, eye: DVec3) -> f64 {
        eye.distance(self.centre) + self.radius
    }

    /// Returns the height of the ground at a position, metres; outside the field that of the nearest edge, over a
    /// hole the stored filling height.
    pub fn ground(&self, at: DVec3) -> f64 {
        let field = &self.field;
        let (x, z) = (at.x.clamp(self.low.x, self.high.x), at.z.clamp(self.low.y, self.high.y));
        field.height_at(x, z).unwrap_or_else(|| {
            let nearest = |at: f64, axis: usize| {
                let sample = (at - field.origin[axis]) / field.spacing[axis];
                sample.round().clamp(0.0, f64::from(field.size()[axis] - 1)) as u32
            };
            f64::from(field.height(nearest(x, 0), nearest(z, 1)))
        })
    }

    /// Clamps a point to within `margin` metres of the field in plan.
    pub fn within(&self, at: DVec3, margin: f64) -> DVec3 {
        DVec3 {
            x: at.x.clamp(self.low.x - margin, self.high.x + margin),
            z: at.z.clamp(self.low.y - margin, self.high.y + margin),
            ..at
        }
    }

    /// Returns the point where a ray hits the terrain, or the middle of the field if it misses.
    pub fn ray_hit(&self, eye: DVec3, forward: DVec3) -> DVec3 {
        let shortest = self.scale();
        let mut at = eye;
        for _ in 0..512 {
            let above = self.field.height_at(at.x, at.z).map_or(f64::INFINITY, |height| at.y - height);
            if above <= 0.0 {
                return at;
            }
            // A step of a quarter of the height above ground rarely passes through a slope.
            at += forward * (above.min(at.distance(eye).max(shortest)) * 0.25).max(0.25 * shortest);
            if at.distance(eye) > 2.0 * self.reach() {
                break;
            }
        }
        self.middle()
    }

    /// Returns the ground point in the middle of the field.
    pub fn middle(&self) -> DVec3 {
        let plan = (self.low + self.high) / 2.0;
        let middle = DVec3::new(plan.x, 0.0, plan.y);
        DVec3 { y: self.ground(middle), ..middle }
    }
}
