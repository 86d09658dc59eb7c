//! Positions of the eye between which a list changes.

use glam::DVec3;

use super::invariants::Subject;
use super::views;
use crate::height::Field;
use crate::lod::Technique;
use crate::view::View;

/// Two views of a flight away from a field, just before and just behind a change of the list.
pub struct Threshold {
    /// Start of the flight.
    pub start: View,
    /// The views, whose eyes are adjacent in f64.
    pub sides: [View; 2],
}

impl Threshold {
    /// Finds a threshold on the way from above a corner of a field to far outside it. Returns `None` if both ends draw
    /// the same number of triangles.
    pub fn find(field: &Field, technique: &mut dyn Technique) -> Option<Self> {
        let all = views::views(field);
        let of = |name: &str| all.iter().find(|view| view.0 == name).expect("a common view").1;
        let (start, end) = (of("from above a corner"), of("far outside").eye);
        Some(Self { start, sides: threshold(field, technique, start, end)? })
    }
}

/// Bisects the path of the eye towards `end` until two adjacent positions (in f64) draw different numbers of
/// triangles. Returns `None` if both ends draw the same number.
fn threshold(field: &Field, technique: &mut dyn Technique, view: View, end: DVec3) -> Option<[View; 2]> {
    let mut subject = Subject::new(field, technique, &[]);
    let way = end - view.eye;
    let at = |share: f64| View { eye: view.eye + way * share, ..view };
    let mut triangles = |share: f64| subject.select(&at(share)).map(|list| list.triangles()).ok();
    let (mut low, mut high) = (0.0, 1.0);
    let first = triangles(low)?;
    if triangles(high)? == first {
        return None;
    }
    while at(low).eye != at(high).eye {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            break;
        }
        *(if triangles(middle)? == first { &mut low } else { &mut high }) = middle;
    }
    Some([at(low), at(high)])
}
