//! Formats that are recognised by their first bytes but not read, and the way to convert each.

use std::path::Path;

/// A format that is recognised and not read.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Known {
    /// Byte position of the magic.
    at: usize,
    /// The bytes there.
    magic: &'static [u8],
    /// Name of the format, with an article where one belongs.
    pub name: &'static str,
    /// The way to a file that is read.
    advice: &'static str,
}

const RASTER: &str = "convert it with `gdal_translate IN OUT.tif`";
const VARIABLE: &str = "convert one variable with `gdal_translate -sds IN OUT.tif`, or name it: \
                        `gdal_translate NETCDF:\"IN\":VARIABLE OUT.tif`";
const DATASET: &str = "convert one dataset of it with `gdal_translate -sds IN OUT.tif`";
const PACKAGE: &str = "export one raster with `gdal_translate IN OUT.tif`";
const POINTS: &str = "make a grid of its points first, as with `pdal translate IN OUT.tif --writer gdal`";
const TABLE: &str = "make a grid of it with `gdal_translate IN OUT.tif` (points of a grid) or `gdal_grid IN OUT.tif`";
const VECTOR: &str =
    "it holds shapes, not a grid of heights: `gdal_rasterize -a FIELD IN OUT.tif` or `gdal_grid` makes one";
const MESH: &str = "it holds a mesh, not a grid of heights: export the height map as a 16-bit PNG or TIFF";
const UNPACK: &str = "unpack it and give the height file inside";
const TILES: &str = "extract its tiles to a folder zoom/x/y.png";
const PICTURE: &str = "it holds no heights: save a height map as a 16-bit PNG or TIFF";
const DOWNLOAD: &str = "the download failed: open it to see why, then download the height file again";

const fn known(at: usize, magic: &'static [u8], name: &'static str, advice: &'static str) -> Known {
    Known { at, magic, name, advice }
}

/// An empty file.
static EMPTY: Known = known(0, b"", "0 bytes (an empty file)", "download or export it again");
static XYZ: Known = known(0, b"", "XYZ text", TABLE);
static HTML: Known = known(0, b"", "an HTML page", DOWNLOAD);
static GEOJSON: Known = known(0, b"", "GeoJSON", VECTOR);
static JSON: Known = known(0, b"", "JSON text", DOWNLOAD);
static XML: Known = known(0, b"", "XML text", DOWNLOAD);
static TILEJSON: Known = known(0, b"", "the description of a tile directory", "give the directory instead");
static ZARR: Known = known(0, b"", "a Zarr array", RASTER);
static COVERAGE: Known = known(0, b"", "an Arc/Info binary grid", RASTER);
static GEODATABASE: Known = known(0, b"", "an Esri file geodatabase", PACKAGE);

/// Formats by magic bytes; the first match counts, of at least four bytes before shorter ones.
static BINARY: &[Known] = &[
    known(0, b"CDF\x01", "NetCDF", VARIABLE),
    known(0, b"CDF\x02", "NetCDF", VARIABLE),
    known(0, b"CDF\x05", "NetCDF", VARIABLE),
    known(0, b"\x89HDF\r\n\x1a\n", "HDF5 (also NetCDF-4 and BAG)", VARIABLE),
    known(0, b"\x0e\x03\x13\x01", "HDF4", DATASET),
    known(0, b"GRIB", "GRIB", RASTER),
    known(0, b"UHL1", "DTED", RASTER),
    known(80, b"UHL1", "DTED", RASTER),
    known(160, b"UHL1", "DTED", RASTER),
    known(0, b"NITF0", "NITF", RASTER),
    known(0, b"EHFA_HEADER_TAG", "Erdas Imagine (.img)", RASTER),
    known(0, b"GRID1.2\0", "an Arc/Info binary grid", RASTER),
    known(0, b" EXP  ", "an Arc/Info export (.e00)", RASTER),
    known(0, b"DSAA", "a Surfer grid", RASTER),
    known(0, b"DSBB", "a Surfer grid", RASTER),
    known(0, b"DSRB", "a Surfer grid", RASTER),
    known(0, b"RUU CROSS SYSTEM MAP FORMAT", "a PCRaster map", RASTER),
    known(0, b"HGPC", "a Vertical Mapper grid", RASTER),
    known(0, b"PCIDSK", "PCIDSK", RASTER),
    known(0, b"binterr1.", "a VTP binary terrain (.bt)", RASTER),
    known(0, b"SIMPLE  =", "FITS", RASTER),
    known(0, b"TERRAGENTERRAIN ", "a Terragen terrain", RASTER),
    known(0, b"CntZImage ", "LERC", RASTER),
    known(0, b"Lerc2 ", "LERC", RASTER),
    known(0, b"\0\0\0\x0cjP  \r\n\x87\n", "JPEG 2000", RASTER),
    known(0, b"\xff\x4f\xff\x51", "JPEG 2000", RASTER),
    known(0, b"msid", "MrSID", RASTER),
    known(0, b"v/1\x01", "OpenEXR", RASTER),
    known(0, b"\x93NUMPY", "a NumPy array", "write its samples bare and give --raw WxH:TYPE"),
    known(0, b"MATLAB 5.0", "a MATLAB file", RASTER),
    known(68, b"GPKG", "a GeoPackage", PACKAGE),
    known(68, b"MPBX", "MBTiles", TILES),
    known(0, b"SQLite format 3\0", "SQLite (MBTiles or GeoPackage)", PACKAGE),
    known(0, b"PMTiles", "PMTiles", TILES),
    known(0, b"LASF", "a LAS or LAZ point cloud", POINTS),
    known(0, b"ASTM-E57", "an E57 point cloud", POINTS),
    known(0, b"# .PCD", "a PCD point cloud", POINTS),
    known(0, b"\0\0\x27\x0a", "a shapefile", VECTOR),
    known(0, b"fgb\x03", "FlatGeobuf", VECTOR),
    known(0, b"PAR1", "Parquet", VECTOR),
    known(0, b"AC10", "a DWG drawing", VECTOR),
    known(0, b"ply\n", "a PLY mesh or point cloud", MESH),
    known(0, b"ply\r\n", "a PLY mesh or point cloud", MESH),
    known(0, b"glTF", "glTF", MESH),
    known(0, b"Kaydara FBX", "FBX", MESH),
    known(0, b"BLENDER", "a Blender file", MESH),
    known(0, b"7z\xbc\xaf\x27\x1c", "a 7z archive", UNPACK),
    known(0, b"Rar!\x1a\x07", "a RAR archive", UNPACK),
    known(0, b"\xfd7zXZ\0", "xz data", UNPACK),
    known(0, b"BZh", "bzip2 data", UNPACK),
    known(0, b"\x28\xb5\x2f\xfd", "Zstandard data", UNPACK),
    known(0, b"\x04\x22\x4d\x18", "LZ4 data", UNPACK),
    known(0, b"PK\x05\x06", "an empty zip archive", DOWNLOAD),
    known(0, b"%PDF", "a PDF document", DOWNLOAD),
    known(0, b"\xff\xd8\xff", "a JPEG picture", PICTURE),
    known(0, b"GIF8", "a GIF picture", PICTURE),
    known(0, b"BM", "a BMP picture", PICTURE),
    known(0, b"P2\n", "a PGM picture", RASTER),
    known(0, b"P5\n", "a PGM picture", RASTER),
    known(0, b"Pf\n", "a PFM picture", RASTER),
    known(0, b"DDS ", "a DDS picture", PICTURE),
    known(0, b"\xabKTX ", "a KTX picture", PICTURE),
    known(0, b"8BPS", "a Photoshop file", PICTURE),
    known(4, b"ftypavif", "an AVIF picture", PICTURE),
    known(4, b"ftypheic", "an HEIC picture", PICTURE),
    known(0, b"\0\0\0\x0cJXL \r\n\x87\n", "a JPEG XL picture", PICTURE),
    known(0, b"#?RADIANCE", "a Radiance picture", PICTURE),
    known(
        0,
        b"version https://git-lfs",
        "a git-lfs pointer",
        "the file itself is elsewhere: `git lfs pull` fetches it",
    ),
    known(0, b"\xff\xfe", "UTF-16 text", "save it as UTF-8"),
    known(0, b"\xfe\xff", "UTF-16 text", "save it as UTF-8"),
];

/// Text formats by their first word after white space, in lower case.
static TEXT: &[Known] = &[
    known(0, b"<!doctype html", "an HTML page", DOWNLOAD),
    known(0, b"<html", "an HTML page", DOWNLOAD),
    known(0, b"<vrtdataset", "a GDAL virtual raster (.vrt)", RASTER),
    known(0, b"<gml", "GML", VECTOR),
    known(0, b"<kml", "KML", VECTOR),
    known(0, b"<error", "an XML error message", DOWNLOAD),
    known(0, b"<serviceexception", "an XML error message", DOWNLOAD),
    known(0, b"<tilemap", "the description of a tile directory", "give the directory instead"),
    known(0, b"north:", "a GRASS ASCII grid", RASTER),
    known(0, b"datasetheader begin", "an ER Mapper header (.ers)", RASTER),
    known(0, b"name\t=", "a SAGA header (.sgrd)", RASTER),
    known(0, b"file format :", "an Idrisi header (.rdc)", RASTER),
    known(0, b"[basemap]", "an ILWIS map", RASTER),
    known(0, b"<mrf_meta>", "a Meta Decoded Format description (.mrf)", RASTER),
    known(0, b"<pamdataset", "the metadata of a raster (.aux.xml)", "give the raster beside it instead"),
    known(0, b"#vrml", "VRML", MESH),
    known(0, b"solid ", "an STL mesh", MESH),
    known(0, b"qgis", "a QGIS project", "export the layer as GeoTIFF"),
    known(0, b"<!doctype qgis", "a QGIS project", "export the layer as GeoTIFF"),
];

impl Known {
    /// The format that a file begins with beyond doubt, by at least four bytes.
    pub fn certain(head: &[u8]) -> Option<&'static Self> {
        BINARY.iter().find(|known| known.magic.len() >= 4 && known.begins(head)).or_else(|| text(head))
    }

    /// The format that a file begins with, if it is one that is not read.
    pub fn of(head: &[u8], len: u64) -> Option<&'static Self> {
        if len == 0 {
            return Some(&EMPTY);
        }
        Self::certain(head).or_else(|| BINARY.iter().find(|known| known.begins(head)))
    }

    fn begins(&self, head: &[u8]) -> bool {
        head.get(self.at..).is_some_and(|rest| rest.starts_with(self.magic))
    }

    /// The format of a folder that is one dataset, if it is one that is not read.
    pub fn of_folder(folder: &Path) -> Option<&'static Self> {
        let holds = |files: &[&str]| files.iter().any(|file| folder.join(file).is_file());
        match () {
            () if holds(&["a00000001.gdbtable"]) => Some(&GEODATABASE),
            () if holds(&[".zgroup", ".zarray", "zarr.json"]) => Some(&ZARR),
            () if holds(&["hdr.adf"]) => Some(&COVERAGE),
            () => None,
        }
    }

    /// The error text: what was found, and what to do.
    pub fn what(&self) -> String {
        format!("expected a height format that is read, found {}: {}", self.name, self.advice)
    }
}

/// A text format that is not read.
fn text(head: &[u8]) -> Option<&'static Known> {
    let head = String::from_utf8_lossy(head.strip_prefix(b"\xef\xbb\xbf").unwrap_or(head)).to_ascii_lowercase();
    if head.contains('\0') {
        return None;
    }
    let mut start = head.trim_start();
    let is_xml = start.starts_with("<?xml");
    if is_xml {
        start = start.split_once("?>").map_or("", |(_, rest)| rest).trim_start();
    }
    let begins = |known: &&Known| start.as_bytes().starts_with(known.magic);
    TEXT.iter().find(begins).or_else(|| match start.as_bytes().first() {
        _ if is_xml => Some(&XML),
        Some(b'<') if start.contains("<html") || start.contains("<body") => Some(&HTML),
        Some(b'{') if start.contains("\"tilejson\"") => Some(&TILEJSON),
        Some(b'{' | b'[') if start.contains("\"feature") => Some(&GEOJSON),
        Some(b'{' | b'[') => Some(&JSON),
        _ => is_xyz(&head).then_some(&XYZ),
    })
}

/// Returns true if every line after a title and comments has three numbers.
fn is_xyz(head: &str) -> bool {
    let whole = head.rsplit_once('\n').map_or(head, |(whole, _)| whole);
    let lines = whole.lines().map(str::trim).filter(|line| !line.is_empty() && !line.starts_with(['#', '/']));
    let is_point = |line: &str| {
        let words = || line.split([' ', '\t', ',', ';']).filter(|word| !word.is_empty());
        words().count() >= 3 && words().take(3).all(|word| word.parse::<f64>().is_ok())
    };
    let mut lines = lines.skip_while(|line| line.starts_with(char::is_alphabetic)).take(8).peekable();
    lines.peek().is_some() && lines.all(is_point)
}
