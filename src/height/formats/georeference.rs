//! Statements of a raster's file about its position and its units.

use super::metadata::Metadata;
use crate::height::georef::affine::Affine;
use crate::height::georef::crs::Crs;

/// Statements of a file about position and units, before those of the files beside it.
#[derive(Clone, Debug, Default)]
pub(super) struct Georeference {
    /// Coordinates of samples.
    pub affine: Option<Affine>,
    /// The coordinate reference system.
    pub crs: Option<Crs>,
    /// Scale, offset, unit and nodata of the band.
    pub band: Metadata,
}
