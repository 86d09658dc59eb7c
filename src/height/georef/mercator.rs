//! Web Mercator: the sphere, its square, and the names and codes of the system.

use std::f64::consts::TAU;

/// Radius of the sphere of web Mercator, metres.
pub const MERCATOR_RADIUS: f64 = 6_378_137.0;

/// Codes of web Mercator, those of ESRI included.
pub const WEB_MERCATOR: [u32; 5] = [3857, 3785, 900_913, 102_100, 102_113];

/// Latitude, degrees, of a web Mercator northing, metres.
pub fn mercator_latitude(y: f64) -> f64 {
    (y / MERCATOR_RADIUS).sinh().atan().to_degrees()
}

/// Half the side of the web Mercator square, metres.
pub const MERCATOR_HALF: f64 = MERCATOR_RADIUS * TAU / 2.0;

/// Returns true for the name or the code of web Mercator.
pub fn is_web_mercator(text: &str) -> bool {
    let squeezed: String = text.chars().filter(|c| c.is_alphanumeric()).collect::<String>().to_uppercase();
    let names = ["PSEUDOMERCATOR", "WEBMERCATOR", "MERCATORAUXILIARYSPHERE"];
    let codes = WEB_MERCATOR.map(|code| code.to_string());
    names.iter().any(|name| squeezed.contains(name))
        || ["EPSG", "ESRI"].iter().any(|authority| {
            squeezed.strip_prefix(authority).is_some_and(|code| codes.iter().any(|known| known == code))
        })
}
