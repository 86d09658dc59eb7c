//! Progress of long work on a field, counted by the workers and read from any thread.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// Steps done, and steps in all. Clones count together.
#[derive(Clone, Debug, Default)]
pub struct Progress(Arc<[AtomicU64; 2]>);

impl Progress {
    /// Adds steps to be done.
    pub fn expect(&self, steps: u64) {
        self.0[1].fetch_add(steps, Ordering::Relaxed);
    }

    /// Adds steps that are done.
    pub fn advance(&self, steps: u64) {
        self.0[0].fetch_add(steps, Ordering::Relaxed);
    }

    /// Returns the share that is done, 0 to 1; `None` before the first [`Self::expect`].
    pub fn share(&self) -> Option<f64> {
        let [done, all] = [0, 1].map(|k| self.0[k].load(Ordering::Relaxed));
        (all > 0).then(|| (done as f64 / all as f64).min(1.0))
    }
}
