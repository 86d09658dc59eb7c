//! Several files, a folder or an archive as one field.

use std::{
    fs,
    path::{Path, PathBuf},
};

use cuesta::internal::height::{Field, Loaded, Options, load, load_all, load_bytes};
use tempfile::{TempDir, tempdir};

use super::{
    real::shared,
    tiff_file::{Tag, TiffFile},
    tiny,
};

const NODATA: u16 = 42113;
const UTM: [[u16; 2]; 2] = [[1024, 1], [3072, 32611]];

/// A file of 6 × 4 samples, 10 m apart in UTM zone 11, whose corner is at a column and row of a common grid.
fn at(column: i32, row: i32) -> TiffFile {
    bare().placed([10.0; 2], [1000.0 + 10.0 * f64::from(column), 9000.0 - 10.0 * f64::from(row)]).keys(&UTM)
}

fn bare() -> TiffFile {
    TiffFile::new([6, 4], 16, 2)
}

/// A folder with files of the given names.
fn folder(files: &[(&str, Vec<u8>)]) -> TempDir {
    let folder = tempdir().unwrap();
    files.iter().for_each(|(name, bytes)| fs::write(folder.path().join(name), bytes).unwrap());
    folder
}

fn load_names(folder: &Path, names: &[&str], options: &Options) -> Result<Loaded, cuesta::internal::height::Error> {
    let paths: Vec<PathBuf> = names.iter().map(|name| folder.join(name)).collect();
    load_all(&paths.iter().map(PathBuf::as_path).collect::<Vec<_>>(), options)
}

fn rows(field: &Field) -> Vec<Vec<Option<f32>>> {
    let [w, h] = field.size();
    let sample = |i, j| (!field.is_hole(i, j)).then(|| field.height(i, j));
    (0..h).map(|j| (0..w).map(|i| sample(i, j)).collect()).collect()
}

/// Big-endian metres that a position on the globe, in samples, decides.
fn hgt(lat: i64, lon: i64) -> Vec<u8> {
    let height = |row: i64, column: i64| ((row * 7 + column * 13) % 3000) as i16;
    let places = (0..1201).flat_map(|j| (0..1201).map(move |i| (j - lat * 1200, i + lon * 1200)));
    places.flat_map(|(row, column)| height(row.rem_euclid(100_000), column.rem_euclid(100_000)).to_be_bytes()).collect()
}

#[test]
fn three_tiles_are_one_field_however_they_come() {
    let tiles = [("N10E020.hgt", hgt(10, 20)), ("N10E021.hgt", hgt(10, 21)), ("N11E020.hgt", hgt(11, 20))];
    let members: Vec<(&str, &[u8])> = tiles.iter().map(|(name, bytes)| (*name, &bytes[..])).collect();
    let (zip, tar) = (tiny::zip(&members), tiny::tar(&members));
    let folder = folder(&tiles);
    let options = Options::default();
    let by_names = load_names(folder.path(), &["N10E020.hgt", "N10E021.hgt", "N11E020.hgt"], &options).unwrap();
    let field = &by_names.field;
    assert_eq!((field.size(), field.holes().count()), ([2401, 2401], 1200 * 1200));
    for (i, j) in [(0, 0), (1200, 0), (0, 1200), (1200, 1200), (1201, 1200), (2400, 2400), (77, 2300), (1999, 1201)] {
        let row = (i64::from(j) - 11 * 1200).rem_euclid(100_000);
        let height = (row * 7 + (i64::from(i) + 20 * 1200) * 13) % 3000;
        assert_eq!((field.is_hole(i, j), field.height(i, j)), (false, height as f32), "({i}, {j})");
    }
    assert!(field.is_hole(1201, 1199) && field.is_hole(2400, 0));
    assert_eq!(by_names.warnings, ["1440000 of 5764801 samples lie in no file and are holes"]);
    // Metres at the middle row of all, 11° north.
    let [east, north] = cuesta::internal::height::metres_per_degree(11.0).map(|metres| metres / 1200.0);
    assert!((field.spacing[0] - east).abs() < 1e-9 && (field.spacing[1] - north).abs() < 1e-9, "{:?}", field.spacing);

    let origins: Vec<[u32; 2]> = by_names.sources.iter().map(|source| source.at).collect();
    assert_eq!(origins, [[0, 1200], [1200, 1200], [0, 0]]);
    fs::write(folder.path().join("README.txt"), "three tiles").unwrap();
    let others = [
        load(folder.path(), &options).unwrap(),
        load_bytes("tiles.zip", &zip, &options).unwrap(),
        load_bytes("tiles.tar", &tar, &options).unwrap(),
        load_bytes("tiles.tar.gz", &tiny::gzip(&tar), &options).unwrap(),
    ];
    for other in others {
        assert_eq!((other.format, other.exact_in_16_bit), ("SRTM HGT", true));
        assert_eq!((other.field.samples(), other.field.holes()), (field.samples(), field.holes()));
        assert_eq!((other.field.spacing, other.field.origin), (field.spacing, field.origin));
        assert_eq!(other.sources.len(), 3);
        assert!(other.sources[2].file.ends_with("/N11E020.hgt"), "{:?}", other.sources);
        assert_eq!(other.warnings, by_names.warnings);
    }
}

#[test]
fn real_neighbours_are_one_field() {
    let (Some(south), Some(north)) = (shared("N41E001.hgt.zip"), shared("N42E001.hgt")) else { return };
    let options = Options::default();
    let both = load_all(&[&south, &north], &options).unwrap();
    let (south, north) = (load(&south, &options).unwrap().field, load(&north, &options).unwrap().field);
    assert_eq!((both.field.size(), both.warnings.len()), ([1201, 2401], 0), "{:?}", both.warnings);
    for (i, j) in (0..2401).flat_map(|j| (0..1201).map(move |i| (i, j))) {
        let (field, row) = if j < 1201 { (&north, j) } else { (&south, j - 1200) };
        assert_eq!(both.field.is_hole(i, j), field.is_hole(i, row), "({i}, {j})");
        assert!(field.is_hole(i, row) || both.field.height(i, j) == field.height(i, row), "({i}, {j})");
    }
    assert_eq!(both.field.origin[0] / both.field.spacing[0], 1200.0, "metres of the middle row of both");
}

/// The pair is georeferenced with steps 0.06 % too long: 359.8 columns apart instead of 360.
#[test]
fn files_near_the_grid_are_moved_onto_it_with_a_warning() {
    let (Some(west), Some(east)) = (shared("ned_oregon_f32_dem1.tif"), shared("ned_oregon_f32_dem2.tif")) else {
        return;
    };
    let both = load_all(&[&west, &east], &Options::default()).unwrap();
    assert_eq!((both.field.size(), both.field.holes().count()), ([721, 361], 0));
    let all = both.warnings.join("\n");
    assert!(all.contains("moved onto the grid of the first, by 0.20 samples at most"), "{all}");
    assert!(all.contains("361 samples have other heights in another file, up to 17.6"), "{all}");
    let east = load(&east, &Options::default()).unwrap().field;
    assert_eq!(both.field.height(360, 100), east.height(0, 100), "the last file counts");
}

#[test]
fn the_last_file_with_data_counts() {
    let nodata = |file: TiffFile, value: i32| file.tag(NODATA, Tag::Text(value.to_string()));
    let west = nodata(at(0, 0), -9999).bytes(|i, j| if (i, j) == (5, 0) { -9999.0 } else { 100.0 });
    let east = nodata(at(4, 1), 0).bytes(|i, j| if (i, j) == (0, 0) { 0.0 } else { 200.0 });
    let folder = folder(&[("a.tif", west), ("b.tif", east)]);
    let load = |names: &[&str]| load_names(folder.path(), names, &Options::default()).unwrap();
    let (over, under) = (load(&["a.tif", "b.tif"]), load(&["b.tif", "a.tif"]));
    let (w, e, hole) = (Some(100.0), Some(200.0), None);
    let expected = |both: Option<f32>| {
        vec![
            vec![w, w, w, w, w, hole, hole, hole, hole, hole],
            vec![w, w, w, w, w, both, e, e, e, e],
            vec![w, w, w, w, both, both, e, e, e, e],
            vec![w, w, w, w, both, both, e, e, e, e],
            vec![hole, hole, hole, hole, e, e, e, e, e, e],
        ]
    };
    assert_eq!(rows(&over.field), expected(e));
    assert_eq!(rows(&under.field), expected(w));
    assert_eq!((over.field.spacing, over.field.origin), ([10.0; 2], [1005.0, -8995.0]));
    assert_eq!(under.field.origin, [1005.0, -8995.0], "whichever is first");
    assert_eq!(over.field.crs.as_deref(), Some("EPSG:32611"));
    let [apart, gap] = &over.warnings[..] else { panic!("{:?}", over.warnings) };
    assert!(apart.starts_with("5 samples have other heights in another file, up to 100.00 m apart"), "{apart}");
    assert!(gap.starts_with("8 of 50 samples lie in no file"), "{gap}");
}

#[test]
fn units_and_types_meet_in_metres() {
    let feet = at(6, 0).keys(&[[1024, 1], [3072, 32611], [4099, 9002]]);
    let feet = TiffFile { tags: feet.tags[..2].iter().chain(&feet.tags[3..]).cloned().collect(), ..feet };
    let files = [
        ("a.tif", at(0, 0).bytes(|_, _| 100.0)),
        ("b.tif", feet.bytes(|_, _| 1000.0)),
        ("c.tif", TiffFile { bits: 32, format: 3, ..at(12, 0) }.bytes(|_, _| 7.25)),
    ];
    let folder = folder(&files);
    let options = Options { nodata: Some(100.0), ..Options::default() };
    let loaded = load(folder.path(), &options).unwrap();
    assert_eq!(
        rows(&loaded.field)[0][4..14],
        [
            None,
            None,
            Some(304.8),
            Some(304.8),
            Some(304.8),
            Some(304.8),
            Some(304.8),
            Some(304.8),
            Some(7.25),
            Some(7.25)
        ]
    );
    assert_eq!(loaded.sample_type, "f32");
    // Options that apply to the mosaic.
    let options =
        Options { crop: Some([5, 1, 4, 2]), spacing: Some([2.0, 3.0]), tiles: Some([2, 1]), ..Options::default() };
    let field = load(folder.path(), &options).unwrap().field;
    assert_eq!((field.size(), field.stored(), field.spacing), ([8, 2], [4, 2], [2.0, 3.0]));
    assert_eq!((field.height(0, 0), field.height(5, 0)), (100.0, 304.8));
}

#[test]
fn files_of_other_grids_are_refused_by_name() {
    let keys = |file: TiffFile, code: u16| file.keys(&[[1024, 1], [3072, code]]);
    let corner = [1060.0, 9000.0];
    let files = [
        ("first.tif", at(0, 0).bytes(|_, _| 1.0), ""),
        ("zone.tif", keys(bare().placed([10.0; 2], corner), 32612).bytes(|_, _| 1.0), "EPSG:32611"),
        (
            "degrees.tif",
            bare().placed([10.0; 2], [60.0, 50.0]).keys(&[[1024, 2], [2048, 4326]]).bytes(|_, _| 1.0),
            "EPSG:4326",
        ),
        (
            "spacing.tif",
            keys(bare().placed([10.0, 12.0], corner), 32611).bytes(|_, _| 1.0),
            "found a spacing of 10 x 12",
        ),
        ("half.tif", keys(bare().placed([10.0; 2], [1065.0, 9003.0]), 32611).bytes(|_, _| 1.0), "south of it"),
        ("bare.tif", bare().bytes(|_, _| 1.0), "position: expected one"),
    ];
    let folder = folder(&files.each_ref().map(|(name, bytes, _)| (*name, bytes.clone())));
    for (name, _, words) in &files[1..] {
        let error = load_names(folder.path(), &["first.tif", name], &Options::default()).unwrap_err().to_string();
        assert!(error.contains(name) && error.contains("first.tif") && error.contains(words), "{error}");
        assert!(!error.contains('\n'), "{error}");
    }
    let error = load_names(folder.path(), &["first.tif", "absent.tif"], &Options::default()).unwrap_err().to_string();
    assert!(error.contains("absent.tif"), "{error}");
}

/// The limit of samples holds for all files together, and for the rectangle around them before it is allocated.
#[test]
fn the_limit_of_samples_holds_for_all_files() {
    let folder = folder(&[
        ("a.tif", at(0, 0).bytes(|_, _| 1.0)),
        ("b.tif", at(6, 0).bytes(|_, _| 1.0)),
        ("far.tif", at(2_000_000_000, 1_900_000_000).bytes(|_, _| 1.0)),
        ("beyond.tif", bare().placed([10.0; 2], [1e12, 9000.0]).keys(&UTM).bytes(|_, _| 1.0)),
    ]);
    let load = |names: &[&str], max_samples| {
        let options = Options { max_samples, ..Options::default() };
        load_names(folder.path(), names, &options).map_err(|error| error.to_string())
    };
    assert!(load(&["a.tif", "b.tif"], 48).is_ok());
    let error = load(&["a.tif", "b.tif"], 47).unwrap_err();
    assert!(error.contains("b.tif: size") && error.contains("after 24 samples of other files"), "{error}");
    let error = load(&["a.tif", "far.tif"], 1 << 30).unwrap_err();
    assert!(error.contains("--max-samples") && error.contains("2000000006x1900000004"), "{error}");
    let error = load(&["a.tif", "beyond.tif"], 1 << 62).unwrap_err();
    assert!(error.contains("size") && error.contains("2^32 samples a side"), "{error}");
}

#[test]
fn companions_are_left_out_with_a_warning() {
    let files = [
        ("dem.tif", at(0, 0).bytes(|i, _| i as f64)),
        ("dem_east.tif", at(6, 0).bytes(|i, _| i as f64)),
        ("dem_num.tif", TiffFile { bits: 8, format: 1, ..at(0, 0) }.bytes(|_, _| 9.0)),
        ("dem.tif.ovr", bare().bytes(|_, _| 0.0)),
        ("preview.png", tiny::png(png::ColorType::Grayscale, png::BitDepth::Eight, &[0; 20])),
        ("scene.nc", b"CDF\x01and so on".to_vec()),
        ("dem.tif.cuesta-errors-32x1", b"cache".to_vec()),
        ("about.md", b"# Heights".to_vec()),
    ];
    let check = |loaded: Loaded, what: &str| {
        assert_eq!(loaded.field.size(), [12, 4], "{what}");
        assert_eq!((loaded.field.height(3, 0), loaded.sources.len()), (3.0, 2), "{what}");
        let [num, png, nc] = &loaded.warnings[..] else { panic!("{what}: {:?}", loaded.warnings) };
        assert!(num.contains("dem_num.tif covers the same samples as") && num.contains("dem.tif"), "{num}");
        assert!(png.contains("preview.png says no position"), "{png}");
        assert!(nc.contains("1 files hold no heights") && nc.contains("scene.nc (NetCDF)"), "{nc}");
    };
    check(load(folder(&files).path(), &Options::default()).unwrap(), "folder");
    let members: Vec<(&str, &[u8])> = files.iter().map(|(name, bytes)| (*name, &bytes[..])).collect();
    check(load_bytes("a.zip", &tiny::zip(&members), &Options::default()).unwrap(), "zip");
    check(load_bytes("a.tgz", &tiny::gzip(&tiny::tar(&members)), &Options::default()).unwrap(), "tar.gz");
    // One file of a folder is that file.
    let loaded = load(folder(&files[4..5]).path(), &Options::default()).unwrap();
    assert_eq!((loaded.field.size(), loaded.format), ([5, 4], "PNG"));
}

/// Packages such as those of ASTER, AW3D30 and Copernicus: names or types identify the file with the heights.
#[test]
fn of_files_of_the_same_samples_the_heights_are_read() {
    let byte = TiffFile { bits: 8, format: 1, ..at(0, 0) };
    let (heights, other) = (at(0, 0).bytes(|i, _| 100.0 + i as f64), at(0, 0).bytes(|_, _| 9.0));
    for (others, name) in [
        (["AUXFILES/x_DSM_10_EDM.tif", "AUXFILES/x_DSM_10_HEM.tif"], "DEM/x_DSM_10_DEM.tif"),
        (["x_MSK.tif", "x_STK.tif"], "y_DSM.tif"),
        (["x_num.tif", "x_swb.tif"], "x_dem.tif"),
    ] {
        let files = [(others[0], &byte.bytes(|_, _| 5.0)[..]), (others[1], &other[..]), (name, &heights[..])];
        let loaded = load_bytes("a.zip", &tiny::zip(&files), &Options::default()).unwrap();
        assert_eq!((loaded.field.height(3, 0), loaded.warnings.len()), (103.0, 2), "{name}: {:?}", loaded.warnings);
        assert!(loaded.sources[0].file.ends_with(name), "{:?}", loaded.sources);
    }
    let files = [("a.tif", &byte.bytes(|_, _| 5.0)[..]), ("b.tif", &heights[..])];
    let loaded = load_bytes("a.zip", &tiny::zip(&files), &Options::default()).unwrap();
    assert_eq!(loaded.field.height(3, 0), 103.0);
}

#[test]
fn folders_and_archives_without_heights_say_what_they_hold() {
    let files = [("scene.nc", b"CDF\x01and so on".to_vec()), ("land.hgt", vec![0; 1000]), ("a.md", b"text".to_vec())];
    let members: Vec<(&str, &[u8])> = files.iter().map(|(name, bytes)| (*name, &bytes[..])).collect();
    let options = Options::default();
    for error in [
        load(folder(&files).path(), &options).unwrap_err(),
        load_bytes("a.zip", &tiny::zip(&members), &options).unwrap_err(),
        load_bytes("a.tar", &tiny::tar(&members), &options).unwrap_err(),
    ] {
        let error = error.to_string();
        assert!(
            error.contains("scene.nc (NetCDF)") && error.contains("land.hgt") && !error.contains("a.md"),
            "{error}"
        );
    }
    let nested = tiny::zip(&[("inner.zip", &tiny::zip(&[("grid.asc", tiny::asc().as_bytes())]))]);
    let error = load_bytes("outer.zip", &nested, &options).unwrap_err().to_string();
    assert!(error.contains("inner.zip (an archive)"), "{error}");
}

/// A download of OpenTopography: a grid and its projection in a .tar.gz.
#[test]
fn texts_beside_a_member_are_found_in_archives() {
    let grid = tiny::asc();
    let prj = "PROJCS[\"UTM\",GEOGCS[\"WGS 84\"],UNIT[\"metre\",1],AUTHORITY[\"EPSG\",\"32611\"]]";
    let members: [(&str, &[u8]); 3] =
        [("out/output_hh.prj", prj.as_bytes()), ("out/output_hh.asc", grid.as_bytes()), ("readme.txt", b"hello")];
    for (name, bytes) in [("r.tar.gz", tiny::gzip(&tiny::tar(&members))), ("r.zip", tiny::zip(&members))] {
        let loaded = load_bytes(name, &bytes, &Options::default()).unwrap();
        assert_eq!((loaded.format, loaded.field.crs.as_deref()), ("ESRI ASCII grid", Some("EPSG:32611")), "{name}");
        assert_eq!(
            (loaded.sources[0].file.as_str(), loaded.warnings.len()),
            (&*format!("{name}/out/output_hh.asc"), 0)
        );
    }
}

#[test]
fn tar_bombs_are_refused() {
    let options = Options { max_samples: 1 << 16, ..Options::default() };
    let long = vec![b' '; 1 << 18];
    let members: Vec<(String, &[u8])> = (0..8).map(|k| (format!("{k}.bin"), &long[..])).collect();
    let members: Vec<(&str, &[u8])> = members.iter().map(|(name, bytes)| (name.as_str(), *bytes)).collect();
    let error = load_bytes("bomb.tar.gz", &tiny::gzip(&tiny::tar(&members)), &options).unwrap_err().to_string();
    assert!(error.contains("at most 1048576 bytes"), "{error}");
}

#[test]
fn tiles_on_both_sides_of_the_antimeridian_are_neighbours() {
    let folder = folder(&[("N65E179.hgt", hgt(65, 179)), ("N65W180.hgt", hgt(65, 180))]);
    let field = load(folder.path(), &Options::default()).unwrap().field;
    assert_eq!((field.size(), field.holes().count()), ([2401, 1201], 0));
    let origin = field.origin[0] / field.spacing[0] / 1200.0;
    assert!((origin - 179.0).abs() < 1e-9, "{origin}");
}

/// Members beyond a limit are an error, not left out silently.
#[test]
fn an_archive_of_too_many_members_is_refused() {
    let folder = tempdir().unwrap();
    let path = folder.path().join("many.tar");
    let mut tar = tar::Builder::new(std::io::BufWriter::new(fs::File::create(&path).unwrap()));
    for k in 0..=1 << 16 {
        let mut header = tar::Header::new_gnu();
        header.set_size(0);
        tar.append_data(&mut header, format!("{k}.txt"), &[][..]).unwrap();
    }
    drop(tar.into_inner().unwrap());
    let error = load(&path, &Options::default()).unwrap_err().to_string();
    assert!(error.contains("expected at most 65536 members") && !error.contains('\n'), "{error}");
}

/// Opening a pipe would block.
#[cfg(unix)]
#[test]
fn a_pipe_in_a_tile_folder_is_refused() {
    let folder = tempdir().unwrap();
    fs::create_dir_all(folder.path().join("1/0")).unwrap();
    let made = std::process::Command::new("mkfifo").arg(folder.path().join("1/0/0.png")).status();
    assert!(made.expect("mkfifo").success());
    let options = Options { encoding: Some(cuesta::internal::height::Encoding::Mapbox), ..Options::default() };
    let error = load(folder.path(), &options).unwrap_err().to_string();
    assert!(error.contains("0.png") && error.contains("neither a file nor a directory"), "{error}");
}
