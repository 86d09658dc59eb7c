//! How fine a texture a wedge needs by spheres: no projected coordinates.
//!
//! After J. Blow, "Terrain Rendering at High Levels of Detail" (2000), part II: each wedge has two spheres, one inside of
//! which its texture rises a level and one outside of which it falls. From a point at distance d, at an angle θ from its
//! normal, a wedge of area A has A·f²·cos θ/d² pixels near the axis of the view, so that places from which it has the
//! same area lie at D·√cos θ. A sphere about the wedge has none of the cos θ and is levels too fine for land seen along
//! the ground. Here spheres are moved out along the normal: about a point 0.45 D away, with a radius of 0.55 D. Their
//! distance is D for θ = 0, and everywhere above cos θ = 0.03 within a factor of 2 of that at which the area is the same:
//! one level.

use glam::DVec3;

use super::resolution::texture_area;

/// Distance of a sphere's middle from the wedge and its radius, over the distance at which the wedge, seen along its
/// normal, needs the level.
const MIDDLE: f64 = 0.45;
const RADIUS: f64 = 0.55;

/// Levels end here, finer and coarser: 4^500 texels are still an f64.
const MAX_LEVEL: i32 = 500;

/// A wedge as its spheres know it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spheres {
    /// Its barycentre, metres.
    pub centre: DVec3,
    /// Unit vector up from it.
    pub normal: DVec3,
    /// Square of the distance, m², at which it needs level 0 of the root square's texture, seen along the normal.
    squared: f64,
}

impl Spheres {
    /// Of a wedge of a level of the binary triangle tree with these corners, counter-clockwise seen from above, for
    /// pictures of `focal_px` pixels per unit of slope and so many texels a pixel along an axis. `None` if it has no area.
    pub fn new(corners: [DVec3; 3], level: u32, focal_px: f64, quality: f64) -> Option<Self> {
        let [a, b, c] = corners;
        let doubled = (b - a).cross(c - a);
        let normal = doubled.try_normalize()?;
        let texels_at_1_m = doubled.length() / 2.0 * (focal_px * quality).powi(2);
        Some(Self { centre: (a + b + c) / 3.0, normal, squared: texels_at_1_m * 2f64.powi(level as i32 + 1) })
    }

    /// Whether a viewpoint is inside the sphere of a level: the wedge needs a higher one of the root square's texture.
    pub fn contains(&self, level: i32, eye: DVec3) -> bool {
        let size = (self.squared / texture_area(level)).sqrt();
        let middle = self.centre + self.normal * (MIDDLE * size);
        middle.distance_squared(eye) < (RADIUS * size).powi(2)
    }

    /// The level for a viewpoint, reached from the last one by raising and lowering.
    pub fn follow(&self, mut level: i32, eye: DVec3) -> i32 {
        while level < MAX_LEVEL && self.contains(level, eye) {
            level += 1;
        }
        while level > -MAX_LEVEL && !self.contains(level - 1, eye) {
            level -= 1;
        }
        level
    }

    /// The level for a viewpoint: that of the sphere through it, rounded up.
    pub fn level(&self, eye: DVec3) -> i32 {
        let to = eye - self.centre;
        let (along, across) = (MIDDLE * to.dot(self.normal), RADIUS * RADIUS - MIDDLE * MIDDLE);
        // |to − MIDDLE·D·normal| = RADIUS·D, solved for D.
        let size = (-along + (along * along + across * to.length_squared()).sqrt()) / across;
        (0.5 * (self.squared / (size * size).max(f64::MIN_POSITIVE)).log2()).ceil() as i32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn direction(dice: &mut fastrand::Rng) -> DVec3 {
        DVec3::new(dice.f64(), dice.f64(), dice.f64()) * 2.0 - 1.0
    }

    fn wedge(dice: &mut fastrand::Rng) -> Spheres {
        let corners = [DVec3::ZERO, DVec3::Z, DVec3::X].map(|at| at * 20.0 + direction(dice) * 3.0);
        Spheres::new(corners, 10, 800.0, 1.0).expect("a triangle")
    }

    #[test]
    fn what_is_followed_is_the_level() {
        let mut dice = fastrand::Rng::with_seed(3);
        for _ in 0..200 {
            let spheres = wedge(&mut dice);
            let (mut eye, mut level) = (direction(&mut dice) * 100.0, 5);
            for _ in 0..100 {
                eye += direction(&mut dice) * 30.0;
                level = spheres.follow(level, eye);
                // On a sphere either will do.
                let expected =
                    [1.0 - 1e-9, 1.0 + 1e-9].map(|part| spheres.level(spheres.centre + (eye - spheres.centre) * part));
                assert!(expected.contains(&level), "{level}, not {expected:?}");
            }
        }
    }

    /// Against the area that a plane piece has, on a small part of the picture near its axis.
    #[test]
    fn within_a_level_of_the_area_but_for_grazing_views() {
        let mut dice = fastrand::Rng::with_seed(4);
        let mut apart = [0usize; 3];
        for _ in 0..20_000 {
            let (spheres, towards) = (wedge(&mut dice), direction(&mut dice));
            let to = towards * 2000.0;
            let cosine = to.dot(spheres.normal) / to.length();
            if cosine < 0.03 {
                continue;
            }
            let half = 0.5 * (spheres.squared * cosine / to.length_squared()).log2();
            let off = (spheres.level(spheres.centre + to) - half.ceil() as i32).unsigned_abs() as usize;
            apart[off.min(2)] += 1;
        }
        assert_eq!(apart[2], 0, "{apart:?}");
        assert!(apart[0] > apart[1], "{apart:?}");
    }
}
