//! Georeferencing: a file's coordinates turned into metres.

pub(super) mod affine;
pub(super) mod crs;
pub(super) mod crs_text;
pub(super) mod ellipsoid;
pub(super) mod epsg;
pub(super) mod extent;
pub(super) mod mercator;
pub(super) mod place;
pub(super) mod registry;
pub(super) mod unit;
pub(super) mod units;
pub(super) mod wkt;

pub use ellipsoid::metres_per_degree;
pub use place::Place;
pub use unit::Unit;
