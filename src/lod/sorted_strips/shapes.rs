//! Triangles of each quad that a strip may contain, and their order of visibility.
//!
//! In the diagrams the walk goes to the right, with the front at the bottom. A quad's front edge has no middle,
//! whatever follows in front of it. Its back edge has the vertices of the front edges behind it; its sides have those
//! of finer quads beside it.
//!
//! ```text
//!  a───────b   a───e───b   a───────────────b   a───────b   a───────b      a ──▸ minor direction
//!  │     ╱ │   │  ╱  ╱ │   │ ╲           ╱ │   │     ╱ │   │   ╱ ╱ │      │
//!  │   ╱   │   │ ╱ ╱   │   │    ╲     ╱    │   │   ╱ ╱ g   f ╱ ╱   │      ▾
//!  │ ╱     │   │╱╱     │   │       ╲╱      │   │ ╱ ╱   │   │ ╱     │      major direction
//!  d───────c   d───────c   d───────m───────c   d───────c   d───────c
//!   A  plain    B  finer    C  coarser behind:  D  finer    E  finer
//!                 behind       two advances        ahead      behind us: merging
//! ```
//!
//! Every shape keeps A's diagonal, which is that of [`rtin`](crate::height::rtin) at the quad's level. A middle on a
//! triangle's side bisects the triangle towards the opposite corner. If the middle lies exactly on the straight side,
//! the surface does not change. C's lines meet where the diagonals of its two quads do. B, D and E are combined where a
//! quad has finer ones on two or three sides, wherever a border between two levels turns a corner.

/// Vertex slots of a quad: corners, middles of three sides, and the middle of the front edge of C.
pub mod slot {
    /// Trailing corner behind.
    pub const A: usize = 0;
    /// Leading corner behind.
    pub const B: usize = 1;
    /// Leading corner in front.
    pub const C: usize = 2;
    /// Trailing corner in front.
    pub const D: usize = 3;
    /// Middle of the back edge.
    pub const E: usize = 4;
    /// Middle of the trailing side.
    pub const F: usize = 5;
    /// Middle of the leading side.
    pub const G: usize = 6;
    /// Middle of the front edge.
    pub const M: usize = 7;
}
use slot::{A, B, C, D, E, F, G, M};

/// Bit of a quad whose back edge has a middle.
pub const BACK: usize = 1;
/// Bit of a quad whose trailing side has a middle.
pub const TRAILING: usize = 2;
/// Bit of a quad whose leading side has a middle.
pub const LEADING: usize = 4;

/// Number of combinations of middles.
const MASKS: usize = 8;

/// Positions of the slots, (along the strip, forward).
pub type Places = [[f64; 2]; 8];

/// Positions of a quad's slots, in half sides.
const PLACES: Places = [[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0], [1.0, 0.0], [0.0, 1.0], [2.0, 1.0], [1.0, 2.0]];
/// Positions of C's slots, in half sides of its two finer halves.
const PAIR_PLACES: Places =
    [[0.0, 0.0], [4.0, 0.0], [4.0, 2.0], [0.0, 2.0], [0.0, 0.0], [0.0, 0.0], [0.0, 0.0], [2.0, 2.0]];

/// One kind of quad.
#[derive(Clone, Debug)]
pub struct Shape {
    /// Triangles as vertex slots. They face up if x is along the strip and z forward.
    pub triangles: Vec<[usize; 3]>,
    /// Positions of the slots, in half sides.
    pub places: &'static Places,
    /// Pairs of adjacent triangles with the line between them; the first triangle is on the side where [`side`] is
    /// positive.
    seams: Vec<Seam>,
}

#[derive(Clone, Copy, Debug)]
struct Seam {
    first: usize,
    second: usize,
    line: [usize; 2],
}

/// All kinds of quads.
pub struct Shapes {
    /// By combination of middles, with one diagonal and then with the other.
    single: Vec<Shape>,
    pair: Shape,
}

impl Default for Shapes {
    fn default() -> Self {
        let shape = |k: usize| Shape::new(triangles(k % MASKS, k >= MASKS), &PLACES);
        let pair = Shape::new(vec![[A, M, D], [A, B, M], [M, B, C]], &PAIR_PLACES);
        Self { single: (0..2 * MASKS).map(shape).collect(), pair }
    }
}

impl Shapes {
    /// Returns the quad with these middles. With `rising` its diagonal is from B to D, otherwise from A to C.
    #[inline]
    pub fn single(&self, middles: usize, rising: bool) -> &Shape {
        &self.single[middles + if rising { MASKS } else { 0 }]
    }

    /// Returns two adjacent quads that match one coarser front edge.
    #[inline]
    pub fn pair(&self) -> &Shape {
        &self.pair
    }

    /// Returns all quads with one of the diagonals.
    pub fn singles(&self, rising: bool) -> &[Shape] {
        let first = if rising { MASKS } else { 0 };
        &self.single[first..first + MASKS]
    }
}

/// Returns the two triangles of a plain quad, each bisected from a middle on its side to the opposite corner.
fn triangles(middles: usize, rising: bool) -> Vec<[usize; 3]> {
    let middle = |bit: usize, slot: usize| (middles & bit != 0).then_some(slot);
    let [e, f, g] = [middle(BACK, E), middle(TRAILING, F), middle(LEADING, G)];
    match rising {
        false => [bisected([A, B, C], e, g), bisected([C, D, A], None, f)].concat(),
        true => [bisected([D, A, B], f, e), bisected([B, C, D], g, None)].concat(),
    }
}

/// Returns a triangle bisected at optional middles of its first and its second side.
fn bisected([p, q, r]: [usize; 3], first: Option<usize>, second: Option<usize>) -> Vec<[usize; 3]> {
    match (first, second) {
        (None, None) => vec![[p, q, r]],
        (Some(m), None) => vec![[p, m, r], [m, q, r]],
        (None, Some(n)) => vec![[p, q, n], [p, n, r]],
        (Some(m), Some(n)) => vec![[m, q, n], [p, m, n], [p, n, r]],
    }
}

impl Shape {
    fn new(triangles: Vec<[usize; 3]>, places: &'static Places) -> Self {
        let at = |slot: usize| places[slot];
        let upward = |t: [usize; 3]| if side([at(t[0]), at(t[1])], at(t[2])) > 0.0 { [t[0], t[2], t[1]] } else { t };
        let triangles: Vec<_> = triangles.into_iter().map(upward).collect();
        let mut seams = Vec::new();
        for second in 0..triangles.len() {
            for first in 0..second {
                let shared: Vec<_> = triangles[first].into_iter().filter(|k| triangles[second].contains(k)).collect();
                if let [from, to] = shared[..] {
                    let apex = triangles[first].into_iter().find(|k| !shared.contains(k)).map_or([0.0; 2], at);
                    let is_positive = side([at(from), at(to)], apex) > 0.0;
                    seams.push(Seam { first, second, line: if is_positive { [from, to] } else { [to, from] } });
                }
            }
        }
        Self { triangles, places, seams }
    }

    /// Returns a triangle's corners, in half sides.
    pub fn corners(&self, triangle: [usize; 3]) -> [[i32; 2]; 3] {
        triangle.map(|slot| self.places[slot].map(|n| n as i32))
    }

    /// Calls `visit` for each triangle, nearest first along every ray from `eye`, with the slots at `places`. Of two
    /// adjacent triangles, the one on the eye's side of the line between them comes first.
    #[inline]
    pub fn visit_in_order(&self, places: &Places, eye: [f64; 2], mut visit: impl FnMut([usize; 3])) {
        let in_order = |seam: &Seam| {
            let first_is_nearer = side(seam.line.map(|slot| places[slot]), eye) >= 0.0;
            if first_is_nearer { [seam.first, seam.second] } else { [seam.second, seam.first] }
        };
        // Fast path for plain quads, the most frequent kind.
        if let [seam] = &self.seams[..] {
            return in_order(seam).into_iter().for_each(|k| visit(self.triangles[k]));
        }
        let mut behind = [0u8; 5];
        for [near, far] in self.seams.iter().map(in_order) {
            behind[far] |= 1 << near;
        }
        // Triangles and seams form a tree, so each round has a triangle with nothing left in front of it.
        let mut pending = (1u8 << self.triangles.len()) - 1;
        while pending != 0 {
            for (k, triangle) in self.triangles.iter().enumerate() {
                if pending >> k & 1 == 1 && behind[k] & pending == 0 {
                    visit(*triangle);
                    pending &= !(1 << k);
                }
            }
        }
    }
}

/// Returns the signed area that is positive on one side of a line and negative on the other.
#[inline]
fn side([from, to]: [[f64; 2]; 2], point: [f64; 2]) -> f64 {
    (to[0] - from[0]) * (point[1] - from[1]) - (to[1] - from[1]) * (point[0] - from[0])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn doubled_area(corners: [[i32; 2]; 3]) -> i32 {
        let [a, b, c] = corners;
        (b[1] - a[1]) * (c[0] - a[0]) - (b[0] - a[0]) * (c[1] - a[1])
    }

    fn all() -> Vec<Shape> {
        let shapes = Shapes::default();
        [shapes.singles(false), shapes.singles(true), std::slice::from_ref(shapes.pair())].concat()
    }

    #[test]
    fn each_shape_faces_up_and_fills_its_quad() {
        for (k, shape) in all().iter().enumerate() {
            let areas: Vec<_> = shape.triangles.iter().map(|&t| doubled_area(shape.corners(t))).collect();
            assert!(areas.iter().all(|area| *area > 0), "{k}: {areas:?}");
            assert_eq!(areas.iter().sum::<i32>(), if k < 2 * MASKS { 8 } else { 16 }, "{k}");
            assert_eq!(shape.seams.len(), shape.triangles.len() - 1, "{k}: triangles in a tree");
        }
    }

    #[test]
    fn shapes_have_exactly_their_middles() {
        let shapes = Shapes::default();
        for (middles, rising) in (0..MASKS).flat_map(|k| [(k, false), (k, true)]) {
            // The surface does not change if middles lie on straight sides.
            let plain: Vec<_> = shapes.single(0, rising).triangles.clone();
            let holds = |plain: &[usize; 3], triangle: &[usize; 3]| {
                let corners = plain.map(|slot| PLACES[slot]);
                triangle.iter().all(|&p| (0..3).all(|k| side([corners[k], corners[(k + 1) % 3]], PLACES[p]) <= 0.0))
            };
            let inner = &shapes.single(middles, rising).triangles;
            assert!(inner.iter().all(|t| plain.iter().any(|p| holds(p, t))), "{middles} {rising}");
            let triangles = &shapes.single(middles, rising).triangles;
            for (slot, bit) in [(E, BACK), (F, TRAILING), (G, LEADING), (M, 0)] {
                assert_eq!(triangles.as_flattened().contains(&slot), middles & bit != 0, "{middles} slot {slot}");
            }
        }
    }

    /// Along rays from random eyes, triangles are met in the order of the visits.
    #[test]
    fn triangles_come_nearest_first() {
        for shape in all() {
            for k in 0..4000 {
                let random = |n: u32| f64::from((k * 4 + n).wrapping_mul(0x9e37_79b1) >> 8) / f64::from(1 << 24);
                let eye = [random(0) * 12.0 - 5.0, random(1) * 12.0 - 5.0];
                let towards = [random(2) * 4.0 - eye[0], random(3) * 2.0 - eye[1]];
                let mut distances = Vec::new();
                shape.visit_in_order(shape.places, eye, |triangle| {
                    let corners = shape.corners(triangle).map(|p| p.map(f64::from));
                    let steps = (0..600).map(|n| f64::from(n) / 200.0);
                    let inside = |t: &f64| {
                        let p = [eye[0] + t * towards[0], eye[1] + t * towards[1]];
                        (0..3).all(|n| side([corners[n], corners[(n + 1) % 3]], p) < -1e-9)
                    };
                    distances.extend(steps.clone().find(inside));
                });
                assert!(distances.is_sorted(), "{:?} from {eye:?}: {distances:?}", shape.triangles);
            }
        }
    }
}
