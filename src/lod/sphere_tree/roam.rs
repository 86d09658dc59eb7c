//! Tracks the front by two priority queues, of splits and of merges, ordered by the earliest possible crossing.
//!
//! Based on M. Duchaineau et al., "ROAMing Terrain: Real-time Optimally Adapting Meshes" (1997), §6: a priority is
//! recomputed only when it may have reached the threshold, given the viewpoint's maximum speed. Here a diamond's slack
//! is a distance. It is due when the viewpoint has travelled that distance, or could have at the maximum speed. The
//! queue ignores directions: a diamond that recedes is checked as often as one that approaches.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use glam::DVec3;

use super::diamond_info::DiamondInfo;
use super::front::{CrossingTracker, Front, TrackingHandle};
use super::reach::Viewpoint;

/// Priority queues of splits and merges.
#[derive(Default)]
pub struct Queues {
    /// Travelled distance, metres, at which diamonds are due, as the bits of a positive float; of those that may split,
    /// and of those that may merge.
    queues: [BinaryHeap<Reverse<(u64, TrackingHandle)>>; 2],
    /// Distance that the viewpoint has travelled so far, metres.
    travelled: f64,
    eye: Option<DVec3>,
    /// Maximum speed, metres a frame; 0 to use the actual distance.
    pub largest_speed: f64,
}

impl CrossingTracker for Queues {
    fn clear(&mut self) {
        self.queues.iter_mut().for_each(BinaryHeap::clear);
        (self.travelled, self.eye) = (0.0, None);
    }

    fn due(&mut self, from: &Viewpoint, handles: &mut Vec<TrackingHandle>, _visited: &mut usize) {
        if let Some(eye) = self.eye {
            self.travelled += eye.distance(from.eye).max(self.largest_speed) * (1.0 + 1e-9);
        }
        self.eye = Some(from.eye);
        for queue in &mut self.queues {
            while queue.peek().is_some_and(|Reverse((travelled, _))| f64::from_bits(*travelled) <= self.travelled) {
                handles.extend(queue.pop().map(|Reverse((_, handle))| handle));
            }
        }
    }

    fn place(&mut self, front: &mut Front, handle: TrackingHandle, _known: &DiamondInfo, is_split: bool, slack: f64) {
        self.eye = Some(front.from.eye);
        self.queues[usize::from(is_split)].push(Reverse(((self.travelled + slack).to_bits(), handle)));
    }
}
