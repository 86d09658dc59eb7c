//! Divides a frame into parts: each part is drawn while the next one is walked.
//!
//! Rows of pages are walked and drawn in the usual order, a few at a time. A part handed over for drawing cannot be
//! taken back, so a frame is divided only if it is certain to fit the limits. On llvmpipe, which draws on the host's
//! own cores, nothing is gained. Medians of 12 frames of 132 000 triangles, in three rounds: 16 to 26 ms whole. Two
//! parts take 20 to 23 ms, four take 17 to 28 ms, eight take 17 to 30 ms.

use super::pages::Row;
use super::sequence::Sequence;
use crate::draw::{Draw, DrawList, Instance};

/// Returns an upper bound on the triangles, and on the vertices, of a frame with these numbers of pages and split
/// squares. A page has four vertices, and a split adds at most the middles of a square and of its sides. There are
/// fewer than twice as many triangles, and rows of pages duplicate the vertices between them.
pub fn max_triangles(pages: usize, splits: usize) -> usize {
    2 * (4 * pages + 5 * splits)
}

/// Divides rows into at most `parts` groups with similar numbers of pages, in drawing order.
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
    if sequence.is_back_to_front() {
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
