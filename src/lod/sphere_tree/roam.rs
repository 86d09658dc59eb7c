//! Two priority queues, of splits and of merges, whose priorities wait until the viewpoint can have come near enough.
//!
//! After M. Duchaineau et al., "ROAMing Terrain: Real-time Optimally Adapting Meshes" (1997), §6: a priority is worked
//! out again only when, at the largest speed of the viewpoint, it may have reached the threshold. Here the slack of a
//! diamond is a distance, and waits for the way that the viewpoint has gone, or could have gone at that speed. The
//! queue knows nothing of where it went: a diamond that it moves away from is looked at as often as one that it nears.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use glam::DVec3;

use super::front::{CrossingTracker, Front, TrackingHandle};
use super::known::Known;
use super::reach::Viewpoint;

/// The queues.
#[derive(Default)]
pub struct Queues {
    /// Way of the viewpoint, metres, upon which members are due, as the bits of a positive float: of those that may
    /// split, and of those that may merge.
    queues: [BinaryHeap<Reverse<(u64, TrackingHandle)>>; 2],
    /// Way of the viewpoint so far, metres.
    way: f64,
    eye: Option<DVec3>,
    /// The largest speed, metres a frame: with 0, the way that it really went.
    pub largest_speed: f64,
}

impl CrossingTracker for Queues {
    fn clear(&mut self) {
        self.queues.iter_mut().for_each(BinaryHeap::clear);
        (self.way, self.eye) = (0.0, None);
    }

    fn due(&mut self, from: &Viewpoint, handles: &mut Vec<TrackingHandle>, _visited: &mut usize) {
        if let Some(eye) = self.eye {
            self.way += eye.distance(from.eye).max(self.largest_speed) * (1.0 + 1e-9);
        }
        self.eye = Some(from.eye);
        for queue in &mut self.queues {
            while queue.peek().is_some_and(|Reverse((way, _))| f64::from_bits(*way) <= self.way) {
                handles.extend(queue.pop().map(|Reverse((_, handle))| handle));
            }
        }
    }

    fn place(&mut self, front: &mut Front, handle: TrackingHandle, _known: &Known, is_split: bool, slack: f64) {
        self.eye = Some(front.from.eye);
        self.queues[usize::from(is_split)].push(Reverse(((self.way + slack).to_bits(), handle)));
    }
}
