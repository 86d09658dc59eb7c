//! Tests that `position.glsl` and its CPU reference agree to the bit.

use std::sync::Arc;

use cuesta::internal::draw::layout::{ExplicitVertex, Frame, VertexNormals};
use cuesta::internal::draw::normals::explicit_normal;
use cuesta::internal::draw::place::{explicit_height, explicit_position, placed, relative_position};
use cuesta::internal::draw::skirts::is_skirted;
use cuesta::internal::draw::weights::{SkirtWeights, SlotWeights};
use cuesta::internal::draw::{DrawList, Instance, Morph, PipelineRequirements, Seams};
use cuesta::internal::gpu::Gpu;
use cuesta::internal::gpu::position_check::{self, Query};
use cuesta::internal::height::{Field, synth};
use cuesta::internal::plan::{Look, ScenePlan};
use cuesta::internal::view::View;

use super::{as_f32, aslant, mountains, on_device, technique};

/// Returns all vertices of every third instance that a technique draws, with its weights or random ones.
fn lattice_queries(
    field: &Arc<Field>,
    view: &View,
    name: &str,
    settings: &[&str],
    are_weights_random: bool,
) -> Vec<Query> {
    let mut technique = technique(field, name, settings);
    let mut list = DrawList::default();
    technique.select(view, &mut list);
    let lattice = &technique.resident().lattice;
    let queries = (1u16..).zip(list.instances.iter().step_by(3)).flat_map(|(k, instance)| {
        // Any bytes are valid weights; level 0 has no finer quadrants.
        let random = |word: u32| u32::from(k).wrapping_mul(0x9e37_79b1).rotate_left(8 * word).wrapping_mul(0x85eb_ca6b);
        let finer = if instance.level == 0 { 0x3f3f_3f3f } else { 0xbfbf_bfbf };
        let inside = random(0) & finer;
        let morphing = if is_skirted(instance) {
            instance.with_weights(SkirtWeights { inside, sides: random(1), depth_m: 1.0 + f32::from(k) / 7.0 })
        } else {
            let [first_sides, last_sides, seams] =
                [random(1) & 0x7f7f_7f7f, random(2) & 0x7f7f_7f7f, random(3) & 0xbfbf_bfbf];
            instance.with_weights(SlotWeights { inside, first_sides, last_sides, seams })
        };
        lattice.iter().map(move |v| Query {
            vertex: ExplicitVertex { position: v.position, ..ExplicitVertex::default() },
            normals: VertexNormals::default(),
            instance: if are_weights_random { morphing } else { *instance },
            explicit_height: 0,
        })
    });
    queries.collect()
}

/// Returns lattice vertices of several techniques, and explicit vertices with their own weights.
fn queries(field: &Arc<Field>, view: &View, morph: Morph) -> Vec<Query> {
    let configs: &[(&str, &[&str])] = match morph {
        // Without weights the shader has no half samples.
        Morph::No => &[("geomipmap", &["block=17"])],
        Morph::ByInstance => &[
            ("geomipmap", &["block=17"]),
            ("clusters", &["block=8", "morph=on"]),
            ("clusters", &["block=8", "morph=on", "seams=skirts"]),
        ],
        Morph::ByDistance => {
            &[("clusters", &["block=8", "morph=distance"]), ("clusters:draw-per-block", &["block=8", "morph=distance"])]
        }
    };
    let are_weights_random = morph == Morph::ByInstance;
    let of_config =
        |(name, settings): &(&str, &[&str])| lattice_queries(field, view, name, settings, are_weights_random);
    let mut queries: Vec<_> = configs.iter().flat_map(of_config).collect();
    let explicit = (0..2000u32).map(|k| Query {
        vertex: ExplicitVertex {
            position: [(k % 37) as i32, (k / 37) as i32],
            height: 1234.567 + 0.37 * k as f32,
            target: 1200.0 + 1.7 * k as f32,
            second_target: 1400.0 - 0.9 * k as f32,
            morph: k as f32 / 1999.0,
            // No region, that of the vertex, those of vertex and target.
            regions: [0, 1 + k % 32, (1 + k % 32) | (1 + k * 7 % 32) << 8][k as usize % 3],
        },
        // Steep and level normals; y follows from x and z.
        normals: VertexNormals {
            normal: k.wrapping_mul(0x9e37_79b1),
            target: k.wrapping_mul(0x85eb_ca6b),
            second_target: if k % 5 == 0 { 0 } else { k.wrapping_mul(0xc2b2_ae35) },
        },
        instance: Instance {
            origin: [5, 3],
            cells: 64,
            shift: (k % 2) as i32,
            rotation: k % 4,
            weights_words: [k, k + 1, k + 2, k + 3].map(|n| n.wrapping_mul(0x9e37_79b1) & 0x7f7f_7f7f),
            ..Instance::default()
        },
        explicit_height: 1,
    });
    queries.extend(explicit);
    queries
}

fn on_the_cpu(field: &Field, frame: &Frame, query: &Query) -> [f32; 3] {
    let vertex = &query.vertex;
    if query.explicit_height == 0 {
        let placed = placed(field, frame, &query.instance, vertex.position);
        return relative_position(frame, placed.at.map(|n| n << frame.vertices.fraction_bits), placed.height);
    }
    let height = explicit_height(&query.instance, vertex);
    relative_position(frame, explicit_position(frame, &query.instance, vertex), height)
}

fn compare(gpu: &Arc<Gpu>, name: &str, field: &Arc<Field>, page_shift: u32) {
    for (morph, fraction_bits) in [(Morph::No, 0), (Morph::No, 6), (Morph::ByInstance, 0), (Morph::ByDistance, 0)] {
        compare_morph(gpu, name, field, page_shift, morph, fraction_bits);
    }
}

fn compare_morph(gpu: &Arc<Gpu>, name: &str, field: &Arc<Field>, page_shift: u32, morph: Morph, fraction_bits: u32) {
    let view = aslant(field, [320, 200], 2.0);
    let frame = Frame::placing(field, &view).with_fractions(fraction_bits);
    let mut plan = ScenePlan::builder(field, &Look::default(), &gpu.device_limits())
        .requirements(PipelineRequirements { morph, seams: Seams::Skirts, ..PipelineRequirements::default() })
        .build()
        .unwrap();
    plan.page_shift = page_shift;
    let queries = queries(field, &view, morph);
    let device = position_check::answers(gpu, &plan, field, &frame, &queries).unwrap();
    for (query, there) in queries.iter().zip(device) {
        let here = on_the_cpu(field, &frame, query);
        assert_eq!(
            here.map(f32::to_bits),
            there.position.map(f32::to_bits),
            "{name}: {here:?} {there:?} {query:?}",
            query = query.vertex
        );
        if query.explicit_height != 0 {
            let normal = explicit_normal(&query.instance, &query.vertex, &query.normals);
            let apart = normal.distance(there.normal.into());
            assert!(apart < 1e-4, "{name}: {normal} {there:?} {normals:?}", normals = query.normals);
        }
    }
}

#[test]
fn vertex_positions_equal_the_cpu_reference() {
    on_device(|gpu| {
        let coded = mountains();
        compare(gpu, "16-bit", &coded, 0);
        compare(gpu, "32-bit", &as_f32(&coded), 0);
        compare(gpu, "pages of 32", &coded, 5);
        let mut far = (*coded).clone();
        far.origin = [4.0e6, -7.0e6];
        far.spacing = [0.3, 31.7];
        compare(gpu, "far, narrow cells", &Arc::new(far), 0);
        compare(gpu, "tiled", &Arc::new((*coded).clone().tiled([3, 2])), 0);
        let powers = synth::synth(synth::Kind::Fractal, [64, 32], 3).tiled([3, 5]);
        compare(gpu, "tiled by powers of two", &Arc::new(powers), 0);
        compare(gpu, "tiled pages", &Arc::new((*coded).clone().tiled([3, 2])), 6);
    });
}
