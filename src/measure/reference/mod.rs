//! Near-optimal reference meshes: about how few triangles approximate a whole field within a vertical error.
//!
//! Two meshes are refined until their largest vertical error over all samples ([`surface::deviation`]) is within the
//! given one:
//!
//! - *greedy*: a Delaunay triangulation to which the sample with the largest error is added repeatedly. This is the
//!   greedy insertion of M. Garland and P. S. Heckbert, "Fast Polygonal Approximation of Terrains and Height Fields"
//!   (1995).
//! - *RTIN*: the coarsest conforming mesh in the hierarchy of right triangles of W. Evans, D. Kirkpatrick and
//!   G. Townsend, "Right-Triangulated Irregular Networks" (2001). It uses true errors instead of estimates
//!   (`reference/rtin.rs`), and is the best that any technique on this hierarchy could do.
//!
//! Both meshes cover the whole rectangle, with holes filled. A field of more than [`TILE`] cells a side is triangulated
//! greedily in separate tiles. The triangles at the seams then increase the number by a few per cent, as tests measure.

mod rtin;

use rayon::prelude::*;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{extended, facing_up};
use crate::height::surface::{self, Corner, Triangle};
use crate::height::{Block, Field, Holes, Samples};

/// Largest number of cells along a side of a tile.
pub const TILE: u32 = 1024;

/// Near-optimal meshes of a whole field within a vertical error, and comparison of a technique with them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(transform = extended::non_negative)]
pub struct Reference {
    /// Largest vertical error of both meshes, metres.
    pub error_m: f64,
    /// Triangles of the greedy Delaunay mesh.
    pub delaunay: Option<u64>,
    /// Triangles of the coarsest mesh of right triangles (RTIN).
    pub rtin: Option<u64>,
    /// The technique's triangles in view, divided by those of the greedy mesh in view (estimated by the share of
    /// samples in view).
    pub multiple: Option<f64>,
}

/// Size and error of a mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mesh {
    /// Number of triangles.
    pub triangles: u64,
    /// Largest vertical error at a sample, metres.
    pub max_error_m: f64,
    /// Number of tiles along (x, z) that were triangulated separately.
    pub tiles: [u32; 2],
}

/// Reason why a mesh cannot be built.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Error {
    /// The given error, metres, is not positive and finite.
    #[error("near-optimal mesh: vertical error: expected more than 0 m and finite, found {0} m")]
    Tolerance(f64),
    /// The triangulation of a tile failed.
    #[error("near-optimal mesh: tile at sample {at:?}: {what}")]
    Tile {
        /// First sample of the tile (x, z).
        at: [u32; 2],
        /// Description of the failure.
        what: String,
    },
}

/// Builds the greedy Delaunay mesh within a vertical error of `tolerance_m` metres.
///
/// # Errors
/// If the error is not positive and finite, or the triangulation fails.
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

/// Builds the coarsest mesh of right triangles within a vertical error of `tolerance_m` metres.
///
/// # Errors
/// If the error is not positive and finite.
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

/// Divides a side of this many cells evenly into tiles of at most [`TILE`] cells. Returns their ends.
fn seams(cells: u32) -> Vec<u32> {
    let pieces = cells.div_ceil(TILE);
    (0..=pieces).map(|k| (u64::from(cells) * u64::from(k) / u64::from(pieces)) as u32).collect()
}

/// A rectangle of samples (x, z), both ends inclusive.
struct Tile<'a> {
    field: &'a Field,
    first: [u32; 2],
    last: [u32; 2],
}

impl Tile<'_> {
    fn size(&self) -> [usize; 2] {
        [0, 1].map(|k| (self.last[k] - self.first[k]) as usize + 1)
    }

    /// Triangulates the tile. Returns the number of triangles and their largest vertical error, metres. The error of
    /// the result is measured, and if it is too large, the triangulation is repeated with a smaller one.
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

    /// Returns the tile as a field with its holes filled.
    fn filled(&self) -> Field {
        let size = [0, 1].map(|k| self.last[k] - self.first[k] + 1);
        let mut heights = Vec::new();
        self.field.read(&Block { first: self.first, last: self.last, step: 1 }, &mut heights);
        let holes = Holes::none((size[0] * size[1]) as usize);
        Field::new(Samples::F32(heights), size, self.field.spacing, holes)
    }
}

/// Returns the largest vertical error of a mesh, metres; `None` if it does not cover the field exactly once. For that,
/// all triangles must have the same winding, and the sum of their areas must be that of the field.
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
