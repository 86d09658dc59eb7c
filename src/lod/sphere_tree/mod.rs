//! Spheres: a binary triangle tree whose wedges split where the viewpoint is inside their spheres.
//!
//! After J. Blow, "Terrain Rendering at High Levels of Detail" (2000), part II. A wedge that has an error on the screen
//! above the tolerance when the eye is near enough has a sphere around it: inside it splits, outside it merges. Two
//! wedges that share a hypotenuse split together, so one sphere serves both, about the middle of that hypotenuse
//! ([`lattice`]). What has split is thus a function of the eye's place alone. Which spheres it may have crossed is found
//! in four ways, with the same triangles: made-up spheres about the viewpoint that group those it cannot have crossed
//! ([`bounding_spheres`]); the same for those that lie behind no other one, as the lecture has it, which costs more than it saves
//! ([`covers`]); ROAM's two queues ([`roam`]); and every sphere anew ([`splits`]).
//!
//! Where this differs from the lecture, and why:
//! - the lecture's functions are its application's; here a sphere's radius follows from an error measured at every
//!   sample ([`measure`]) and the view's tolerance, `certified` or as published elsewhere ([`reach`]);
//! - spheres are nested over both parents of a diamond, not only in the tree. So no split is ever forced by a neighbour:
//!   it is inside its own sphere already, and no order of crossings matters;
//! - any size of field: the root square may be larger, and its vertices beyond the field fall onto its edge;
//! - `morph=on` lets vertices fade in over a band around their spheres ([`mesh`]), but for those of diamonds that stick
//!   out of the field;
//! - triangles out of sight are left out, by blocks.
//!
//! Laws kept: watertight, covered once, error within tolerance, no state between views (`hold=off`).

pub mod blocks;
pub mod bounding_spheres;
pub mod by_index;
pub mod covers;
pub mod evaluated;
pub mod front;
pub mod known;
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
use super::{Entry, Setting, Settings, Technique, Values, select_within_limits};
use crate::draw::{DrawKinds, DrawList, Geometry, Limits, Normals, PipelineRequirements};
use crate::height::{Field, MAX_SIDE};
use crate::view::View;

/// Vertices fade in over so many times a sphere's radius: a wider band draws more, a narrower one is seen.
const BAND: f32 = 1.3;
/// Diamonds that have split stay so up to this many times a sphere's radius, if they are held.
const HOLD: f64 = 1.1;
/// The most diamonds that split, whatever the tolerance: buffers are made for them. Beyond it the tolerance is widened.
const MAX_SPLITS: usize = 1 << 20;
/// The same of a land without end, whose diamonds are worked out as they are met.
const MAX_OPEN_SPLITS: usize = 1 << 17;

/// The row of the table.
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
            about: "how crossed spheres are found: by made-up ones, behind others, by two queues, or among all; same triangles",
        },
        Setting {
            key: "morph",
            values: Values::Words(&["off", "on"]),
            default: "off",
            about: "whether vertices come at once or fade in around their spheres",
        },
        Setting {
            key: "hold",
            values: Values::Words(&["off", "on"]),
            default: "off",
            about: "whether a wedge merges a little further away than it splits",
        },
        Setting {
            key: "patches",
            values: Values::Words(&["streamed", "resident"]),
            default: "streamed",
            about: "whether all triangles are sent in each frame, or, of a land with samples, blocks that changed",
        },
    ],
    needs: &[],
    max_samples: 1 << 27,
    max_side: MAX_SIDE,
    takes_endless: true,
    build: |field, settings| Box::new(SphereTree::new(field, settings)),
};

/// How the split diamonds are found.
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
    /// What stays on the device, unless all is streamed.
    patches: Option<Patches>,
    nothing: Geometry,
    /// Bytes of vertices and indices in the last list.
    sent: usize,
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
        let (band, nothing) = (f64::from(band), Geometry::default());
        Self { measured, blocks, criterion, band, hold, limits, patches, nothing, sent: 0 }
    }
}

/// A split makes two triangles more. A block's pieces have two vertices more than triangles at most, and larger wedges
/// three each.
fn limits(measured: &Measured, blocks: &Blocks) -> Limits {
    let [w, h] = measured.field.size().map(|n| n as usize);
    let triangles = (2 * (w - 1) * (h - 1)).min(2 * max_splits(measured) + 2);
    let draws = blocks.number() + 1;
    let vertices = triangles + 8 * draws;
    let normals = if measured.is_endless() { vertices } else { 0 };
    Limits { draws, instances: draws, vertices, normals, indices: 3 * triangles, upload_bytes: 0 }
}

fn max_splits(measured: &Measured) -> usize {
    if measured.is_endless() { MAX_OPEN_SPLITS } else { MAX_SPLITS }
}

impl Technique for SphereTree {
    fn resident(&self) -> &Geometry {
        self.patches.as_ref().map_or(&self.nothing, Patches::geometry)
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
        self.blocks.look(view);
        let changes = self.criterion.changes();
        let Self { measured, blocks, criterion, patches, .. } = self;
        if let Some(patches) = patches {
            patches.begin(&changes, from.band > 1.0, blocks);
        }
        let mesh = Mesh { measured, splits: criterion.splits(), blocks, from: &from };
        match measured.field.procedural() {
            Some(terrain) => mesh.fill_open(terrain, view, list),
            None => mesh.fill(patches.as_mut(), list),
        }
        let size = list.size();
        self.sent = size.upload_bytes + patches::bytes(size.vertices, size.indices);
    }

    fn is_settled(&self) -> bool {
        !self.patches.as_ref().is_some_and(Patches::waits)
    }

    fn keeps_tolerance(&self) -> bool {
        true
    }

    fn pipeline_requirements(&self) -> PipelineRequirements {
        let normals = if self.measured.is_endless() { Normals::Vertices } else { Normals::Texture };
        PipelineRequirements { draws: DrawKinds::EXPLICIT, normals, ..PipelineRequirements::default() }
    }

    fn stats(&self) -> Vec<(&'static str, f64, &'static str)> {
        vec![
            ("wedges visited for the last view", 2.0 * self.criterion.visited() as f64, ""),
            ("wedges split in the last view", 2.0 * self.criterion.splits().count() as f64, ""),
            ("bytes of triangles sent for the last view", self.sent as f64, "B"),
            ("bytes of errors and balls", self.measured.bytes() as f64, "B"),
        ]
    }
}
