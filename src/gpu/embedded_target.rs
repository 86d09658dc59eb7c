//! The caller's attachments, and the clip space of its depth buffer.

use anyhow::{Result, ensure};
use ash::vk;
use glam::{DMat4, DVec4};

use super::formats::Formats;
use crate::view::{Lens, View};

/// The caller's attachments and clip space.
///
/// There is one colour attachment. Terrain is drawn without blending.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Target {
    /// Format of the colour attachment. Colours are linear: an sRGB format encodes them.
    pub colour: vk::Format,
    /// The depth attachment; `None`: there is no depth test, and the technique draws from back to front.
    pub depth: Option<DepthTarget>,
    /// Samples of a pixel.
    pub samples: vk::SampleCountFlags,
    /// Render pass and subpass in which terrain is drawn; `None`: dynamic rendering.
    pub render_pass: Option<(vk::RenderPass, u32)>,
    /// True if the y axis of clip space points up, for viewports of negative height.
    pub is_y_up: bool,
}

/// A depth attachment, and the meaning of its values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DepthTarget {
    /// Format of the attachment.
    pub format: vk::Format,
    /// True if the pass has the image as a stencil attachment, too.
    pub has_stencil: bool,
    /// True if depth is 1 at the near plane and 0 at the far one; false if it is 0 and 1.
    pub is_reversed: bool,
    /// Distance of the far plane of a perspective view, metres: terrain beyond it is clipped. `None`: at infinity.
    pub far_m: Option<f64>,
}

impl Target {
    /// A target for dynamic rendering with reversed depth, a far plane at infinity, one sample, and y down.
    pub fn new(colour: vk::Format, depth: vk::Format) -> Self {
        let depth = DepthTarget { format: depth, has_stencil: false, is_reversed: true, far_m: None };
        let samples = vk::SampleCountFlags::TYPE_1;
        Self { colour, depth: Some(depth), samples, render_pass: None, is_y_up: false }
    }

    /// Returns the matrix from world metres relative to the eye to clip space.
    ///
    /// Terrain is drawn with it, rounded to single precision. Other objects that use it meet the terrain exactly.
    pub fn clip_from_relative(&self, view: &View) -> DMat4 {
        // The view's own matrix: y down, reversed depth, a perspective far plane at infinity.
        let clip = view.clip_from_relative();
        let (mut y, mut z, w) = (clip.row(1), clip.row(2), clip.row(3));
        if let (Some(DepthTarget { is_reversed, far_m, .. }), lens) = (self.depth, view.lens) {
            if let (Some(far), Lens::Perspective { .. }) = (far_m, lens) {
                z = (z * far - w * view.near) / (far - view.near);
            }
            if !is_reversed {
                z = w - z;
            }
        }
        if self.is_y_up {
            y = -y;
        }
        from_rows([clip.row(0), y, z, w])
    }

    /// Checks the far plane for a view.
    ///
    /// # Errors
    /// If it is not beyond the near plane.
    pub(super) fn check(&self, view: &View) -> Result<()> {
        let far = self.depth.and_then(|depth| depth.far_m);
        let is_beyond = far.is_none_or(|far| far.is_finite() && far > view.near);
        ensure!(is_beyond, "far plane at {far:?} m: expected a distance beyond the near plane, {} m", view.near);
        Ok(())
    }

    pub(super) fn formats(&self) -> Formats {
        let depth = self.depth.as_ref();
        let stencil = depth.filter(|depth| depth.has_stencil).map_or(vk::Format::UNDEFINED, |depth| depth.format);
        Formats {
            colour: self.colour,
            depth: depth.map(|depth| depth.format),
            stencil,
            is_reversed: depth.is_none_or(|depth| depth.is_reversed),
            samples: self.samples,
            render_pass: self.render_pass,
            has_sky: false,
        }
    }
}

fn from_rows(rows: [DVec4; 4]) -> DMat4 {
    let [x, y, z, w] = rows;
    DMat4::from_cols(x, y, z, w).transpose()
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    use crate::view::{Metric, Tolerance};

    fn view(lens: Lens) -> View {
        View {
            eye: DVec3::ZERO,
            world_from_eye: View::turned(30.0, -10.0, 0.0),
            lens,
            size: [320, 200],
            near: 2.0,
            tolerance: Tolerance { px: 1.0, metric: Metric::Certified },
            time_s: 0.0,
        }
    }

    fn depth_at(target: &Target, view: &View, metres: f64) -> f64 {
        let clip = target.clip_from_relative(view) * (view.forward() * metres).extend(1.0);
        clip.z / clip.w
    }

    #[test]
    fn depth_is_0_and_1_at_the_planes() {
        let own = Target::new(vk::Format::R8G8B8A8_SRGB, vk::Format::D32_SFLOAT);
        let lenses = [Lens::Perspective { fov_x: 1.0 }, Lens::Orthographic { width: 90.0, far: 500.0 }];
        for (lens, far_m, is_reversed) in lenses
            .into_iter()
            .flat_map(|lens| [None, Some(500.0)].map(|far| (lens, far)))
            .flat_map(|(lens, far)| [true, false].map(|is_reversed| (lens, far, is_reversed)))
        {
            let target = Target { depth: own.depth.map(|d| DepthTarget { is_reversed, far_m, ..d }), ..own };
            let view = view(lens);
            let is_infinite = far_m.is_none() && matches!(lens, Lens::Perspective { .. });
            let (near, far) =
                (depth_at(&target, &view, 2.0), depth_at(&target, &view, if is_infinite { 1e15 } else { 500.0 }));
            let expected = if is_reversed { [1.0, 0.0] } else { [0.0, 1.0] };
            assert!(
                (near - expected[0]).abs() < 1e-9 && (far - expected[1]).abs() < 1e-9,
                "{target:?} {lens:?}: {near} {far}"
            );
            let between = depth_at(&target, &view, 100.0);
            assert!(between > 0.0 && between < 1.0, "{between}");
        }
    }

    #[test]
    fn y_up_mirrors_the_picture_and_nothing_else() {
        let down = Target::new(vk::Format::R8G8B8A8_SRGB, vk::Format::D32_SFLOAT);
        let up = Target { is_y_up: true, ..down };
        let view = view(Lens::Perspective { fov_x: 1.0 });
        let point = (view.forward() * 50.0 + DVec3::new(3.0, 4.0, 5.0)).extend(1.0);
        let [down, up] = [down, up].map(|target| target.clip_from_relative(&view) * point);
        assert_eq!([down.x, -down.y, down.z, down.w], up.to_array());
    }
}
