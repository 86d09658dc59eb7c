//! Hierarchy of nested spheres: a sphere is not checked while another one separates it from the eye.
//!
//! Based on J. Blow, "Terrain Rendering at High Levels of Detail" (2000), part II. Let a sphere B lie inside a sphere
//! A. An eye outside A cannot cross B before A, and an eye inside B cannot leave A before B. So A *covers* B, or B
//! covers A, until it is crossed or leaves the front. The two wedges may be far apart in the tree. The lecture does not
//! say how to find such pairs. Here the ray from the eye to the diamond's middle is sampled beyond it, or before it,
//! and the wedge drawn there is tested. Diamonds that nothing covers use [`BoundingSpheres`].

use glam::DVec3;

use super::bounding_spheres::BoundingSpheres;
use super::by_index::ByIndex;
use super::diamond_info::DiamondInfo;
use super::front::{CrossingTracker, Front, TrackingHandle};
use super::reach::Viewpoint;

/// Sample points along the ray in plan, in multiples of the distance to the diamond: beyond one that may split, before
/// one that may merge.
const BEYOND: [f64; 2] = [1.5, 2.5];
const BEFORE: [f64; 2] = [0.6, 0.3];

/// Covering pairs of diamonds, and bounding spheres for the other ones.
#[derive(Default)]
pub struct Covers {
    bounding_spheres: BoundingSpheres,
    /// Handles of covered diamonds, by the index of the diamond that covers them.
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

    fn place(&mut self, front: &mut Front, handle: TrackingHandle, diamond: &DiamondInfo, is_split: bool, slack: f64) {
        match cover(front, diamond, is_split) {
            Some(cover) => self.covered.entry(cover).or_default().push(handle),
            None => self.bounding_spheres.place(front, handle, diamond, is_split, slack),
        }
    }

    fn removed(&mut self, index: u64, handles: &mut Vec<TrackingHandle>) {
        if let Some(covered) = self.covered.remove(&index) {
            handles.extend(covered);
        }
    }
}

/// Returns the index of a diamond of the front that covers this one.
fn cover(front: &mut Front, diamond: &DiamondInfo, is_split: bool) -> Option<u64> {
    let eye = front.from.eye;
    let places = if is_split { BEFORE } else { BEYOND };
    places.into_iter().find_map(|share| {
        let index = drawn_at(front, eye + (diamond.centre - eye) * share, is_split)?;
        let other = front.members.get(&index).filter(|other| other.is_split == is_split)?;
        *front.visited += 1;
        let other = front.measured.diamond(other.at, index as usize);
        let (inner, outer) = if is_split { (&other, diamond) } else { (diamond, &other) };
        let margin = front.from.radius(outer, is_split) - front.from.radius(inner, is_split);
        // Requires a larger sphere, so that diamonds never cover each other in a cycle.
        (margin > 0.0 && inner.centre.distance(outer.centre) <= margin).then_some(index)
    })
}

/// Returns the diamond of the wedge drawn at a place in plan: the one it is half of, or the one whose split created it.
fn drawn_at(front: &Front, at: DVec3, is_split: bool) -> Option<u64> {
    let lattice = &front.measured.lattice;
    let side = f64::from(lattice.side());
    let spacing = front.measured.field.spacing;
    let [x, z] = [at.x / spacing[0], at.z / spacing[1]].map(|n| n.clamp(0.0, side));
    let far = lattice.side();
    let mut wedge = if z > x { [[0, far], [far, far], [0, 0]] } else { [[far, 0], [0, 0], [far, far]] };
    let mut created = None;
    loop {
        let [apex, left, right] = wedge;
        let sum = [0, 1].map(|k| left[k] + right[k]);
        let middle = sum.map(|n| n / 2);
        let index = lattice.index(middle).filter(|_| (sum[0] | sum[1]) & 1 == 0);
        let Some(index) = index.filter(|&index| front.splits.contains(index)) else {
            return if is_split { created } else { index }.map(|index| index as u64);
        };
        created = Some(index);
        // Continues in the half on the place's side of the line from the apex to the middle.
        let to = |from: [i32; 2]| [x - f64::from(from[0]), z - f64::from(from[1])];
        let ([px, pz], [dx, dz]) = (to(apex), [middle[0] - apex[0], middle[1] - apex[1]].map(f64::from));
        let [lx, lz] = [left[0] - apex[0], left[1] - apex[1]].map(f64::from);
        let is_left = (dx * pz - dz * px) * (dx * lz - dz * lx) >= 0.0;
        wedge = if is_left { [middle, apex, left] } else { [middle, right, apex] };
    }
}
