//! The table of formats.

use super::format::Detect::{By, Folder, Magic, Word};
use super::format::Read::{Archive, Bands, Beside, Dataset, One};
use super::format::{Format, read, unread};
use super::{archive, asc, bil, folder, hgt, png, raw, terrain_rgb, tiff, tiles, usgs_dem};

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

/// All formats in the order in which they are detected: the first row that matches a file or folder counts.
///
/// Unread rows name a format in errors, and state the conversion. Magic numbers below four bytes come last, because
/// samples may begin with them by chance.
pub const FORMATS: &[Format] = &[
    read("raw", By(|head| head.is_raw), One(raw::read), "bare samples, of the layout `--raw WxH:TYPE`"),
    read(
        "GeoTIFF",
        By(|head| tiff::is_tiff(head.bytes)),
        Bands(tiff::read),
        "also TIFF, COG and BigTIFF: integers of 1 to 32 and 64 bits, floats of 16, 24, 32 and 64; strips and tiles, \
         planar or chunky; none, LZW, Deflate, ZSTD, PackBits, with predictors; internal masks and alpha; `--band N` \
         (band 1 unless given)",
    ),
    read(
        "PNG",
        Magic(0, b"\x89PNG"),
        One(png::read),
        "8 and 16 bits of grey; Terrain-RGB and Terrarium colours with `--encoding`",
    ),
    read("zip", Magic(0, b"PK\x03\x04"), Archive(archive::gather_zip), "its height files, as of a folder"),
    read(
        "gzip",
        Magic(0, b"\x1f\x8b\x08"),
        Archive(archive::gather_gzip),
        "its height file, or those of a tar archive in it",
    ),
    read(
        "WebP",
        By(|head| terrain_rgb::is_webp(head.bytes)),
        One(terrain_rgb::read),
        "Terrain-RGB and Terrarium colours with `--encoding`",
    ),
    read(
        "tar",
        By(|head| archive::is_tar(head.bytes)),
        Archive(archive::gather_tar),
        "its height files, as of a folder",
    ),
    read(
        "ESRI BIL",
        By(|head| bil::is_header(head.unmarked())),
        Beside { data: bil::data_beside, read: bil::read },
        bil::ABOUT,
    ),
    read(
        "ESRI ASCII grid",
        By(|head| asc::is_header(head.unmarked())),
        One(asc::read),
        "with byte order mark, decimal commas, `null`",
    ),
    read("USGS DEM", By(|head| usgs_dem::is_header(head.bytes)), One(usgs_dem::read), "ASCII profiles"),
    read(
        "SRTM HGT",
        By(|head| !head.has_header && hgt::size(head.len).is_some()),
        One(hgt::read),
        "1201², 3601², 7201² and 1801 × 3601 samples, position from the name",
    ),
    unread("NetCDF", Magic(0, b"CDF\x01"), VARIABLE),
    unread("NetCDF", Magic(0, b"CDF\x02"), VARIABLE),
    unread("NetCDF", Magic(0, b"CDF\x05"), VARIABLE),
    unread("HDF5 (also NetCDF-4 and BAG)", Magic(0, b"\x89HDF\r\n\x1a\n"), VARIABLE),
    unread("HDF4", Magic(0, b"\x0e\x03\x13\x01"), DATASET),
    unread("GRIB", Magic(0, b"GRIB"), RASTER),
    unread("DTED", Magic(0, b"UHL1"), RASTER),
    unread("DTED", Magic(80, b"UHL1"), RASTER),
    unread("DTED", Magic(160, b"UHL1"), RASTER),
    unread("NITF", Magic(0, b"NITF0"), RASTER),
    unread("Erdas Imagine (.img)", Magic(0, b"EHFA_HEADER_TAG"), RASTER),
    unread("an Arc/Info binary grid", Magic(0, b"GRID1.2\0"), RASTER),
    unread("an Arc/Info export (.e00)", Magic(0, b" EXP  "), RASTER),
    unread("a Surfer grid", Magic(0, b"DSAA"), RASTER),
    unread("a Surfer grid", Magic(0, b"DSBB"), RASTER),
    unread("a Surfer grid", Magic(0, b"DSRB"), RASTER),
    unread("a PCRaster map", Magic(0, b"RUU CROSS SYSTEM MAP FORMAT"), RASTER),
    unread("a Vertical Mapper grid", Magic(0, b"HGPC"), RASTER),
    unread("PCIDSK", Magic(0, b"PCIDSK"), RASTER),
    unread("a VTP binary terrain (.bt)", Magic(0, b"binterr1."), RASTER),
    unread("FITS", Magic(0, b"SIMPLE  ="), RASTER),
    unread("a Terragen terrain", Magic(0, b"TERRAGENTERRAIN "), RASTER),
    unread("LERC", Magic(0, b"CntZImage "), RASTER),
    unread("LERC", Magic(0, b"Lerc2 "), RASTER),
    unread("JPEG 2000", Magic(0, b"\0\0\0\x0cjP  \r\n\x87\n"), RASTER),
    unread("JPEG 2000", Magic(0, b"\xff\x4f\xff\x51"), RASTER),
    unread("MrSID", Magic(0, b"msid"), RASTER),
    unread("OpenEXR", Magic(0, b"v/1\x01"), RASTER),
    unread("a NumPy array", Magic(0, b"\x93NUMPY"), "write its samples bare and give --raw WxH:TYPE"),
    unread("a MATLAB file", Magic(0, b"MATLAB 5.0"), RASTER),
    unread("a GeoPackage", Magic(68, b"GPKG"), PACKAGE),
    unread("MBTiles", Magic(68, b"MPBX"), TILES),
    unread("SQLite (MBTiles or GeoPackage)", Magic(0, b"SQLite format 3\0"), PACKAGE),
    unread("PMTiles", Magic(0, b"PMTiles"), TILES),
    unread("a LAS or LAZ point cloud", Magic(0, b"LASF"), POINTS),
    unread("an E57 point cloud", Magic(0, b"ASTM-E57"), POINTS),
    unread("a PCD point cloud", Magic(0, b"# .PCD"), POINTS),
    unread("a shapefile", Magic(0, b"\0\0\x27\x0a"), VECTOR),
    unread("FlatGeobuf", Magic(0, b"fgb\x03"), VECTOR),
    unread("Parquet", Magic(0, b"PAR1"), VECTOR),
    unread("a DWG drawing", Magic(0, b"AC10"), VECTOR),
    unread("a PLY mesh or point cloud", Magic(0, b"ply\n"), MESH),
    unread("a PLY mesh or point cloud", Magic(0, b"ply\r\n"), MESH),
    unread("glTF", Magic(0, b"glTF"), MESH),
    unread("FBX", Magic(0, b"Kaydara FBX"), MESH),
    unread("a Blender file", Magic(0, b"BLENDER"), MESH),
    unread("a 7z archive", Magic(0, b"7z\xbc\xaf\x27\x1c"), UNPACK),
    unread("a RAR archive", Magic(0, b"Rar!\x1a\x07"), UNPACK),
    unread("xz data", Magic(0, b"\xfd7zXZ\0"), UNPACK),
    unread("Zstandard data", Magic(0, b"\x28\xb5\x2f\xfd"), UNPACK),
    unread("LZ4 data", Magic(0, b"\x04\x22\x4d\x18"), UNPACK),
    unread("an empty zip archive", Magic(0, b"PK\x05\x06"), DOWNLOAD),
    unread("a PDF document", Magic(0, b"%PDF"), DOWNLOAD),
    unread("a GIF picture", Magic(0, b"GIF8"), PICTURE),
    unread("a DDS picture", Magic(0, b"DDS "), PICTURE),
    unread("a KTX picture", Magic(0, b"\xabKTX "), PICTURE),
    unread("a Photoshop file", Magic(0, b"8BPS"), PICTURE),
    unread("an AVIF picture", Magic(4, b"ftypavif"), PICTURE),
    unread("an HEIC picture", Magic(4, b"ftypheic"), PICTURE),
    unread("a JPEG XL picture", Magic(0, b"\0\0\0\x0cJXL \r\n\x87\n"), PICTURE),
    unread("a Radiance picture", Magic(0, b"#?RADIANCE"), PICTURE),
    unread(
        "a git-lfs pointer",
        Magic(0, b"version https://git-lfs"),
        "the file itself is elsewhere: `git lfs pull` fetches it",
    ),
    unread("an HTML page", Word("<!doctype html"), DOWNLOAD),
    unread("an HTML page", Word("<html"), DOWNLOAD),
    unread("a GDAL virtual raster (.vrt)", Word("<vrtdataset"), RASTER),
    unread("GML", Word("<gml"), VECTOR),
    unread("KML", Word("<kml"), VECTOR),
    unread("an XML error message", Word("<error"), DOWNLOAD),
    unread("an XML error message", Word("<serviceexception"), DOWNLOAD),
    unread("the description of a tile directory", Word("<tilemap"), "give the directory instead"),
    unread("a GRASS ASCII grid", Word("north:"), RASTER),
    unread("an ER Mapper header (.ers)", Word("datasetheader begin"), RASTER),
    unread("a SAGA header (.sgrd)", Word("name\t="), RASTER),
    unread("an Idrisi header (.rdc)", Word("file format :"), RASTER),
    unread("an ILWIS map", Word("[basemap]"), RASTER),
    unread("a Meta Decoded Format description (.mrf)", Word("<mrf_meta>"), RASTER),
    unread("the metadata of a raster (.aux.xml)", Word("<pamdataset"), "give the raster beside it instead"),
    unread("VRML", Word("#vrml"), MESH),
    unread("an STL mesh", Word("solid "), MESH),
    unread("a QGIS project", Word("qgis"), "export the layer as GeoTIFF"),
    unread("a QGIS project", Word("<!doctype qgis"), "export the layer as GeoTIFF"),
    unread("XML text", By(|head| head.is_xml), DOWNLOAD),
    unread("an HTML page", By(|head| head.begins("<") && (head.says("<html") || head.says("<body"))), DOWNLOAD),
    unread(
        "the description of a tile directory",
        By(|head| head.begins("{") && head.says("\"tilejson\"")),
        "give the directory instead",
    ),
    unread("GeoJSON", By(|head| (head.begins("{") || head.begins("[")) && head.says("\"feature")), VECTOR),
    unread("JSON text", By(|head| head.begins("{") || head.begins("[")), DOWNLOAD),
    unread("XYZ text", By(|head| head.is_xyz()), TABLE),
    read("ESRI BIL", By(|head| head.has_header), One(bil::read), bil::ABOUT),
    unread("bzip2 data", Magic(0, b"BZh"), UNPACK),
    unread("a JPEG picture", Magic(0, b"\xff\xd8\xff"), PICTURE),
    unread("a BMP picture", Magic(0, b"BM"), PICTURE),
    unread("a PGM picture", Magic(0, b"P2\n"), RASTER),
    unread("a PGM picture", Magic(0, b"P5\n"), RASTER),
    unread("a PFM picture", Magic(0, b"Pf\n"), RASTER),
    unread("UTF-16 text", Magic(0, b"\xff\xfe"), "save it as UTF-8"),
    unread("UTF-16 text", Magic(0, b"\xfe\xff"), "save it as UTF-8"),
    unread("0 bytes (an empty file)", By(|head| head.len == 0), "download or export it again"),
    unread("an Esri file geodatabase", Folder(&["a00000001.gdbtable"]), PACKAGE),
    unread("a Zarr array", Folder(&[".zgroup", ".zarray", "zarr.json"]), RASTER),
    unread("an Arc/Info binary grid", Folder(&["hdr.adf"]), RASTER),
    read(
        "web-map tiles",
        Folder(&[]),
        Dataset(tiles::gather),
        "a folder `z/x/y` of Terrain-RGB or Terrarium PNG or WebP, rows from north or south (TMS), `@2x`; absent and \
         empty tiles are holes",
    ),
    read(
        "folder",
        Folder(&[]),
        Dataset(folder::gather),
        "like several files: one field of one grid, where gaps are holes and a later file overlies an earlier one",
    ),
];

#[cfg(test)]
mod tests {
    use super::*;

    /// The documents that may hold the table of formats.
    const DOCUMENTS: [&str; 2] = ["README.md", "docs/guide.md"];

    #[test]
    fn the_documents_hold_the_table() {
        let mut rows: Vec<String> = Vec::new();
        for format in FORMATS.iter().filter(|format| format.is_read()) {
            let row = format!("| {} | {} |\n", format.name, format.about);
            if !rows.contains(&row) {
                rows.push(row);
            }
        }
        let table = format!("| format | what is read |\n|---|---|\n{}", rows.concat());
        let text = |file: &str| std::fs::read_to_string(format!("{}/{file}", env!("CARGO_MANIFEST_DIR")));
        let found = DOCUMENTS.into_iter().filter_map(|file| text(file).ok()).any(|text| text.contains(&table));
        assert!(found, "expected in one of {DOCUMENTS:?}:\n{table}");
    }

    #[test]
    fn every_row_can_match() {
        // A magic number that begins with another row's would never be found.
        let magic = |format: &Format| match format.detect {
            Magic(at, bytes) => Some((at, bytes)),
            _ => None,
        };
        for (row, (at, bytes)) in FORMATS.iter().enumerate().filter_map(|(row, format)| Some((row, magic(format)?))) {
            let mut earlier = FORMATS[..row].iter().filter_map(magic);
            let hidden = earlier.find(|(other_at, other)| *other_at == at && bytes.starts_with(other));
            assert_eq!(hidden, None, "{}", FORMATS[row].name);
        }
    }
}
