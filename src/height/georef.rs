//! Where samples lie: coordinates of a file turned into metres.

use std::f64::consts::TAU;

/// Radius of the sphere of web Mercator, metres.
pub const MERCATOR_RADIUS: f64 = 6_378_137.0;
/// International foot, metres.
pub const FOOT: f64 = 0.3048;
/// US survey foot, metres.
pub const US_FOOT: f64 = 1200.0 / 3937.0;

/// Metres per degree of longitude and of latitude on the WGS 84 ellipsoid.
///
/// The usual series of the lengths of a degree of the parallel and of the meridian at latitude φ (degrees),
/// good to a centimetre: 111412.84 cos φ − 93.5 cos 3φ + 0.118 cos 5φ and
/// 111132.92 − 559.82 cos 2φ + 1.175 cos 4φ − 0.0023 cos 6φ.
pub fn metres_per_degree(latitude: f64) -> [f64; 2] {
    let cos = |n: f64| (n * latitude.to_radians()).cos();
    [
        111_412.84 * cos(1.0) - 93.5 * cos(3.0) + 0.118 * cos(5.0),
        111_132.92 - 559.82 * cos(2.0) + 1.175 * cos(4.0) - 0.0023 * cos(6.0),
    ]
}

/// Latitude, degrees, of a web Mercator northing, metres.
pub fn mercator_latitude(y: f64) -> f64 {
    (y / MERCATOR_RADIUS).sinh().atan().to_degrees()
}

/// Half the side of the web Mercator square, metres.
pub const MERCATOR_HALF: f64 = MERCATOR_RADIUS * TAU / 2.0;

/// What a coordinate counts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Unit {
    /// Longitude and latitude, degrees.
    Degrees,
    /// Projected lengths, in so many metres each.
    Metres(f64),
    /// Web Mercator metres, which are 1 / cos φ times too long on the ground.
    Mercator,
}

/// Coordinates of the north-west sample (east, north), and steps (east, south).
pub type Grid = ([f64; 2], [f64; 2]);

/// Where a raster lies, north up.
#[derive(Clone, Debug, PartialEq)]
pub struct Place {
    /// East and north coordinate of the north-west sample.
    pub origin: [f64; 2],
    /// Distance of neighbouring samples east and south, both positive.
    pub step: [f64; 2],
    /// Unit of both.
    pub unit: Unit,
    /// Coordinate reference system, as the file names it.
    pub crs: Option<String>,
}

impl Place {
    /// Distance of neighbouring samples (x, z) on the ground and world position (x, z) of the north-west
    /// sample, metres, for `rows` rows.
    ///
    /// Degrees become metres by [`metres_per_degree`] at the middle row. Web Mercator distances shrink by
    /// cos φ of the middle row; its origin stays in Mercator metres.
    pub fn spacing_and_origin(&self, rows: u32) -> ([f64; 2], [f64; 2]) {
        let [east, north] = self.origin;
        let middle = north - self.step[1] * f64::from(rows - 1) / 2.0;
        let (ground, world) = match self.unit {
            Unit::Degrees if middle.abs() > 90.0 => ([f64::NAN; 2], [f64::NAN; 2]),
            Unit::Degrees => (metres_per_degree(middle), metres_per_degree(middle)),
            Unit::Metres(factor) => ([factor; 2], [factor; 2]),
            Unit::Mercator => ([mercator_latitude(middle).to_radians().cos(); 2], [1.0; 2]),
        };
        ([self.step[0] * ground[0], self.step[1] * ground[1]], [east * world[0], -north * world[1]])
    }

    /// The place of the part that begins at sample (x, z).
    pub fn moved(mut self, [x, z]: [u32; 2]) -> Self {
        self.origin[0] += f64::from(x) * self.step[0];
        self.origin[1] -= f64::from(z) * self.step[1];
        self
    }

    /// A place whose file names no coordinate system: degrees if all of it could be longitude and latitude,
    /// and a warning that says what was taken.
    pub fn guessed((origin, step): Grid, [w, h]: [u32; 2]) -> (Self, String) {
        let [east, south] = [origin[0] + step[0] * f64::from(w), origin[1] - step[1] * f64::from(h)];
        // A grid of someone's own often begins near (0, 0) with steps of metres; a degree is the longest
        // step of published global grids.
        let on_globe = origin[0] >= -181.0 && east <= 361.0 && south >= -91.0 && origin[1] <= 91.0;
        let local = origin[0].abs() <= step[0] && south.abs() <= 2.0 * step[1] && step[0] >= 0.1;
        let degrees = on_globe && !local && step[0] <= 1.0 && step[1] <= 1.0;
        let (unit, found) = match degrees {
            true => (Unit::Degrees, "degrees of longitude and latitude"),
            false => (Unit::Metres(1.0), "metres"),
        };
        let warning = format!("no coordinate system is named; the coordinates look like {found} (--spacing overrides)");
        (Self { origin, step, unit, crs: None }, warning)
    }
}

/// Unit and name of the coordinate system that a projection text (`.prj`, well-known text) describes.
pub fn from_wkt(text: &str) -> Option<(Unit, Option<String>)> {
    let upper = text.to_ascii_uppercase();
    let named = |keys: &[&str]| keys.iter().find_map(|key| upper.find(key));
    // A compound system names a projected or geographic one, and then a vertical one.
    let end = named(&["VERT_CS[", "VERTCS[", "VERTCRS["]).unwrap_or(upper.len());
    let projected = named(&["PROJCS[", "PROJCRS[", "PROJECTEDCRS["]);
    let degrees = named(&["GEOGCS[", "GEOGCRS[", "GEODCRS[", "GEODETICCRS[", "GEOGRAPHICCRS["]);
    let begin = projected.or(degrees).unwrap_or(0).min(end);
    let upper = &upper[begin..end];
    let crs = epsg(upper).or_else(|| text.get(begin..)?.split('"').nth(1).map(str::to_owned));
    if projected.is_none() && degrees.is_some() {
        return Some((Unit::Degrees, crs));
    }
    if projected.is_some() {
        let unit = match is_web_mercator(upper) {
            true => Unit::Mercator,
            false => Unit::Metres(last_unit(upper).unwrap_or(1.0)),
        };
        return Some((unit, crs));
    }
    // ARC/INFO wrote lines such as "Projection GEOGRAPHIC" and "Units DD".
    let value = |key: &str| upper.lines().find_map(|line| line.trim().strip_prefix(key)).map(str::trim);
    match (value("PROJECTION"), value("UNITS")) {
        (Some("GEOGRAPHIC"), _) | (_, Some("DD")) => Some((Unit::Degrees, None)),
        (Some(_), Some("FEET")) => Some((Unit::Metres(US_FOOT), None)),
        (Some(_), _) => Some((Unit::Metres(1.0), None)),
        _ => None,
    }
}

/// Whether the name or code of a coordinate system (upper case) is web Mercator's.
pub fn is_web_mercator(text: &str) -> bool {
    let squeezed: String = text.chars().filter(|c| c.is_alphanumeric()).collect();
    ["PSEUDOMERCATOR", "WEBMERCATOR", "EPSG3857", "EPSG900913"].iter().any(|name| squeezed.contains(name))
}

fn epsg(upper: &str) -> Option<String> {
    let (_, code) = upper.rsplit_once("\"EPSG\",")?;
    let digits: String = code.trim_start_matches('"').chars().take_while(char::is_ascii_digit).collect();
    (!digits.is_empty()).then(|| format!("EPSG:{digits}"))
}

/// The factor of the outermost unit, which comes last.
fn last_unit(upper: &str) -> Option<f64> {
    let (_, unit) = upper.rsplit_once("UNIT[")?;
    let number = unit.split([',', ']']).nth(1)?.trim().parse().ok()?;
    (f64::is_finite(number) && number > 0.0).then_some(number)
}
