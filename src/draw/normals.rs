//! Normals of explicit vertices, which morph with the heights: the CPU reference of `shaders/position.glsl`.

use glam::{Vec2, Vec3};

use super::layout::{ExplicitVertex, Instance, VertexNormals};
use super::place::explicit_weights;

/// Packs a unit vector that does not point down in 32 bits: x in the lower half, z in the upper half, both snorm16.
pub fn pack(normal: Vec3) -> u32 {
    let snorm = |n: f32| u32::from((n.clamp(-1.0, 1.0) * 32767.0).round() as i16 as u16);
    snorm(normal.x) | snorm(normal.z) << 16
}

/// Unpacks a normal, exact to 1/32767 in x and z.
pub fn unpack(packed: u32) -> Vec3 {
    let plan = [packed, packed >> 16].map(|n| (f32::from(n as u16 as i16) / 32767.0).max(-1.0));
    let plan = Vec2::from(plan);
    Vec3::new(plan.x, (1.0 - plan.length_squared()).max(0.0).sqrt(), plan.y)
}

/// Unit normal of a vertex at its morph weights.
pub fn explicit_normal(instance: &Instance, vertex: &ExplicitVertex, normals: &VertexNormals) -> Vec3 {
    let [weight, second_target] = explicit_weights(instance, vertex);
    let target = unpack(normals.target).lerp(unpack(normals.second_target), second_target);
    // None points down: their mean is not zero, unless two are level and opposite.
    unpack(normals.normal).lerp(target, weight).try_normalize().unwrap_or(Vec3::Y)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn packing_keeps_a_direction() {
        let mut worst = 0f32;
        for k in 0..40_000u32 {
            let (turn, lean) = (k as f32 * 0.618, (k as f32 / 40_000.0).powi(2) * 1.57);
            let normal = Vec3::new(lean.sin() * turn.cos(), lean.cos(), lean.sin() * turn.sin());
            worst = worst.max(unpack(pack(normal)).angle_between(normal));
        }
        // Where a normal is almost level its y follows from small differences.
        assert!(worst < 0.006, "{worst} radians");
        assert_eq!(unpack(pack(Vec3::Y)), Vec3::Y);
    }
}
