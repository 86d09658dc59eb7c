//! A killed run resumes: every row exists once, whatever byte the file ends at.

use std::fs;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

use cuesta::internal::bench::journal::ROWS;
use cuesta::internal::bench::results::{RESULTS, Results, TABLE};
use cuesta::internal::bench::rows::Row;
use cuesta::internal::bench::run::{Ended, Run};
use cuesta::internal::bench::{BenchBackend, journal};
use rayon::prelude::*;

use super::mock::{self, Mock};

/// Identity of a row.
fn keys(rows: &[Row]) -> Vec<String> {
    let key = |row: &Row| match row {
        Row::Header(_) => panic!("one header is enough"),
        Row::Time(row) => format!("{} round {}", row.case, row.times.round),
        Row::Error(row) => format!("{} errors", row.case),
    };
    rows.iter().map(key).collect()
}

#[test]
fn killed_at_any_byte_a_run_goes_on_and_every_row_is_there_once() {
    let fields = vec![mock::field(9)];
    let cases = vec![mock::case(&fields[0].0, "geomipmap", 1.0, "certified", "spin")];
    let whole = tempfile::tempdir().unwrap();
    let run = |folder: &Path| {
        mock::run_with(Mock { is_bare: true, ..Mock::default() }, folder, fields.clone(), cases.clone(), 2)
    };
    run(whole.path());
    let text = fs::read(whole.path().join(ROWS)).unwrap();
    let expected = keys(&journal::read(whole.path()).unwrap().1);
    assert_eq!(expected.len(), 3);
    (0..=text.len()).into_par_iter().for_each(|length| {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join(ROWS), &text[..length]).unwrap();
        let again = run(folder.path());
        let rows = journal::read(folder.path()).unwrap().1;
        assert_eq!(keys(&rows), expected, "killed after {length} bytes");
        let kept = text[..length].iter().filter(|&&byte| byte == b'\n').count().saturating_sub(1);
        assert_eq!(again.calls.len(), 3 - kept, "{length}: what is there is not measured again");
    });
}

#[test]
fn a_stop_ends_after_the_row_at_hand_and_leaves_results() {
    let fields = vec![mock::field(9)];
    let cases = mock::cases(&fields, &["spin"]);
    let folder = tempfile::tempdir().unwrap();
    let mut mock = Mock::default();
    let header = mock::header(&mut mock, &fields);
    let stop = AtomicBool::new(false);
    let run = Run { folder: folder.path(), cases, fields, rounds: 2, warm_up: 3, stop: &stop };
    let mut steps = 0;
    let ended = run.run(&mut mock, header.clone(), &mut |step| {
        steps += 1;
        stop.store(step.done[0] == 4, Ordering::Relaxed);
    });
    assert_eq!((ended.unwrap(), steps, mock.calls.len()), (Ended::Stopped, 5, 5));
    assert_eq!(Results::read(folder.path()).unwrap().cases.len(), 5);
    for file in [RESULTS, TABLE] {
        assert!(folder.path().join(file).is_file(), "{file}");
    }
    stop.store(false, Ordering::Relaxed);
    let ended = run.run(&mut mock, header, &mut |_| {});
    assert_eq!((ended.unwrap(), mock.calls.len()), (Ended::Complete, 33));
}

#[test]
fn cases_of_a_scene_take_turns_and_the_warm_up_is_dropped() {
    let fields = vec![mock::field(9)];
    let cases = mock::cases(&fields, &["spin", "circle"]);
    let folder = tempfile::tempdir().unwrap();
    let calls = mock::run(folder.path(), fields, cases.clone(), 3).calls;
    let (spin, circle) = cases.split_at(11);
    let turn = |cases: &[cuesta::internal::bench::Case], what: &str| {
        cases.iter().map(|c| format!("{what} {c}")).collect::<Vec<_>>()
    };
    let scene =
        |cases| [turn(cases, "time"), turn(cases, "time"), turn(cases, "time"), turn(cases, "measure")].concat();
    assert_eq!(calls, [scene(spin), scene(circle)].concat());
    for case in Results::read(folder.path()).unwrap().cases {
        let time = case.time.unwrap();
        assert!(time.frame_max_ms < 1.5 * time.frame_ms.value, "the slow first frames do not count");
        assert_eq!((time.hitches_percent, case.rounds.len()), (0.0, 3));
        let base = time.over_base.unwrap();
        assert_eq!(case.case.technique == "brute-force", (base.value - 1.0).abs() < 1e-12, "{base:?}");
    }
}

#[test]
fn the_base_is_that_of_the_same_tolerance() {
    let fields = vec![mock::field(9)];
    let of = |technique: &str, px: f64| mock::case(&fields[0].0, technique, px, "certified", "spin");
    let cases: Vec<_> = [1.0, 8.0].iter().flat_map(|&px| [of("geomipmap", px), of("clusters", px)]).collect();
    let folder = tempfile::tempdir().unwrap();
    mock::run(folder.path(), fields.clone(), cases, 3);
    let (mut header, rows) = cuesta::internal::bench::journal::read(folder.path()).unwrap();
    header.base = "geomipmap".to_string();
    let times: Vec<_> = Results::of(header, &rows).cases.into_iter().map(|case| case.time.unwrap()).collect();
    for pair in times.chunks(2) {
        assert_eq!((pair[0].over_base.unwrap().value, pair[0].cpu_over_base.unwrap().value), (1.0, 1.0));
        assert_eq!(pair[0].triangles, pair[1].triangles);
        for (ratio, of, over) in [
            (pair[1].over_base, pair[1].frame_ms, pair[0].frame_ms),
            (pair[1].cpu_over_base, pair[1].cpu_ms, pair[0].cpu_ms),
        ] {
            assert!((ratio.unwrap().value / (of.value / over.value) - 1.0).abs() < 0.05, "{ratio:?}");
        }
        assert!((pair[0].cpu_ms.value - pair[0].select_ms - pair[0].record_ms).abs() < 1e-9);
    }
}

#[test]
fn rows_of_another_run_are_refused_in_one_line() {
    let fields = vec![mock::field(9)];
    let cases = vec![mock::case(&fields[0].0, "geomipmap", 1.0, "certified", "spin")];
    let folder = tempfile::tempdir().unwrap();
    mock::run(folder.path(), fields.clone(), cases.clone(), 1);
    let mut mock = Mock::default();
    let same = mock::header(&mut mock, &fields);
    let stop = AtomicBool::new(false);
    let run = Run { folder: folder.path(), cases, fields, rounds: 1, warm_up: 3, stop: &stop };
    let mut refused = |change: &dyn Fn(&mut cuesta::internal::bench::Header), word: &str| {
        let mut header = same.clone();
        change(&mut header);
        let error = format!("{:#}", run.run(&mut mock as &mut dyn BenchBackend, header, &mut |_| {}).unwrap_err());
        assert!(error.contains(word) && error.contains(ROWS) && error.lines().count() == 1, "{error}");
    };
    refused(&|h| h.arguments.push("--frames 7".to_string()), "arguments");
    refused(&|h| h.device.driver = "other".to_string(), "device");
    refused(&|h| h.commit = None, "commit");
    refused(&|h| h.machine.cores = 64, "machine");
    let mut header = same.clone();
    header.date = "later".to_string();
    assert_eq!(run.run(&mut mock, header, &mut |_| {}).unwrap(), Ended::Complete);
    assert_eq!(mock.calls.len(), 0, "nothing was measured twice");

    let path = folder.path().join(ROWS);
    let text = fs::read_to_string(&path).unwrap();
    fs::write(&path, text.replacen("\"round\"", "\"rund\"", 1)).unwrap();
    let error = format!("{:#}", journal::read(folder.path()).unwrap_err());
    assert!(error.contains("rows.jsonl: line 2"), "{error}");
}
