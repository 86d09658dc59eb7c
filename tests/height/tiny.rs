//! Tiny files of every format that holds the same field.

use std::io::{Cursor, Write};

use cuesta::internal::height::{Loaded, Options, load_bytes_with};

use super::tiff_file::{DEFLATE, TiffFile, ZSTD};

/// Samples along (x, z) of all tiny files.
pub const SIZE: [usize; 2] = [5, 4];

/// Height of sample (i, j), metres.
pub fn height(i: usize, j: usize) -> f64 {
    (20 + 7 * i + 3 * j + i * j) as f64
}

/// A file, and the header beside it.
pub struct Tiny {
    pub name: &'static str,
    pub bytes: Vec<u8>,
    pub hdr: Option<Vec<u8>>,
    pub options: Options,
}

impl Tiny {
    fn new(name: &'static str, bytes: Vec<u8>) -> Self {
        Self { name, bytes, hdr: None, options: Options { max_samples: 1 << 16, ..Options::default() } }
    }

    /// Reads other bytes in place of the file's, and of the header's.
    pub fn load_as(&self, bytes: &[u8], hdr: Option<&[u8]>) -> Result<Loaded, cuesta::internal::height::Error> {
        let sibling = |extension: &str| hdr.filter(|_| extension == "hdr").map(<[u8]>::to_vec);
        load_bytes_with(self.name, bytes, &sibling, &self.options)
    }

    pub fn load(&self) -> Result<Loaded, cuesta::internal::height::Error> {
        self.load_as(&self.bytes, self.hdr.as_deref())
    }
}

fn rows() -> impl Iterator<Item = (usize, usize)> {
    (0..SIZE[1]).flat_map(|j| (0..SIZE[0]).map(move |i| (i, j)))
}

pub fn png(color: png::ColorType, depth: png::BitDepth, pixels: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, SIZE[0] as u32, SIZE[1] as u32);
    encoder.set_color(color);
    encoder.set_depth(depth);
    encoder.write_header().unwrap().write_image_data(pixels).unwrap();
    bytes
}

pub fn zip(members: &[(&str, &[u8])]) -> Vec<u8> {
    let mut writer = zip::ZipWriter::new(Cursor::new(Vec::new()));
    for (name, bytes) in members {
        writer.start_file(*name, zip::write::SimpleFileOptions::default()).unwrap();
        writer.write_all(bytes).unwrap();
    }
    writer.finish().unwrap().into_inner()
}

pub fn tar(members: &[(&str, &[u8])]) -> Vec<u8> {
    let mut builder = tar::Builder::new(Vec::new());
    for (name, bytes) in members {
        let mut header = tar::Header::new_ustar();
        header.set_size(bytes.len() as u64);
        header.set_mode(0o644);
        builder.append_data(&mut header, name, *bytes).unwrap();
    }
    builder.into_inner().unwrap()
}

pub fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
    encoder.write_all(bytes).unwrap();
    encoder.finish().unwrap()
}

pub fn asc() -> String {
    let [w, h] = SIZE;
    let mut text = format!("ncols {w}\nnrows {h}\nxllcorner 1000\nyllcorner 2000\ncellsize 10\nNODATA_value -9999\n");
    for j in 0..h {
        let row: Vec<String> = (0..w).map(|i| height(i, j).to_string()).collect();
        text += &(row.join(" ") + "\n");
    }
    text
}

/// Record A and a profile a column; `reach` is the first and last row from the south of a column.
pub fn usgs_dem(reach: impl Fn(usize) -> [usize; 2]) -> Vec<u8> {
    let [w, h] = SIZE;
    let float = |value: f64| {
        let text = format!("{value:.15E}");
        let (mantissa, exponent) = text.split_once('E').unwrap();
        format!("{:>24}", format!("{mantissa}D{:+03}", exponent.parse::<i32>().unwrap()))
    };
    let mut text = format!("{:144}{:6}{:6}{:6}{:6}", "TINY", 1, 1, 1, 10);
    text += &float(0.0).repeat(15).chars().take(360).collect::<String>();
    text = format!("{text:528}{:6}{:6}{:6}", 2, 2, 4);
    text = format!("{text:738}");
    text = format!("{text:816}{:12.6E}{:12.6E}{:12.6E}{:6}{:6}", 30.0, 30.0, 1.0, 1, w);
    text = format!("{text:1024}");
    for i in 0..w {
        let [south, north] = reach(i);
        let mut profile = format!("{:6}{:6}{:6}{:6}", 1, i + 1, north - south + 1, 1);
        let at = [600_000.0 + 30.0 * i as f64, 5_100_000.0 + 30.0 * south as f64, 0.0, 0.0, 0.0];
        at.iter().for_each(|&n| profile += &float(n));
        (south..=north).for_each(|row| profile += &format!("{:6}", height(i, h - 1 - row)));
        text += &format!("{profile:1024}");
    }
    text.into_bytes()
}

/// One file of each format.
pub fn all() -> Vec<Tiny> {
    let u16s = |order: fn(u16) -> [u8; 2]| rows().flat_map(|(i, j)| order(height(i, j) as u16)).collect::<Vec<u8>>();
    let f32s: Vec<u8> = rows().flat_map(|(i, j)| (height(i, j) as f32).to_le_bytes()).collect();
    let u8s: Vec<u8> = rows().map(|(i, j)| height(i, j) as u8).collect();
    let terrarium: Vec<u8> = rows().flat_map(|(i, j)| [128, height(i, j) as u8, 0]).collect();
    let tiff = TiffFile::new(SIZE, 16, 2).placed([30.0, 30.0], [1000.0, 2000.0]).keys(&[[1024, 1], [3072, 32611]]);
    let dem = usgs_dem(|_| [0, SIZE[1] - 1]);

    let mut files = vec![
        Tiny::new("strips.tif", tiff.bytes(height)),
        Tiny::new("tiles.tif", TiffFile { tile: Some([16, 16]), big_endian: true, ..tiff.clone() }.bytes(height)),
        Tiny::new("deflate.tif", TiffFile { compression: DEFLATE, predictor: 2, ..tiff.clone() }.bytes(height)),
        Tiny::new("zstd.tif", TiffFile { compression: ZSTD, big_tiff: true, ..tiff.clone() }.bytes(height)),
        Tiny::new("f32.tif", TiffFile { bits: 32, format: 3, predictor: 3, ..tiff }.bytes(height)),
        Tiny::new("grey8.png", png(png::ColorType::Grayscale, png::BitDepth::Eight, &u8s)),
        Tiny::new("grey16.png", png(png::ColorType::Grayscale, png::BitDepth::Sixteen, &u16s(u16::to_be_bytes))),
        Tiny::new("terrarium.png", png(png::ColorType::Rgb, png::BitDepth::Eight, &terrarium)),
        Tiny::new("grid.asc", asc().into_bytes()),
        Tiny::new("grid.asc.gz", gzip(asc().as_bytes())),
        Tiny::new("grid.zip", zip(&[("grid.asc", asc().as_bytes())])),
        Tiny::new("grid.tar.gz", gzip(&tar(&[("grid.asc", asc().as_bytes())]))),
        Tiny::new("quad.dem", dem),
        Tiny::new("bare.raw", u16s(u16::to_be_bytes)),
        Tiny::new("esri.bil", u16s(u16::to_le_bytes)),
        Tiny::new("esri.flt", f32s.clone()),
        Tiny::new("envi.dat", f32s),
    ];
    let mut file = |name: &str| files.iter_mut().position(|file| file.name == name).unwrap();
    let (raw, rgb, bil, flt, envi) =
        (file("bare.raw"), file("terrarium.png"), file("esri.bil"), file("esri.flt"), file("envi.dat"));
    files[raw].options.raw = Some("5x4:u16be".parse().unwrap());
    files[rgb].options.encoding = Some("terrarium".parse().unwrap());
    files[bil].hdr = Some(
        b"BYTEORDER I\nLAYOUT BIL\nNROWS 4\nNCOLS 5\nNBANDS 1\nNBITS 16\nBANDROWBYTES 10\nTOTALROWBYTES 10\n\
          ULXMAP 1005\nULYMAP 2035\nXDIM 10\nYDIM 10\nNODATA 0\n"
            .to_vec(),
    );
    files[flt].hdr = Some(
        b"ncols 5\nnrows 4\nxllcorner 1000\nyllcorner 2000\ncellsize 10\nNODATA_value -9999\nbyteorder LSBFIRST\n"
            .to_vec(),
    );
    files[envi].hdr = Some(
        b"ENVI\ndescription = {\n  tiny}\nsamples = 5\nlines = 4\nbands = 1\nheader offset = 0\ndata type = 4\n\
          interleave = bsq\nbyte order = 0\nmap info = {UTM, 1, 1, 1000, 2040, 10, 10, 11, North, WGS-84, units=Meters}\n"
            .to_vec(),
    );
    files
}
