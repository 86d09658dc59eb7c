//! Files of every format and layout are read back exactly.

use cuesta::internal::height::{Field, Loaded, Options, Samples, load_bytes};
use png::{BitDepth, ColorType};

use super::{
    tiff_file::{DEFLATE, LZW, NONE, PACK_BITS, TiffFile, ZSTD},
    tiny::{self, SIZE},
};

fn heights(field: &Field) -> Vec<f32> {
    let [w, h] = field.size();
    (0..h).flat_map(|j| (0..w).map(move |i| field.height(i, j))).collect()
}

fn expected([w, h]: [usize; 2], value: impl Fn(usize, usize) -> f64) -> Vec<f32> {
    (0..h).flat_map(|j| (0..w).map(|i| value(i, j) as f32).collect::<Vec<_>>()).collect()
}

/// Reads values as metres: pictures of codes would get a scale.
fn load(name: &str, bytes: &[u8]) -> Loaded {
    load_bytes(name, bytes, &Options { height_scale: Some(1.0), ..Options::default() }).unwrap()
}

#[test]
fn every_format_holds_the_same_field() {
    for file in tiny::all() {
        let loaded = file.load().unwrap();
        assert_eq!(loaded.field.size(), SIZE.map(|n| n as u32), "{}", file.name);
        assert_eq!(heights(&loaded.field), expected(SIZE, tiny::height), "{}", file.name);
        assert_eq!(loaded.field.holes().count(), 0, "{}", file.name);
        assert!(loaded.exact_in_16_bit, "{}", file.name);
    }
}

/// Every layout of a TIFF: order, size of offsets, strips or tiles, compression, sample type and predictor.
#[test]
fn tiff_layouts() {
    let types = [
        (8, 1, 1),
        (8, 2, 2),
        (16, 1, 1),
        (16, 1, 2),
        (16, 2, 1),
        (16, 2, 2),
        (32, 1, 1),
        (32, 1, 2),
        (32, 2, 1),
        (32, 2, 2),
        (32, 3, 1),
        (32, 3, 2),
        (32, 3, 3),
        (64, 3, 1),
        (64, 3, 2),
        (64, 3, 3),
    ];
    let size = [21, 19];
    for (bits, format, predictor) in types {
        let value = |i: usize, j: usize| {
            let n = ((31 * i + 17 * j) % 200) as f64;
            match (format, bits) {
                (1, 8) => n,
                (1, _) => n * 300.0,
                (2, 8) => n - 100.0,
                (2, _) => n * 300.0 - 30000.0,
                _ => n * 0.3 - 20.0,
            }
        };
        for compression in [NONE, LZW, DEFLATE, PACK_BITS, ZSTD] {
            for layout in 0..8 {
                let file = TiffFile {
                    big_endian: layout & 1 != 0,
                    big_tiff: layout & 2 != 0,
                    tile: (layout & 4 != 0).then_some([16, 16]),
                    compression,
                    predictor,
                    ..TiffFile::new(size, bits, format)
                };
                let loaded = load("layout.tif", &file.bytes(value));
                assert_eq!(heights(&loaded.field), expected(size, value), "{file:?}");
                assert_eq!(loaded.exact_in_16_bit, format != 3, "{file:?}");
            }
        }
    }
}

#[test]
fn tiff_by_another_encoder() {
    use tiff::encoder::{Compression, TiffEncoder, colortype::Gray16};
    let value = |i: usize, j: usize| ((i * i + 3 * j) % 60000) as f64;
    let pixels: Vec<u16> = expected([300, 200], value).iter().map(|&v| v as u16).collect();
    for compression in [Compression::Lzw, Compression::Packbits, Compression::Deflate(Default::default())] {
        let mut bytes = std::io::Cursor::new(Vec::new());
        let mut encoder = TiffEncoder::new(&mut bytes).unwrap().with_compression(compression);
        encoder.write_image::<Gray16>(300, 200, &pixels).unwrap();
        assert_eq!(heights(&load("x.tif", bytes.get_ref()).field), expected([300, 200], value));
    }
}

#[test]
fn tiff_black_and_white_and_sparse() {
    let mut file = TiffFile::new(SIZE, 16, 1);
    let inverted = file.clone().bytes(tiny::height);
    // PhotometricInterpretation is the fifth entry; white is zero still means the number stored.
    let at = inverted.windows(4).position(|w| w == [6, 1, 3, 0]).unwrap();
    let mut inverted = inverted;
    inverted[at + 8] = 0;
    assert_eq!(heights(&load("white.tif", &inverted).field), expected(SIZE, tiny::height));

    file.tile = Some([16, 16]);
    file.size = [32, 16];
    let mut sparse = file.bytes(tiny::height);
    // The second of two tile byte counts, at the end of the file: left out.
    let n = sparse.len();
    sparse[n - 4..].fill(0);
    let loaded = load("sparse.tif", &sparse);
    assert_eq!(loaded.field.holes().count(), 256);
    assert!(loaded.field.is_hole(16, 0) && !loaded.field.is_hole(15, 15));
}

#[test]
fn png_grey_with_alpha_and_interlace() {
    let pixels: Vec<u8> = (0..20).flat_map(|k| [40 + k, if k == 7 { 0 } else { 255 }]).collect();
    let loaded = load("alpha.png", &tiny::png(ColorType::GrayscaleAlpha, BitDepth::Eight, &pixels));
    assert_eq!((loaded.field.holes().count(), loaded.field.is_hole(2, 1)), (1, true));
    assert_eq!(loaded.field.height(3, 1), 48.0);

    // Adam7, written by hand: 8 × 8 pixels of 16 bits in seven passes.
    let value = |i: usize, j: usize| (1000 * i + j) as f64;
    let passes = [(0, 0, 8, 8), (4, 0, 8, 8), (0, 4, 4, 8), (2, 0, 4, 4), (0, 2, 2, 4), (1, 0, 2, 2), (0, 1, 1, 2)];
    let mut data = Vec::new();
    for (x, z, dx, dz) in passes {
        for j in (z..8).step_by(dz) {
            data.push(0);
            (x..8).step_by(dx).for_each(|i| data.extend((value(i, j) as u16).to_be_bytes()));
        }
    }
    let mut zlib = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::default());
    std::io::Write::write_all(&mut zlib, &data).unwrap();
    let mut bytes = b"\x89PNG\r\n\x1a\n".to_vec();
    let header = [0, 0, 0, 8, 0, 0, 0, 8, 16, 0, 0, 0, 1];
    for (kind, body) in [(b"IHDR", header.to_vec()), (b"IDAT", zlib.finish().unwrap()), (b"IEND", vec![])] {
        let mut crc = flate2::Crc::new();
        crc.update(kind);
        crc.update(&body);
        bytes.extend((body.len() as u32).to_be_bytes());
        bytes.extend(kind);
        bytes.extend(&body);
        bytes.extend(crc.sum().to_be_bytes());
    }
    assert_eq!(heights(&load("adam7.png", &bytes).field), expected([8, 8], value));
}

#[test]
fn colours_that_encode_heights() {
    let pixels: Vec<u8> = (0..20).flat_map(|k| [1, 134 + k / 10, 160 + k, if k == 0 { 0 } else { 255 }]).collect();
    let bytes = tiny::png(ColorType::Rgba, BitDepth::Eight, &pixels);
    let error = load_bytes("rgb.png", &bytes, &Options::default()).unwrap_err().to_string();
    assert!(error.contains("--encoding terrarium|mapbox"), "{error}");
    let options = Options { encoding: Some("mapbox".parse().unwrap()), ..Options::default() };
    let loaded = load_bytes("rgb.png", &bytes, &options).unwrap();
    // −10000 + (65536 + 134 · 256 + 161) · 0.1 m
    assert_eq!(loaded.field.height(1, 0), 0.1);
    assert!(loaded.field.is_hole(0, 0) && loaded.exact_in_16_bit);

    let file = TiffFile { bands: 3, ..TiffFile::new(SIZE, 8, 1) };
    let bytes = file.bytes(|i, j| {
        if i % 3 == 0 {
            128.0
        } else if i % 3 == 1 {
            tiny::height(i / 3, j)
        } else {
            64.0
        }
    });
    assert!(load_bytes("rgb.tif", &bytes, &Options::default()).unwrap_err().to_string().contains("--encoding"));
    let options = Options { encoding: Some("terrarium".parse().unwrap()), ..Options::default() };
    let loaded = load_bytes("rgb.tif", &bytes, &options).unwrap();
    assert_eq!(heights(&loaded.field), expected(SIZE, |i, j| tiny::height(i, j) + 0.25));
}

#[test]
fn usgs_dem_with_ragged_profiles() {
    let bytes = tiny::usgs_dem(|i| if i == 0 { [1, 2] } else { [0, SIZE[1] - 1] });
    let field = load("ragged.dem", &bytes).field;
    assert_eq!(field.size(), [5, 4]);
    assert_eq!(field.holes().count(), 2);
    assert!(field.is_hole(0, 0) && field.is_hole(0, 3));
    assert_eq!(field.height(0, 1), tiny::height(0, 1) as f32);
    assert_eq!((field.spacing, field.origin), ([30.0; 2], [600_000.0, -5_100_090.0]));
    assert_eq!(field.crs.as_deref(), Some("EPSG:26710"));
}

#[test]
fn hgt_by_its_length() {
    let mut bytes: Vec<u8> = (0..1201 * 1201).flat_map(|k| ((k % 1201) as i16).to_be_bytes()).collect();
    bytes[..2].copy_from_slice(&i16::MIN.to_be_bytes());
    for (name, bytes) in [
        ("a/S10W020.hgt", bytes.clone()),
        ("S10W020.hgt.gz", tiny::gzip(&bytes)),
        ("x.zip", tiny::zip(&[("about.txt", b"not heights"), ("s10w020.HGT", &bytes)])),
    ] {
        let loaded = load(name, &bytes);
        assert_eq!((loaded.format, loaded.field.size()), ("SRTM HGT", [1201, 1201]), "{name}");
        assert!(loaded.field.is_hole(0, 0) && loaded.field.holes().count() == 1, "{name}");
        assert_eq!(loaded.field.height(1200, 700), 1200.0);
        // North-west corner at 9° S 20° W.
        assert!((loaded.field.origin[1] - 9.0 * 110_600.0).abs() < 1000.0, "{:?}", loaded.field.origin);
        assert!(loaded.field.origin[0] < -2.1e6);
    }
    assert_eq!(load("unnamed", &bytes).warnings.len(), 1);
}

#[test]
fn zip_with_header_and_projection() {
    let esri = tiny::all().into_iter().find(|file| file.name == "esri.bil").unwrap();
    let prj = br#"PROJCS["NAD83 / UTM zone 11N",GEOGCS["NAD83",UNIT["degree",0.0174]],UNIT["metre",1],AUTHORITY["EPSG","26911"]]"#;
    let bytes = tiny::zip(&[("a.hdr", esri.hdr.as_deref().unwrap()), ("a.bil", &esri.bytes), ("a.prj", prj)]);
    let loaded = load("a.zip", &bytes);
    assert_eq!((loaded.format, loaded.field.crs.as_deref()), ("ESRI BIL", Some("EPSG:26911")));
    assert_eq!(loaded.field.origin, [1005.0, -2035.0]);
}

#[test]
fn compacted_is_exact_or_nothing() {
    for (heights, scale) in [
        (vec![-3.0f32, 5.0, 65532.0], Some(1.0)),
        (vec![-3.0, 5.0, 65533.0], None),
        (vec![0.5, 1000.25, -7.0], Some(0.25)),
        (vec![0.00390625, 255.0], Some(0.00390625)),
        (vec![0.00390625, 257.0], None),
        (vec![0.1, 0.2], None),
        (vec![f32::NAN, 1.0], None),
        (vec![1e30, 1e30], None),
        (vec![16_777_215.0, 16_777_200.0], Some(1.0)),
    ] {
        let compacted = Samples::F32(heights.clone()).compacted();
        match &compacted {
            Samples::Coded { scale: found, .. } => assert_eq!(Some(*found), scale, "{heights:?}"),
            Samples::F32(_) => assert_eq!(None, scale, "{heights:?}"),
        }
        if scale.is_some() {
            let back: Vec<f32> = (0..heights.len()).map(|k| compacted.height(k)).collect();
            assert_eq!(back, heights);
        }
    }
}
