//! Regressions in simulated times, as noisy as those of a software device on a shared machine: each time moves by up
//! to 12 %, one in twenty by 38 %.

use cuesta::internal::bench::compare::{THRESHOLD, compare};
use cuesta::internal::bench::results::Results;
use cuesta::internal::bench::rows::{ErrorRow, Errors, Row, TimeRow, Within};
use cuesta::internal::bench::run::Timed;
use cuesta::internal::bench::sample::FrameSample;
use cuesta::internal::bench::{Case, Times};
use cuesta::internal::measure::summary::Summary;

use super::mock::{self, Mock};

const ROUNDS: usize = 5;

/// 21 cases along two paths; `slower` says by what a case's times are multiplied.
fn simulated(random: &mut fastrand::Rng, slower: impl Fn(&Case) -> f64) -> Results {
    run(random, None, slower)
}

/// With floors, if given by what the machine is slower in this run: what disturbs a frame disturbs its floor, but for
/// 4 %.
fn run(random: &mut fastrand::Rng, machine: Option<f64>, slower: impl Fn(&Case) -> f64) -> Results {
    let fields = [mock::field(65)];
    let mut rows = Vec::new();
    for case in mock::cases(&fields, &["circle", "spin"]) {
        for round in 0..ROUNDS {
            let outlier = if random.u8(..) < 13 { 1.38 } else { 1.0 };
            let noise = outlier * (1.0 + 0.12 * (2.0 * random.f64() - 1.0)) * machine.unwrap_or(1.0);
            let frame_ms = 20.0 * slower(&case) * noise;
            let shading_only_ms = machine.map(|_| 7.0 * noise * (1.0 + 0.04 * (2.0 * random.f64() - 1.0)));
            let frame = FrameSample { frame_ms, shading_only_ms, triangles: 1000, ..FrameSample::default() };
            let times = Times::of(round, Timed { frames: vec![frame; 8], ..Timed::default() }, None);
            rows.push(Row::Time(TimeRow { case: case.clone(), times }));
        }
        let errors = Errors {
            frames: 4,
            error_px: Summary { rms: 0.1, p999: 0.5, max: 0.9 },
            within: Some(Within { frames: 1.0, samples: 1.0 }),
            watertight: Some(true),
            ..Errors::default()
        };
        rows.push(Row::Error(ErrorRow { case, errors }));
    }
    Results::of(mock::header(&mut Mock::default(), &fields), &rows)
}

#[test]
fn ten_repeats_of_the_same_run_raise_no_alarm() {
    for seed in 0..8 {
        let mut random = fastrand::Rng::with_seed(seed);
        let first = simulated(&mut random, |_| 1.0);
        for repeat in 0..10 {
            let again = simulated(&mut random, |_| 1.0);
            let comparison = compare(&first, &again, THRESHOLD);
            assert_eq!(comparison.regressions, [""; 0], "{seed}: repeat {repeat}");
            assert_eq!((comparison.matched, comparison.techniques.len()), (22, 3));
        }
    }
}

#[test]
fn a_fifth_slower_is_found_and_found_where_it_is() {
    let mut found = 0;
    for seed in 0..40 {
        let mut random = fastrand::Rng::with_seed(1000 + seed);
        let before = simulated(&mut random, |_| 1.0);
        let slower = |case: &Case| if case.series() == "geomipmap" { 1.2 } else { 1.0 };
        let comparison = compare(&before, &simulated(&mut random, slower), THRESHOLD);
        let of = |technique: &str| comparison.techniques.iter().find(|c| c.what.starts_with(technique)).unwrap();
        let slow = of("geomipmap, 10 cases");
        found += usize::from(slow.is_regression);
        assert!((1.08..1.33).contains(&slow.ratio.value), "{slow:?}");
        assert!(!of("brute-force").is_regression && !of("geomipmap (paper").is_regression, "seed {seed}");
        assert!(comparison.regressions.iter().all(|what| !what.contains("brute-force")), "seed {seed}");
    }
    assert!(found >= 38, "found {found} times of 40");
}

#[test]
fn a_slower_machine_hides_nothing_and_raises_no_alarm_but_for_the_floor() {
    for seed in 0..15 {
        let mut random = fastrand::Rng::with_seed(2000 + seed);
        let before = run(&mut random, Some(1.0), |_| 1.0);
        let comparison = compare(&before, &run(&mut random, Some(1.15), |_| 1.0), THRESHOLD);
        assert!(
            comparison.over_shading_only && comparison.regressions.is_empty(),
            "{seed}: {:?}",
            comparison.regressions
        );
        let slower = |case: &Case| if case.series() == "geomipmap" { 1.2 } else { 1.0 };
        let comparison = compare(&before, &run(&mut random, Some(0.85), slower), THRESHOLD);
        let alarms: Vec<_> = comparison.techniques.iter().filter(|c| c.is_regression).map(|c| &c.what).collect();
        assert_eq!(alarms, ["geomipmap, 10 cases"], "{seed}");
        let shading = compare(&before, &run(&mut random, Some(1.6), |_| 1.0), THRESHOLD);
        assert_eq!(shading.regressions.len(), 1, "{:?}", shading.regressions);
        assert!(shading.regressions[0].starts_with("shading only, 22 cases"), "{:?}", shading.regressions);
    }
}

#[test]
fn a_case_that_doubles_is_found_by_itself() {
    let mut random = fastrand::Rng::with_seed(7);
    let before = simulated(&mut random, |_| 1.0);
    let slower = |case: &Case| if case.tolerance_px == 4.0 && case.path == "spin" { 2.0 } else { 1.0 };
    let comparison = compare(&before, &simulated(&mut random, slower), THRESHOLD);
    let alarms: Vec<_> = comparison.cases.iter().filter(|c| c.is_regression).map(|c| c.what.as_str()).collect();
    assert_eq!(alarms.len(), 2, "{alarms:?}");
    assert!(alarms.iter().all(|what| what.contains("spin") && what.ends_with(" 4 px")), "{alarms:?}");
}

#[test]
fn counts_and_errors_are_compared_exactly() {
    let mut random = fastrand::Rng::with_seed(7);
    let before = simulated(&mut random, |_| 1.0);
    let mut after = before.clone();
    assert!(compare(&before, &after, THRESHOLD).differences.is_empty());
    let errors = after.cases[3].errors.as_mut().unwrap();
    errors.error_px.max += 1e-12;
    errors.within = Some(Within { frames: 1.0, samples: 1.0 - 1e-9 });
    after.cases[4].time.as_mut().unwrap().triangles = 1200.0;
    after.cases[5].errors.as_mut().unwrap().watertight = Some(false);
    after.cases[6].time.as_mut().unwrap().triangles = 900.0;
    let dropped = after.cases.pop().unwrap();
    let comparison = compare(&before, &after, THRESHOLD);
    let found: Vec<_> = comparison.differences.iter().map(|d| (d.value, d.is_regression)).collect();
    assert_eq!(
        found,
        [
            ("error_px.max", false),
            ("samples beyond the tolerance", true),
            ("triangles", true),
            ("not watertight", true),
            ("triangles", false),
        ]
    );
    assert_eq!(comparison.regressions.len(), 3);
    assert_eq!(comparison.unmatched, [format!("only in A: {}", dropped.case)]);
}
