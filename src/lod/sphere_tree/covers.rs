//! The hierarchy that emerges among the spheres of the front: what lies behind another one is not looked at.
//!
//! After J. Blow, "Terrain Rendering at High Levels of Detail" (2000), part II: where a sphere B lies in a sphere A
//! around which the viewpoint is outside, it cannot cross B before A, however far apart their wedges are in the tree.
//! Likewise a viewpoint inside B cannot leave A before it leaves B. So A *covers* B, or B covers A, until it is crossed
//! or leaves the front. The lecture does not say how such pairs are found: here by a look from the viewpoint past the
//! diamond, or short of it, at the wedge that is drawn there. What nothing covers is left to made-up spheres
//! ([`BoundingSpheres`]).

use glam::DVec3;

use super::bounding_spheres::BoundingSpheres;
use super::by_index::ByIndex;
use super::front::{CrossingTracker, Front, TrackingHandle};
use super::known::Known;
use super::reach::Viewpoint;

/// Where to look, in distances of the diamond in plan: past one that may split, and short of one that may merge.
const PAST: [f64; 2] = [1.5, 2.5];
const SHORT: [f64; 2] = [0.6, 0.3];

/// Spheres that cover others, and made-up ones for the rest.
#[derive(Default)]
pub struct Covers {
    bounding_spheres: BoundingSpheres,
    /// By the covering diamond: whom it covers.
    covered: ByIndex<Vec<TrackingHandle>>,
}

impl CrossingTracker for Covers {
    fn clear(&mut self) {
        self.bounding_spheres.clear();
        self.covered.clear();
    }

    fn due(&mut self, from: &Viewpoint, handles: &mut Vec<TrackingHandle>, visited: &mut usize) {
        self.bounding_spheres.due(from, handles, visited);
    }

    fn place(&mut self, front: &mut Front, handle: TrackingHandle, known: &Known, is_split: bool, slack: f64) {
        match cover(front, known, is_split) {
            Some(cover) => self.covered.entry(cover).or_default().push(handle),
            None => self.bounding_spheres.place(front, handle, known, is_split, slack),
        }
    }

    fn left(&mut self, index: u64, handles: &mut Vec<TrackingHandle>) {
        if let Some(covered) = self.covered.remove(&index) {
            handles.extend(covered);
        }
    }
}

/// A member of the front that covers this one.
fn cover(front: &mut Front, known: &Known, is_split: bool) -> Option<u64> {
    let eye = front.from.eye;
    let places = if is_split { SHORT } else { PAST };
    places.into_iter().find_map(|share| {
        let index = drawn_at(front, eye + (known.centre - eye) * share, is_split)?;
        let other = front.members.get(&index).filter(|other| other.is_split == is_split)?;
        *front.visited += 1;
        let other = front.measured.known(other.at, index as usize);
        let (inner, outer) = if is_split { (&other, known) } else { (known, &other) };
        let room = front.from.radius(outer, is_split) - front.from.radius(inner, is_split);
        // A larger one only: nothing covers itself through others.
        (room > 0.0 && inner.centre.distance(outer.centre) <= room).then_some(index)
    })
}

/// The diamond of the wedge that is drawn at a place in plan: the one that it is half of, or the one whose split made it.
fn drawn_at(front: &Front, at: DVec3, is_split: bool) -> Option<u64> {
    let lattice = &front.measured.lattice;
    let side = f64::from(lattice.side());
    let spacing = front.measured.field.spacing;
    let [x, z] = [at.x / spacing[0], at.z / spacing[1]].map(|n| n.clamp(0.0, side));
    let far = lattice.side();
    let mut wedge = if z > x { [[0, far], [far, far], [0, 0]] } else { [[far, 0], [0, 0], [far, far]] };
    let mut made = None;
    loop {
        let [apex, left, right] = wedge;
        let sum = [0, 1].map(|k| left[k] + right[k]);
        let middle = sum.map(|n| n / 2);
        let index = lattice.index(middle).filter(|_| (sum[0] | sum[1]) & 1 == 0);
        let Some(index) = index.filter(|&index| front.splits.contains(index)) else {
            return if is_split { made } else { index }.map(|index| index as u64);
        };
        made = Some(index);
        // On which side of the line from the apex to the middle.
        let to = |from: [i32; 2]| [x - f64::from(from[0]), z - f64::from(from[1])];
        let ([px, pz], [dx, dz]) = (to(apex), [middle[0] - apex[0], middle[1] - apex[1]].map(f64::from));
        let [lx, lz] = [left[0] - apex[0], left[1] - apex[1]].map(f64::from);
        let is_left = (dx * pz - dz * px) * (dx * lz - dz * lx) >= 0.0;
        wedge = if is_left { [middle, apex, left] } else { [middle, right, apex] };
    }
}
