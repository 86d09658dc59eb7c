//! Units of length and angle by EPSG code and by name.

use std::f64::consts::PI;

/// International foot, metres.
pub const FOOT: f64 = 0.3048;
/// US survey foot, metres.
pub const US_FOOT: f64 = 1200.0 / 3937.0;

/// Metres of the EPSG units of length; EPSG registry v11.022, by `pyproj` 3.7.2.
const LENGTHS: [(u16, f64); 55] = [
    (1025, 0.001),
    (1033, 0.01),
    (9001, 1.0),
    (9002, 0.3048),
    (9003, US_FOOT),
    (9005, 0.3047972654),
    (9014, 1.8288),
    (9030, 1852.0),
    (9031, 1.0000135965),
    (9033, 20.1168402336805),
    (9034, 0.201168402336805),
    (9035, 1609.34721869444),
    (9036, 1000.0),
    (9037, 0.9143917962),
    (9038, 20.1166195164),
    (9039, 0.201166195164),
    (9040, 0.914398414616029),
    (9041, 0.304799471538676),
    (9042, 20.1167651215526),
    (9043, 0.201167651215526),
    (9050, 0.9143992),
    (9051, 0.304799733333333),
    (9052, 20.1167824),
    (9053, 0.201167824),
    (9060, 0.914399204289812),
    (9061, 0.304799734763271),
    (9062, 20.1167824943759),
    (9063, 0.201167824943759),
    (9070, 0.304800833333333),
    (9080, 0.304799510248147),
    (9081, 0.30479841),
    (9082, 0.3047996),
    (9083, 0.3047995),
    (9084, 0.914398530744441),
    (9085, 0.91439523),
    (9086, 0.9143988),
    (9087, 0.9143985),
    (9093, 1609.344),
    (9094, 0.304799710181509),
    (9095, 0.3048007491),
    (9096, 0.9144),
    (9097, 20.1168),
    (9098, 0.201168),
    (9099, 0.914398),
    (9204, 100.584201168402),
    (9205, 50.2921005842012),
    (9206, 25.1460502921006),
    (9207, 37.5),
    (9208, 25.0),
    (9209, 12.5),
    (9210, 6.25),
    (9211, 3.125),
    (9300, 0.304799333333333),
    (9301, 20.116756),
    (9302, 0.20116756),
];

/// Metres of an EPSG unit of length.
pub fn length(code: u16) -> Option<f64> {
    LENGTHS.iter().find(|&&(known, _)| known == code).map(|&(_, metres)| metres)
}

/// Radians of an EPSG unit of angle.
///
/// Units that count degrees, minutes and seconds apart measure in degrees.
pub fn angle(code: u16) -> Option<f64> {
    let degree = PI / 180.0;
    match code {
        9101 => Some(1.0),
        9102 | 9107 | 9108 | 9115..=9120 | 9122 => Some(degree),
        9103 => Some(degree / 60.0),
        9104 => Some(degree / 3600.0),
        9105 | 9106 => Some(PI / 200.0),
        9109 => Some(1e-6),
        9112 => Some(PI / 20_000.0),
        9113 => Some(PI / 2_000_000.0),
        9114 => Some(PI / 3200.0),
        1031 => Some(degree / 3_600_000.0),
        _ => None,
    }
}

/// Metres of a unit of length by its name, as in `US survey foot`, `ftUS`, `Meters`.
pub fn named_length(name: &str) -> Option<f64> {
    let squeezed: String = name.chars().filter(|c| c.is_alphanumeric()).collect::<String>().to_lowercase();
    match squeezed.as_str() {
        "m" | "metre" | "metres" | "meter" | "meters" | "mtr" => Some(1.0),
        "ft" | "foot" | "feet" | "footinternational" | "internationalfoot" | "internationalfeet" | "ift" | "ftint" => {
            Some(FOOT)
        }
        "ussurveyfoot" | "ussurveyfeet" | "surveyfoot" | "surveyfeet" | "ussurveyft" | "usft" | "ftus" | "footus"
        | "feetus" | "usfoot" | "usfeet" | "sft" => Some(US_FOOT),
        "mm" | "millimetre" | "millimeter" | "millimetres" | "millimeters" => Some(1e-3),
        "cm" | "centimetre" | "centimeter" | "centimetres" | "centimeters" => Some(0.01),
        "dm" | "decimetre" | "decimeter" | "decimetres" | "decimeters" => Some(0.1),
        "km" | "kilometre" | "kilometer" | "kilometres" | "kilometers" => Some(1000.0),
        "in" | "inch" | "inches" => Some(FOOT / 12.0),
        "yd" | "yard" | "yards" => Some(0.9144),
        "fathom" | "fathoms" | "fath" => Some(1.8288),
        "mi" | "mile" | "miles" => Some(1609.344),
        "nmi" | "kmi" | "nauticalmile" | "nauticalmiles" => Some(1852.0),
        _ => None,
    }
}

/// Radians of a unit of angle by its name, as in `Degrees`.
pub fn named_angle(name: &str) -> Option<f64> {
    match name.trim().to_lowercase().trim_end_matches('s') {
        "degree" | "dd" => angle(9102),
        "minute" | "dm" => angle(9103),
        "second" | "d" => angle(9104),
        "radian" => angle(9101),
        "grad" | "gon" => angle(9105),
        _ => None,
    }
}
