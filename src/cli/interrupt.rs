//! Ctrl-C. Work that can stop at a good place says how; the first Ctrl-C asks it to. Without such work, or the second
//! time, the program ends at once: files that are not whole are removed, and none of them has its final name yet.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};

use signal_hook::low_level::exit;

use super::report::note;
use crate::height::save::discard_unfinished;

/// Asks the work at hand to stop.
pub type Ask = Box<dyn FnOnce() + Send>;

static ASK: Mutex<Option<Ask>> = Mutex::new(None);

/// From now on Ctrl-C does what this module says.
pub fn install() {
    // Refused where the process has another handler, and that one is then asked.
    let _ = ctrlc::set_handler(|| {
        let ask = ASK.lock().unwrap_or_else(|e| e.into_inner()).take();
        ask.map_or_else(end, |ask| ask());
    });
}

/// What the next Ctrl-C does instead of ending the program.
pub fn once(ask: Ask) {
    *ASK.lock().unwrap_or_else(|e| e.into_inner()) = Some(ask);
}

/// What the next Ctrl-C sets.
pub fn flag() -> Arc<AtomicBool> {
    let flag = Arc::new(AtomicBool::new(false));
    let set = Arc::clone(&flag);
    once(Box::new(move || set.store(true, Ordering::Relaxed)));
    flag
}

/// Other threads are in the middle of something: nothing of the process is tidied up behind their backs.
fn end() {
    discard_unfinished();
    note("error: stopped by Ctrl-C: what was not whole is not written");
    exit(2);
}
