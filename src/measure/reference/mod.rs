//! The near-optimal reference: how few triangles could hold a field within a vertical error, seen from anywhere.
//!
//! Two meshes of the whole field, refined until their true largest error, measured over every sample by
//! [`surface::deviation`], is within what was asked:
//!
//! - *greedy*: the Delaunay triangulation to which the worst sample is added again and again, the greedy insertion
//!   of M. Garland and P. S. Heckbert, "Fast Polygonal Approximation of Terrains and Height Fields" (1995);
//! - *RTIN*: the coarsest conforming mesh of the right-triangle hierarchy of W. Evans, D. Kirkpatrick and
//!   G. Townsend, "Right-Triangulated Irregular Networks" (2001), here not by an estimate of errors but by the
//!   errors themselves (`reference/rtin.rs`): what any technique on that hierarchy could do at best.
//!
//! Both mesh the whole rectangle: a hole counts as the land that fills it. The greedy mesh of more than
//! [`TILE`] cells along a side is made in tiles that size or a little smaller, each by itself: its count is then
//! a few per cent higher, for the triangles at the seams (measured in the tests).

mod rtin;

use rayon::prelude::*;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{extended, facing_up};
use crate::height::surface::{self, Corner, Triangle};
use crate::height::{Block, Field, Holes, Samples};

/// Most cells along a side of a greedy mesh.
pub const TILE: u32 = 1024;

/// Near-optimal meshes of a whole field within a vertical error, and a technique against them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(transform = extended::non_negative)]
pub struct Reference {
    /// Largest vertical error of both meshes, metres.
    pub error_m: f64,
    /// Triangles of the greedy Delaunay mesh.
    pub delaunay: Option<u64>,
    /// Triangles of the right-triangulated irregular network.
    pub rtin: Option<u64>,
    /// The technique's triangles over the greedy mesh's, both over the terrain in view.
    pub multiple: Option<f64>,
}

/// A mesh within an error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mesh {
    /// Triangles.
    pub triangles: u64,
    /// Its true largest vertical error at a sample, metres.
    pub max_error_m: f64,
    /// Pieces, along x and z, that were meshed each by itself.
    pub tiles: [u32; 2],
}

/// Reason for a missing reference.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Error {
    /// The error asked for, metres, cannot be one.
    #[error("near-optimal mesh: vertical error: expected more than 0 m and finite, found {0} m")]
    Tolerance(f64),
    /// The triangulation broke down.
    #[error("near-optimal mesh: tile at sample {at:?}: {what}")]
    Tile {
        /// The tile's first sample.
        at: [u32; 2],
        /// Description of the fault.
        what: String,
    },
}

/// The greedy Delaunay mesh within `tolerance_m` metres.
pub fn greedy(field: &Field, tolerance_m: f64) -> Result<Mesh, Error> {
    check(tolerance_m)?;
    let [columns, rows] = field.size().map(|n| seams(n - 1));
    let tiles: Vec<Tile> = rows
        .array_windows()
        .flat_map(|&[north, south]| columns.array_windows().map(move |&[west, east]| [[west, north], [east, south]]))
        .map(|[first, last]| Tile { field, first, last })
        .collect();
    let meshes = tiles.par_iter().map(|tile| tile.greedy(tolerance_m)).collect::<Result<Vec<_>, _>>()?;
    Ok(Mesh {
        triangles: meshes.iter().map(|mesh| mesh.0).sum(),
        max_error_m: meshes.iter().map(|mesh| mesh.1).fold(0.0, f64::max),
        tiles: [columns, rows].map(|seams| seams.len() as u32 - 1),
    })
}

/// The coarsest mesh of right triangles within `tolerance_m` metres.
pub fn rtin(field: &Field, tolerance_m: f64) -> Result<Mesh, Error> {
    check(tolerance_m)?;
    let whole = field.clone().without_holes();
    let (triangles, max_error_m) = rtin::coarsest(&whole, tolerance_m);
    Ok(Mesh { triangles, max_error_m, tiles: [1, 1] })
}

fn check(tolerance_m: f64) -> Result<(), Error> {
    let allowed = tolerance_m.is_finite() && tolerance_m > 0.0;
    if allowed { Ok(()) } else { Err(Error::Tolerance(tolerance_m)) }
}

/// Returns the cuts of a side with this many cells: even pieces of at most [`TILE`] cells.
fn seams(cells: u32) -> Vec<u32> {
    let pieces = cells.div_ceil(TILE);
    (0..=pieces).map(|k| (u64::from(cells) * u64::from(k) / u64::from(pieces)) as u32).collect()
}

/// A rectangle of samples, both ends inclusive.
struct Tile<'a> {
    field: &'a Field,
    first: [u32; 2],
    last: [u32; 2],
}

impl Tile<'_> {
    fn size(&self) -> [usize; 2] {
        [0, 1].map(|k| (self.last[k] - self.first[k]) as usize + 1)
    }

    /// Triangles and their true largest error. The triangulation's own error is checked and never trusted: a
    /// lower one is asked for until the true one is low enough.
    fn greedy(&self, tolerance_m: f64) -> Result<(u64, f64), Error> {
        let (whole, [width, height]) = (self.filled(), self.size());
        let heights: Vec<f64> = (0..width * height).map(|k| f64::from(whole.samples().height(k))).collect();
        let failed = |what: String| Error::Tile { at: self.first, what };
        let mut asked_m = tolerance_m;
        loop {
            let (points, triangles) = delatin::triangulate(&heights, (width, height), delatin::Error(asked_m))
                .map_err(|error| failed(error.to_string()))?;
            let corner = |k: usize| {
                let (x, z) = points[k];
                Corner { x: x as i32, z: z as i32, y: whole.height(x as u32, z as u32) }
            };
            let mesh: Vec<Triangle> = triangles.iter().map(|&(a, b, c)| [a, b, c].map(corner)).collect();
            let true_m = true_error(&whole, &mesh).ok_or_else(|| failed("the mesh does not cover it once".into()))?;
            if true_m <= tolerance_m {
                return Ok((mesh.len() as u64, true_m));
            }
            asked_m *= 0.999 * tolerance_m / true_m;
        }
    }

    /// The samples as a field of their own, without holes.
    fn filled(&self) -> Field {
        let size = [0, 1].map(|k| self.last[k] - self.first[k] + 1);
        let mut heights = Vec::new();
        self.field.read(&Block { first: self.first, last: self.last, step: 1 }, &mut heights);
        let holes = Holes::none((size[0] * size[1]) as usize);
        Field::new(Samples::F32(heights), size, self.field.spacing, holes)
    }
}

/// The largest vertical error of a mesh, metres; `None` if it does not cover the field once, which it does if its
/// triangles are turned one way and their areas add up to the field's.
fn true_error(field: &Field, mesh: &[Triangle]) -> Option<f64> {
    let areas: Vec<i64> = mesh.iter().map(surface::doubled_area).collect();
    let cells: i64 = field.size().iter().map(|&n| i64::from(n) - 1).product();
    let one_way = areas.iter().all(|&area| area > 0) || areas.iter().all(|&area| area < 0);
    let covered = one_way && areas.iter().sum::<i64>().abs() == 2 * cells;
    let errors = mesh.iter().map(|triangle| surface::deviation(field, &facing_up(triangle)));
    covered.then(|| errors.map(f64::from).fold(0.0, f64::max))
}

#[cfg(test)]
mod tests;
