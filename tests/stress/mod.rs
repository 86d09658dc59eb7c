//! Tests of the stress suite: it finds broken techniques, reports where they fail and saves counter-examples.

use cuesta::internal::draw::{DrawList, Geometry, Limits};
use cuesta::internal::height::{Options, load};
use cuesta::internal::lod::{Entry, Technique, Techniques, geomipmap};
use cuesta::internal::stress::jitter::{Jitter, LIMIT_PX, VertexPlacement};
use cuesta::internal::stress::rows::{FILE, Row, SCHEMA, Stress};
use cuesta::internal::stress::{Case, CaseRun, Finding, Kind, TechniqueConfig, cases, forms, saved};
use cuesta::internal::view::View;

use crate::altered::BLOCK_LOST;

/// A mutant that panics in every view.
struct Panics(Geometry);

impl Technique for Panics {
    fn resident(&self) -> &Geometry {
        &self.0
    }
    fn limits(&self) -> Limits {
        Limits::default()
    }
    fn select(&mut self, _: &View, _: &mut DrawList) {
        panic!("out of cheese");
    }
    fn keeps_tolerance(&self) -> bool {
        true
    }
}

static PANICS: Entry =
    Entry { name: "panics", build: |_, _| Box::new(Panics(Geometry::default())), ..geomipmap::ENTRY };

fn config(entry: &'static Entry) -> TechniqueConfig {
    let [config] =
        forms::with_defaults(&Techniques::built_in(), &["geomipmap".to_string()]).unwrap().try_into().ok().unwrap();
    TechniqueConfig { entry, name: entry.name.to_string(), ..config }
}

fn case(name: &str) -> &'static Case {
    cases().find(|case| case.name == name).expect("a case of the suite")
}

fn failed(run: &CaseRun) -> Vec<Finding> {
    run.run().into_iter().filter(|finding| !finding.passes()).collect()
}

#[test]
fn a_dropped_block_is_found_in_terrains_and_flights_and_saved() {
    for name in ["prime sides, 131 x 67", "back again in mid-morph"] {
        let run = CaseRun { case: case(name), config: Some(config(&BLOCK_LOST)) };
        let failed = failed(&run);
        let finding =
            failed.iter().find(|finding| finding.check.starts_with("one surface")).expect("a surface with a gap");
        let violation = finding.violation.as_ref().expect("the view that shows it");
        assert!(violation.why.contains("Gap"), "{violation}");
        let folder = tempfile::tempdir().unwrap();
        let files = saved::counter_example(folder.path(), &run, finding, None).unwrap();
        let extensions: Vec<_> = files.iter().map(|file| file.extension().unwrap().to_str().unwrap()).collect();
        assert_eq!(extensions, ["tif", "txt", "ply"]);
        assert!(load(&files[0], &Options::default()).unwrap().field.size()[0] > 100);
        let text = std::fs::read_to_string(&files[1]).unwrap();
        assert!(text.contains("cuesta render") && text.contains("--eye="), "{text}");
        assert!(std::fs::read_to_string(&files[2]).unwrap().contains("element face"));
    }
}

#[test]
fn a_panic_is_a_finding() {
    let failed = failed(&CaseRun { case: case("flat"), config: Some(config(&PANICS)) });
    assert_eq!(failed.len(), 1);
    assert_eq!((failed[0].check, failed[0].why.as_deref()), ("panics", Some("out of cheese")));
}

#[test]
fn nan_and_infinity_do_not_pass() {
    assert!(!Finding::within("a check", f64::NAN, 1.0).passes());
    assert!(!Finding::within("a check", f64::INFINITY, 1.0).passes());
    assert!(Finding::within("a check", 1.0, 1.0).passes() && Finding::reported("a check", f64::NAN).passes());
}

/// The renderer's own placement jitters at most 1/16 of the limit; world coordinates exceed it by far.
#[test]
fn only_world_coordinates_jitter_far_from_the_origin() {
    let px = |way| Jitter::of(1e7, way).max_px();
    let [world, relative, own] =
        [VertexPlacement::WorldF32, VertexPlacement::EyeRelative, VertexPlacement::SampleRelative].map(px);
    println!("at 1e7 m: {world:.3} px, {relative:.5} px, {own:.5} px");
    assert!(world > 16.0 * LIMIT_PX && relative < LIMIT_PX && own < LIMIT_PX / 16.0);
}

#[test]
fn all_families_exist_and_case_names_are_unique() {
    let mut families: Vec<_> = cases().map(|case| case.family).collect();
    families.dedup();
    assert_eq!(families, ["data", "position", "view", "time", "arithmetic", "stiff", "file", "sweep"]);
    let mut names: Vec<_> = cases().map(|case| (case.family, case.name)).collect();
    let count = names.len();
    names.sort_unstable();
    names.dedup();
    assert_eq!(names.len(), count);
}

/// Runs all cases without a technique: controller, loaders and vertex placement.
#[test]
fn standalone_cases_pass() {
    for case in cases().filter(|case| matches!(case.kind, Kind::Standalone(..))) {
        let failed = failed(&CaseRun { case, config: None });
        assert!(failed.is_empty(), "{}: {failed:?}", case.name);
    }
}

#[test]
fn results_survive_a_round_trip_and_become_a_page() {
    let row = |check: &str, value: Option<f64>, limit: Option<f64>, pass: bool| Row {
        family: "data".to_string(),
        name: "flat <b>".to_string(),
        technique: "geomipmap metric=linear".to_string(),
        check: check.to_string(),
        value,
        limit,
        pass,
        why: (!pass).then(|| "a gap & a crack".to_string()),
        repeat: "cuesta stress --case flat".to_string(),
        saved: Vec::new(),
    };
    let rows = vec![
        row("error", Some(0.5), Some(1.0), true),
        row("gaps", None, Some(0.0), false),
        row("loads", Some(5.0), None, true),
    ];
    let stress = Stress {
        schema: SCHEMA,
        program: "cuesta".to_string(),
        device: None,
        ended: None,
        cases: rows,
        pictures: Vec::new(),
    };
    assert_eq!(stress.counts(), [1, 1]);
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join(FILE), serde_json::to_vec(&stress).unwrap()).unwrap();
    assert_eq!(Stress::read(folder.path()).unwrap(), stress);
    let page = std::fs::read_to_string(cuesta::internal::report::write_stress(folder.path()).unwrap()).unwrap();
    for part in ["1 checks passed, 1 failed", "1 of 2", "a gap &amp; a crack", "flat &lt;b&gt;"] {
        assert!(page.contains(part), "{part}");
    }
    let other = serde_json::to_string(&Stress { schema: 99, ..stress }).unwrap();
    std::fs::write(folder.path().join(FILE), other).unwrap();
    assert!(Stress::read(folder.path()).unwrap_err().to_string().contains("schema: expected 1, found 99"));
}
