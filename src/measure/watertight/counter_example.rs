//! Counter-examples: triangles that show why a surface is not watertight.

use crate::draw::expand::Drawn;
use crate::height::surface::Triangle;

/// Kind of fault of a surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Kind {
    /// A corner lies outside the field.
    Outside,
    /// A triangle faces down.
    Fold,
    /// A vertex has different heights in two triangles.
    Crack,
    /// Triangles overlap in plan view.
    Overlap,
    /// A vertex of one triangle lies inside an edge of another.
    TJunction,
    /// Terrain with data that may be in view is not covered.
    Gap,
    /// One edge lies above another, and no skirt covers the gap between them.
    Seam,
}

/// A fault of a surface, with the few triangles that show it.
#[derive(Clone, Debug, PartialEq)]
pub struct CounterExample {
    /// Kind of the fault.
    pub kind: Kind,
    /// The triangles at fault. For a gap, the triangle of the samples' surface that is missing.
    pub triangles: Vec<Triangle>,
    /// Description of the fault and its position.
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

/// Returns a counter-example with the triangles whose numbers are `guilty`.
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
