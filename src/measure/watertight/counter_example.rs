//! Refutations of a proof.

use crate::draw::expand::Drawn;
use crate::height::surface::Triangle;

/// Kind of fault of a surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Kind {
    /// A corner lies outside the field.
    Outside,
    /// A triangle faces down.
    Fold,
    /// One vertex has two heights.
    Crack,
    /// Land is covered more than once.
    Overlap,
    /// A vertex of one triangle lies inside an edge of another.
    TJunction,
    /// Terrain with data, perhaps in view, is not covered.
    Gap,
    /// One edge lies above another, and no skirt hides what is between them.
    Seam,
}

/// The fewest triangles that show what is wrong.
#[derive(Clone, Debug, PartialEq)]
pub struct CounterExample {
    /// Description of the fault.
    pub kind: Kind,
    /// The triangles at fault, as they were given; for a gap the samples' one that is missing.
    pub triangles: Vec<Triangle>,
    /// Description of the fault and its place.
    pub text: String,
}

impl std::fmt::Display for CounterExample {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        write!(f, "{:?}: {}", self.kind, self.text)?;
        self.triangles.iter().try_for_each(|[a, b, c]| {
            write!(f, "; ({}, {}, {}) ({}, {}, {}) ({}, {}, {})", a.x, a.z, a.y, b.x, b.z, b.y, c.x, c.z, c.y)
        })
    }
}

impl std::error::Error for CounterExample {}

/// A refutation by some of the triangles.
pub(super) fn refuted<T>(
    kind: Kind,
    triangles: &[Drawn],
    guilty: impl IntoIterator<Item = u32>,
    text: String,
) -> Result<T, Box<CounterExample>> {
    let guilty: Vec<&Drawn> = guilty.into_iter().map(|k| &triangles[k as usize]).collect();
    let instances: Vec<_> = guilty.iter().map(|t| t.instance.to_string()).collect();
    let text = format!("{text} (instances {})", instances.join(", "));
    Err(Box::new(CounterExample { kind, triangles: guilty.iter().map(|t| t.corners).collect(), text }))
}
