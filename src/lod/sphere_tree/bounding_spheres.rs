//! Made-up spheres about places where the viewpoint was, each with the members of the front that lie beyond it.
//!
//! After J. Blow, "Terrain Rendering at High Levels of Detail" (2000), part II: where there are many surfaces, made-up
//! ones that belong to no wedge group them, and none of a group is looked at before the viewpoint crosses that. Here all
//! members that were looked at in one frame lie around the place of the viewpoint in that frame, as shells one in the
//! other: by how far the viewpoint may go from there before it can have crossed each. While it stays inside the
//! innermost shell of a place, whichever way it goes there, none of them is looked at; and that shell itself is only
//! when the way gone could have led out of it.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use glam::DVec3;

use super::front::{CrossingTracker, Front, TrackingHandle};
use super::known::Known;
use super::reach::Viewpoint;

/// The shells about one place.
#[derive(Default)]
struct Nest {
    centre: DVec3,
    /// Radius, metres, as the bits of a positive float, and what it is for; the innermost last.
    bounding_spheres: Vec<(u64, TrackingHandle)>,
}

impl Nest {
    /// How far the innermost shell is from a place inside it, metres.
    fn slack(&self, eye: DVec3) -> Option<f64> {
        let &(radius, _) = self.bounding_spheres.last()?;
        Some(f64::from_bits(radius) - self.centre.distance(eye) * (1.0 + 1e-9))
    }
}

/// All places with their shells.
#[derive(Default)]
pub struct BoundingSpheres {
    /// About the viewpoint, not sorted yet.
    current: Nest,
    nests: Vec<Nest>,
    /// Numbers of nests without shells.
    empty: Vec<u32>,
    /// Way of the viewpoint, metres, upon which a nest's innermost shell may be crossed, as the bits of a float.
    queue: BinaryHeap<Reverse<(u64, u32)>>,
    eye: DVec3,
    /// Way of the viewpoint so far, metres.
    way: f64,
}

impl BoundingSpheres {
    /// Sorts the shells about the last place of the viewpoint.
    fn close_current(&mut self) {
        if self.current.bounding_spheres.is_empty() {
            return;
        }
        self.current.bounding_spheres.sort_unstable_by_key(|&shell| Reverse(shell));
        let number = self.empty.pop().unwrap_or_else(|| {
            self.nests.push(Nest::default());
            self.nests.len() as u32 - 1
        });
        std::mem::swap(&mut self.nests[number as usize], &mut self.current);
        self.await_innermost(number, self.eye);
    }

    fn await_innermost(&mut self, number: u32, eye: DVec3) {
        match self.nests[number as usize].slack(eye) {
            Some(slack) => self.queue.push(Reverse(((self.way + slack).max(0.0).to_bits(), number))),
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
        self.way += self.eye.distance(from.eye) * (1.0 + 1e-9);
        self.eye = from.eye;
        while let Some(&Reverse((_, number))) = self.queue.peek().filter(|q| f64::from_bits(q.0.0) <= self.way) {
            self.queue.pop();
            *visited += 1;
            let (nest, way) = (&mut self.nests[number as usize], self.way);
            // A slack that is nothing beside the way cannot be waited for.
            while nest.slack(from.eye).is_some_and(|slack| way + slack <= way) {
                handles.extend(nest.bounding_spheres.pop().map(|(_, handle)| handle));
            }
            self.await_innermost(number, from.eye);
        }
    }

    fn place(&mut self, front: &mut Front, handle: TrackingHandle, _known: &Known, _is_split: bool, slack: f64) {
        (self.eye, self.current.centre) = (front.from.eye, front.from.eye);
        self.current.bounding_spheres.push((slack.to_bits(), handle));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lod::sphere_tree::reach::Reach;
    use crate::view::{Lens, Metric, Tolerance, View};

    /// After a long way, a shell is left that is nearer than the way's next number: it is not waited for for ever.
    #[test]
    fn a_slack_that_is_nothing_beside_the_way_is_due() {
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
        let mut bounding_spheres = BoundingSpheres { way: 1e9, ..BoundingSpheres::default() };
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
