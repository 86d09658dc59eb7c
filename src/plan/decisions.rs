//! The features that a plan keeps and omits, each with its reason and its bytes.

use super::features::{FEATURES, Feature};
use super::scene_plan::ScenePlan;
use crate::draw::{DeviceGeometry, Geometry, Limits};
use crate::height::Field;

/// A feature that a plan keeps or omits.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Decision {
    /// Its name.
    pub feature: &'static str,
    /// The reason.
    pub reason: String,
    /// Device bytes that it takes, or that omitting it saves.
    pub bytes: u64,
}

impl Feature {
    fn decide(&self, plan: &ScenePlan, field: &Field, kept: &DeviceGeometry) -> (bool, Decision) {
        let is_kept = (self.is_kept)(plan, kept);
        let reason = match (plan.forced.has(self), is_kept, self.name) {
            (true, true, _) => "kept by hand".to_string(),
            (true, false, _) => "left out by hand".to_string(),
            (_, true, "hole mask") => format!("{} {}", field.holes().count(), self.kept),
            (_, true, _) => self.kept.to_string(),
            (_, false, _) => self.left_out.to_string(),
        };
        (is_kept, Decision { feature: self.name, reason, bytes: (self.bytes)(plan, kept) })
    }
}

impl ScenePlan {
    /// The kept features, then the omitted ones. Without the geometry of a technique, only those that the scene decides.
    pub fn decisions(&self, field: &Field, technique: Option<&DeviceGeometry>) -> (Vec<Decision>, Vec<Decision>) {
        let nothing = DeviceGeometry { geometry: &Geometry::default(), limits: Limits::default(), gpu_selection: None };
        let kept = technique.unwrap_or(&nothing);
        let known = FEATURES.iter().filter(|feature| technique.is_some() || !feature.by_technique);
        let all = known.map(|feature| feature.decide(self, field, kept));
        let (keep, leave): (Vec<_>, Vec<_>) = all.partition(|(is_kept, _)| *is_kept);
        let decisions = |part: Vec<(bool, Decision)>| part.into_iter().map(|(_, decision)| decision).collect();
        (decisions(keep), decisions(leave))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::height::{Holes, Samples};
    use crate::plan::mipmaps::overlay_bytes;
    use crate::plan::{Colour, DeviceLimits, Look};

    /// An overlay is one texture if it fits, else a virtual texture, with a reason each time.
    #[test]
    fn an_overlay_is_either_whole_or_virtual() {
        let field = Field::new(Samples::F32(vec![0.0; 65 * 65]), [65, 65], [1.0; 2], Holes::none(65 * 65));
        let device = DeviceLimits { image_side: 4096, image_layers: 256, filters_heights: true };
        let reasons = |size: Option<[u32; 2]>, texture_bytes: u64| {
            let look = Look { colour: Colour::Overlay, texture_bytes, ..Look::default() };
            let plan = ScenePlan::builder(&field, &look, &device).overlay(size).build()?;
            let (kept, left_out) = plan.decisions(&field, None);
            let is_of_picture = |d: &&Decision| ["overlay", "texture maps"].contains(&d.feature);
            assert_eq!(kept.iter().chain(&left_out).filter(is_of_picture).count(), 2);
            let kept: Vec<_> = kept.into_iter().filter(|d| is_of_picture(&d)).map(|d| (d.feature, d.bytes)).collect();
            let reason = left_out.iter().find(is_of_picture).map(|d| d.reason.clone());
            Ok::<_, String>((kept, reason.unwrap_or_default()))
        };
        let bytes = overlay_bytes([2048, 1024]);
        assert_eq!(bytes, (0..10).map(|level| (8 << 20) >> (2 * level)).sum::<u64>() + 8 + 4);
        let whole = reasons(Some([2048, 1024]), bytes).unwrap();
        assert_eq!(whole, (vec![("overlay", bytes)], "no picture exceeds the memory for it".to_string()));
        let (kept, reason) = reasons(Some([2048, 1024]), bytes - 1).unwrap();
        assert!(kept[0].0 == "texture maps" && kept[0].1 < bytes && reason.contains("as a whole"), "{reason}");
        assert_eq!(reasons(Some([8192, 16]), 1 << 30).unwrap().0[0].0, "texture maps", "beyond one image");
        assert!(reasons(Some([2048, 1024]), 99_999).unwrap_err().contains("expected at least"));
    }
}
