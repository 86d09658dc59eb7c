//! Overlays, and terrain of extreme sizes, from the command line.

use std::path::Path;

use image::{Rgb, RgbImage, RgbaImage};
use tiff::encoder::{TiffEncoder, colortype::RGB8};
use tiff::tags::Tag;

use super::with_a_device::has_device;
use super::*;

/// Draws a picture from straight above a place, of the samples as stored.
fn above(folder: &Path, terrain: &[&str], eye: &str, width: &str) -> RgbaImage {
    let view = ["-o", "p.png", "--size", "120x90", "--eye", eye, "--pitch=-90", "--yaw=-90", "--ortho", width];
    let more = ["--technique", "brute-force", "--validate", "--quiet"];
    json(folder, &[&["render"], terrain, &view[..], &more[..]].concat());
    image::open(folder.join("p.png")).expect("a picture").into_rgba8()
}

/// Returns the share of pixels with a channel that differs by more than 8.
fn difference(a: &RgbaImage, b: &RgbaImage) -> f64 {
    let differs = |(p, q): &(&image::Rgba<u8>, &image::Rgba<u8>)| p.0.iter().zip(q.0).any(|(x, y)| x.abs_diff(y) > 8);
    a.pixels().zip(b.pixels()).filter(differs).count() as f64 / a.pixels().len() as f64
}

#[test]
fn the_demos_overlay_repeats_and_is_cropped_with_it() {
    if !has_device() {
        return;
    }
    let folder = folder();
    // The same 100 × 75 samples within the whole, the part and a tile: 25 m between samples.
    let whole = above(folder.path(), &["demo"], "5000,9000,5000", "2500");
    let part = above(folder.path(), &["demo", "--crop", "100,100,200,200"], "2500,9000,2500", "2500");
    assert!(difference(&whole, &part) < 0.01, "cropped: {}", difference(&whole, &part));
    let tile = above(folder.path(), &["demo", "--crop", "0,0,300,300", "--tile", "3,3"], "20000,9000,12500", "2500");
    assert!(difference(&whole, &tile) < 0.01, "cropped and tiled: {}", difference(&whole, &tile));
    let other = above(folder.path(), &["demo"], "8000,9000,5000", "2500");
    assert!(difference(&whole, &other) > 0.5, "elsewhere is another picture");
}

/// Writes terrain of 61 × 41 samples, 10 m apart, whose north-west sample lies at 500005, 4100395.
fn terrain(folder: &Path) {
    let mut text = "ncols 61\nnrows 41\nxllcorner 500000\nyllcorner 4099990\ncellsize 10\n".to_string();
    (0..41).for_each(|j| {
        text += &format!("{}\n", (0..61).map(|i| format!("{} ", 100 + i % 2 + j % 3)).collect::<String>())
    });
    std::fs::write(folder.join("land.asc"), text).unwrap();
    std::fs::write(folder.join("land.prj"), PROJECTION).unwrap();
}

const PROJECTION: &str = r#"PROJCS["WGS 84 / UTM zone 32N",GEOGCS["WGS 84",AUTHORITY["EPSG","4326"]],UNIT["metre",1],AUTHORITY["EPSG","32632"]]"#;

/// Makes a picture that is red in its north-west quarter and blue elsewhere.
fn quarters([w, h]: [u32; 2]) -> RgbImage {
    RgbImage::from_fn(w, h, |x, y| if x < w / 2 && y < h / 2 { Rgb([230, 0, 0]) } else { Rgb([0, 0, 230]) })
}

/// Writes a GeoTIFF picture in a coordinate system, with its north-west corner and texel size in metres.
fn geotiff(file: &Path, picture: &RgbImage, epsg: u16, corner: [f64; 2], step: f64) {
    let mut encoder = TiffEncoder::new(std::fs::File::create(file).unwrap()).unwrap();
    let (w, h) = picture.dimensions();
    let mut image = encoder.new_image::<RGB8>(w, h).unwrap();
    let tags = image.encoder();
    tags.write_tag(Tag::ModelPixelScaleTag, &[step, step, 0.0][..]).unwrap();
    tags.write_tag(Tag::ModelTiepointTag, &[0.0, 0.0, 0.0, corner[0], corner[1], 0.0][..]).unwrap();
    let keys = [1, 1, 0, 3, 1024, 0, 1, 1, 1025, 0, 1, 1, 3072, 0, 1, epsg];
    tags.write_tag(Tag::GeoKeyDirectoryTag, &keys[..]).unwrap();
    image.write_data(picture.as_raw()).unwrap();
}

/// Returns true if a pixel has the colour of the sky above the horizon.
fn is_sky(pixel: &image::Rgba<u8>) -> bool {
    const SKY: [u8; 3] = [207, 222, 239];
    pixel.0.iter().zip(SKY).all(|(a, b)| a.abs_diff(b) <= 3)
}

/// Returns the colour at a place, metres east and south of the north-west sample, in a picture from [`above`] the middle.
fn at(picture: &RgbaImage, east: f64, south: f64) -> &'static str {
    let pixel = picture.get_pixel((east - 300.0 + 360.0) as u32 / 6, (south - 200.0 + 270.0) as u32 / 6).0;
    match pixel {
        sky if is_sky(&image::Rgba(sky)) => "none",
        [r, g, b, 255] if r > 100 && g < 60 && b < 60 => "red",
        [r, g, b, 255] if b > 100 && g < 60 && r < 60 => "blue",
        _ => "land",
    }
}

/// Twenty by ten texels of 10 m, from 200 m east and 100 m south of the field's north-west corner on.
#[test]
fn a_picture_lies_where_it_says() {
    if !has_device() {
        return;
    }
    let folder = folder();
    terrain(folder.path());
    let picture = quarters([20, 10]);
    picture.save(folder.path().join("world.png")).unwrap();
    std::fs::write(folder.path().join("world.pgw"), "10\n0\n0\n-10\n500205\n4100295\n").unwrap();
    // The same with rows that run north.
    image::imageops::flip_vertical(&picture).save(folder.path().join("turned.bmp")).unwrap();
    std::fs::write(folder.path().join("turned.bpw"), "10\n0\n0\n10\n500205\n4100205\n").unwrap();
    geotiff(&folder.path().join("tags.tif"), &picture, 32632, [500_200.0, 4_100_300.0], 10.0);
    let middle = "500305,9000,-4100195";
    for file in ["world.png", "turned.bmp", "tags.tif"] {
        let seen = above(folder.path(), &["land.asc", "--overlay", file], middle, "720");
        // Texels are centred on samples: from 195 m to 395 m, and from 95 m to 195 m.
        for (east, south, expected) in [
            (210.0, 110.0, "red"),
            (280.0, 130.0, "red"),
            (310.0, 110.0, "blue"),
            (210.0, 160.0, "blue"),
            (380.0, 180.0, "blue"),
            (180.0, 110.0, "land"),
            (410.0, 150.0, "land"),
            (300.0, 80.0, "land"),
            (300.0, 210.0, "land"),
            (590.0, 390.0, "land"),
            (640.0, 200.0, "none"),
        ] {
            assert_eq!(at(&seen, east, south), expected, "{file}: {east} m east, {south} m south");
        }
        // A part of the field has the same part of the picture: it begins 250 m east and 120 m south.
        let crop = ["land.asc", "--crop", "25,12,36,29", "--overlay", file];
        let part = above(folder.path(), &crop, middle, "720");
        for (east, south, expected) in [(280.0, 130.0, "red"), (380.0, 180.0, "blue"), (410.0, 150.0, "land")] {
            assert_eq!(at(&part, east, south), expected, "{file}, cropped: {east} m east, {south} m south");
        }
    }
}

#[test]
fn a_picture_of_another_coordinate_system_is_refused() {
    let folder = folder();
    terrain(folder.path());
    let render = ["render", "land.asc", "-o", "p.png", "--overlay", "other.tif"];
    geotiff(&folder.path().join("other.tif"), &quarters([4, 4]), 32633, [500_200.0, 4_100_300.0], 10.0);
    refused(folder.path(), &render, &["other.tif", "EPSG:32632", "EPSG:32633"]);
    // An overlay elsewhere in the same system is a warning, not an error.
    geotiff(&folder.path().join("other.tif"), &quarters([4, 4]), 32632, [900_200.0, 4_100_300.0], 10.0);
    if has_device() {
        let told = cuesta(folder.path(), &render);
        assert_eq!(code(&told), 0);
        assert!(String::from_utf8_lossy(&told.stderr).contains("beside the terrain"));
    }
}

/// A picture of 588 MB: more than decoders allow by default.
#[test]
fn a_picture_of_14_000_texels_a_side_opens() {
    let folder = folder();
    let file = std::io::BufWriter::new(std::fs::File::create(folder.path().join("large.png")).unwrap());
    let mut encoder = png::Encoder::new(file, 14_000, 14_000);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_compression(png::Compression::Fast);
    let mut writer = encoder.write_header().unwrap();
    let mut rows = writer.stream_writer().unwrap();
    let row = [90, 120, 60].repeat(14_000);
    (0..14_000).for_each(|_| std::io::Write::write_all(&mut rows, &row).unwrap());
    rows.finish().unwrap();
    writer.finish().unwrap();
    let plan = |arguments: &[&str]| {
        cuesta(folder.path(), &[&["info", "demo", "--plan", "--json", "--overlay", "large.png"], arguments].concat())
    };
    let output = plan(&[]);
    let told = String::from_utf8_lossy(&output.stderr).into_owned();
    if !told.contains("no Vulkan device") {
        assert_eq!(code(&output), 0, "{told}");
        assert!(stdout(&output).contains("texture maps"));
    }
}

/// Millimetres, thousands of kilometres, and the smallest field: terrain is in view, without a warning.
#[test]
fn terrain_of_any_size_is_seen() {
    if !has_device() {
        return;
    }
    let folder = folder();
    let sizes =
        [("0.000001", "0.00000004"), ("0.0001", "0.000004"), ("0.005", "0.0002"), ("25", "1"), ("1000000", "40000")];
    for (spacing, scale) in sizes {
        for crop in ["0,0,1025,1025", "100,100,2,2", "100,100,65,33"] {
            for ortho in [false, true] {
                let width = format!("{}", spacing.parse::<f64>().unwrap() * 3.0);
                let terrain =
                    ["demo", "--spacing", spacing, "--height-scale", scale, "--crop", crop, "--colour", "height"];
                let lens = if ortho { vec!["--ortho", &width] } else { Vec::new() };
                let view = ["-o", "p.png", "--size", "96x64", "--tolerance", "4", "--validate", "--quiet"];
                json(folder.path(), &[&["render"], &terrain[..], &view[..], &lens].concat());
                let seen = image::open(folder.path().join("p.png")).unwrap().into_rgba8();
                let share = seen.pixels().filter(|p| !is_sky(p)).count() as f64 / (96.0 * 64.0);
                assert!(
                    share > if ortho { 0.02 } else { 0.1 },
                    "{spacing} m, {crop}, ortho {ortho}: {share} of it is land"
                );
            }
        }
    }
}
