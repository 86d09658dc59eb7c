//! Sphere tree: a binary triangle tree whose wedges split while the eye is inside their spheres.
//!
//! Based on J. Blow, "Terrain Rendering at High Levels of Detail" (2000), part II. Each wedge has a sphere outside of
//! which its screen-space error is below the tolerance. It splits when the eye enters the sphere and merges when the
//! eye leaves it. Two wedges that share a hypotenuse split together, so one sphere about the middle of that hypotenuse
//! serves both ([`lattice`]). The split wedges are therefore a function of the eye's position alone. Crossed spheres
//! are found by one of four criteria, which draw the same triangles:
//! - bounding spheres about past viewpoints that group spheres the eye cannot have crossed ([`bounding_spheres`]);
//! - the lecture's hierarchy of nested spheres, which costs more than it saves ([`covers`]);
//! - ROAM's two queues ([`roam`]);
//! - a check of every sphere ([`splits`]).
//!
//! Differences from the lecture:
//! - The lecture leaves the radius to the application. Here it follows from an error measured at every sample
//!   ([`measure`]) and the view's tolerance, under the metric `certified` or the paper's ([`reach`]).
//! - Spheres are nested over both parents of a diamond, not only in the tree. A neighbour therefore never forces a
//!   split, and the order of crossings does not matter.
//! - Fields may have any size. The root square may be larger; its vertices beyond the field collapse onto the field's
//!   edge.
//! - `morph=on` fades vertices in over a band around their spheres ([`mesh`]), except for those of diamonds that extend
//!   beyond the field.
//! - Invisible triangles are culled by blocks.
//!
//! Invariants: watertight; the field is covered once; error within tolerance; no state between views (`hold=off`).

pub mod blocks;
pub mod bounding_spheres;
pub mod by_index;
pub mod covers;
pub mod diamond_info;
pub mod evaluated;
pub mod front;
pub mod lattice;
pub mod measure;
pub mod mesh;
pub mod open;
pub mod patches;
pub mod reach;
pub mod roam;
pub mod splits;

use std::sync::Arc;

use self::blocks::Blocks;
use self::bounding_spheres::BoundingSpheres;
use self::covers::Covers;
use self::front::Follower;
use self::measure::Measured;
use self::mesh::Mesh;
use self::patches::Patches;
use self::reach::{Reach, Viewpoint};
use self::roam::Queues;
use self::splits::{Changes, Found, Splits};
use super::entry::Entry;
use super::settings::{Setting, Settings, Values};
use super::technique::{Diagnostics, Gradual, Technique};
use super::within_limits::select_within_limits;
use crate::draw::{DrawKinds, DrawList, Geometry, Limits, Normals, PipelineRequirements};
use crate::height::{Field, MAX_SIDE};
use crate::view::View;

/// Vertices fade in between this multiple of a sphere's radius and the sphere. A wider band draws more, a narrower one
/// is noticeable.
const BAND: f32 = 1.3;
/// With `hold=on`, split diamonds merge at this multiple of a sphere's radius.
const HOLD: f64 = 1.1;
/// Maximum number of split diamonds, for which buffers are allocated. The tolerance is scaled until they suffice.
const MAX_SPLITS: usize = 1 << 20;
/// Maximum number of split diamonds of a procedural terrain, whose diamonds are computed on demand.
const MAX_PROCEDURAL_SPLITS: usize = 1 << 17;

/// Row of [`super::TECHNIQUES`].
pub const ENTRY: Entry = Entry {
    name: "sphere-tree",
    about: "binary triangle tree: a wedge splits where the eye is inside its sphere",
    paper: "Blow 2000",
    variants: &[],
    settings: &[
        Setting {
            key: "criterion",
            values: Values::Words(&["spheres", "covers", "roam", "plain"]),
            default: "spheres",
            about: "how crossed spheres are found: bounding spheres, nested spheres, ROAM's queues, or a check of all; same triangles",
        },
        Setting {
            key: "morph",
            values: Values::Words(&["off", "on"]),
            default: "off",
            about: "off: vertices appear at once; on: they fade in around their spheres",
        },
        Setting {
            key: "hold",
            values: Values::Words(&["off", "on"]),
            default: "off",
            about: "on: a wedge merges at a slightly greater distance than it splits",
        },
        Setting {
            key: "patches",
            values: Values::Words(&["streamed", "resident"]),
            default: "streamed",
            about: "streamed: upload all triangles each frame; resident: only changed blocks (not for procedural terrain)",
        },
    ],
    needs: &[],
    max_samples: 1 << 27,
    max_side: MAX_SIDE,
    takes_endless: true,
    build: |field, settings| Box::new(SphereTree::new(field, settings)),
};

/// Method of finding the split diamonds.
enum Criterion {
    Spheres(Follower<BoundingSpheres>),
    Covers(Follower<Covers>),
    Roam(Follower<Queues>),
    Plain { splits: Splits, found: Found },
}

struct SphereTree {
    measured: Measured,
    blocks: Blocks,
    criterion: Criterion,
    band: f64,
    hold: f64,
    limits: Limits,
    /// Geometry that stays on the device; `None` if all is streamed.
    patches: Option<Patches>,
    empty: Geometry,
    /// Bytes of vertices and indices in the last list.
    sent_bytes: usize,
}

impl Criterion {
    fn follow(&mut self, measured: &Measured, from: &Viewpoint, max: usize) -> bool {
        match self {
            Criterion::Spheres(follower) => follower.follow(measured, from, max),
            Criterion::Covers(follower) => follower.follow(measured, from, max),
            Criterion::Roam(follower) => follower.follow(measured, from, max),
            Criterion::Plain { splits, found } => splits.refill(measured, from, found, max),
        }
    }

    fn splits(&self) -> &Splits {
        match self {
            Criterion::Spheres(follower) => follower.splits(),
            Criterion::Covers(follower) => follower.splits(),
            Criterion::Roam(follower) => follower.splits(),
            Criterion::Plain { splits, .. } => splits,
        }
    }

    fn changes(&mut self) -> Changes {
        match self {
            Criterion::Spheres(follower) => follower.changes(),
            Criterion::Covers(follower) => follower.changes(),
            Criterion::Roam(follower) => follower.changes(),
            Criterion::Plain { splits, .. } => splits.changes(),
        }
    }

    fn visited(&self) -> usize {
        match self {
            Criterion::Spheres(follower) => follower.visited(),
            Criterion::Covers(follower) => follower.visited(),
            Criterion::Roam(follower) => follower.visited(),
            Criterion::Plain { found, .. } => found.visited,
        }
    }
}

impl SphereTree {
    fn new(field: Arc<Field>, settings: &Settings) -> Self {
        let band = if settings.word("morph") == "on" { BAND } else { 1.0 };
        let measured = Measured::new(field, band, &settings.progress);
        let blocks = Blocks::new(&measured.field, &measured.lattice);
        let criterion = match settings.word("criterion") {
            "spheres" => Criterion::Spheres(Follower::new(&measured)),
            "covers" => Criterion::Covers(Follower::new(&measured)),
            "roam" => Criterion::Roam(Follower::new(&measured)),
            _ => Criterion::Plain { splits: Splits::none(&measured), found: Found::default() },
        };
        let hold = if settings.word("hold") == "on" { HOLD } else { 1.0 };
        let mut limits = limits(&measured, &blocks);
        let is_resident = settings.word("patches") == "resident" && !measured.is_endless();
        let patches = is_resident.then(|| Patches::new(blocks.number(), &limits));
        limits.upload_bytes = patches.as_ref().map_or(0, Patches::upload_bytes);
        let (band, empty) = (f64::from(band), Geometry::default());
        Self { measured, blocks, criterion, band, hold, limits, patches, empty, sent_bytes: 0 }
    }
}

/// Upper bounds of a list. Each split adds two triangles. A block's piece has at most two vertices more than triangles;
/// larger wedges have three vertices each.
fn limits(measured: &Measured, blocks: &Blocks) -> Limits {
    let [w, h] = measured.field.size().map(|n| n as usize);
    let triangles = (2 * (w - 1) * (h - 1)).min(2 * max_splits(measured) + 2);
    let draws = blocks.number() + 1;
    let vertices = triangles + 8 * draws;
    let normals = if measured.is_endless() { vertices } else { 0 };
    Limits { draws, instances: draws, vertices, normals, indices: 3 * triangles, upload_bytes: 0 }
}

fn max_splits(measured: &Measured) -> usize {
    if measured.is_endless() { MAX_PROCEDURAL_SPLITS } else { MAX_SPLITS }
}

impl Technique for SphereTree {
    fn resident(&self) -> &Geometry {
        self.patches.as_ref().map_or(&self.empty, Patches::geometry)
    }

    fn limits(&self) -> Limits {
        self.limits
    }

    fn select(&mut self, view: &View, list: &mut DrawList) {
        let (from, tolerance_scale) = select_within_limits(view, |wider| {
            let (eye, reach) = (self.measured.relative(view.eye), Reach::new(&self.measured.without_rounding(wider)?));
            let from = Viewpoint { eye, reach, band: self.band, hold: self.hold };
            self.criterion.follow(&self.measured, &from, max_splits(&self.measured)).then_some(from)
        });
        list.tolerance_scale = tolerance_scale;
        self.blocks.update_visibility(view);
        let changes = self.criterion.changes();
        let Self { measured, blocks, criterion, patches, .. } = self;
        if let Some(patches) = patches {
            patches.begin(&changes, from.band > 1.0, blocks);
        }
        let mesh = Mesh { measured, splits: criterion.splits(), blocks, from: &from };
        match measured.field.procedural() {
            Some(terrain) => mesh.fill_procedural(terrain, view, list),
            None => mesh.fill(patches.as_mut(), list),
        }
        let size = list.size();
        self.sent_bytes = size.upload_bytes + patches::bytes(size.vertices, size.indices);
    }

    fn keeps_tolerance(&self) -> bool {
        true
    }

    fn pipeline_requirements(&self) -> PipelineRequirements {
        let normals = if self.measured.is_endless() { Normals::Vertices } else { Normals::Texture };
        PipelineRequirements { draws: DrawKinds::EXPLICIT, normals, ..PipelineRequirements::default() }
    }

    fn gradual(&self) -> Option<&dyn Gradual> {
        Some(self)
    }

    fn diagnostics(&self) -> Option<&dyn Diagnostics> {
        Some(self)
    }
}

impl Gradual for SphereTree {
    fn is_settled(&self) -> bool {
        !self.patches.as_ref().is_some_and(Patches::is_pending)
    }
}

impl Diagnostics for SphereTree {
    fn stats(&self) -> Vec<(&'static str, f64, &'static str)> {
        vec![
            ("wedges visited for the last view", 2.0 * self.criterion.visited() as f64, ""),
            ("wedges split in the last view", 2.0 * self.criterion.splits().count() as f64, ""),
            ("bytes of triangles sent for the last view", self.sent_bytes as f64, "B"),
            ("bytes of errors and balls", self.measured.bytes() as f64, "B"),
        ]
    }
}
