//! Numbers in flags: negative ones, gdalinfo's spellings, and errors that name only flags that were given.

use clap::error::ErrorKind;
use cuesta::internal::cli::{Cli, command};

use super::*;
use crate::height::{
    tiff_file::{Tag, TiffFile},
    tiny,
};

/// Returns a command line with everything that a subcommand requires.
fn words(subcommand: &clap::Command, more: &[&str]) -> Vec<String> {
    let mut words = vec!["cuesta".to_string(), subcommand.get_name().to_string()];
    let is_needed = |arg: &&clap::Arg| arg.is_required_set() || arg.get_id() == "terrain";
    for arg in subcommand.get_arguments().filter(is_needed) {
        words.extend(arg.get_long().map(|long| format!("--{long}")));
        words.push(if subcommand.get_name() == "synth" && arg.is_positional() { "flat" } else { "demo" }.to_string());
    }
    words.extend(more.iter().map(|word| word.to_string()));
    words
}

#[test]
fn every_flag_for_numbers_takes_negative_ones() {
    let mut found = Vec::new();
    for subcommand in command().get_subcommands() {
        let flags = subcommand.get_arguments().filter(|arg| arg.get_action().takes_values());
        for long in flags.filter_map(|arg| arg.get_long()) {
            let flag = format!("--{long}");
            let parse = |value: &str| Cli::parse_words(words(subcommand, &[&flag, value])).map(|_| ());
            let is_taken =
                |value: &str| !matches!(parse(value), Err(e) if e.kind() != ErrorKind::MissingRequiredArgument);
            let is_number = ["1", "1,1", "1,1,1", "1,1,1,1", "2x2"].iter().any(|n| is_taken(n)) && !is_taken("word");
            if !is_number {
                continue;
            }
            found.push(long.to_string());
            for value in ["-1", "-3.4028234663852886e+38", "-1.#IND", "-inf", "-1,-1"] {
                if let Err(error) = parse(value) {
                    // The value is refused under the flag's name.
                    let line = cuesta::internal::cli::one_line(&error);
                    let is_named = line.contains(&flag) && !line.contains("unexpected");
                    // A flag with an optional value takes no word that begins like a flag.
                    assert!(is_named || long == "measure", "{} {flag} {value}: {line}", subcommand.get_name());
                }
            }
        }
    }
    for long in
        ["nodata", "height-scale", "spacing", "near", "fov", "tolerance", "crop", "tile", "band", "max-samples", "seed"]
    {
        assert!(found.iter().any(|flag| flag == long), "{long}: {found:?}");
    }
}

/// Returns the number of holes under a value of `--nodata`.
fn holes(folder: &Path, nodata: &str) -> Value {
    json(folder, &["info", "land.tif", "--nodata", nodata])["hole_count"].clone()
}

#[test]
fn nodata_as_gdalinfo_prints_it() {
    let folder = folder();
    for (value, spellings) in [
        (f64::from(f32::MIN), &["-3.4028234663852886e+38", "-3.40282346638529e+38", "-3.4028234663852886E+038"][..]),
        (-9999.0, &["-9999", "-9999.0", "-9.999e3"]),
        (f64::NAN, &["nan", "NaN", "-nan", "-1.#IND", "1.#QNAN"]),
        (f64::INFINITY, &["inf", "Infinity", "1.#INF"]),
        (f64::NEG_INFINITY, &["-inf", "-1.#INF"]),
    ] {
        let file = TiffFile::new(tiny::SIZE, 32, 3);
        let bytes = file.bytes(|i, j| if i + j == 0 { value } else { tiny::height(i, j) });
        std::fs::write(folder.path().join("land.tif"), bytes).unwrap();
        for spelling in spellings {
            assert_eq!(holes(folder.path(), spelling), 1, "{spelling}");
        }
    }
    refused(folder.path(), &["info", "land.tif", "--nodata", "none"], &["--nodata", "none", "expected a number"]);
}

#[test]
fn negative_scales_and_gdalinfo_pixel_sizes() {
    let folder = folder();
    let bytes = TiffFile::new(tiny::SIZE, 16, 2).bytes(tiny::height);
    std::fs::write(folder.path().join("land.tif"), bytes).unwrap();
    let info = json(folder.path(), &["info", "land.tif", "--height-scale", "-1"]);
    assert_eq!((&info["min_m"], &info["max_m"]), (&Value::from(-69.0), &Value::from(-20.0)));
    for size in ["(30.0,-40.0)", "30,-40", "30,40"] {
        let info = json(folder.path(), &["info", "land.tif", "--spacing", size]);
        assert_eq!(info["spacing_m"], serde_json::json!([30.0, 40.0]), "{size}");
    }
    for (flag, value) in
        [("--spacing", "-30"), ("--spacing", "0,-40"), ("--crop", "-1,0,2,2"), ("--tile", "-1,1"), ("--band", "-1")]
    {
        refused(folder.path(), &["info", "land.tif", flag, value], &[flag, value]);
    }
}

/// An error names only flags of the command line, for any content of the file.
#[test]
fn no_error_names_a_flag_that_was_not_given() {
    let folder = folder();
    for (name, bits, value) in
        [("far.tif", 32, 1e29), ("low.tif", 32, -1e25), ("deep.tif", 64, -9e12), ("wide.tif", 32, 3e38)]
    {
        let file = TiffFile::new(tiny::SIZE, bits, 3).tag(33550, Tag::Double(vec![1e9, 1e9, 0.0]));
        let bytes = file.bytes(|i, j| if i + j == 0 { value } else { tiny::height(i, j) });
        std::fs::write(folder.path().join(name), bytes).unwrap();
        let output = cuesta(folder.path(), &["export", name, "-o", "mesh.ply", "--quiet"]);
        let text = String::from_utf8_lossy(&output.stderr).into_owned();
        let error = text.lines().find(|line| line.starts_with("error: ")).unwrap_or_default();
        let place = error.split(": ").nth(2).unwrap_or_default();
        assert!(!place.starts_with("--"), "{name}: {error}");
        assert!(error.is_empty() || error.starts_with(&format!("error: {name}: heights: ")), "{name}: {error}");
        assert_eq!(code(&output) == 0, name == "wide.tif", "{text}");
    }
    for (arguments, flag, other) in [
        (vec!["export", "demo", "-o", "m.ply", "--technique", "geomipmap:none"], "--technique", "--set"),
        (vec!["export", "demo", "-o", "m.ply", "--set", "none=1"], "--set", "--technique"),
        (vec!["bench", "demo", "--out", "d", "--technique", "geomipmap:none"], "--technique", "--set"),
        (vec!["bench", "demo", "--out", "d", "--set", "block=none"], "--set", "--technique"),
    ] {
        let output = cuesta(folder.path(), &arguments);
        let line = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(code(&output), 2, "{line}");
        assert!(line.contains(flag) && !line.contains(other), "{line}");
    }
}
