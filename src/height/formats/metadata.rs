//! Band metadata as GDAL writes it: in the tag `GDAL_METADATA` of a TIFF, and in the file `.aux.xml` beside a raster.

use roxmltree::{Document, Node, ParsingOptions};

use crate::height::georef::affine::Affine;
use crate::height::georef::crs::Crs;
use crate::height::georef::crs_text;

/// Most elements and texts that are read.
const MAX_NODES: u32 = 1 << 18;

/// The statements about one band and the place of its raster.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Metadata {
    /// Units per value.
    pub scale: Option<f64>,
    /// Added to the scaled value, in units.
    pub offset: Option<f64>,
    /// Name of the unit.
    pub unit: Option<String>,
    /// The value that means "no data".
    pub nodata: Option<f64>,
    /// Coordinates of samples.
    pub affine: Option<Affine>,
    /// The coordinate reference system.
    pub crs: Option<Crs>,
    /// Warnings about values that could not be read.
    pub warnings: Vec<String>,
}

impl Metadata {
    /// The statements of either; where both state a thing, `self` decides.
    pub fn or(self, other: Self) -> Self {
        Self {
            scale: self.scale.or(other.scale),
            offset: self.offset.or(other.offset),
            unit: self.unit.or(other.unit),
            nodata: self.nodata.or(other.nodata),
            affine: self.affine.or(other.affine),
            crs: self.crs.or(other.crs),
            warnings: [self.warnings, other.warnings].concat(),
        }
    }

    /// Reads the number of an element or warns.
    fn number(&mut self, what: &str, text: &str) -> Option<f64> {
        let number = text.trim().parse::<f64>().ok();
        if number.is_none() {
            self.warnings.push(format!("{what}: expected a number, found {:?}; ignored", text.trim()));
        }
        number
    }

    /// Drops a scale or offset that cannot be applied, with a warning.
    fn checked(mut self, what: &str) -> Self {
        if self.scale.is_some_and(|scale| !scale.is_finite() || scale == 0.0) {
            self.warnings
                .push(format!("{what}: expected a finite scale other than 0, found {:?}; ignored", self.scale));
            self.scale = None;
        }
        if self.offset.is_some_and(|offset| !offset.is_finite()) {
            self.warnings.push(format!("{what}: expected a finite offset, found {:?}; ignored", self.offset));
            self.offset = None;
        }
        self
    }
}

/// Reads the tag of a TIFF for a band, counted from 1.
pub(super) fn from_tag(text: &str, band: u32) -> Metadata {
    let what = "GDAL_METADATA";
    read(what, text.trim_matches(['\0', ' ', '\n']), |root, metadata| {
        let sample = (band - 1).to_string();
        for item in root.children().filter(|node| node.has_tag_name("Item")) {
            if item.attribute("sample").unwrap_or("0") != sample {
                continue;
            }
            let value = item.text().unwrap_or_default();
            match item.attribute("role").map(str::to_lowercase).as_deref() {
                Some("scale") => metadata.scale = metadata.number("GDAL_METADATA scale", value),
                Some("offset") => metadata.offset = metadata.number("GDAL_METADATA offset", value),
                Some("unittype") => metadata.unit = unit(value),
                _ => (),
            }
        }
    })
}

/// Reads `.aux.xml` for a band, counted from 1.
pub(super) fn from_aux_xml(text: &str, band: u32) -> Metadata {
    let what = ".aux.xml";
    read(what, text.trim_start_matches('\u{feff}').trim(), |root, metadata| {
        let text = |node: Node, name: &str| {
            let child = node.children().find(|child| child.has_tag_name(name))?;
            Some(child.text().unwrap_or_default().to_owned())
        };
        // ArcGIS writes the system deeper down, by the name of WKT.
        let esri = || root.descendants().find(|node| node.has_tag_name("WKT")).and_then(|node| node.text());
        if let Some(system) = text(root, "SRS").or_else(|| esri().map(str::to_owned)).filter(|t| !t.trim().is_empty()) {
            metadata.crs = crs_text::from_text(&system);
            if metadata.crs.is_none() {
                let head: String = system.chars().take(40).collect();
                metadata.warnings.push(format!(".aux.xml SRS: expected a known system, found {head:?}; ignored"));
            }
        }
        if let Some(numbers) = text(root, "GeoTransform") {
            metadata.affine = geo_transform(&numbers);
            if metadata.affine.is_none() {
                metadata.warnings.push(".aux.xml GeoTransform: expected six numbers, found others; ignored".to_owned());
            }
        }
        let number = band.to_string();
        let is_band = |node: &Node| node.has_tag_name("PAMRasterBand") && node.attribute("band") == Some(&number);
        let Some(band) = root.children().find(is_band) else { return };
        if let Some(value) = text(band, "NoDataValue") {
            metadata.nodata = metadata.number(".aux.xml NoDataValue", &value);
        }
        if let Some(value) = text(band, "Scale") {
            metadata.scale = metadata.number(".aux.xml Scale", &value);
        }
        if let Some(value) = text(band, "Offset") {
            metadata.offset = metadata.number(".aux.xml Offset", &value);
        }
        metadata.unit = text(band, "UnitType").and_then(|name| unit(&name));
    })
}

/// Reads a document; one that is no XML is a warning.
fn read(what: &str, text: &str, fill: impl FnOnce(Node, &mut Metadata)) -> Metadata {
    let mut metadata = Metadata::default();
    let options = ParsingOptions { nodes_limit: MAX_NODES, ..ParsingOptions::default() };
    match Document::parse_with_options(text, options) {
        Ok(document) => fill(document.root_element(), &mut metadata),
        Err(error) => metadata.warnings.push(format!("{what}: expected XML, found {error}; ignored")),
    }
    metadata.checked(what)
}

fn unit(name: &str) -> Option<String> {
    Some(name.trim().to_owned()).filter(|name| !name.is_empty())
}

/// x, steps of x along columns and rows, and the same of y, of the corner of the first sample.
fn geo_transform(text: &str) -> Option<Affine> {
    let numbers = text.split([',', ' ', '\n', '\t']).filter(|word| !word.is_empty()).map(|word| word.parse().ok());
    let numbers: Vec<f64> = numbers.collect::<Option<_>>()?;
    let [x, a, b, y, d, e] = numbers[..] else { return None };
    Some(Affine { origin: [x, y], column: [a, d], row: [b, e] }.shifted([0.5, 0.5]))
}
