//! The invariants that every technique keeps with every configuration, on every field, from every view. No GPU is
//! needed.
//!
//! An invariant is a function of a field, a technique and views. Tests apply invariants to mutants (techniques with
//! one mechanism broken), the suite to any field and view.

use std::collections::HashMap;
use std::fmt;

use glam::DVec3;

use super::views;
use crate::draw::expand::{self, Drawn};
use crate::draw::layout::Frame;
use crate::draw::{Draw, DrawList, Geometry, RESTART, Source, Topology};
use crate::height::surface::{self, has_terrain, is_terrain};
use crate::height::{Field, rtin};
use crate::lod::Technique;
use crate::measure::{geometric, in_view, watertight};
use crate::view::View;

/// A technique on a field, with views, as the input of an invariant.
pub struct Subject<'a> {
    /// The field.
    pub field: &'a Field,
    /// The technique.
    pub technique: &'a mut dyn Technique,
    /// Names and views.
    pub views: &'a [(&'static str, View)],
    /// Tolerances for comparisons, pixels, in ascending order.
    pub tolerances_px: &'a [f64],
    /// Scene time of the last list, seconds; advances by 1 s per list.
    pub time_s: f64,
}

/// A violation of an invariant.
#[derive(Clone, Debug)]
pub struct Violation {
    /// Name and view in which it occurs.
    pub view: Box<(&'static str, View)>,
    /// Reason.
    pub why: String,
}

impl Violation {
    /// Creates a violation in a view.
    pub fn new(view: (&'static str, View), why: impl Into<String>) -> Self {
        Self { view: Box::new(view), why: why.into() }
    }
}

impl fmt::Display for Violation {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{}: {}", self.view.0, self.why)
    }
}

/// An invariant.
pub struct Invariant {
    /// Name.
    pub name: &'static str,
    /// Techniques it applies to; empty for all.
    pub only: &'static [&'static str],
    /// Returns the first violation found.
    pub check: fn(&mut Subject) -> Result<(), Violation>,
}

/// Creates an invariant for all techniques.
const fn invariant(name: &'static str, check: fn(&mut Subject) -> Result<(), Violation>) -> Invariant {
    Invariant { name, only: &[], check }
}

/// All invariants.
pub const INVARIANTS: &[Invariant] = &[
    invariant("one surface", one_surface),
    invariant("everything in view is drawn", everything_in_view),
    invariant("error within tolerance", error_within_tolerance),
    invariant("same view, same list", same_view_same_list),
    invariant("teleport and return, same list", teleport_and_return),
    invariant("lists fit the limits", lists_fit),
    invariant("a wider tolerance never draws more", wider_never_more),
    invariant("holes stay holes", holes_stay_holes),
    Invariant {
        name: "neighbours within one level",
        only: &["geomipmap", "smooth-tiles"],
        check: neighbours_within_one_level,
    },
];

/// Tolerances that suit any field, pixels, in ascending order.
pub const TOLERANCES_PX: [f64; 5] = [0.5, 1.0, 2.0, 4.0, 8.0];

/// Relative allowance for rounding in a screen error. Heights are compared as the f32 values that are drawn;
/// everything else is f64, whose rounding over a projection stays far below this.
pub const SLACK: f64 = 1e-9;

/// Upper limit of frames of one view until a technique settles: a few for each tile of the largest field.
const MAX_FRAMES: usize = 5000;

/// Distance of a teleport out of any field, metres.
const ELSEWHERE_M: f64 = 1e9;

/// Returns the invariants that apply to a technique of this name.
pub fn of_technique(name: &str) -> impl Iterator<Item = &'static Invariant> {
    INVARIANTS.iter().filter(move |invariant| invariant.only.is_empty() || invariant.only.contains(&name))
}

impl<'a> Subject<'a> {
    /// Creates the input for common tolerances ([`TOLERANCES_PX`]).
    pub fn new(field: &'a Field, technique: &'a mut dyn Technique, views: &'a [(&'static str, View)]) -> Self {
        Self { field, technique, views, tolerances_px: &TOLERANCES_PX, time_s: 0.0 }
    }
}

impl Subject<'_> {
    /// Returns the list of a view once the technique has settled.
    pub fn select(&mut self, view: &View) -> Result<DrawList, String> {
        for _ in 0..MAX_FRAMES {
            let list = self.select_once(view);
            if self.technique.is_settled() {
                return Ok(list);
            }
        }
        Err(format!("not settled after {MAX_FRAMES} frames of one view"))
    }

    /// Returns the next list of a view, one second after the previous one.
    pub fn select_once(&mut self, view: &View) -> DrawList {
        let mut list = DrawList::default();
        self.time_s += 1.0;
        self.technique.select(&View { time_s: self.time_s, ..*view }, &mut list);
        list
    }

    /// Returns the triangles of a view and the fraction bits of their corners.
    fn drawn(&mut self, view: &View) -> Result<(Vec<Drawn>, u32), String> {
        let list = self.select(view)?;
        Ok((self.expanded(view, &list), list.fraction_bits))
    }

    /// Returns the triangles of a list.
    fn expanded(&self, view: &View, list: &DrawList) -> Vec<Drawn> {
        let frame = Frame::placing(self.field, view);
        expand::triangles(self.field, &frame, self.technique.resident(), list)
    }

    /// Runs a check in every view and reports the first violation.
    fn in_every_view(&mut self, check: impl Fn(&mut Self, &View) -> Result<(), String>) -> Result<(), Violation> {
        self.views.iter().try_for_each(|view| check(self, &view.1).map_err(|why| Violation::new(*view, why)))
    }
}

/// No cracks or T-junctions, every point covered once, triangles facing up, no visible gap. For techniques with
/// skirts: every gap is hidden by one.
fn one_surface(subject: &mut Subject) -> Result<(), Violation> {
    let [w, h] = subject.field.size().map(i64::from);
    subject.in_every_view(|subject, view| {
        let whole = 2 * (w - 1) * (h - 1);
        let all_terrain = subject.field.holes().count() == 0 && views::sees_everything(subject.field, view);
        // The first list of the view, and the settled one.
        [false, true].into_iter().try_for_each(|settles| {
            let list = if settles { subject.select(view)? } else { subject.select_once(view) };
            let seams = subject.technique.pipeline_requirements().seams;
            let proof = watertight::prove_list(subject.field, view, seams, subject.technique.resident(), &list)
                .map_err(|why| why.to_string())?;
            let all_terrain = all_terrain && list.reach_m == f64::INFINITY;
            ensure(!all_terrain || proof.doubled_area == whole, || format!("area {} of {whole}", proof.doubled_area))
        })
    })
}

/// Every visible sample within the list's reach lies in a drawn triangle. This repeats the last step of
/// [`watertight`] independently, by exact projection of points instead of boxes and areas.
fn everything_in_view(subject: &mut Subject) -> Result<(), Violation> {
    let terrain = samples_of_terrain(subject.field);
    subject.in_every_view(|subject, view| {
        let [w, h] = subject.field.size();
        let mut covered = vec![false; (w * h) as usize];
        let list = subject.select(view)?;
        let triangles = subject.expanded(view, &list);
        for triangle in triangles.iter().filter(|t| surface::doubled_area(&t.corners) > 0) {
            let cover = |x, z, _| covered[(z * w + x) as usize] = true;
            surface::visit_samples_between(&triangle.corners, list.fraction_bits, cover);
        }
        let is_seen = |point: DVec3| {
            let within_reach = (point.x - view.eye.x).hypot(point.z - view.eye.z) <= list.reach_m;
            within_reach && in_view(view, point)
        };
        let open = |&k: &u32| !covered[k as usize] && is_seen(subject.field.world(k % w, k / w));
        let missing = terrain.iter().find(|&k| open(k));
        missing.map_or(Ok(()), |k| Err(format!("sample ({}, {}) is in view and not drawn", k % w, k / w)))
    })
}

/// Returns the samples that are corners of a triangle with data.
fn samples_of_terrain(field: &Field) -> Vec<u32> {
    let [w, h] = field.size();
    let mut terrain = vec![false; (w * h) as usize];
    let cells = (0..h as i32 - 1).flat_map(|j| (0..w as i32 - 1).map(move |i| (i, j)));
    for [x, z] in cells.flat_map(|(i, j)| rtin::cell(i, j)).filter(|t| is_terrain(field, t)).flatten() {
        terrain[(z as u32 * w + x as u32) as usize] = true;
    }
    (0..w * h).filter(|&k| terrain[k as usize]).collect()
}

/// No sample in view is drawn with a screen error above the tolerance, under the certified metric.
fn error_within_tolerance(subject: &mut Subject) -> Result<(), Violation> {
    if !subject.technique.keeps_tolerance() {
        return Ok(());
    }
    subject.in_every_view(|subject, view| {
        let mut last = None;
        subject.tolerances_px.iter().try_for_each(|&px| {
            let view = views::with_tolerance(view, px);
            let list = subject.select(&view)?;
            let is_same = |last: &DrawList| last.tolerance_scale == 1.0 && same_list(last, &list);
            if last.as_ref().is_some_and(is_same) {
                // The same triangles passed at a smaller tolerance already.
                return Ok(());
            }
            let errors = geometric::errors(subject.field, &view, subject.technique.resident(), &list);
            // A list that did not fit reports a larger tolerance. A tolerance beyond the image size is no bound.
            let (max, px) = (errors.screen_px.max, px * list.tolerance_scale);
            let is_bound = list.tolerance_scale == 1.0 || px < f64::from(view.size[0].max(view.size[1]));
            last = Some(list);
            ensure(!is_bound || max <= px * (1.0 + SLACK), || format!("{max} px of {px}, at {:?}", errors.screen_at))
        })
    })
}

/// Two lists in a row of one view are equal.
fn same_view_same_list(subject: &mut Subject) -> Result<(), Violation> {
    subject.in_every_view(|subject, view| {
        let (first, second) = (subject.select(view)?, subject.select(view)?);
        ensure(same_list(&first, &second), || "two lists in a row differ".into())
    })
}

/// The list of a view is the same after a teleport and return. Techniques with uploads may store geometry elsewhere
/// afterwards; for them the drawn triangles are compared.
fn teleport_and_return(subject: &mut Subject) -> Result<(), Violation> {
    let views = subject.views;
    let uploads = subject.technique.limits().upload_bytes > 0;
    views.iter().zip(views.iter().skip(3).chain(views)).try_for_each(|(view, (_, away))| {
        let same = same_after_teleport(subject, &view.1, away, uploads);
        let same = same.and_then(|same| ensure(same, || "another list after teleport and return".into()));
        same.map_err(|why| Violation::new(*view, why))
    })
}

fn same_after_teleport(subject: &mut Subject, view: &View, away: &View, uploads: bool) -> Result<bool, String> {
    // Teleport both times.
    let elsewhere = View { eye: view.eye + DVec3::X * ELSEWHERE_M, ..*view };
    subject.select_once(&elsewhere);
    let list = subject.select(view)?;
    let drawn = if uploads { sorted(subject.drawn(view)?.0) } else { Vec::new() };
    subject.select(away)?;
    subject.select_once(&elsewhere);
    let list_again = subject.select(view)?;
    Ok(if uploads { drawn == sorted(subject.drawn(view)?.0) } else { same_list(&list, &list_again) })
}

fn same_list(a: &DrawList, b: &DrawList) -> bool {
    let bytes = |list: &DrawList| bytemuck::cast_slice::<_, u8>(&list.streamed.vertices).to_vec();
    (&a.draws, &a.instances, a.submission) == (&b.draws, &b.instances, b.submission)
        && a.streamed.indices == b.streamed.indices
        && bytes(a) == bytes(b)
}

fn sorted(triangles: Vec<Drawn>) -> Vec<[(i32, i32, u32); 3]> {
    let mut sorted: Vec<_> = triangles.iter().map(|t| t.corners.map(|c| (c.x, c.z, c.y.to_bits()))).collect();
    sorted.sort_unstable();
    sorted
}

/// A list is within the technique's limits, its ranges within what they address, and its draws of the kinds that the
/// technique states.
fn lists_fit(subject: &mut Subject) -> Result<(), Violation> {
    subject.in_every_view(|subject, view| {
        let list = subject.select(view)?;
        let (limits, size) = (subject.technique.limits(), list.size());
        ensure(limits.hold(&size), || format!("{size:?} exceeds {limits:?}"))?;
        let (resident, draws) = (subject.technique.resident(), subject.technique.pipeline_requirements().draws);
        let addressed = |source| if source == Source::Streamed { &list.streamed } else { resident };
        list.draws.iter().try_for_each(|draw| {
            let fits = in_range(addressed(draw.source), draw) && draw.instances.end as usize <= list.instances.len();
            ensure(fits, || format!("{draw:?} reaches outside"))?;
            ensure(draws.hold(draw.source, draw.topology), || format!("{draw:?} is none of {draws:?}"))
        })
    })
}

fn in_range(geometry: &Geometry, draw: &Draw) -> bool {
    let vertices = if draw.source == Source::Lattice { geometry.lattice.len() } else { geometry.vertices.len() };
    let indices = geometry.indices.get(draw.indices.start as usize..draw.indices.end as usize);
    let is_end = |k: u32| k == RESTART && draw.topology == Topology::Strip;
    let fits = |&k: &u32| is_end(k) || ((k + draw.first_vertex) as usize) < vertices;
    indices.is_some_and(|indices| indices.iter().all(fits))
}

/// A larger tolerance never draws more triangles.
fn wider_never_more(subject: &mut Subject) -> Result<(), Violation> {
    let tolerances_px = subject.tolerances_px;
    subject.in_every_view(|subject, view| {
        let count = |px| subject.select(&views::with_tolerance(view, px)).map(|list| list.triangles());
        let counts = tolerances_px.iter().copied().map(count).collect::<Result<Vec<_>, _>>()?;
        ensure(counts.is_sorted_by(|a, b| a >= b), || format!("triangles by tolerance: {counts:?}"))
    })
}

/// No instance that contains only holes is drawn. ([`everything_in_view`] checks that all terrain is.)
fn holes_stay_holes(subject: &mut Subject) -> Result<(), Violation> {
    subject.in_every_view(|subject, view| {
        let mut boxes: HashMap<u32, [i32; 4]> = HashMap::new();
        let (triangles, bits) = subject.drawn(view)?;
        for triangle in triangles {
            let [west, north, east, south] = boxes.entry(triangle.instance).or_insert([i32::MAX, i32::MAX, 0, 0]);
            for corner in triangle.corners {
                (*west, *north) = (corner.x.min(*west), corner.z.min(*north));
                (*east, *south) = (corner.x.max(*east), corner.z.max(*south));
            }
        }
        boxes.values().try_for_each(|&[west, north, east, south]| {
            let [west, north] = [west, north].map(|n| n >> bits);
            let [east, south] = [east, south].map(|n| -(-n >> bits));
            let terrain = has_terrain(subject.field, [west, north], [east, south]);
            ensure(terrain, || format!("only holes in ({west}, {north}) to ({east}, {south})"))
        })
    })
}

/// Adjacent blocks differ by at most one level.
fn neighbours_within_one_level(subject: &mut Subject) -> Result<(), Violation> {
    subject.in_every_view(|subject, view| {
        let list = subject.select(view)?;
        let level_at: HashMap<_, _> = list.instances.iter().map(|block| (block.origin, block.level)).collect();
        list.instances.iter().try_for_each(|block| {
            let [x, z] = block.origin;
            let side = (block.cells << block.shift) as i32;
            let neighbours = [[x + side, z], [x, z + side]];
            neighbours.iter().filter_map(|at| level_at.get(at)).try_for_each(|level| {
                let apart = level.abs_diff(block.level);
                ensure(apart <= 1, || format!("levels {} and {level} meet at the block at {:?}", block.level, [x, z]))
            })
        })
    })
}

fn ensure(holds: bool, why: impl FnOnce() -> String) -> Result<(), String> {
    if holds { Ok(()) } else { Err(why()) }
}
