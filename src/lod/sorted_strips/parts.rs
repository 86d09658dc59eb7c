//! A frame in parts: what is walked first is drawn while the rest is walked.
//!
//! Rows of pages are walked and drawn in the same order as otherwise, a few at a time. What was given away to be drawn
//! cannot be taken back, so that a frame comes in parts only where it surely fits its limits. On llvmpipe, where the device is
//! the host's own cores, nothing is gained: 12 frames of 132 000 triangles, three rounds, medians of 16 to 26 ms whole, 20 to
//! 23 in two parts, 17 to 28 in four, 17 to 30 in eight.

use super::pages::Row;
use super::sequence::Sequence;
use crate::draw::{Draw, DrawList, Instance};

/// The most triangles of a frame of so many pages with so many split squares, and the most vertices: a page has four, a
/// split adds at most the middles of a square and of its sides, there are less than twice as many triangles, and rows of
/// pages have the vertices between them twice.
pub fn max_triangles(pages: usize, splits: usize) -> usize {
    2 * (4 * pages + 5 * splits)
}

/// Rows in at most so many groups of about as many pages each, in the order in which they are drawn.
pub fn groups(rows: &[Row], parts: usize, sequence: Sequence) -> Vec<&[Row]> {
    let pages = |row: &Row| row.runs.iter().map(|run| run.pages as usize).sum::<usize>();
    let all: usize = rows.iter().map(pages).sum();
    let (mut groups, mut rest, mut taken) = (Vec::new(), rows, 0);
    for part in 1..=parts {
        let mut count = 0;
        while count < rest.len() && taken < all * part / parts {
            taken += pages(&rest[count]);
            count += 1;
        }
        let (group, after) = rest.split_at(count);
        groups.extend((!group.is_empty()).then_some(group));
        rest = after;
    }
    if sequence.is_from_afar() {
        groups.reverse();
    }
    groups
}

/// Appends a list to another one.
pub fn append(part: &DrawList, list: &mut DrawList) {
    let streamed = &mut list.streamed;
    let (vertex, index) = (streamed.vertices.len() as u32, streamed.indices.len() as u32);
    let instance = list.instances.len() as u32;
    streamed.vertices.extend_from_slice(&part.streamed.vertices);
    streamed.indices.extend_from_slice(&part.streamed.indices);
    list.instances.extend(part.instances.iter().map(|own| Instance { batch: own.batch + instance, ..*own }));
    list.draws.extend(part.draws.iter().map(|draw| Draw {
        indices: draw.indices.start + index..draw.indices.end + index,
        instances: draw.instances.start + instance..draw.instances.end + instance,
        first_vertex: draw.first_vertex + vertex,
        ..draw.clone()
    }));
}
