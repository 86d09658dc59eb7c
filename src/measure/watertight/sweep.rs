//! Sweeps from north to south over the bands between adjacent rows of samples. No vertex of the border lies inside a
//! band, so the border consists of straight lines there, which bound trapezoids of covered terrain.

use std::cmp::Ordering;
use std::ops::Range;

use rayon::prelude::*;

use super::counter_example::{CounterExample, Kind, refuted};
use super::edges::BorderEdge;
use crate::draw::expand::Drawn;
use crate::height::surface::{Corner, is_terrain};
use crate::height::{Field, rtin};
use crate::view::{Aabb, Containment, Frustum};

/// A trapezoid of covered terrain in one band.
#[derive(Clone, Copy, Debug)]
pub struct Strip {
    /// The band, between rows `band` and `band + 1`.
    pub band: i32,
    west: Line,
    east: Line,
}

/// A line in a band, by the columns at which it meets the northern and the southern row.
type Line = [Fraction; 2];

/// An exact rational number.
#[derive(Clone, Copy, Debug)]
struct Fraction {
    numerator: i64,
    /// Positive.
    denominator: i64,
}

impl Fraction {
    fn floor(self) -> i64 {
        self.numerator.div_euclid(self.denominator)
    }

    fn ceil(self) -> i64 {
        -(-self.numerator).div_euclid(self.denominator)
    }
}

impl From<i32> for Fraction {
    fn from(n: i32) -> Self {
        Self { numerator: n.into(), denominator: 1 }
    }
}

impl Ord for Fraction {
    fn cmp(&self, other: &Self) -> Ordering {
        let product = |a: &Self, b: &Self| i128::from(a.numerator) * i128::from(b.denominator);
        product(self, other).cmp(&product(other, self))
    }
}

impl PartialOrd for Fraction {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Fraction {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Fraction {}

/// The part of a border edge in one band.
#[derive(Clone, Copy)]
struct Crossing {
    band: i32,
    line: Line,
    /// True if covered terrain lies to its east.
    enters: bool,
    triangle: u32,
}

/// Divides the terrain inside a border into strips, sorted by band and from west to east.
///
/// # Errors
/// If terrain is covered twice: border lines cross, or two in a row have covered terrain to the same side.
pub fn strips(triangles: &[Drawn], border: &[BorderEdge]) -> Result<Vec<Strip>, Box<CounterExample>> {
    let mut crossings: Vec<Crossing> = border.iter().flat_map(crossings).collect();
    crossings.par_sort_unstable_by_key(|c| (c.band, c.line, !c.enters, c.triangle));
    let mut strips = Vec::with_capacity(crossings.len() / 2);
    let refute = |a: &Crossing, b: &Crossing| {
        let text = format!("land covered twice between rows {} and {}", a.band, a.band + 1);
        refuted(Kind::Overlap, triangles, [a.triangle, b.triangle], text)
    };
    for crossings in crossings.chunk_by(|a, b| a.band == b.band) {
        if let Some([a, b]) = crossings.array_windows().find(|[a, b]| a.line[1] > b.line[1]) {
            return refute(a, b);
        }
        for pair in crossings.chunks(2) {
            match pair {
                [west, east] if west.enters && !east.enters => {
                    strips.push(Strip { band: west.band, west: west.line, east: east.line });
                }
                _ => return refute(&pair[0], &pair[pair.len() - 1]),
            }
        }
    }
    Ok(strips)
}

/// Returns the parts of a border edge in each band; none if it runs along a row.
fn crossings(edge: &BorderEdge) -> impl Iterator<Item = Crossing> + use<> {
    let &BorderEdge { from, to, triangle } = edge;
    let (north, south) = if from[1] < to[1] { (from, to) } else { (to, from) };
    let denominator = i64::from(south[1] - north[1]);
    let at = move |z: i32| Fraction {
        numerator: i64::from(north[0]) * denominator + i64::from(south[0] - north[0]) * i64::from(z - north[1]),
        denominator,
    };
    let enters = from[1] < to[1];
    (north[1]..south[1]).map(move |band| Crossing { band, line: [at(band), at(band + 1)], enters, triangle })
}

/// Number of adjacent cells that are tested for visibility together, before each of them is.
const RUN: i32 = 64;

/// Proves that all terrain with data that may be in view is covered by the strips, which are sorted by band.
///
/// # Errors
/// If some is not; the error has a missing triangle of the samples' surface.
pub fn no_gap(field: &Field, frustum: &Frustum, strips: &[Strip]) -> Result<(), Box<CounterExample>> {
    let bands = 0..field.size()[1] as i32 - 1;
    let missing = bands.into_par_iter().find_map_first(|band| {
        let first = strips.partition_point(|s| s.band < band);
        let strips = &strips[first..first + strips[first..].partition_point(|s| s.band == band)];
        let shows = |t: &[[i32; 2]; 3]| {
            is_terrain(field, t) && !strips.iter().any(|s| s.contains(t)) && may_be_seen(field, frustum, *t)
        };
        open_runs(field, strips).find_map(|run| {
            let samples = (run.start..=run.end).flat_map(|x| [[x, band], [x, band + 1]]);
            let mut cells = run.flat_map(|i| rtin::cell(i, band));
            may_be_seen(field, frustum, samples).then(|| cells.find(shows)).flatten()
        })
    });
    let Some(triangle) = missing else { return Ok(()) };
    let text = format!("terrain at {triangle:?} is neither covered nor out of view");
    let corners = triangle.map(|[x, z]| Corner { x, z, y: field.height(x as u32, z as u32) });
    Err(Box::new(CounterExample { kind: Kind::Gap, triangles: vec![corners], text }))
}

/// Returns the cells of a band that are not wholly inside one of its strips, in ranges of at most [`RUN`] cells.
fn open_runs(field: &Field, strips: &[Strip]) -> impl Iterator<Item = Range<i32>> {
    let last = field.size()[0] as i32 - 1;
    let ends = strips.iter().map(Strip::whole_cells).chain([(last, last)]);
    let gaps = ends.scan(0, |next, (first, end)| {
        let gap = *next..first;
        *next = end.max(*next);
        Some(gap)
    });
    gaps.flat_map(|gap| gap.clone().step_by(RUN as usize).map(move |first| first..(first + RUN).min(gap.end)))
}

impl Strip {
    /// Returns the range of cells that lie wholly inside.
    fn whole_cells(&self) -> (i32, i32) {
        let [west, east] = [self.west[0].max(self.west[1]).ceil(), self.east[0].min(self.east[1]).floor()];
        (west as i32, east.max(west) as i32)
    }

    /// Returns true if a triangle with corners on the band's two rows lies inside. As strips are convex, it suffices to
    /// test the corners.
    fn contains(&self, triangle: &[[i32; 2]; 3]) -> bool {
        triangle.iter().all(|&[x, z]| {
            let row = (z - self.band) as usize;
            self.west[row] <= x.into() && self.east[row] >= x.into()
        })
    }
}

/// Returns true if the bounding box of some samples is at least partly inside the frustum.
fn may_be_seen(field: &Field, frustum: &Frustum, samples: impl IntoIterator<Item = [i32; 2]>) -> bool {
    let points = samples.into_iter().map(|[x, z]| field.world(x as u32, z as u32));
    let bounds = points.map(|p| Aabb { min: p, max: p }).reduce(|a, b| a.union(&b));
    bounds.is_some_and(|bounds| frustum.contains(&bounds) != Containment::Outside)
}
