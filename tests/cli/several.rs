//! Several files and folders as one terrain.

use std::fs;

use super::{folder, json, refused, synth};

/// Returns heights of a grid of 10 m whose corner is at a column and a row.
fn grid(column: u32, row: u32) -> String {
    let corner = format!("xllcorner {}\nyllcorner {}\n", 600_000 + 10 * column, 200_000 - 10 * row);
    let heights = format!("{column} {row} 7\n").repeat(3);
    format!("ncols 3\nnrows 3\n{corner}cellsize 10\nNODATA_value -9999\n{heights}")
}

#[test]
fn files_and_folders_are_one_field() {
    let folder = folder();
    let tiles = folder.path().join("tiles");
    fs::create_dir(&tiles).expect("a folder");
    fs::write(tiles.join("a.asc"), grid(0, 0)).expect("a file");
    fs::write(tiles.join("b.asc"), grid(3, 0)).expect("a file");
    fs::write(folder.path().join("c.asc"), grid(0, 3)).expect("a file");
    for arguments in [["info", "tiles", "c.asc"], ["info", "tiles/", "./c.asc"]] {
        let info = json(folder.path(), &arguments);
        assert_eq!((info["width"].as_u64(), info["height"].as_u64()), (Some(6), Some(6)));
        assert_eq!((info["hole_count"].as_u64(), info["max_m"].as_f64()), (Some(9), Some(7.0)));
        let sources = info["sources"].as_array().expect("sources");
        assert_eq!(sources.len(), 3);
        assert!(sources[1]["file"].as_str().expect("a name").ends_with("b.asc"), "{sources:?}");
        assert_eq!(sources[1]["at"].as_array().map(|at| at.len()), Some(2));
    }
    let one = json(folder.path(), &["info", "c.asc"]);
    assert_eq!(one["sources"].as_array().map(Vec::len), Some(1));
    let mesh = json(folder.path(), &["export", "tiles", "-o", "m.obj", "--technique", "brute-force"]);
    assert_eq!(mesh["vertices"].as_u64(), Some(18));
    let mesh =
        json(folder.path(), &["export", "tiles/a.asc", "tiles/b.asc", "-o", "m.obj", "--technique", "brute-force"]);
    assert_eq!(mesh["vertices"].as_u64(), Some(18));
}

#[test]
fn what_does_not_fit_is_refused_in_one_line() {
    let folder = folder();
    fs::write(folder.path().join("a.asc"), grid(0, 0)).expect("a file");
    fs::write(folder.path().join("b.asc"), grid(3, 0).replace("cellsize 10", "cellsize 20")).expect("a file");
    synth(folder.path(), "flat", "9x9", "bare.png");
    refused(folder.path(), &["info", "a.asc", "b.asc"], &["b.asc", "a.asc", "spacing"]);
    refused(folder.path(), &["info", "a.asc", "bare.png"], &["bare.png", "position"]);
    refused(folder.path(), &["info", "a.asc", "demo"], &["demo", "files and folders"]);
    refused(folder.path(), &["info", "endless:3", "a.asc"], &["endless:3", "files and folders"]);
    refused(folder.path(), &["info", "a.asc", "nothing.asc"], &["nothing.asc"]);
    fs::create_dir(folder.path().join("empty")).expect("a folder");
    refused(folder.path(), &["info", "empty"], &["empty: directory", "none"]);
}

#[test]
fn formats_that_are_not_read_are_named_in_one_line() {
    let folder = folder();
    for (name, bytes, words) in [
        ("a.nc", &b"CDF\x01........"[..], ["NetCDF", "gdal_translate"]),
        ("b.tif", b"version https://git-lfs.github.com/spec/v1\n", ["git-lfs", "git lfs pull"]),
        ("c.hgt", b"<!DOCTYPE html>\n<html>\n", ["HTML", "download"]),
        ("d.asc", b"", ["empty file", "download"]),
    ] {
        fs::write(folder.path().join(name), bytes).expect("a file");
        refused(folder.path(), &["info", name], &[name, words[0], words[1]]);
    }
}

/// Opening a pipe blocks until it has a writer.
#[cfg(unix)]
#[test]
fn a_pipe_is_refused_at_once() {
    let folder = folder();
    let made = std::process::Command::new("mkfifo").arg(folder.path().join("pipe")).status();
    if made.is_ok_and(|status| status.success()) {
        refused(folder.path(), &["info", "pipe"], &["pipe: file"]);
    }
}
