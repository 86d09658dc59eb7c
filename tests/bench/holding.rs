//! Cases with a goal: the driver and its rows.

use cuesta::internal::bench::Case;
use cuesta::internal::bench::goal::{BudgetStats, Goal};
use cuesta::internal::bench::results::Results;

use super::mock;

/// Of the mock, whose triangles go with 1 / (1 + τ) and its time with them, with noise of 5 %.
#[test]
fn goals_are_held_and_rows_say_so() {
    let fields = vec![mock::field(513)];
    let of = |px: f64, goal: Option<Goal>| Case {
        goal,
        frames: 60,
        ..mock::case(&fields[0].0, "geomipmap", px, "certified", "spin")
    };
    let cases = vec![of(0.5, Some(Goal::Triangles(2e4))), of(0.5, Some(Goal::FrameMs(25.0))), of(0.5, None)];
    let folder = tempfile::tempdir().unwrap();
    mock::run(folder.path(), fields.clone(), cases.clone(), 2);
    let results = Results::read(folder.path()).unwrap();
    assert_eq!(results.cases.iter().map(|result| result.case.clone()).collect::<Vec<_>>(), cases);
    let [triangles, time, free] = [0, 1, 2].map(|k| &results.cases[k]);
    let held = |k: usize| results.cases[k].time.as_ref().unwrap().budget.expect("a case with a goal");
    for (result, held) in [(triangles, held(0)), (time, held(1))] {
        println!("{}: {held:?}", result.case);
        // A time is held within what its noise was until it is known better.
        let share = if matches!(result.case.goal, Some(Goal::Triangles(_))) { 0.95 } else { 0.3 };
        assert!(held.settled >= share && held.settling_frames < 15.0 && held.max < 1.3, "{}: {held:?}", result.case);
        let round = &result.rounds[0];
        assert_eq!(round.tolerances_px.len(), result.case.frames);
        assert!(round.tolerances_px.iter().any(|px| *px != 0.5), "it stayed where it began");
    }
    assert!((time.time.as_ref().unwrap().frame_ms.value / 25.0 - 1.0).abs() < 0.1);
    assert!((triangles.time.as_ref().unwrap().triangles / 2e4 - 1.0).abs() < 0.05);
    assert!(free.time.as_ref().unwrap().budget.is_none() && free.rounds[0].tolerances_px.is_empty());
}

#[test]
fn a_goal_out_of_reach_is_not_said_to_be_held() {
    let fields = vec![mock::field(129)];
    let goal = Some(Goal::Triangles(1e9));
    let case = Case { goal, ..mock::case(&fields[0].0, "geomipmap", 1.0, "certified", "spin") };
    let folder = tempfile::tempdir().unwrap();
    mock::run(folder.path(), fields.clone(), vec![case], 1);
    let results = Results::read(folder.path()).unwrap();
    let BudgetStats { within, settled, settling_frames, .. } = results.cases[0].time.as_ref().unwrap().budget.unwrap();
    assert_eq!((within, settled, settling_frames), (0.0, 0.0, 20.0));
    let finest = *results.cases[0].rounds[0].tolerances_px.last().unwrap();
    assert!((finest * 64.0 - 1.0).abs() < 1e-9, "{finest} px");
}
