//! Tests of device loss: an error at the first call that reports it, without leaks or invalid use; earlier results
//! are kept.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use anyhow::Result;
use cuesta::internal::bench::device::DeviceBackend;
use cuesta::internal::bench::results::Results;
use cuesta::internal::bench::rows::Row;
use cuesta::internal::bench::run::{Ended, Run};
use cuesta::internal::bench::{BenchBackend, Case, Terrain, journal};
use cuesta::internal::gpu::Gpu;
use cuesta::internal::height::{Field, synth};
use cuesta::internal::lod::{TECHNIQUES, Techniques};
use cuesta::internal::plan::Look;

use super::memory::{Work, drawn, measured};
use super::{on_device, technique};
use crate::bench::mock;

/// Loses the device at the first Vulkan call that can report it, then `step` calls later, and so on. Returns the
/// number of calls.
fn lose(gpu: &Arc<Gpu>, field: &Arc<Field>, name: &str, work: Work, step: usize) -> u64 {
    let bytes = || gpu.device_bytes().values().sum::<u64>();
    let empty = bytes();
    for calls in (0..).step_by(step) {
        gpu.lose_after(calls);
        let outcome = work(gpu, field, technique(field, name, &[]).as_mut());
        assert_eq!(gpu.is_lost(), outcome.is_err(), "{name}, {calls}");
        gpu.lose_after(u64::MAX);
        assert_eq!(bytes(), empty, "{name}: bytes left after {calls} calls");
        let Err(error) = outcome else { return calls };
        let text = format!("{error:#}");
        assert!(text.contains("the device is lost") && !text.contains('\n'), "{name}, {calls}: {text}");
    }
    unreachable!("ends when nothing is lost")
}

fn render(step: usize) {
    let field = Arc::new(synth::synth(synth::Kind::Fractal, [65, 49], 3));
    on_device(|gpu| {
        for entry in TECHNIQUES {
            let count = lose(gpu, &field, entry.name, drawn, step);
            println!("{}: an error at each of {count} calls, {step} apart", entry.name);
            assert!(count > 20, "{}: {count} calls", entry.name);
        }
        let gpu_selector = lose(gpu, &field, "clusters:gpu-driven", drawn, step);
        let all = lose(gpu, &field, "clusters", measured, step);
        println!("selecting on the device: {gpu_selector}; measured: {all}");
        assert!(gpu_selector > 20 && all > gpu_selector, "{gpu_selector} and {all}");
    });
}

#[test]
fn a_loss_is_an_error_and_leaks_nothing() {
    render(19);
}

#[test]
#[ignore = "minutes: the same at every call"]
fn a_loss_at_every_call_is_an_error_and_leaks_nothing() {
    render(1);
}

/// Runs a benchmark of two cases with one round and the errors of each.
fn bench(gpu: &Arc<Gpu>, folder: &Path, (terrain, field): &(Terrain, Arc<Field>)) -> Result<Ended> {
    let case = |name: &str| {
        let path = mock::case(terrain, name, 2.0, "certified", "spin");
        Case { size: [32, 20], frames: 2, every: 1, ..path }
    };
    let mut backend = DeviceBackend::new(Arc::clone(gpu), Look::default(), Techniques::built_in());
    let fields = vec![(terrain.clone(), Arc::clone(field))];
    let (cases, stop) = (vec![case("geomipmap"), case("clusters")], AtomicBool::new(false));
    let header = mock::header(&mut backend as &mut dyn BenchBackend, &fields);
    Run { folder, cases, fields, rounds: 1, warm_up: 1, stop: &stop }.run(&mut backend, header, &mut |_| {})
}

/// Returns the keys of the rows written.
fn keys(folder: &Path) -> Vec<String> {
    let key = |row: &Row| match row {
        Row::Header(_) => "header".to_string(),
        Row::Time(row) => format!("{}, round {}", row.case, row.times.round),
        Row::Error(row) => format!("{}, errors", row.case),
    };
    journal::read(folder).expect("rows").1.iter().map(key).collect()
}

/// Loses the device in a benchmark every `step` calls, and resumes with the rows written before.
fn resume(step: usize) {
    on_device(|gpu| {
        let field = mock::field(33);
        let whole = tempfile::tempdir().unwrap();
        assert_eq!(bench(gpu, whole.path(), &field).unwrap(), Ended::Complete);
        let rows = keys(whole.path());
        let mut kept = vec![0; rows.len() + 1];
        for calls in (0..).step_by(step) {
            let folder = tempfile::tempdir().unwrap();
            gpu.lose_after(calls);
            let ended = bench(gpu, folder.path(), &field);
            gpu.lose_after(u64::MAX);
            let found = keys(folder.path());
            assert_eq!(found, rows[..found.len()], "{calls} calls");
            assert_eq!(Results::read(folder.path()).unwrap().cases.len(), found.len().min(2));
            kept[found.len()] += 1;
            let Err(error) = ended else { break };
            let message = format!("{error:#}");
            let says = [&format!("{} rows are kept", found.len()), "the device is lost"];
            assert!(says.iter().all(|part| message.contains(*part)), "{message}");
            assert_eq!(bench(gpu, folder.path(), &field).unwrap(), Ended::Complete, "the benchmark resumes");
            assert_eq!(keys(folder.path()), rows, "{calls} calls");
        }
        println!("rows kept, and after how many of the calls: {kept:?}");
        assert!(kept.iter().filter(|&&times| times > 0).count() > 2, "{kept:?}");
        assert!(step > 1 || kept.iter().all(|&times| times > 0), "{kept:?}");
    });
}

#[test]
fn a_benchmark_resumes_after_device_loss() {
    resume(97);
}

#[test]
#[ignore = "minutes: the same at every call"]
fn a_benchmark_resumes_after_device_loss_at_every_call() {
    resume(1);
}
