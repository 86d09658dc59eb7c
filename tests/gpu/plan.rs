//! Tests of scene plans: features that a scene does not need are left out, and forcing them in does not change the
//! image.

use std::sync::Arc;

use cuesta::internal::draw::{Morph, PipelineRequirements};
use cuesta::internal::height::Field;
use cuesta::internal::plan::{Colour, DeviceLimits, FEATURES, Forced, Look, ScenePlan};
use cuesta::internal::scene::{Scene, savings};

use super::{as_f32, aslant, difference, mountains, on_device, render_planned, technique};

fn without_holes() -> Arc<Field> {
    Arc::new((*mountains()).clone().without_holes())
}

#[test]
fn forced_features_give_the_same_image() {
    on_device(|gpu| {
        let field = without_holes();
        let view = aslant(&field, [160, 120], 1.0);
        let render = |field: &Arc<Field>, plan: &ScenePlan| {
            render_planned(gpu, field, plan, technique(field, "geomipmap", &["block=17"]).as_mut(), &view).picture
        };
        let plan = ScenePlan::builder(&field, &Look::default(), &gpu.device_limits()).build().unwrap();
        assert!(plan.coded && !plan.holes && !plan.tiled && !plan.fog && plan.page_shift == 0 && plan.filtered);
        let lean = render(&field, &plan);
        let same = |name: &str, forced: ScenePlan| assert_eq!(render(&field, &forced), lean, "{name}");
        same("holes", ScenePlan { holes: true, ..plan.clone() });
        same("tiling", ScenePlan { tiled: true, ..plan.clone() });
        // Without morph weights.
        same(
            "morphing",
            plan.with_requirements(PipelineRequirements {
                morph: Morph::ByInstance,
                ..PipelineRequirements::default()
            }),
        );
        // The look's density is 0.
        same("fog", ScenePlan { fog: true, ..plan.clone() });
        same("queries", ScenePlan { measured: false, ..plan.clone() });
        let normals = Look { colour: Colour::Normal, ..Look::default() };
        let of_normals = ScenePlan::builder(&field, &normals, &gpu.device_limits()).build().unwrap();
        let detailed = ScenePlan { detail: true, ..of_normals.clone() };
        assert_eq!(render(&field, &detailed), render(&field, &of_normals), "detail");
        let wide = as_f32(&field);
        let wide_plan = ScenePlan { coded: false, ..plan.clone() };
        assert!(difference(&render(&wide, &wide_plan), &lean, 2).1 < 0.01, "32-bit heights");
        let unfiltered = ScenePlan { filtered: false, ..plan.clone() };
        assert!(difference(&render(&field, &unfiltered), &lean, 3).1 < 0.01, "filtering in the shader");
        let paged = ScenePlan { page_shift: 5, ..unfiltered.clone() };
        assert_eq!(render(&field, &paged), render(&field, &unfiltered), "pages");
    });
}

/// For every technique and every omitted feature: forcing it in costs what the plan states, and does not change the
/// image.
#[test]
fn every_omitted_feature_saves_something_and_changes_no_picture() {
    on_device(|gpu| {
        let field = without_holes();
        let view = aslant(&field, [160, 120], 1.0);
        let look = Look { colour: Colour::Normal, ..Look::default() };
        let mut kept_in_some = std::collections::BTreeSet::new();
        for (name, settings) in [
            ("brute-force", &[][..]),
            ("geomipmap", &["block=17"]),
            ("smooth-tiles", &[]),
            ("sorted-strips", &["order=painter"]),
            ("sphere-tree", &[]),
            ("clusters", &["block=8"]),
        ] {
            let mut techniques = [technique(&field, name, settings), technique(&field, name, settings)];
            let plan = ScenePlan::builder(&field, &look, &gpu.device_limits())
                .requirements(techniques[0].pipeline_requirements())
                .build()
                .unwrap();
            let scene = Scene { gpu, field: &field, plan: &plan, look: &look, overlay: None };
            let (lean, savings) = savings::measure(&scene, &mut techniques, &view, 1).unwrap();
            assert!(lean.bytes > 0 && lean.pipelines > 1 && lean.instructions > 100, "{name}: {lean:?}");
            for saving in savings {
                println!("{name}: {saving:?}");
                let texels = field.samples().len() as i64;
                let min_bytes = match saving.feature {
                    "32-bit heights" => 2 * texels,
                    "hole mask" => texels - 1,
                    "depth buffer" => 4 * 160 * 120,
                    "detail textures" => 1 << 20,
                    _ => 0,
                };
                assert!(saving.bytes >= min_bytes, "{name}: {saving:?}");
                let adds_programs =
                    ["lattice program", "explicit program", "triangle strips"].contains(&saving.feature);
                assert_eq!(saving.pipelines > 0, adds_programs, "{name}: {saving:?}");
                let in_all = ["hole mask", "fog", "filtering in the shader"].contains(&saving.feature);
                let of_lattice = ["tiling", "vertex weights"].contains(&saving.feature) && plan.draws.lattice;
                assert!(saving.instructions > 0 || !(in_all || of_lattice), "{name}: {saving:?}");
                let is_rounded =
                    ["32-bit heights", "height pages", "filtering in the shader"].contains(&saving.feature);
                let (largest, pixels) = saving.differs;
                assert!(largest <= if is_rounded { 8 } else { 0 }, "{name}: {saving:?}");
                assert!(pixels <= 160 * 120 / if is_rounded { 2 } else { 1 }, "{name}: {saving:?}");
                kept_in_some.insert(saving.feature);
            }
        }
        // Scenes without queries measure nothing; all other features are omitted in some scene above.
        let forcible = FEATURES.iter().filter(|f| f.can_be(true) && f.name != "queries").map(|f| f.name);
        assert!(forcible.clone().all(|name| kept_in_some.contains(name)), "{kept_in_some:?}");
        assert_eq!(kept_in_some.len(), forcible.count());
    });
}

#[test]
fn features_omitted_by_hand_are_off() {
    on_device(|gpu| {
        let field = without_holes();
        let view = aslant(&field, [96, 64], 1.0);
        let forced = Forced::default().with("fog", false).unwrap();
        let [plain, foggy, without] = [(0.0, Forced::default()), (3e-4, Forced::default()), (3e-4, forced)]
            .map(|(fog, forced)| Look { fog, forced, ..Look::default() })
            .map(|look| {
                let plan = ScenePlan::builder(&field, &look, &gpu.device_limits()).build().unwrap();
                let scene = Scene { gpu, field: &field, plan: &plan, look: &look, overlay: None };
                scene.render(technique(&field, "geomipmap", &["block=17"]).as_mut(), &view, 1).unwrap().picture
            });
        assert!(plain != foggy && plain == without);
    });
}

#[test]
fn looks_differ_visibly() {
    on_device(|gpu| {
        let field = without_holes();
        let view = aslant(&field, [96, 64], 1.0);
        let mut pictures = Vec::new();
        let looks = [Colour::Height, Colour::Level, Colour::Error, Colour::Normal, Colour::Batch]
            .map(|colour| Look { colour, ..Look::default() })
            .into_iter()
            .chain([
                Look { fog: 3e-4, ..Look::default() },
                Look { wireframe: true, ..Look::default() },
                Look { detail: true, ..Look::default() },
                Look { sun_speed: 30.0, ..Look::default() }.after(4.0),
            ]);
        for look in looks {
            let plan = ScenePlan::builder(&field, &look, &gpu.device_limits()).build().unwrap();
            let scene = cuesta::internal::scene::Scene { gpu, field: &field, plan: &plan, look: &look, overlay: None };
            let mut geomipmap = technique(&field, "geomipmap", &["block=17"]);
            pictures.push((look, scene.render(geomipmap.as_mut(), &view, 1).unwrap().picture));
        }
        for (k, (look, picture)) in pictures.iter().enumerate() {
            for (other, other_picture) in &pictures[..k] {
                assert!(difference(picture, other_picture, 8).1 > 0.05, "{look:?} looks like {other:?}");
            }
        }
    });
}

#[test]
fn large_fields_are_paged_and_too_large_ones_name_the_limit() {
    let field = mountains();
    let device = DeviceLimits { image_side: 64, image_layers: 6, filters_heights: true };
    let plan = ScenePlan::builder(&field, &Look::default(), &device).build().unwrap();
    assert_eq!((plan.page_size(), plan.pages(), plan.filtered), ([64, 64], [3, 2], false));
    let refused =
        ScenePlan::builder(&field, &Look::default(), &DeviceLimits { image_layers: 5, ..device }).build().unwrap_err();
    assert!(refused.contains("maxImageArrayLayers is 5"), "{refused}");
}
