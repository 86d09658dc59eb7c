//! The position and the units of a raster, from its file and from the small files beside it.
//!
//! Priority is GDAL's: `.aux.xml`, then the file itself, then a world file and `.prj`.

use super::decoded::Decoded;
use super::input::Input;
use super::options::Options;
use super::{metadata, world_file};
use crate::height::georef::affine::{Affine, Turn};
use crate::height::georef::crs::Crs;
use crate::height::georef::place::Place;
use crate::height::georef::unit::Unit;
use crate::height::georef::{crs_text, units};

/// Settles the place, the turn, the scale and the unit of a raster.
pub(super) fn settle(input: &Input, options: &Options, raster: &mut Decoded) {
    let stated = std::mem::take(&mut raster.georeference);
    let beside = input
        .sibling_text("aux.xml")
        .map(|text| metadata::from_aux_xml(&text, options.band.unwrap_or(1)))
        .unwrap_or_default();
    let band = beside.or(stated.band);
    raster.warnings.extend(band.warnings);
    raster.nodata = band.nodata.map(|value| value * raster.step).or(raster.nodata);
    raster.scale = band.scale.unwrap_or(1.0);
    raster.offset = band.offset.unwrap_or(0.0);

    let named = [band.crs, stated.crs].into_iter().flatten().reduce(Crs::and);
    let crs = named.or_else(|| projection(input, raster)).unwrap_or_default();
    if let Some(affine) = band.affine.or(stated.affine).or_else(|| world(input, raster)) {
        lay(raster, affine, &crs);
    } else if let (Some(place), Some(unit)) = (&mut raster.place, crs.unit) {
        (place.unit, place.crs) = (unit, crs.name.clone());
    }
    settle_heights(raster, options, &crs, band.unit.as_deref());
}

/// Returns the transformation of a world file, if the format has no position of its own.
fn world(input: &Input, raster: &mut Decoded) -> Option<Affine> {
    if raster.place.is_some() {
        return None;
    }
    match world_file::beside(input)? {
        Ok(affine) => Some(affine),
        Err(warning) => {
            raster.warnings.push(warning);
            None
        }
    }
}

/// Returns the system of the `.prj` beside a file that names none.
fn projection(input: &Input, raster: &mut Decoded) -> Option<Crs> {
    if raster.place.is_some() {
        return None;
    }
    let text = input.sibling_text("prj")?;
    let crs = crs_text::from_text(&text);
    if crs.is_none() {
        raster.warnings.push(".prj: expected well-known text or an EPSG code, found neither; ignored".to_owned());
    }
    crs
}

/// Lays the raster north up at its coordinates.
fn lay(raster: &mut Decoded, affine: Affine, crs: &Crs) {
    let Some(laid) = affine.laid(raster.size) else {
        raster.warnings.push("the georeference is degenerate and ignored".to_owned());
        return;
    };
    if laid.rotation != 0.0 {
        let angle = laid.rotation;
        raster.warnings.push(format!(
            "the grid is rotated by {angle:.3} degrees against its axes: it is shown unrotated about its centre"
        ));
    }
    let Turn { transposed, .. } = laid.turn;
    let size = if transposed { [raster.size[1], raster.size[0]] } else { raster.size };
    raster.turn = laid.turn;
    let (origin, step) = laid.grid;
    raster.place = Some(match crs.unit {
        Some(unit) => Place { origin, step, unit, crs: crs.name.clone() },
        None => {
            let (place, warning) = Place::guessed(laid.grid, size);
            raster.warnings.push(warning);
            place
        }
    });
}

/// Sets metres per unit of height: from the band, else from the vertical system. Else it is metres, with a warning if the
/// horizontal unit makes another one likely.
fn settle_heights(raster: &mut Decoded, options: &Options, crs: &Crs, band_unit: Option<&str>) {
    let by_band = band_unit.and_then(units::named_length);
    if let (Some(name), None) = (band_unit, by_band) {
        raster.warnings.push(format!("band unit: expected a length, found {name:?}; taken as metres (--height-scale)"));
    }
    if let (Some(band), Some(vertical)) = (by_band, crs.height_unit)
        && (band / vertical - 1.0).abs() > 1e-9
    {
        raster.warnings.push(format!(
            "the unit of heights is {band} m by the band and {vertical} m by the vertical system: the band's is taken"
        ));
    }
    if crs.is_depth {
        raster.warnings.push(
            "the vertical system counts depths, positive down: they are shown as heights (--height-scale -1)"
                .to_owned(),
        );
    }
    match by_band.or(crs.height_unit) {
        Some(metres) => raster.unit = metres,
        None if band_unit.is_none() && options.height_scale.is_none() => {
            if let Some(Place { unit: Unit::Metres(metres), .. }) = raster.place
                && metres < 0.95
            {
                raster.warnings.push(format!(
                    "nothing states the unit of heights, and a unit of distance is {metres:.6} m: heights are taken as \
                     metres (--height-scale {metres:.6} takes them in that unit)"
                ));
            }
        }
        None => (),
    }
}
