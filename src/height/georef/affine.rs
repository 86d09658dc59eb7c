//! The affine transformation from raster positions to coordinates, and the turn that lays a raster north up.

use super::place::Grid;

/// The largest part of a step that may point across its axis in an unrotated grid.
const ACROSS: f64 = 1e-6;

/// Coordinates (east, north) of sample (0, 0), and the steps to the next column and to the next row.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Affine {
    /// Coordinates of the centre of sample (0, 0).
    pub origin: [f64; 2],
    /// Step from one column to the next.
    pub column: [f64; 2],
    /// Step from one row to the next.
    pub row: [f64; 2],
}

/// The permutation of a file's samples that makes columns run east and rows run south.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Turn {
    /// Rows of the file become columns.
    pub transposed: bool,
    /// Columns and rows run backwards, after the transposition.
    pub flip: [bool; 2],
}

/// A raster laid north up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Laid {
    /// North-west sample and steps.
    pub grid: Grid,
    /// The turn that the samples take.
    pub turn: Turn,
    /// Angle that remains against the axes, degrees anticlockwise; 0 for a grid along them.
    pub rotation: f64,
}

impl Affine {
    /// A grid whose columns run east and whose rows run south.
    pub fn north_up((origin, [dx, dy]): Grid) -> Self {
        Self { origin, column: [dx, 0.0], row: [0.0, -dy] }
    }

    /// The same grid with the origin moved by a number of columns and rows.
    pub fn shifted(self, [columns, rows]: [f64; 2]) -> Self {
        let at = |k: usize| self.origin[k] + columns * self.column[k] + rows * self.row[k];
        Self { origin: [at(0), at(1)], ..self }
    }

    /// Lays a raster of `size` samples; `None` if the transformation is degenerate.
    ///
    /// Reflections and quarter turns are laid exactly. A rotated grid is laid unrotated about its centre.
    pub fn laid(self, size: [u32; 2]) -> Option<Laid> {
        let Self { origin, column, row } = self;
        let [along, across] = [(column[0] * row[1]).abs(), (column[1] * row[0]).abs()];
        let is_finite = [origin, column, row].as_flattened().iter().all(|n| n.is_finite());
        if !is_finite || along == across {
            return None;
        }
        let transposed = across > along;
        let (east, south, sides) = match transposed {
            true => (row, column, [size[1], size[0]]),
            false => (column, row, size),
        };
        let flip = [east[0] < 0.0, south[1] > 0.0];
        let last = sides.map(|n| f64::from(n - 1));
        let is_rotated = east[1].abs() > ACROSS * east[0].abs() || south[0].abs() > ACROSS * south[1].abs();
        let (origin, step, rotation) = if is_rotated {
            let centre = self.shifted(size.map(|n| f64::from(n - 1) / 2.0)).origin;
            let step = [east[0].hypot(east[1]), south[0].hypot(south[1])];
            let origin = [centre[0] - last[0] / 2.0 * step[0], centre[1] + last[1] / 2.0 * step[1]];
            (origin, step, (east[1] / east[0]).atan().to_degrees())
        } else {
            let first = |k: usize, step: f64| origin[k] + if flip[k] { last[k] * step } else { 0.0 };
            ([first(0, east[0]), first(1, south[1])], [east[0].abs(), south[1].abs()], 0.0)
        };
        Some(Laid { grid: (origin, step), turn: Turn { transposed, flip }, rotation })
    }
}
