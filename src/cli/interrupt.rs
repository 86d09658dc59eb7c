//! Handling of Ctrl-C.
//!
//! The first Ctrl-C requests a clean stop if the current work supports it. Otherwise, and at the second Ctrl-C, the
//! program ends immediately. Incomplete files have temporary names and are removed.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};

use signal_hook::low_level::exit;

use super::report::note;
use crate::height::save::discard_unfinished;

/// A function that requests the current work to stop.
pub type StopRequest = Box<dyn FnOnce() + Send>;

/// The function that the next Ctrl-C calls; `None` to end the program.
static NEXT: Mutex<Option<StopRequest>> = Mutex::new(None);

/// Installs the handler of Ctrl-C. Does nothing if the process already has one.
pub fn install() {
    let _ = ctrlc::set_handler(|| {
        let next = NEXT.lock().unwrap_or_else(|e| e.into_inner()).take();
        next.map_or_else(end, |request| request());
    });
}

/// Makes the next Ctrl-C call a function instead of ending the program.
pub fn once(request: StopRequest) {
    *NEXT.lock().unwrap_or_else(|e| e.into_inner()) = Some(request);
}

/// Returns a flag that the next Ctrl-C sets to true, instead of ending the program.
pub fn flag() -> Arc<AtomicBool> {
    let flag = Arc::new(AtomicBool::new(false));
    let set = Arc::clone(&flag);
    once(Box::new(move || set.store(true, Ordering::Relaxed)));
    flag
}

/// Removes incomplete files and ends the program with exit code 2. Destructors do not run, as other threads are still
/// working.
fn end() {
    discard_unfinished();
    note("error: stopped by Ctrl-C; incomplete files were removed");
    exit(2);
}
