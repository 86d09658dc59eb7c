//! Ctrl-C. The first one asks the current work to stop at a good place, if it can. Otherwise, or the second time, the
//! program ends at once. Unfinished files have temporary names and are removed.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};

use signal_hook::low_level::exit;

use super::report::note;
use crate::height::save::discard_unfinished;

/// A request to the current work to stop.
pub type Ask = Box<dyn FnOnce() + Send>;

static ASK: Mutex<Option<Ask>> = Mutex::new(None);

/// Installs the handler of Ctrl-C.
pub fn install() {
    // Fails if the process has another handler, which then stays.
    let _ = ctrlc::set_handler(|| {
        let ask = ASK.lock().unwrap_or_else(|e| e.into_inner()).take();
        ask.map_or_else(end, |ask| ask());
    });
}

/// Replaces the effect of the next Ctrl-C.
pub fn once(ask: Ask) {
    *ASK.lock().unwrap_or_else(|e| e.into_inner()) = Some(ask);
}

/// Returns a flag that the next Ctrl-C sets.
pub fn flag() -> Arc<AtomicBool> {
    let flag = Arc::new(AtomicBool::new(false));
    let set = Arc::clone(&flag);
    once(Box::new(move || set.store(true, Ordering::Relaxed)));
    flag
}

/// Ends the process without destructors: other threads are still at work.
fn end() {
    discard_unfinished();
    note("error: stopped by Ctrl-C: what was not whole is not written");
    exit(2);
}
