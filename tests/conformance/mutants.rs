//! Mutants: techniques with one broken mechanism each. Every invariant must fail on its mutant.

use std::collections::BTreeSet;
use std::sync::Arc;

use cuesta::internal::draw::expand;
use cuesta::internal::draw::layout::Frame;
use cuesta::internal::draw::weights::{SkirtWeights, SlotWeights};
use cuesta::internal::draw::{
    Draw, DrawKinds, DrawList, ExplicitVertex, Geometry, Instance, Limits, PipelineRequirements, Seams, Source,
    Topology,
};
use cuesta::internal::height::Field;
use cuesta::internal::lod::Technique;
use cuesta::internal::lod::geomipmap::mesh::{BlockMesh, Masks, side};
use cuesta::internal::view::{Lens, View};

use cuesta::internal::stress::invariants::{INVARIANTS, Subject};
use cuesta::internal::stress::views;

use super::cases;
use crate::altered::{Altered, scale_skirts};
use crate::prepared::technique;

/// Invariant, mutation, words of the expected message, name of the field, and constructor of the mutant.
type Mutant = (&'static str, &'static str, &'static str, &'static str, fn(&Arc<Field>) -> Box<dyn Technique>);

const MUTANTS: &[Mutant] = &[
    ("one surface", "no stitching", "TJunction", "noise", |field| Blocks::boxed(field, false, &[0, 1])),
    ("one surface", "a jump of two levels", "TJunction", "noise", |field| Blocks::boxed(field, true, &[0, 2])),
    ("one surface", "a block dropped", "Gap", "ramp", |field| changed(field, drop_a_block)),
    ("one surface", "a block doubled", "Overlap", "ramp", |field| changed(field, double_a_block)),
    ("one surface", "a block moved", "", "ramp", |field| changed(field, move_a_block)),
    ("one surface", "a triangle flipped", "Fold", "131 × 67", |field| streamed(field, flip_a_triangle)),
    ("one surface", "a triangle dropped", "Gap", "real mountains", |field| streamed(field, drop_a_triangle)),
    ("one surface", "a vertex one ulp off", "Crack", "tiled", |field| streamed(field, nudge_a_vertex)),
    ("one surface", "a side one morph step ahead", "Crack", "131 × 67", |field| {
        Box::new(Altered::new(technique(field, "smooth-tiles", &["tile=9"])).with_list(nudge_a_side))
    }),
    ("one surface", "too narrow a frustum", "Gap", "131 × 67", |field| in_another_view(field, narrower)),
    ("one surface", "skirts half as deep", "Seam", "131 × 67", |field| skirted(field, |list| scale_skirts(list, 0.5))),
    ("one surface", "a side without its skirt", "Seam", "131 × 67", |field| skirted(field, drop_a_skirt)),
    ("one surface", "skirts although sides are shared", "Crack", "131 × 67", |field| {
        Box::new(Altered::new(clusters(field)).with_requirements(|requirements| requirements.seams = Seams::Shared))
    }),
    ("everything in view is drawn", "a block dropped", "in view and not drawn", "ramp", |field| {
        changed(field, drop_a_block)
    }),
    ("everything in view is drawn", "too narrow a frustum", "in view and not drawn", "131 × 67", |field| {
        in_another_view(field, narrower)
    }),
    ("error within tolerance", "an ε a quarter too small", "px of", "131 × 67", |field| {
        in_another_view(field, |view, _| views::with_tolerance(view, 1.25 * view.tolerance.px))
    }),
    ("error within tolerance", "the paper's metric", "px of", "131 × 67", |field| {
        in_another_view(field, with_paper_metric)
    }),
    ("same view, same list", "a counter", "differ", "131 × 67", |field| {
        in_another_view(field, every_other_time_coarser)
    }),
    (
        "teleport and return, same list",
        "a persistent coarser level",
        "after teleport and return",
        "131 × 67",
        |field| in_another_view(field, coarser_since_far_away),
    ),
    ("lists fit the limits", "an instance too many", "exceeds", "ramp", |field| changed(field, one_instance_too_many)),
    ("lists fit the limits", "an index too many", "reaches outside", "ramp", |field| {
        changed(field, one_index_too_many)
    }),
    ("a wider tolerance never draws more", "the inverse tolerance", "triangles by tolerance", "131 × 67", |field| {
        in_another_view(field, |view, _| views::with_tolerance(view, 1.0 / view.tolerance.px))
    }),
    ("holes stay holes", "holes drawn", "only holes in", "holes", |field| Blocks::boxed(field, true, &[0])),
    ("neighbours within one level", "a jump of two levels", "meet", "noise", |field| {
        Blocks::boxed(field, true, &[0, 2])
    }),
];

#[test]
fn mutants_are_detected() {
    let fields = cases::fields();
    for (invariant, mutant, complaint, field, build) in MUTANTS {
        let Some((_, field)) = fields.iter().find(|(name, _)| name == field) else { continue };
        let views = views::views(field);
        let mut technique = build(field);
        let mut subject = Subject::new(field, &mut *technique, &views);
        let invariant = INVARIANTS.iter().find(|l| l.name == *invariant).expect("an invariant of the table");
        match (invariant.check)(&mut subject) {
            Ok(()) => panic!("{}: does not detect {mutant}", invariant.name),
            Err(violation) => assert!(violation.why.contains(complaint), "{}: {mutant}: {violation}", invariant.name),
        }
    }
    let (violation, invariants): (BTreeSet<_>, BTreeSet<_>) =
        (MUTANTS.iter().map(|b| b.0).collect(), INVARIANTS.iter().map(|l| l.name).collect());
    assert_eq!(violation, invariants, "every invariant is violated once");
}

/// Checks that the mutants' base techniques keep the invariants when not mutated.
#[test]
fn unmutated_bases_keep_the_invariants() {
    let fields = cases::fields();
    let (_, field) = fields.iter().find(|(name, _)| *name == "131 × 67").expect("a field of the list");
    let whole: [Box<dyn Technique>; 5] = [
        skirted(field, |_| ()),
        changed(field, |_| ()),
        streamed(field, |_| ()),
        in_another_view(field, |view, _| *view),
        Blocks::boxed(field, true, &[0, 1]),
    ];
    for mut technique in whole {
        let views = views::views(field);
        let mut subject = Subject::new(field, &mut *technique, &views);
        // Clusters may have blocks of several levels.
        let has_levels = subject.technique.pipeline_requirements().seams == Seams::Shared;
        for invariant in
            INVARIANTS.iter().filter(|invariant| has_levels || invariant.name != "neighbours within one level")
        {
            (invariant.check)(&mut subject).unwrap_or_else(|why| panic!("{}: {why}", invariant.name));
        }
    }
}

fn geomipmap(field: &Arc<Field>) -> Box<dyn Technique> {
    technique(field, "geomipmap", &["block=17"])
}

/// Clusters with skirts.
fn clusters(field: &Arc<Field>) -> Box<dyn Technique> {
    technique(field, "clusters", &["block=8", "seams=skirts", "morph=on"])
}

fn changed(field: &Arc<Field>, change: fn(&mut DrawList)) -> Box<dyn Technique> {
    Box::new(Altered::new(geomipmap(field)).with_list(change))
}

fn skirted(field: &Arc<Field>, change: fn(&mut DrawList)) -> Box<dyn Technique> {
    Box::new(Altered::new(clusters(field)).with_list(change))
}

/// Adds one step of a morph to the last sides of the tile in the middle of the list.
fn nudge_a_side(list: &mut DrawList) {
    let middle = list.instances.len() / 2;
    list.instances.iter_mut().skip(middle).take(1).for_each(|tile| {
        let weights = SlotWeights::of(tile);
        *tile = tile.with_weights(SlotWeights { last_sides: weights.last_sides + 0x0101_0101, ..weights });
    });
}

/// Removes the bit of the first skirt in a list.
fn drop_a_skirt(list: &mut DrawList) {
    let skirted = list.instances.iter_mut().find(|instance| SkirtWeights::of(instance).sides != 0);
    skirted.into_iter().for_each(|instance| {
        let weights = SkirtWeights::of(instance);
        *instance = instance.with_weights(SkirtWeights { sides: weights.sides & (weights.sides - 1), ..weights });
    });
}

/// Removes the last block from all draws; the draws of one level's borders and centre share blocks.
fn drop_a_block(list: &mut DrawList) {
    let Some(victim) = list.instances.len().checked_sub(1) else { return };
    list.draws.iter_mut().for_each(|draw| draw.instances.end = draw.instances.end.min(victim as u32));
    list.draws.retain(|draw| !draw.instances.is_empty());
}

fn double_a_block(list: &mut DrawList) {
    list.draws.extend(list.draws.last().cloned());
}

fn move_a_block(list: &mut DrawList) {
    list.instances.iter_mut().take(1).for_each(|block| block.origin[0] += 8);
}

fn one_instance_too_many(list: &mut DrawList) {
    let max = 81usize.div_ceil(16) * 66usize.div_ceil(16);
    list.instances.resize(max + 6, Instance::default());
}

fn one_index_too_many(list: &mut DrawList) {
    list.draws.iter_mut().for_each(|draw| draw.indices = draw.indices.start + 900_000..draw.indices.end + 900_000);
}

/// Geomipmap's triangles as an explicit stream, changed.
struct Streamed {
    field: Arc<Field>,
    inner: Box<dyn Technique>,
    change: fn(&mut Geometry),
    nothing: Geometry,
}

fn streamed(field: &Arc<Field>, change: fn(&mut Geometry)) -> Box<dyn Technique> {
    Box::new(Streamed { field: Arc::clone(field), inner: geomipmap(field), change, nothing: Geometry::default() })
}

impl Technique for Streamed {
    fn pipeline_requirements(&self) -> PipelineRequirements {
        PipelineRequirements { draws: DrawKinds::EXPLICIT, ..PipelineRequirements::default() }
    }
    fn resident(&self) -> &Geometry {
        &self.nothing
    }
    fn limits(&self) -> Limits {
        let max = 6 * self.field.size().iter().product::<u32>() as usize;
        Limits { draws: 1, instances: 1, vertices: max, indices: max, ..Limits::default() }
    }
    fn select(&mut self, view: &View, list: &mut DrawList) {
        let mut blocks = DrawList::default();
        self.inner.select(view, &mut blocks);
        let frame = Frame::placing(&self.field, view);
        for corner in
            expand::triangles(&self.field, &frame, self.inner.resident(), &blocks).iter().flat_map(|t| t.corners)
        {
            list.streamed.indices.push(list.streamed.vertices.len() as u32);
            let position = [corner.x, corner.z];
            list.streamed.vertices.push(ExplicitVertex {
                position,
                height: corner.y,
                target: corner.y,
                morph: 0.0,
                ..ExplicitVertex::default()
            });
        }
        (self.change)(&mut list.streamed);
        list.instances.push(Instance::default());
        let indices = 0..list.streamed.indices.len() as u32;
        list.draws.push(Draw {
            source: Source::Streamed,
            topology: Topology::Triangles,
            indices,
            instances: 0..1,
            first_vertex: 0,
        });
    }
    fn keeps_tolerance(&self) -> bool {
        true
    }
}

fn flip_a_triangle(geometry: &mut Geometry) {
    let middle = geometry.indices.len() / 6 * 3;
    if middle > 0 {
        geometry.indices.swap(middle, middle + 1);
    }
}

fn drop_a_triangle(geometry: &mut Geometry) {
    let middle = geometry.indices.len() / 6 * 3;
    geometry.indices.drain(middle..(middle + 3).min(geometry.indices.len()));
}

fn nudge_a_vertex(geometry: &mut Geometry) {
    let middle = geometry.vertices.len() / 2;
    geometry.vertices.iter_mut().skip(middle).take(1).for_each(|vertex| vertex.height = vertex.height.next_up());
}

/// Geomipmap that receives another view than the list is for. `count` is passed to the function that changes the view.
fn in_another_view(field: &Arc<Field>, view: fn(&View, &mut u32) -> View) -> Box<dyn Technique> {
    let mut count = 0;
    Box::new(Altered::new(geomipmap(field)).with_view(move |seen| view(seen, &mut count)))
}

fn narrower(view: &View, _: &mut u32) -> View {
    match view.lens {
        Lens::Perspective { fov_x } => View { lens: Lens::Perspective { fov_x: 0.7 * fov_x }, ..*view },
        Lens::Orthographic { .. } => *view,
    }
}

fn with_paper_metric(view: &View, _: &mut u32) -> View {
    let mut view = *view;
    view.tolerance.metric = cuesta::internal::view::Metric::Paper;
    view
}

fn every_other_time_coarser(view: &View, count: &mut u32) -> View {
    *count += 1;
    views::with_tolerance(view, if count.is_multiple_of(2) { 30.0 } else { 1.0 })
}

/// Uses a coarser tolerance permanently after a view from far away.
fn coarser_since_far_away(view: &View, count: &mut u32) -> View {
    *count += u32::from(view.eye.y > 1e4);
    views::with_tolerance(view, if *count > 0 { 30.0 } else { 1.0 })
}

/// Blocks of 8 cells over the whole field, including holes, with levels along a diagonal from a list.
struct Blocks {
    mesh: BlockMesh,
    count: [i32; 2],
    stitched: bool,
    levels: &'static [u32],
}

impl Blocks {
    fn boxed(field: &Arc<Field>, stitched: bool, levels: &'static [u32]) -> Box<dyn Technique> {
        let count = field.size().map(|n| (n as i32 - 1).div_euclid(8) + i32::from((n - 1) % 8 > 0));
        Box::new(Blocks { mesh: BlockMesh::new(8, Masks::Sixteen), count, stitched, levels })
    }

    fn level(&self, [i, j]: [i32; 2]) -> u32 {
        self.levels[((i + j) as usize / 2) % self.levels.len()]
    }

    fn mask(&self, [i, j]: [i32; 2]) -> u8 {
        let sides = [(-1, 0, side::LEFT), (0, -1, side::TOP), (1, 0, side::RIGHT), (0, 1, side::BOTTOM)];
        let meets = |di: i32, dj: i32| {
            let at = [i + di, j + dj];
            let exists = (0..2).all(|k| (0..self.count[k]).contains(&at[k]));
            self.stitched && exists && self.level(at) > self.level([i, j])
        };
        sides.iter().filter(|&&(di, dj, _)| meets(di, dj)).map(|&(.., bit)| bit).sum()
    }
}

impl Technique for Blocks {
    fn resident(&self) -> &Geometry {
        &self.mesh.geometry
    }
    fn limits(&self) -> Limits {
        let blocks = (self.count[0] * self.count[1]) as usize;
        Limits { draws: 2 * blocks, instances: blocks, ..Limits::default() }
    }
    fn select(&mut self, _: &View, list: &mut DrawList) {
        for at in (0..self.count[1]).flat_map(|j| (0..self.count[0]).map(move |i| [i, j])) {
            let (level, first) = (self.level(at), list.instances.len() as u32);
            list.instances.push(Instance { origin: at.map(|n| 8 * n), cells: 8, level, ..Instance::default() });
            let border = &self.mesh.borders[level as usize][usize::from(self.mask(at))];
            for indices in [border, &self.mesh.centres[level as usize]].map(Clone::clone) {
                let instances = first..first + 1;
                list.draws.push(Draw {
                    source: Source::Lattice,
                    topology: Topology::Triangles,
                    indices,
                    instances,
                    first_vertex: 0,
                });
            }
        }
    }
    fn keeps_tolerance(&self) -> bool {
        false
    }
}
