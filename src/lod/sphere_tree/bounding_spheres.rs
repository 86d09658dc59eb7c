//! Bounding spheres about past viewpoints, which delay checks of wedges until the eye may have crossed their spheres.
//!
//! Based on J. Blow, "Terrain Rendering at High Levels of Detail" (2000), part II. The lecture groups spheres by
//! additional bounding spheres that belong to no wedge; no member of a group is checked before the eye crosses them.
//! Here all wedges checked in one frame form a group around that frame's viewpoint. Each has a concentric sphere whose
//! radius is the distance that the eye may move before it can cross the wedge's own sphere. No wedge is checked while
//! the eye stays inside the innermost of these. That one is checked only when the distance travelled could have led out
//! of it.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use glam::DVec3;

use super::diamond_info::DiamondInfo;
use super::front::{CrossingTracker, Front, TrackingHandle};
use super::reach::Viewpoint;

/// Concentric spheres about one past viewpoint.
#[derive(Default)]
struct Group {
    centre: DVec3,
    /// Radius, metres, as the bits of a positive float, and the tracked wedge; the innermost sphere last.
    bounding_spheres: Vec<(u64, TrackingHandle)>,
}

impl Group {
    /// Returns the distance from a point inside to the innermost sphere, metres.
    fn slack(&self, eye: DVec3) -> Option<f64> {
        let &(radius, _) = self.bounding_spheres.last()?;
        Some(f64::from_bits(radius) - self.centre.distance(eye) * (1.0 + 1e-9))
    }
}

/// All groups of spheres.
#[derive(Default)]
pub struct BoundingSpheres {
    /// Group about the current viewpoint, not sorted yet.
    current: Group,
    groups: Vec<Group>,
    /// Indices of groups without spheres.
    empty: Vec<u32>,
    /// Travelled distance, metres, at which the innermost sphere of a group may be crossed, as the bits of a float; and
    /// the group.
    queue: BinaryHeap<Reverse<(u64, u32)>>,
    eye: DVec3,
    /// Distance that the eye has travelled so far, metres.
    travelled: f64,
}

impl BoundingSpheres {
    /// Sorts the spheres about the last viewpoint and starts tracking them.
    fn close_current(&mut self) {
        if self.current.bounding_spheres.is_empty() {
            return;
        }
        self.current.bounding_spheres.sort_unstable_by_key(|&sphere| Reverse(sphere));
        let number = self.empty.pop().unwrap_or_else(|| {
            self.groups.push(Group::default());
            self.groups.len() as u32 - 1
        });
        std::mem::swap(&mut self.groups[number as usize], &mut self.current);
        self.track_innermost(number, self.eye);
    }

    fn track_innermost(&mut self, number: u32, eye: DVec3) {
        match self.groups[number as usize].slack(eye) {
            Some(slack) => self.queue.push(Reverse(((self.travelled + slack).max(0.0).to_bits(), number))),
            None => self.empty.push(number),
        }
    }
}

impl CrossingTracker for BoundingSpheres {
    fn clear(&mut self) {
        *self = Self::default();
    }

    fn due(&mut self, from: &Viewpoint, handles: &mut Vec<TrackingHandle>, visited: &mut usize) {
        self.close_current();
        self.travelled += self.eye.distance(from.eye) * (1.0 + 1e-9);
        self.eye = from.eye;
        while let Some(&Reverse((_, number))) = self.queue.peek().filter(|q| f64::from_bits(q.0.0) <= self.travelled) {
            self.queue.pop();
            *visited += 1;
            let (group, travelled) = (&mut self.groups[number as usize], self.travelled);
            // A slack below the distance's floating-point resolution would never become due, so it is due now.
            while group.slack(from.eye).is_some_and(|slack| travelled + slack <= travelled) {
                handles.extend(group.bounding_spheres.pop().map(|(_, handle)| handle));
            }
            self.track_innermost(number, from.eye);
        }
    }

    fn place(&mut self, front: &mut Front, handle: TrackingHandle, _known: &DiamondInfo, _is_split: bool, slack: f64) {
        (self.eye, self.current.centre) = (front.from.eye, front.from.eye);
        self.current.bounding_spheres.push((slack.to_bits(), handle));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lod::sphere_tree::reach::Reach;
    use crate::view::{Lens, Metric, Tolerance, View};

    /// A sphere nearer than the floating-point resolution of a long travelled distance must still become due.
    #[test]
    fn slack_below_float_resolution_is_due() {
        let view = View {
            eye: DVec3::ZERO,
            world_from_eye: View::turned(0.0, 0.0, 0.0),
            lens: Lens::Perspective { fov_x: 1.0 },
            size: [64, 64],
            near: 0.1,
            tolerance: Tolerance { px: 1.0, metric: Metric::Certified },
            time_s: 0.0,
        };
        let from = |eye: DVec3| Viewpoint { eye, reach: Reach::new(&view), band: 1.0, hold: 1.0 };
        let mut bounding_spheres = BoundingSpheres { travelled: 1e9, ..BoundingSpheres::default() };
        let handle = |index| TrackingHandle { index, number: index as u32 };
        bounding_spheres.current.bounding_spheres = vec![(5.0f64.to_bits(), handle(1)), (1e-9f64.to_bits(), handle(2))];
        let (mut handles, mut visited) = (Vec::new(), 0);
        bounding_spheres.due(&from(DVec3::ZERO), &mut handles, &mut visited);
        assert_eq!((handles.as_slice(), visited), (&[handle(2)][..], 1));
        bounding_spheres.due(&from(DVec3::new(4.0, 0.0, 0.0)), &mut handles, &mut visited);
        assert_eq!(handles.len(), 1, "the other one is a metre away");
        bounding_spheres.due(&from(DVec3::new(5.1, 0.0, 0.0)), &mut handles, &mut visited);
        assert_eq!(handles, [handle(2), handle(1)]);
    }
}
