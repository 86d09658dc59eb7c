//! The grid of a tile directory, from the descriptions in it: the order of rows and the position of tiles.

use std::{collections::BTreeMap, path::Path};

use roxmltree::{Document, Node};
use serde_json::Value;

use super::encoding::Encoding;
use super::input::small_file;
use super::text::without_mark;
use crate::height::error::Error;
use crate::height::georef::crs::Crs;
use crate::height::georef::crs_text;
use crate::height::georef::mercator::MERCATOR_HALF;
use crate::height::georef::place::Place;
use crate::height::georef::unit::Unit;

/// Descriptions as TileJSON or of the MBTiles kind.
const JSON: [&str; 4] = ["tilejson.json", "tiles.json", "tile.json", "metadata.json"];
/// The description of a Tile Map Service.
const TMS: &str = "tilemapresource.xml";

/// The grid of a tile directory; by default web Mercator with rows from the north.
#[derive(Debug, Default)]
pub(super) struct TileGrid {
    /// True if row 0 is the southernmost one, as in a Tile Map Service.
    from_south: bool,
    /// The encoding that a description names.
    pub encoding: Option<Encoding>,
    /// A grid other than that of web Mercator.
    other: Option<OtherGrid>,
}

/// A grid in other coordinates than web Mercator's.
#[derive(Debug)]
struct OtherGrid {
    /// South-west corner of tile (0, 0).
    origin: [f64; 2],
    /// Length of a pixel by zoom level.
    step: BTreeMap<u32, f64>,
    unit: Unit,
    crs: Option<String>,
}

impl TileGrid {
    /// Reads the descriptions in a tile directory.
    pub fn read(path: &Path) -> Result<Self, Error> {
        let json = JSON.iter().find_map(|file| {
            let text = small_file(&path.join(file), "").ok()?;
            serde_json::from_slice::<Value>(without_mark(&text)).ok()
        });
        let word = |key: &str| json.as_ref()?.get(key)?.as_str().map(str::to_lowercase);
        let mut grid = match small_file(&path.join(TMS), "") {
            Ok(text) => {
                let name = path.join(TMS).display().to_string();
                Self::of_tms(&name, &String::from_utf8_lossy(without_mark(&text)))?
            }
            Err(_) => Self::default(),
        };
        grid.from_south = word("scheme").map_or(grid.from_south, |scheme| scheme == "tms");
        grid.encoding = word("encoding").and_then(|word| word.parse().ok());
        Ok(grid)
    }

    fn of_tms(name: &str, text: &str) -> Result<Self, Error> {
        let error = |field: &str, what: &str| Error::new(name, field, what);
        let document = Document::parse(text).map_err(|e| Error::new(name, "XML", e))?;
        let node = |tag: &str| document.descendants().find(|node| node.has_tag_name(tag));
        let profile = node("TileSets").and_then(|sets| sets.attribute("profile")).unwrap_or("mercator");
        let srs = node("SRS").and_then(|srs| srs.text()).map(str::trim).unwrap_or_default();
        let sets = document.descendants().filter(|node| node.has_tag_name("TileSet"));
        let step =
            sets.filter_map(|set| Some((number(set, "order")? as u32, number(set, "units-per-pixel")?))).collect();
        let other = match profile {
            "mercator" | "global-mercator" => None,
            "geodetic" | "global-geodetic" => Some(OtherGrid {
                origin: [-180.0, -90.0],
                step,
                unit: Unit::DEGREES,
                crs: Some("EPSG:4326".to_owned()),
            }),
            _ => {
                let corner = node("Origin").and_then(|origin| Some([number(origin, "x")?, number(origin, "y")?]));
                let origin = corner.ok_or_else(|| error("Origin", "expected x and y, found none"))?;
                let (unit, crs) = system(srs);
                Some(OtherGrid { origin, step, unit, crs })
            }
        };
        Ok(Self { from_south: true, encoding: None, other })
    }

    /// The tile's column from the west and row from the north, if it lies within a zoom level.
    pub fn tile_at(&self, zoom: u32, [x, y]: [u32; 2]) -> Option<[u32; 2]> {
        // A geodetic grid has two tiles side by side at level 0.
        let columns = (1u64 << zoom) * if self.other.is_some() { 2 } else { 1 };
        let is_tile = u64::from(x) < columns && y < 1 << zoom;
        is_tile.then(|| [x, if self.from_south { (1 << zoom) - 1 - y } else { y }])
    }

    /// Place of the samples of tiles with `side` pixels a side; `corner` is the north-west tile.
    pub fn place(&self, name: &str, zoom: u32, side: u32, corner: [u32; 2]) -> Result<Place, Error> {
        let (side, tiles) = (f64::from(side), f64::from(1u32 << zoom));
        let centre = |tile: u32| f64::from(tile) * side + 0.5;
        let Some(other) = &self.other else {
            let step = 2.0 * MERCATOR_HALF / (side * tiles);
            let origin = [centre(corner[0]) * step - MERCATOR_HALF, MERCATOR_HALF - centre(corner[1]) * step];
            return Ok(Place { origin, step: [step; 2], unit: Unit::Mercator, crs: Some("EPSG:3857".to_owned()) });
        };
        let halved = || (other.unit == Unit::DEGREES).then(|| 180.0 / (side * tiles));
        let step = other.step.get(&zoom).copied().filter(|step| *step > 0.0).or_else(halved);
        let step = step.ok_or_else(|| {
            Error::new(
                format!("{name}/{TMS}"),
                "TileSet",
                format!("expected units-per-pixel of order {zoom}, found none"),
            )
        })?;
        let [west, south] = other.origin;
        let origin = [west + centre(corner[0]) * step, south + (tiles * side - centre(corner[1])) * step];
        Ok(Place { origin, step: [step; 2], unit: other.unit, crs: other.crs.clone() })
    }
}

fn number(node: Node, attribute: &str) -> Option<f64> {
    node.attribute(attribute)?.trim().parse().ok().filter(|number: &f64| number.is_finite())
}

/// Unit and name of the coordinate system of a raster profile: well-known text or a code; metres where it is neither.
fn system(srs: &str) -> (Unit, Option<String>) {
    let Crs { unit, name, .. } = crs_text::from_text(srs).unwrap_or_default();
    (unit.unwrap_or(Unit::Metres(1.0)), name.or_else(|| (!srs.is_empty()).then(|| srs.to_owned())))
}
