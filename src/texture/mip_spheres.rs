//! Finds the mip level a wedge needs from two spheres around it, without projecting its corners.
//!
//! After J. Blow, "Terrain Rendering at High Levels of Detail" (2000), part II: each wedge has two spheres. Inside
//! the first its texture rises a mip level, outside the second it falls a level. Seen from distance d at an angle θ
//! from its normal, a wedge of area A covers A·f²·cos θ/d² pixels near the view axis. Viewpoints with equal area
//! therefore lie at D·√cos θ.
//!
//! Difference: a sphere centred on the wedge ignores cos θ and is several levels too fine at grazing angles. Here the
//! spheres are moved along the normal, to a centre at 0.45 D with a radius of 0.55 D. Their distance is D for θ = 0.
//! For cos θ > 0.03 it stays within a factor of 2 of the equal-area distance, which is one mip level.

use glam::DVec3;

use super::resolution::texture_area;

/// Distance of a sphere's centre from the wedge, and its radius, as fractions of D: the distance from which the
/// wedge, seen along its normal, needs the level.
const MIDDLE: f64 = 0.45;
const RADIUS: f64 = 0.55;

/// Levels are clamped to ±`MAX_LEVEL`; 4^500 texels still fit an f64.
const MAX_LEVEL: i32 = 500;

/// The mip spheres of one wedge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MipSpheres {
    /// Barycentre of the wedge, metres.
    pub centre: DVec3,
    /// Unit normal, upwards.
    pub normal: DVec3,
    /// Square of the distance, m², at which the wedge needs level 0 of the root square's texture when seen along the
    /// normal.
    squared: f64,
}

impl MipSpheres {
    /// Returns the spheres of a wedge of the binary triangle tree; `None` if it has no area. Corners are
    /// counter-clockwise seen from above, metres. `focal_px` is pixels per unit of slope; `quality` is texels per
    /// pixel along an axis.
    pub fn new(corners: [DVec3; 3], level: u32, focal_px: f64, quality: f64) -> Option<Self> {
        let [a, b, c] = corners;
        let doubled = (b - a).cross(c - a);
        let normal = doubled.try_normalize()?;
        let texels_at_1_m = doubled.length() / 2.0 * (focal_px * quality).powi(2);
        Some(Self { centre: (a + b + c) / 3.0, normal, squared: texels_at_1_m * 2f64.powi(level as i32 + 1) })
    }

    /// Returns true if a viewpoint is inside the sphere of a level: the wedge then needs a finer level than this one.
    pub fn contains(&self, level: i32, eye: DVec3) -> bool {
        let size = (self.squared / texture_area(level)).sqrt();
        let middle = self.centre + self.normal * (MIDDLE * size);
        middle.distance_squared(eye) < (RADIUS * size).powi(2)
    }

    /// Returns the level for a viewpoint by stepping from the level of the previous frame.
    pub fn follow(&self, mut level: i32, eye: DVec3) -> i32 {
        while level < MAX_LEVEL && self.contains(level, eye) {
            level += 1;
        }
        while level > -MAX_LEVEL && !self.contains(level - 1, eye) {
            level -= 1;
        }
        level
    }

    /// Returns the level for a viewpoint directly: the level of the sphere through it, rounded up.
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

    fn wedge(dice: &mut fastrand::Rng) -> MipSpheres {
        let corners = [DVec3::ZERO, DVec3::Z, DVec3::X].map(|at| at * 20.0 + direction(dice) * 3.0);
        MipSpheres::new(corners, 10, 800.0, 1.0).expect("a triangle")
    }

    #[test]
    fn stepping_reaches_the_direct_level() {
        let mut dice = fastrand::Rng::with_seed(3);
        for _ in 0..200 {
            let spheres = wedge(&mut dice);
            let (mut eye, mut level) = (direction(&mut dice) * 100.0, 5);
            for _ in 0..100 {
                eye += direction(&mut dice) * 30.0;
                level = spheres.follow(level, eye);
                // On a sphere either level is right.
                let expected =
                    [1.0 - 1e-9, 1.0 + 1e-9].map(|part| spheres.level(spheres.centre + (eye - spheres.centre) * part));
                assert!(expected.contains(&level), "{level}, not {expected:?}");
            }
        }
    }

    /// Compares with the projected area of a plane wedge near the view axis.
    #[test]
    fn within_one_level_of_the_projected_area_for_cosines_above_0_03() {
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
