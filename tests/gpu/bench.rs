//! Tests of a benchmark on the GPU: its rows for techniques with known errors.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use cuesta::internal::bench::device::DeviceBackend;
use cuesta::internal::bench::journal::Journal;
use cuesta::internal::bench::rows::{Case, ErrorRow, Header, Machine, Row, Terrain, TimeRow};
use cuesta::internal::bench::run::{BenchBackend, Ended, Run};
use cuesta::internal::gpu::Gpu;
use cuesta::internal::height::Field;
use cuesta::internal::lod::Techniques;
use cuesta::internal::plan::Look;

use super::{mountains, on_device};

const TECHNIQUES: [(&str, f64); 4] =
    [("brute-force", 1.0), ("geomipmap", 4.0), ("geomipmap", 12.0), ("geomipmap:draw-per-block", 12.0)];

fn rows(gpu: &Arc<Gpu>, field: &Arc<Field>, folder: &Path) -> (Vec<TimeRow>, Vec<ErrorRow>) {
    let terrain = Terrain { name: "mountains".to_string(), size: field.size(), spacing_m: field.spacing };
    let case = |(technique, tolerance_px): (&str, f64)| Case {
        terrain: terrain.clone(),
        technique: technique.to_string(),
        settings: Default::default(),
        tolerance_px,
        goal: None,
        metric: "certified".to_string(),
        path: "circle".to_string(),
        size: [160, 100],
        frames: 12,
        every: 4,
    };
    let fields = vec![(terrain.clone(), Arc::clone(field))];
    let mut backend = DeviceBackend::new(Arc::clone(gpu), Look::default(), Techniques::built_in());
    let (device, plans) = backend.describe(&fields).unwrap();
    let header = Header {
        schema: cuesta::internal::bench::SCHEMA,
        program: String::new(),
        commit: None,
        date: String::new(),
        arguments: Vec::new(),
        base: "brute-force".to_string(),
        machine: Machine::this(),
        device,
        plans,
    };
    let stop = AtomicBool::new(false);
    let cases = TECHNIQUES.map(case).to_vec();
    let run = Run { folder, cases, fields, rounds: 2, warm_up: 2, stop: &stop };
    assert_eq!(run.run(&mut backend, header.clone(), &mut |_| {}).unwrap(), Ended::Complete);
    let journal = Journal::open(folder, header).unwrap();
    let (mut times, mut errors) = (Vec::new(), Vec::new());
    for row in journal.rows() {
        match row.clone() {
            Row::Header(_) => {}
            Row::Time(row) => times.push(row),
            Row::Error(row) => errors.push(row),
        }
    }
    (times, errors)
}

#[test]
fn rows_match_known_errors() {
    on_device(|gpu| {
        let folder = tempfile::tempdir().unwrap();
        let (times, errors) = rows(gpu, &mountains(), folder.path());
        assert_eq!((times.len(), errors.len()), (2 * TECHNIQUES.len(), TECHNIQUES.len()));
        for row in &times {
            let t = &row.times;
            assert!(t.frame_ms.p50 > 0.0 && t.shading_only_ms.unwrap().p50 > 0.0 && t.triangles.mean > 0.0, "{row:?}");
            assert!(t.frame_ms.p50 >= t.select_ms.p50, "{row:?}");
            assert!(t.device_bytes["heights"] > 0, "{row:?}");
        }
        for row in &errors {
            let e = &row.errors;
            let is_exact = row.case.technique == "brute-force";
            assert_eq!(e.frames, 3);
            assert_eq!((e.watertight, e.as_drawn, e.hole_pixels), (Some(true), Some(true), Some(0)), "{row:?}");
            assert_eq!(e.within.unwrap().frames, 1.0);
            assert!(e.error_px.max <= row.case.tolerance_px, "{row:?}");
            assert_eq!(e.error_px.max == 0.0, is_exact, "{row:?}");
            assert_eq!(e.image.unwrap().rmse == 0.0, is_exact, "{row:?}");
            assert!(e.pop.as_ref().unwrap().max_px == 0.0 || !is_exact, "{row:?}");
            assert!(e.reference.is_none_or(|r| r.multiple.unwrap() > 1.0 && r.delaunay < r.rtin), "{row:?}");
            assert!(e.by_angle.iter().all(|bin| bin.max <= 1.0) && e.by_angle.len() >= 3, "{row:?}");
            assert!(e.economy.as_ref().unwrap().overdraw.is_none_or(|o| o >= 1.0), "{row:?}");
            assert_eq!(e.reference.is_none(), is_exact, "{row:?}");
            let worst = e.worst.as_ref().unwrap();
            assert!(worst.frame % 4 == 0 && worst.frame < 12);
            let picture = image::open(folder.path().join(worst.picture.as_ref().unwrap())).unwrap();
            assert_eq!((picture.width(), picture.height()), (160, 100));
        }
        // The same triangles in one draw call or in many.
        let [indirect, direct] = [2, 3].map(|k| &errors[k].errors);
        assert_eq!((indirect.error_px, indirect.peers_px), (direct.error_px, direct.peers_px));
        assert!(errors[2].errors.error_px.max > errors[1].errors.error_px.max);
    });
}
