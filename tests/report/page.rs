//! Contents of the page and the figures.

use std::fs;
use std::path::Path;

use cuesta::internal::bench::journal::ROWS;
use cuesta::internal::bench::results::Results;
use cuesta::internal::bench::run::Run;
use cuesta::internal::report;

use crate::bench::mock::{self, Mock};

/// A benchmark over two sizes of terrain and two paths, and its page.
pub fn drawn(folder: &Path) -> String {
    let fields = vec![mock::field(129), mock::field(65)];
    let cases = mock::cases(&fields, &["circle", "spin"]);
    mock::run(folder, fields, cases, 3);
    fs::read_to_string(report::write(folder).expect("a page")).unwrap()
}

#[test]
fn the_page_asks_the_network_for_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let page = drawn(folder.path());
    let plain = page.replace("http://www.w3.org/2000/svg", "");
    for word in ["http:", "https:", "//cdn", "@import", "<link rel=\"stylesheet", "<script src", "fetch(", "url("] {
        assert!(!plain.contains(word), "{word}");
    }
    for source in plain.split("src=\"").skip(1) {
        assert!(source.starts_with("data:"), "{}", &source[..40]);
    }
    assert_eq!(
        plain.matches("<img ").count(),
        16,
        "the worst frame of each series with errors in each scene, and its difference"
    );
}

#[test]
fn what_comes_from_rows_is_text_and_never_markup() {
    let folder = tempfile::tempdir().unwrap();
    let page = drawn(folder.path());
    assert!(page.contains("Mock &amp; Sons &lt;1&gt;") && !page.contains("Sons <1>"));
    assert!(page.contains("commit 0123456789ab") && page.contains("Made-up CPU, 2 threads"));
    assert!(page.contains("hole mask") && page.contains("every sample has data"));
}

#[test]
fn every_case_is_a_point_of_the_plot_with_its_values() {
    let folder = tempfile::tempdir().unwrap();
    let page = drawn(folder.path());
    let results = Results::read(folder.path()).unwrap();
    assert_eq!(results.cases.len(), 44);
    for result in &results.cases {
        let x = result.errors.as_ref().unwrap().error_px.max;
        let y = result.time.as_ref().unwrap().frame_ms.value;
        assert!(page.contains(&format!("data-x=\"{x}\" data-y=\"{y}\"")), "{}", result.case);
    }
}

#[test]
fn the_figures_are_files_that_stand_alone() {
    let folder = tempfile::tempdir().unwrap();
    drawn(folder.path());
    let mut files: Vec<_> =
        fs::read_dir(folder.path().join(report::PLOTS)).unwrap().map(|e| e.unwrap().path()).collect();
    files.sort();
    // Five charts and the split of each of four scenes, and two figures across them.
    assert_eq!(files.len(), 26, "{files:?}");
    for file in files {
        let text = fs::read_to_string(&file).unwrap();
        assert!(text.starts_with("<svg xmlns=\"http://www.w3.org/2000/svg\"") && text.contains("<style>"), "{file:?}");
        assert_eq!(text.matches("<g").count(), text.matches("</g>").count(), "{file:?}");
        assert!(!text.contains("NaN") && !text.contains("inf"), "{file:?}");
    }
}

#[test]
fn from_rows_alone_the_page_is_the_same_but_for_pictures() {
    let folder = tempfile::tempdir().unwrap();
    let page = drawn(folder.path());
    let other = tempfile::tempdir().unwrap();
    fs::copy(folder.path().join(ROWS), other.path().join(ROWS)).unwrap();
    let again = fs::read_to_string(report::write(other.path()).unwrap()).unwrap();
    assert!(!again.contains("<img ") && again.contains("No pictures of errors were kept."));
    let charts = |page: &str| page.matches("<svg class=\"chart").count();
    assert_eq!(charts(&page), charts(&again));
    for file in ["rows.jsonl", "index.html"] {
        assert!(other.path().join(file).is_file());
    }
}

/// The mock's times follow its triangles: 0.9 of the samples' cells at 0 px, and half as many at 1 px.
#[test]
fn published_ratios_have_ours_of_the_same_tolerance_beside_them() {
    let fields = vec![mock::field(65)];
    let of = |technique: &str, block: &str, px: f64| {
        let mut case = mock::case(&fields[0].0, technique, px, "certified", "skim");
        case.settings.insert("block".to_string(), block.to_string());
        case
    };
    let slow = ["32", "64"].map(|block| of("clusters:draw-per-block", block, 1.0));
    let others = [of("clusters", "32", 1.0), of("clusters", "32", 3.0), of("clusters:draw-per-block", "32", 10.0)];
    let folder = tempfile::tempdir().unwrap();
    mock::run(folder.path(), fields.clone(), slow.into_iter().chain(others).collect(), 3);
    let page = fs::read_to_string(report::write(folder.path()).expect("a page")).unwrap();
    let told: Vec<&str> = page.match_indices("times as fast (").map(|(at, _)| &page[at - 90..at + 30]).collect();
    assert_eq!(told.len(), 2, "{told:?}");
    for (told, block) in told.iter().zip([32, 64]) {
        assert!(told.contains(&format!("against clusters:draw-per-block block={block}, 1 px: ")), "{told}");
        let ratio = told.split(" px: ").nth(1).and_then(|text| text.split(' ').next()).unwrap();
        assert!((0.9..1.1).contains(&ratio.parse::<f64>().unwrap()), "{told}");
    }
}

#[test]
fn what_was_not_measured_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let fields = vec![mock::field(33)];
    let cases = vec![mock::case(&fields[0].0, "geomipmap", 1.0, "certified", "spin")];
    let mut mock = Mock { is_bare: true, ..Mock::default() };
    let header = mock::header(&mut mock, &fields);
    let stop = std::sync::atomic::AtomicBool::new(false);
    let run = Run { folder: folder.path(), cases, fields, rounds: 1, warm_up: 0, stop: &stop };
    run.run(&mut mock, header, &mut |_| {}).unwrap();
    let page = fs::read_to_string(report::write(folder.path()).unwrap()).unwrap();
    for said in
        ["Not measured in this run.", "Only one size of terrain", "No error was measured by angle", "No pictures"]
    {
        assert!(page.contains(said), "{said}");
    }
    assert!(!page.contains("FLIP"), "a column of nothing is left out");
}

#[test]
fn published_figures_stand_beside_ours() {
    let folder = tempfile::tempdir().unwrap();
    let mut fields = vec![mock::field(2049)];
    fields[0].0.name = "peers-1".to_string();
    let of = |px: f64| mock::case(&fields[0].0, "geomipmap", px, "certified", "fly");
    let cases = [0.5, 1.0, 2.0].map(of).to_vec();
    mock::run(folder.path(), fields, cases, 1);
    let page = fs::read_to_string(report::write(folder.path()).unwrap()).unwrap();
    let results = Results::read(folder.path()).unwrap();
    let row = page.split("LongestEdgeBisection 12 px").nth(1).and_then(|rest| rest.split("</tr>").next()).unwrap();
    // At p99 1.2 px: 0.5 px and 1 px stay within, and 1 px is the faster one.
    let frame_ms = results.cases[1].time.as_ref().unwrap().frame_ms.value;
    assert!(row.contains("geomipmap 1 px") && row.contains(&format!("{frame_ms:.0} ms")), "{row}");
    assert!(page.contains("not in this run"), "clusters are not in this run");
}

/// Published times of triangle generation alone are compared with the host's share of the fastest selection.
#[test]
fn published_generation_stands_beside_selection() {
    let folder = tempfile::tempdir().unwrap();
    let fields = vec![mock::field(65)];
    let of = |px: f64| mock::case(&fields[0].0, "sorted-strips", px, "certified", "circle");
    let cases = [0.5, 4.0].map(of).to_vec();
    mock::run(folder.path(), fields, cases, 1);
    let page = fs::read_to_string(report::write(folder.path()).unwrap()).unwrap();
    let results = Results::read(folder.path()).unwrap();
    let row = page.split("generation alone").nth(1).and_then(|rest| rest.split("</tr>").next()).unwrap();
    let [slow, fast] = [0, 1].map(|k| results.cases[k].time.as_ref().unwrap().select_ms);
    assert!(fast < slow, "{fast} {slow}");
    let told: f64 = row.split(" px: ").nth(1).and_then(|text| text.split(' ').next()).unwrap().parse().unwrap();
    assert!(row.contains("sorted-strips 4 px: ") && row.contains("ms of selection"), "{row}");
    assert!((told / fast - 1.0).abs() < 0.01, "{told} for {fast}: {row}");
}
