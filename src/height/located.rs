//! Where a field and a picture lie in their coordinate system, to lay one over the other.

use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use tiff::decoder::Decoder;

use super::georef::{self, Place, Unit};
use super::{geokeys, load};

/// The part of a file that a field is, and where that lies.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Footprint {
    /// Samples of the whole file (x, z).
    pub whole: [u32; 2],
    /// The field's first sample in it.
    pub first: [u32; 2],
    /// Where that sample lies, if the file says so.
    pub place: Option<Place>,
}

/// Where a picture lies.
#[derive(Clone, Debug, PartialEq)]
pub struct Located {
    /// Place of its north-west texel's centre once flipped, and length of a texel.
    pub place: Place,
    /// Whether the file's columns run west and its rows north.
    pub flip: [bool; 2],
    /// What the user should know, one sentence each.
    pub warnings: Vec<String>,
}

/// Reads where a picture of this size lies: from its GeoTIFF tags, or from the world file beside it and the projection
/// beside that. `None` if neither says so.
pub fn place_of(path: &Path, size: [u32; 2]) -> Option<Located> {
    from_tags(path, size).or_else(|| from_world_file(path, size))
}

fn from_tags(path: &Path, size: [u32; 2]) -> Option<Located> {
    let mut decoder = Decoder::new(BufReader::new(File::open(path).ok()?)).ok()?;
    let geokeys::Georeference { place, flip, warnings, .. } = geokeys::read(&mut decoder, size);
    Some(Located { place: place?, flip, warnings })
}

fn from_world_file(path: &Path, size: [u32; 2]) -> Option<Located> {
    let extension = path.extension()?.to_str()?.to_lowercase();
    let (first, last) = (extension.chars().next()?, extension.chars().last()?);
    let names = [format!("{first}{last}w"), format!("{extension}w"), "wld".to_owned()];
    let text = names.iter().find_map(|name| load::sibling(path, name))?;
    let (place, flip, warnings) = placed(&String::from_utf8_lossy(&text), size)?;
    let projection = load::sibling(path, "prj").map(|bytes| String::from_utf8_lossy(&bytes).into_owned());
    let (unit, crs) = projection.and_then(|text| georef::from_wkt(&text)).unwrap_or((Unit::Metres(1.0), None));
    Some(Located { place: Place { unit, crs, ..place }, flip, warnings })
}

/// The place that a world file states: six numbers, of which the first four are steps and the last two the centre of
/// the first texel.
fn placed(text: &str, size: [u32; 2]) -> Option<(Place, [bool; 2], Vec<String>)> {
    let numbers: Vec<f64> = text.split_whitespace().filter_map(|word| word.parse().ok()).collect();
    let &[dx, b, c, dy, x, y] = numbers.as_slice() else { return None };
    if !numbers.iter().all(|n| n.is_finite()) || dx == 0.0 || dy == 0.0 {
        return None;
    }
    let is_turned = b.abs() > 1e-6 * dx.abs() || c.abs() > 1e-6 * dy.abs();
    let warning = is_turned.then(|| "the picture is rotated against north; it is shown unrotated".to_owned());
    let flip = [dx < 0.0, dy > 0.0];
    let first = |k: usize| if flip[k] { f64::from(size[k] - 1) } else { 0.0 };
    let origin = [x + first(0) * dx, y + first(1) * dy];
    let place = Place { origin, step: [dx.abs(), dy.abs()], unit: Unit::Metres(1.0), crs: None };
    Some((place, flip, warning.into_iter().collect()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_world_file_states_the_first_texels_centre() {
        let (place, flip, warnings) = placed("2.0\n0\n0.0\n-4.0\n1000.5\n2000\n", [10, 20]).unwrap();
        assert_eq!((place.origin, place.step, flip), ([1000.5, 2000.0], [2.0, 4.0], [false; 2]));
        assert!(warnings.is_empty());
        let (place, flip, _) = placed("-2 0 0 4 1000 2000", [10, 20]).unwrap();
        assert_eq!((place.origin, flip), ([982.0, 2076.0], [true; 2]));
        assert_eq!(placed("2 0.5 0.5 -2 0 0", [10, 20]).unwrap().2.len(), 1, "rotated");
        for broken in ["", "1 0 0 -1 5", "0 0 0 -1 5 5", "1 0 0 NaN 5 5", "one 0 0 -1 5 5"] {
            assert_eq!(placed(broken, [10, 20]), None, "{broken:?}");
        }
    }
}
