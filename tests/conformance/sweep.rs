//! Random cases of every technique, checked against every invariant.
//!
//! `SWEEP_CASES` sets their number and `SWEEP_SEED` their seed. `SWEEP_TECHNIQUE` selects one technique. `SWEEP_CASE`
//! runs the single case that a failure printed.

use std::env;
use std::path::Path;
use std::str::FromStr;
use std::sync::Arc;
use std::time::Instant;

use cuesta::internal::cli::whole::Whole;
use cuesta::internal::draw::DrawList;
use cuesta::internal::height::{self, Field, Options, synth};
use cuesta::internal::lod::{self, TECHNIQUES};
use cuesta::internal::stress::invariants::{INVARIANTS, Subject};
use cuesta::internal::stress::sweep::{self, Failure, SweepCase, random, shrink};
use cuesta::internal::stress::views;
use cuesta::internal::view::{Lens, Metric, Tolerance, View};
use rayon::prelude::*;

use crate::altered::BLOCK_LOST;
use crate::prepared::technique;

/// Default number of cases: about two minutes on two cores.
const CASES: u64 = 9000;
const SEED: u64 = 19;

fn set<T: FromStr>(key: &str) -> Option<T> {
    let value = env::var(key).ok()?;
    Some(value.parse().unwrap_or_else(|_| panic!("{key}={value}: invalid value")))
}

/// Checks a case with its own technique.
fn check(case: &SweepCase) -> Result<(), Box<Failure>> {
    case.check(lod::find(&case.technique).expect("a technique"))
}

#[test]
fn random_cases_keep_every_invariant() {
    if let Some(case) = set::<SweepCase>("SWEEP_CASE") {
        check(&case).unwrap_or_else(|failure| panic!("{failure}"));
        return;
    }
    let (cases, seed) = (set("SWEEP_CASES").unwrap_or(CASES), set("SWEEP_SEED").unwrap_or(SEED));
    let entry = set::<String>("SWEEP_TECHNIQUE").map(|name| lod::find(&name).expect("a technique"));
    let entry_of = |number: u64| entry.unwrap_or(&TECHNIQUES[(number % TECHNIQUES.len() as u64) as usize]);
    let case = |number| random::case(seed, number, entry_of(number), None);
    let start = Instant::now();
    let failures = sweep::run((0..cases).into_par_iter().map(case), check);
    let minutes = start.elapsed().as_secs_f64() / 60.0;
    println!("{cases} cases, {:.0} a minute, {} fail", cases as f64 / minutes, failures.len());
    let few: Vec<_> = failures.iter().take(8).map(ToString::to_string).collect();
    assert!(few.is_empty(), "{} of {cases} cases fail, the first:\n{}", failures.len(), few.join("\n"));
}

/// Views of fields that are too large for all views.
const FEW_VIEWS: [&str; 3] = ["from above a corner", "straight down", "orthographic"];
/// Invariants about coverage.
const OF_COVERAGE: [&str; 3] = ["one surface", "everything in view is drawn", "a wider tolerance never draws more"];

/// Fields whose sides are not 2^n + 1, at tolerances where coarse triangles extend beyond them, which were once drawn
/// with holes.
#[test]
fn coarse_triangles_reach_the_edge_of_any_field() {
    let synthetic = |kind: &str, size, seed| {
        let field = synth::synth(kind.parse().expect("a kind"), size, seed);
        (format!("{kind} {} x {}", size[0], size[1]), Some(Arc::new(field)))
    };
    let fields = [
        (synthetic("ridge", [921, 859], 3), &[4.0, 8.0][..]),
        (synthetic("cliff", [921, 859], 3), &[4.0, 8.0]),
        (synthetic("eroded", [921, 859], 3), &[16.0, 64.0]),
        (synthetic("eroded", [1198, 9], 3), &[1.7, 30.0]),
        (synthetic("spike", [55, 311], 3), &[2.4]),
        (synthetic("flat", [226, 70], 3), &[0.7]),
        (real("gabilan_lidar1m_921x859_f32_cog_deflate_pred3.tif"), &[1.0, 2.0, 3.0, 4.0]),
    ];
    let forms: [&[&str]; 3] = [&[], &["morph=on", "hold=on"], &["patches=resident"]];
    fields.par_iter().for_each(|((name, field), tolerances_px)| {
        let Some(field) = field else { return };
        let is_large = field.size().iter().product::<u32>() > 100_000;
        let near = views::views(field).into_iter().filter(|(name, _)| !is_large || FEW_VIEWS.contains(name));
        let views: Vec<_> = near.chain([("all of it", default_view(field))]).collect();
        for form in forms {
            let mut technique = technique(field, "sphere-tree", form);
            let under = |view: &(&'static str, View)| {
                let (name, view) = *view;
                tolerances_px.iter().map(move |&px| (name, views::with_tolerance(&view, px)))
            };
            let views: Vec<_> = views.iter().flat_map(under).collect();
            let mut subject = Subject { tolerances_px, ..Subject::new(field, &mut *technique, &views) };
            for invariant in INVARIANTS.iter().filter(|invariant| OF_COVERAGE.contains(&invariant.name)) {
                (invariant.check)(&mut subject)
                    .unwrap_or_else(|why| panic!("{}: {name}, {form:?}: {why}", invariant.name));
            }
        }
    });
}

/// Returns the default view of `render`.
fn default_view(field: &Field) -> View {
    let size = [640, 360];
    let Whole { eye, world_from_eye, radius, .. } = Whole::of(field, 60.0, size);
    let tolerance = Tolerance { px: 1.0, metric: Metric::Certified };
    let lens = Lens::Perspective { fov_x: 60f64.to_radians() };
    View { eye, world_from_eye, lens, size, near: radius / 1000.0, tolerance, time_s: 0.0 }
}

fn real(file: &str) -> (String, Option<Arc<Field>>) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data").join(file);
    if !path.exists() {
        eprintln!("skipped: {} is absent", path.display());
        return (file.to_string(), None);
    }
    (file.to_string(), Some(Arc::new(height::load(&path, &Options::default()).expect("a field").field)))
}

/// Cases that once failed, as printed by the sweep.
const FOUND: [&str; 6] = [
    // A block of only holes was drawn with the square at the edge that contains it.
    r#"{"technique":"sphere-tree","terrain":{"kind":"ramp","size":[34,6],"seed":0,"spacing":[10.0,10.0],"voids":"Most"},"view":{"at":[0.5,0.5],"above":1.0,"direction":{"Turned":[0.0,-90.0]},"lens":{"Degrees":90.0},"size":[64,64],"near":0.0001},"tolerance_px":0.25}"#,
    r#"{"technique":"sphere-tree","terrain":{"kind":"peers","size":[56,7],"seed":0,"spacing":[10.0,10.0],"voids":"Most"},"view":{"at":[1.0,-3.25],"above":0.125,"direction":{"Towards":[0.787,0.059]},"lens":{"Parallel":1.82},"size":[1000,30],"near":0.0001},"tolerance_px":1.8}"#,
    // A block at the end of a tiled field used the data of the whole tile.
    r#"{"technique":"clusters","terrain":{"kind":"ramp","size":[6,17],"seed":0,"spacing":[10.0,10.0],"voids":"Most","tiles":[2,4]},"view":{"at":[0.0,0.0],"above":9.3e-10,"direction":{"Towards":[0.746,0.552]},"lens":{"Degrees":90.0},"size":[64,64],"near":0.0001},"tolerance_px":16.0}"#,
    // The check itself ignored that the list has a limited draw distance.
    r#"{"technique":"sorted-strips","settings":[["far","0.0798"]],"terrain":{"kind":"flat","size":[2,66],"seed":0,"spacing":[10.0,10.0]},"view":{"at":[1.25,0.25],"above":0.002,"direction":{"Towards":[0.428,0.67]},"lens":{"Degrees":90.0},"size":[64,64],"near":0.0001},"tolerance_px":1.0}"#,
    // The chunk buffer of a field of few tiles did not hold tiles of many levels, and the tolerance was scaled.
    r#"{"technique":"smooth-tiles","settings":[["tile","65"]],"terrain":{"kind":"spike","size":[2,465],"seed":216,"spacing":[10.0,10.0]},"view":{"at":[0.5,0.5],"above":1.0,"direction":{"Turned":[0.0,-90.0]},"lens":{"Degrees":90.0},"size":[64,64],"near":0.0001},"tolerance_px":32.0}"#,
    r#"{"technique":"smooth-tiles","settings":[["tile","65"],["memory","6.46"]],"terrain":{"kind":"cliff","size":[2,66],"seed":0,"spacing":[10.0,10.0]},"view":{"at":[0.5,0.5],"above":1.0,"direction":{"Turned":[0.0,-90.0]},"lens":{"Degrees":90.0},"size":[64,64],"near":0.0001},"tolerance_px":1.0}"#,
];

#[test]
fn past_failures_stay_fixed() {
    for line in FOUND {
        let case: SweepCase = line.parse().expect("a case");
        check(&case).unwrap_or_else(|failure| panic!("{failure}"));
    }
}

/// The list of a flat field stays short for any size.
#[test]
fn flat_fields_take_few_triangles() {
    for (size, max) in [([226, 70], 15), ([921, 859], 139), ([129, 129], 2), ([20, 31], 2), ([1300, 2], 22)] {
        let field = Arc::new(synth::synth(synth::Kind::Flat, size, 3));
        let mut technique = technique(&field, "sphere-tree", &[]);
        let mut list = DrawList::default();
        technique.select(&default_view(&field), &mut list);
        println!("{size:?}: {} triangles", list.triangles());
        assert!(list.triangles() <= max, "{size:?}: {} triangles", list.triangles());
    }
}

#[test]
fn broken_techniques_are_detected_and_shrunk() {
    let case = |number| random::case(SEED, number, &BLOCK_LOST, None);
    let failures: Vec<_> = (0..20).filter_map(|number| case(number).check(&BLOCK_LOST).err()).collect();
    assert!(failures.len() > 5, "{} of 20 cases fail", failures.len());
    let shrunk = shrink::shrink(*failures[0].clone(), |case| case.check(&BLOCK_LOST));
    let SweepCase { terrain, settings, .. } = &shrunk.case;
    assert_eq!((terrain.kind.as_str(), terrain.size), ("flat", [2, 2]), "{shrunk}");
    assert!(settings.is_empty() && shrunk.invariant == "one surface", "{shrunk}");
    assert_eq!(shrunk.case.to_string().parse(), Ok(shrunk.case.clone()), "a printed case reads back the same");
}
