//! Coordinate reference systems: units of coordinates and heights.

use super::unit::Unit;

/// The part of a coordinate reference system that placing a raster needs.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Crs {
    /// Unit of horizontal coordinates; `None` for a vertical system.
    pub unit: Option<Unit>,
    /// Metres a unit of height; `None` where no vertical unit is named.
    pub height_unit: Option<f64>,
    /// The vertical axis points down.
    pub is_depth: bool,
    /// Name or authority code of the horizontal system.
    pub name: Option<String>,
}

impl Crs {
    /// Joins a horizontal and a vertical system; the first that names a thing decides it.
    pub fn and(self, other: Self) -> Self {
        Self {
            unit: self.unit.or(other.unit),
            height_unit: self.height_unit.or(other.height_unit),
            is_depth: self.is_depth || other.is_depth,
            name: self.name.or(other.name),
        }
    }
}
