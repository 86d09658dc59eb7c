//! Reads the overlay, a picture draped over the terrain, and finds its position on the field.

use std::path::Path;

use anyhow::{Context, Result, bail};
use image::ImageDecoder;

use super::common::Common;
use super::report;
use crate::height::{Error, Field, Footprint, Located, Place, demo, place_of};
use crate::texture::drape::Drape;

/// Largest number of texels of a picture.
const MAX_TEXELS: u64 = 1 << 30;

/// A picture with north up, and its position as stated by its file.
pub struct Picture {
    /// The texels.
    pub image: image::RgbaImage,
    file: String,
    located: Located,
}

impl Picture {
    /// Reads a picture of any format that is supported for overlays, with at most 2^30 texels.
    ///
    /// # Errors
    /// If the file cannot be read, is not a picture, or is too large.
    pub fn read(path: &str) -> Result<Self> {
        let fail = |e: &dyn std::fmt::Display| Error::new(path, "picture", e);
        // Opening a named pipe would block until a process writes to it.
        if !std::fs::metadata(path).map_err(|e| fail(&e))?.is_file() {
            return Err(fail(&"expected a file, found a folder or a device").into());
        }
        let reader =
            image::ImageReader::open(path).map_err(|e| fail(&e))?.with_guessed_format().map_err(|e| fail(&e))?;
        let mut decoder = reader.into_decoder().map_err(|e| fail(&e))?;
        let (width, height) = decoder.dimensions();
        if u64::from(width) * u64::from(height) > MAX_TEXELS {
            return Err(fail(&format!("expected at most 2^30 texels, found {width}x{height}")).into());
        }
        // The number of texels was checked above, so the decoder needs no limit of its own.
        decoder.set_limits(image::Limits::no_limits()).map_err(|e| fail(&e))?;
        let mut image = image::DynamicImage::from_decoder(decoder).map_err(|e| fail(&e))?.into_rgba8();
        let located = place_of(Path::new(path), [width, height])?;
        if located.transposed {
            image = image::imageops::rotate90(&image);
            image::imageops::flip_horizontal_in_place(&mut image);
        }
        if located.flip[0] {
            image::imageops::flip_horizontal_in_place(&mut image);
        }
        if located.flip[1] {
            image::imageops::flip_vertical_in_place(&mut image);
        }
        Ok(Self { image, file: path.to_string(), located })
    }

    /// Returns the overlay of the embedded terrain `demo`.
    pub fn demo() -> Result<Self> {
        let image = image::load_from_memory(demo::OVERLAY).context("the embedded overlay")?.into_rgba8();
        Ok(Self { image, file: "demo".to_string(), located: Located::default() })
    }

    /// Returns the position of the picture on a field, and prints warnings about it. Without a position in both files,
    /// the picture is stretched over the whole terrain.
    ///
    /// # Errors
    /// If picture and field have different coordinate systems.
    pub fn drape(&self, common: &Common, field: &Field, footprint: &Footprint) -> Result<Drape> {
        let stretched = match footprint.whole {
            [0, _] | [_, 0] => Drape::over(field),
            whole => Drape::of_part(field, footprint.first, whole),
        };
        let warn = |text: &str| report::warn(common, &format!("{}: {text}", self.file));
        self.located.warnings.iter().for_each(|warning| warn(warning));
        let Some(own) = &self.located.place else { return Ok(stretched) };
        let Some(place) = &footprint.place else {
            warn("it has a position, but the terrain has none: it is stretched over the whole terrain");
            return Ok(stretched);
        };
        if let Some(text) = self.mismatch(own, place)? {
            warn(&text);
        }
        let drape = placed(own, self.image.dimensions().into(), place, field);
        let last = field.stored().map(|n| f64::from(n - 1));
        if (0..2).any(|k| drape.first[k] >= last[k] || drape.first[k] + drape.length[k] <= 0.0) {
            warn("it lies beside the terrain: nothing of it is visible");
        }
        Ok(drape)
    }

    /// Compares the coordinate systems of picture and terrain. Returns a warning if they have different names.
    ///
    /// # Errors
    /// If they have different EPSG codes.
    fn mismatch(&self, picture: &Place, terrain: &Place) -> Result<Option<String>> {
        // The vertical part of a compound system applies to the terrain alone.
        let horizontal = |place: &Place| place.crs.as_ref().map(|crs| crs.split('+').next().unwrap_or(crs).to_string());
        let (Some(own), Some(other)) = (horizontal(picture), horizontal(terrain)) else { return Ok(None) };
        let is_code = |crs: &str| crs.starts_with("EPSG:");
        match own == other {
            true => Ok(None),
            false if is_code(&own) && is_code(&other) => {
                bail!("{}: coordinate system: expected that of the terrain, {other}, found {own}", self.file)
            }
            false => {
                Ok(Some(format!("its coordinate system is named {own}, the terrain's {other}: assumed to be the same")))
            }
        }
    }
}

/// Returns the position of a picture on a field, in units of samples. Texels and samples lie at the centres of their
/// cells. `size` is the picture's, texels.
fn placed(picture: &Place, size: [u32; 2], terrain: &Place, field: &Field) -> Drape {
    let east = picture.origin[0] - picture.step[0] / 2.0 - terrain.origin[0];
    let south = terrain.origin[1] - (picture.origin[1] + picture.step[1] / 2.0);
    Drape {
        first: [east / terrain.step[0], south / terrain.step[1]],
        length: [0, 1].map(|k| f64::from(size[k]) * picture.step[k] / terrain.step[k]),
        period: Drape::period_of(field),
        ends: true,
    }
}
