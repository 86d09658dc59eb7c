//! The suite finds what is broken, says where, and keeps what shows it.

use std::sync::Arc;

use cuesta::internal::draw::{DrawList, Geometry, Limits, PipelineRequirements};
use cuesta::internal::height::{Field, Options, load};
use cuesta::internal::lod::{Entry, Settings, Technique, Techniques, geomipmap};
use cuesta::internal::stress::jitter::{Jitter, LIMIT_PX, Way};
use cuesta::internal::stress::rows::{FILE, Row, SCHEMA, Stress};
use cuesta::internal::stress::{Case, Finding, Form, Kind, Trial, cases, forms, saved};
use cuesta::internal::view::View;

/// GeoMipMapping without its last block.
struct BlockLost(Box<dyn Technique>);

/// A technique that panics in every view.
struct Panics(Geometry);

impl Technique for BlockLost {
    fn resident(&self) -> &Geometry {
        self.0.resident()
    }
    fn limits(&self) -> Limits {
        self.0.limits()
    }
    fn select(&mut self, view: &View, list: &mut DrawList) {
        self.0.select(view, list);
        if let Some(draw) = list.draws.last_mut() {
            draw.instances.end -= 1;
        }
    }
    fn keeps_tolerance(&self) -> bool {
        true
    }
    fn pipeline_requirements(&self) -> PipelineRequirements {
        self.0.pipeline_requirements()
    }
}

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

fn block_lost(field: Arc<Field>, settings: &Settings) -> Box<dyn Technique> {
    Box::new(BlockLost((geomipmap::ENTRY.build)(field, settings)))
}

static BLOCK_LOST: Entry = Entry { name: "block-lost", build: block_lost, ..geomipmap::ENTRY };
static PANICS: Entry =
    Entry { name: "panics", build: |_, _| Box::new(Panics(Geometry::default())), ..geomipmap::ENTRY };

fn form(entry: &'static Entry) -> Form {
    let [form] = forms::plain(&Techniques::built_in(), &["geomipmap".to_string()]).unwrap().try_into().ok().unwrap();
    Form { entry, name: entry.name.to_string(), ..form }
}

fn case(name: &str) -> &'static Case {
    cases().find(|case| case.name == name).expect("a case of the suite")
}

fn failed(trial: &Trial) -> Vec<Finding> {
    trial.run().into_iter().filter(|finding| !finding.passes()).collect()
}

#[test]
fn what_is_broken_is_found_in_terrains_and_flights_and_kept() {
    for name in ["prime sides, 131 x 67", "back again in mid-morph"] {
        let trial = Trial { case: case(name), form: Some(form(&BLOCK_LOST)) };
        let failed = failed(&trial);
        let finding =
            failed.iter().find(|finding| finding.check.starts_with("one surface")).expect("a surface with a gap");
        let violation = finding.violation.as_ref().expect("the view that shows it");
        assert!(violation.why.contains("Gap"), "{violation}");
        let folder = tempfile::tempdir().unwrap();
        let files = saved::counter_example(folder.path(), &trial, finding, None).unwrap();
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
    let failed = failed(&Trial { case: case("flat"), form: Some(form(&PANICS)) });
    assert_eq!(failed.len(), 1);
    assert_eq!((failed[0].check, failed[0].why.as_deref()), ("panics", Some("out of cheese")));
}

#[test]
fn no_number_never_passes() {
    assert!(!Finding::within("a check", f64::NAN, 1.0).passes());
    assert!(!Finding::within("a check", f64::INFINITY, 1.0).passes());
    assert!(Finding::within("a check", 1.0, 1.0).passes() && Finding::reported("a check", f64::NAN).passes());
}

/// The product trembles 16 times less than it may, and what it is compared with far more.
#[test]
fn only_world_coordinates_tremble_far_from_the_origin() {
    let px = |way| Jitter::of(1e7, way).max_px();
    let [world, relative, product] = [Way::World, Way::Relative, Way::Product].map(px);
    println!("at 1e7 m: {world:.3} px, {relative:.5} px, {product:.5} px");
    assert!(world > 16.0 * LIMIT_PX && relative < LIMIT_PX && product < LIMIT_PX / 16.0);
}

#[test]
fn every_family_of_the_contract_is_there_and_every_name_once() {
    let mut families: Vec<_> = cases().map(|case| case.family).collect();
    families.dedup();
    assert_eq!(families, ["data", "position", "view", "time", "arithmetic", "stiff", "file", "sweep"]);
    let mut names: Vec<_> = cases().map(|case| (case.family, case.name)).collect();
    let count = names.len();
    names.sort_unstable();
    names.dedup();
    assert_eq!(names.len(), count);
}

/// The cases without a technique, whole: the controller, the loaders, the vertex program.
#[test]
fn what_stands_alone_passes() {
    for case in cases().filter(|case| matches!(case.kind, Kind::Alone(..))) {
        let failed = failed(&Trial { case, form: None });
        assert!(failed.is_empty(), "{}: {failed:?}", case.name);
    }
}

#[test]
fn a_suite_is_read_again_as_it_was_written_and_drawn_as_a_page() {
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
