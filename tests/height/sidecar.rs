//! World files, `.prj` and `.aux.xml` beside a raster; turns, rotations; scale and offset.

use cuesta::internal::height::{Field, Loaded, Options, load, load_bytes, load_bytes_with};
use png::{BitDepth, ColorType};

use super::{
    tiff_file::{Tag, TiffFile},
    tiny::{self, SIZE},
};

const UTM: [[u16; 2]; 2] = [[1024, 1], [3072, 32611]];
const GDAL_METADATA: u16 = 42112;

fn tiff() -> TiffFile {
    TiffFile::new(SIZE, 16, 2)
}

/// A 16-bit grey picture of the tiny field.
fn picture(value: impl Fn(usize, usize) -> f64) -> Vec<u8> {
    let samples = (0..SIZE[1]).flat_map(|j| (0..SIZE[0]).map(move |i| (i, j)));
    let bytes: Vec<u8> = samples.flat_map(|(i, j)| (value(i, j) as u16).to_be_bytes()).collect();
    tiny::png(ColorType::Grayscale, BitDepth::Sixteen, &bytes)
}

/// Reads bytes with files beside them, by extension.
fn with(name: &str, bytes: &[u8], beside: &[(&str, &str)], options: &Options) -> Loaded {
    let sibling = |extension: &str| {
        beside.iter().find(|(known, _)| *known == extension).map(|(_, text)| text.as_bytes().to_vec())
    };
    load_bytes_with(name, bytes, &sibling, options).unwrap()
}

/// Checks that the sample of the file at (column, row) lies at the coordinates of `at`.
fn check_samples(field: &Field, at: impl Fn(f64, f64) -> [f64; 2]) {
    for (c, r) in (0..SIZE[1]).flat_map(|r| (0..SIZE[0]).map(move |c| (c, r))) {
        let [x, y] = at(c as f64, r as f64);
        let i = ((x - field.origin[0]) / field.spacing[0]).round() as u32;
        let j = ((-y - field.origin[1]) / field.spacing[1]).round() as u32;
        assert_eq!(field.height(i, j), tiny::height(c, r) as f32, "column {c}, row {r} at {x}, {y}");
        let [dx, dz] = field.spacing;
        assert!((field.origin[0] + f64::from(i) * dx - x).abs() < 1e-6, "{x}");
        assert!((field.origin[1] + f64::from(j) * dz + y).abs() < 1e-6, "{y}");
    }
}

/// The eight ways in which columns and rows run along the axes.
const TURNS: [[[f64; 2]; 2]; 8] = [
    [[10.0, 0.0], [0.0, -5.0]],
    [[-10.0, 0.0], [0.0, -5.0]],
    [[10.0, 0.0], [0.0, 5.0]],
    [[-10.0, 0.0], [0.0, 5.0]],
    [[0.0, -5.0], [10.0, 0.0]],
    [[0.0, 5.0], [10.0, 0.0]],
    [[0.0, -5.0], [-10.0, 0.0]],
    [[0.0, 5.0], [-10.0, 0.0]],
];

#[test]
fn every_turn_is_laid_north_up_by_matrix_world_file_and_aux_xml() {
    for [column, row] in TURNS {
        let at = |c: f64, r: f64| [0, 1].map(|k| [500.0, 700.0][k] + c * column[k] + r * row[k]);
        let [x, y] = at(-0.5, -0.5);
        let matrix = vec![column[0], row[0], 0.0, x, column[1], row[1], 0.0, y, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0];
        let by_matrix = tiff().tag(34264, Tag::Double(matrix)).keys(&UTM).bytes(tiny::height);
        let world = format!("{}\n{}\n{}\n{}\n500\n700\n", column[0], column[1], row[0], row[1]);
        let transform = format!(
            "<PAMDataset><SRS>EPSG:32611</SRS><GeoTransform> {x}, {}, {}, {y}, {}, {}</GeoTransform></PAMDataset>",
            column[0], row[0], column[1], row[1]
        );
        for loaded in [
            with("a.tif", &by_matrix, &[], &Options::default()),
            with("a.tif", &tiff().bytes(tiny::height), &[("tfw", &world), ("prj", "EPSG:32611")], &Options::default()),
            with("a.png", &picture(tiny::height), &[("pgw", &world), ("prj", "EPSG:32611")], &Options::default()),
            with("a.tif", &tiff().bytes(tiny::height), &[("aux.xml", &transform)], &Options::default()),
        ] {
            assert_eq!(loaded.warnings, Vec::<String>::new(), "{column:?} {row:?}");
            assert_eq!((loaded.field.spacing, loaded.field.crs.as_deref()), ([10.0, 5.0], Some("EPSG:32611")));
            check_samples(&loaded.field, at);
        }
        // A crop counts samples of the field as shown, whose size may be turned.
        let [w, h] = with("a.tif", &by_matrix, &[], &Options::default()).field.size();
        let crop = Options { crop: Some([1, 1, w - 1, h - 1]), ..Options::default() };
        let (whole, part) =
            (with("a.tif", &by_matrix, &[], &Options::default()), with("a.tif", &by_matrix, &[], &crop));
        assert_eq!(part.field.height(0, 1), whole.field.height(1, 2));
        assert_eq!(part.field.origin, [whole.field.origin[0] + 10.0, whole.field.origin[1] + 5.0]);
    }
}

#[test]
fn negative_pixel_scale_runs_west() {
    let file = tiff().placed([-10.0, 5.0], [500.0, 700.0]).keys(&UTM);
    check_samples(&load_bytes("w.tif", &file.bytes(tiny::height), &Options::default()).unwrap().field, |c, r| {
        [495.0 - 10.0 * c, 697.5 - 5.0 * r]
    });
    let north = load_bytes(
        "n.tif",
        &tiff().placed([10.0, -5.0], [500.0, 700.0]).keys(&UTM).bytes(tiny::height),
        &Options::default(),
    );
    assert!(north.unwrap().warnings[0].contains("ModelPixelScale"));
}

#[test]
fn rotated_grids_are_warned_of() {
    let (sin, cos) = 30f64.to_radians().sin_cos();
    let world = format!("{}\n{}\n{}\n{}\n500\n700\n", 10.0 * cos, 10.0 * sin, 10.0 * sin, -10.0 * cos);
    let beside = [("tfw", world.as_str()), ("prj", "EPSG:32611")];
    let envi = tiny::all().into_iter().find(|file| file.name == "envi.dat").unwrap();
    let header = String::from_utf8(envi.hdr.clone().unwrap()).unwrap();
    let rotated = header.replace("units=Meters", "units=Meters, rotation=30");
    assert_ne!(header, rotated);
    for loaded in [
        with("a.tif", &tiff().bytes(tiny::height), &beside, &Options::default()),
        with("envi.dat", &envi.bytes, &[("hdr", &rotated)], &Options::default()),
    ] {
        let [warning] = &loaded.warnings[..] else { panic!("{:?}", loaded.warnings) };
        assert!(warning.contains("rotated by 30.000 degrees"), "{warning}");
        assert!((loaded.field.spacing[0] - 10.0).abs() < 1e-9, "{:?}", loaded.field.spacing);
    }
    // The centre stays: 500 + 2 columns + 1.5 rows.
    let field = with("a.tif", &tiff().bytes(tiny::height), &beside, &Options::default()).field;
    let centre = [field.origin[0] + 20.0, field.origin[1] + 15.0];
    let expected = [500.0 + 20.0 * cos + 15.0 * sin, -(700.0 + 20.0 * sin - 15.0 * cos)];
    assert!((0..2).all(|k| (centre[k] - expected[k]).abs() < 1e-9), "{centre:?} {expected:?}");
}

/// Quarter turns of ENVI, against the transformations that GDAL 3.10.3 reads.
#[test]
fn envi_turns_and_units() {
    let envi = tiny::all().into_iter().find(|file| file.name == "envi.dat").unwrap();
    let load = |map: &str| {
        let header = String::from_utf8(envi.hdr.clone().unwrap()).unwrap();
        let line = header.lines().find(|line| line.starts_with("map info")).unwrap();
        with(
            "envi.dat",
            &envi.bytes,
            &[("hdr", &header.replace(line, &format!("map info = {{{map}}}")))],
            &Options::default(),
        )
    };
    let turned = |degrees: i32| {
        load(&format!("UTM, 1, 1, 1000, 2000, 10, 20, 11, North, WGS-84, units=Meters, rotation={degrees}"))
    };
    for (degrees, column, row) in [
        (0, [10.0, 0.0], [0.0, -20.0]),
        (90, [0.0, 20.0], [10.0, 0.0]),
        (180, [-10.0, 0.0], [0.0, 20.0]),
        (-90, [0.0, -20.0], [-10.0, 0.0]),
    ] {
        let loaded = turned(degrees);
        assert_eq!(loaded.warnings, Vec::<String>::new(), "{degrees}");
        check_samples(&loaded.field, |c, r| {
            [0, 1].map(|k| [1000.0, 2000.0][k] + (c + 0.5) * column[k] + (r + 0.5) * row[k])
        });
    }
    for (unit, metres) in [("Meters", 1.0), ("Feet", 0.3048), ("Km", 1000.0), ("Yards", 0.9144), ("Miles", 1609.344)] {
        let spacing = load(&format!("Arbitrary, 1, 1, 1000, 2000, 10, 20, units={unit}")).field.spacing;
        assert!((spacing[0] / (10.0 * metres) - 1.0).abs() < 1e-12, "{unit}: {spacing:?}");
    }
    let seconds = load("Geographic Lat/Lon, 1, 1, 36000, 162000, 1, 1, WGS-84, units=Seconds").field.spacing;
    assert!((seconds[1] - 30.87).abs() < 0.01, "{seconds:?}");
}

#[test]
fn world_files_by_path() {
    let folder = tempfile::tempdir().unwrap();
    let world = "5\n0\n0\n-5\n500002.5\n5199997.5\n";
    for (data, world_name) in [
        ("a.tif", "a.tfw"),
        ("b.tif", "b.tifw"),
        ("c.tif", "c.wld"),
        ("d.tif", "d.TFW"),
        ("e.tif", "e.tif.wld"),
        ("f.png", "f.pgw"),
        ("g.png", "g.pngw"),
        ("h.png", "h.wld"),
    ] {
        let bytes = if data.ends_with("tif") { tiff().bytes(tiny::height) } else { picture(tiny::height) };
        let path = folder.path().join(data);
        std::fs::write(&path, bytes).unwrap();
        std::fs::write(folder.path().join(world_name), world).unwrap();
        let field = load(&path, &Options::default()).unwrap().field;
        assert_eq!((field.spacing, field.origin), ([5.0, 5.0], [500002.5, -5199997.5]), "{world_name}");
    }
    let zip =
        tiny::zip(&[("x.tif", &tiff().bytes(tiny::height)), ("x.tfw", world.as_bytes()), ("x.prj", b"EPSG:2263")]);
    assert!((load_bytes("x.zip", &zip, &Options::default()).unwrap().field.spacing[0] - 1.524003).abs() < 1e-6);
    let bil = tiny::all().into_iter().find(|file| file.name == "esri.bil").unwrap();
    let header = String::from_utf8(bil.hdr.unwrap()).unwrap();
    let bare: Vec<&str> = header.lines().filter(|line| !line.to_lowercase().contains("dim")).collect();
    let loaded = with("esri.bil", &bil.bytes, &[("hdr", &bare.join("\n")), ("blw", world)], &Options::default());
    assert_eq!(loaded.field.spacing, [5.0, 5.0]);
    // What a TIFF says itself comes first; a broken world file is named.
    let own = tiff().placed([10.0, 10.0], [0.0, 0.0]).keys(&UTM).bytes(tiny::height);
    assert_eq!(with("a.tif", &own, &[("tfw", world)], &Options::default()).field.spacing, [10.0; 2]);
    for broken in ["5\n0\n0\n-5\n1", "5 0 0 x 1 2", "nan 0 0 nan 1 2"] {
        let loaded = with("a.tif", &tiff().bytes(tiny::height), &[("tfw", broken)], &Options::default());
        assert!(loaded.warnings.iter().any(|warning| warning.contains(".tfw")), "{:?}", loaded.warnings);
    }
    let flat = with("a.tif", &tiff().bytes(tiny::height), &[("tfw", "0 0 0 0 1 2")], &Options::default());
    assert!(flat.warnings[0].contains("degenerate"), "{:?}", flat.warnings);
}

fn metadata(items: &str) -> TiffFile {
    let xml = format!("<GDALMetadata>{items}</GDALMetadata>");
    tiff().placed([10.0, 10.0], [0.0, 0.0]).keys(&UTM).tag(GDAL_METADATA, Tag::Text(xml))
}

fn item(role: &str, value: &str) -> String {
    format!(r#"<Item name="X" sample="0" role="{role}">{value}</Item>"#)
}

#[test]
fn scale_offset_and_unit_of_the_band() {
    let read =
        |items: String, options: &Options| load_bytes("m.tif", &metadata(&items).bytes(tiny::height), options).unwrap();
    let height = |loaded: &Loaded| f64::from(loaded.field.height(1, 1));
    let raw = tiny::height(1, 1);
    for (items, expected) in [
        (item("scale", "0.1"), raw * 0.1),
        (item("offset", "100"), raw + 100.0),
        (item("scale", "0.1") + &item("offset", "-12.34"), raw * 0.1 - 12.34),
        (item("unittype", "ft"), raw * 0.3048),
        (item("unittype", "US survey foot"), raw * 1200.0 / 3937.0),
        (item("unittype", "cm"), raw * 0.01),
        (item("scale", "2") + &item("offset", "10") + &item("unittype", "foot"), (raw * 2.0 + 10.0) * 0.3048),
        // Another band's.
        (
            r#"<Item name="S" sample="1" role="scale">7</Item><Item name="STATISTICS_MEAN" sample="0">3</Item>"#
                .to_owned(),
            raw,
        ),
    ] {
        let loaded = read(items.clone(), &Options::default());
        assert!((height(&loaded) - expected).abs() < 1e-4, "{items}: {} {expected}", height(&loaded));
        assert_eq!(loaded.warnings, Vec::<String>::new(), "{items}");
    }
    let options = Options { height_scale: Some(2.0), height_offset: -5.5, ..Options::default() };
    let loaded = read(item("scale", "0.5") + &item("offset", "10"), &options);
    assert!((height(&loaded) - ((raw * 0.5 + 10.0) * 2.0 - 5.5)).abs() < 1e-5);
    for (items, words) in [
        (item("scale", "0"), "scale"),
        (item("scale", "x"), "scale"),
        (item("offset", "inf"), "offset"),
        (item("unittype", "degC"), "degC"),
        ("<Item".to_owned(), "expected XML"),
    ] {
        let loaded = read(items.clone(), &Options::default());
        let [warning] = &loaded.warnings[..] else { panic!("{items}: {:?}", loaded.warnings) };
        assert!(warning.contains(words) && height(&loaded) == raw, "{warning}");
    }
    // The band's unit decides over the vertical system's, and says so.
    let both = metadata(&item("unittype", "ft")).tags.into_iter().filter(|(tag, _)| *tag != 34735);
    let both = TiffFile { tags: both.collect(), ..tiff() }.keys(&[[1024, 1], [3072, 32611], [4096, 5703]]);
    let loaded = load_bytes("m.tif", &both.bytes(tiny::height), &Options::default()).unwrap();
    assert!((height(&loaded) - raw * 0.3048).abs() < 1e-5 && loaded.warnings[0].contains("by the band"));
}

#[test]
fn offsets_of_holes_codes_and_text() {
    // Holes are found by the stored value, before scale and offset.
    let file = metadata(&(item("scale", "0.5") + &item("offset", "3"))).tag(42113, Tag::Text("20".to_owned()));
    let loaded = load_bytes("h.tif", &file.bytes(tiny::height), &Options::default()).unwrap();
    assert_eq!((loaded.field.holes().count(), loaded.field.is_hole(0, 0)), (1, true));
    assert!(loaded.exact_in_16_bit && loaded.field.height(1, 0) == 16.5);
    // Codes that an offset of whole steps leaves exact, and one that it does not.
    for (offset, exact) in [(-1000.0, true), (0.25, true), (0.1, false)] {
        let options = Options { height_offset: offset, ..Options::default() };
        let loaded =
            load_bytes("o.tif", &tiff().placed([1.0, 1.0], [0.0, 0.0]).keys(&UTM).bytes(tiny::height), &options)
                .unwrap();
        assert_eq!(loaded.exact_in_16_bit, exact, "{offset}");
        assert_eq!(loaded.field.height(2, 1), (tiny::height(2, 1) + offset) as f32);
    }
    let options = Options { height_offset: f64::INFINITY, ..Options::default() };
    assert!(load_bytes("o.asc", tiny::asc().as_bytes(), &options).is_err());
}

#[test]
fn aux_xml_comes_first() {
    let own = metadata(&(item("scale", "0.5") + &item("offset", "7"))).tag(42113, Tag::Text("-9999".to_owned()));
    let xml = r#"<PAMDataset><SRS dataAxisToSRSAxisMapping="1,2">EPSG:2263</SRS>
      <GeoTransform>  5.0e+00,  2.0e+00,  0.0,  6.0e+00,  0.0, -3.0e+00</GeoTransform>
      <PAMRasterBand band="2"><Scale>9</Scale></PAMRasterBand>
      <PAMRasterBand band="1"><NoDataValue>2.3E+01</NoDataValue><UnitType>ft</UnitType><Offset>3</Offset><Scale>0.25</Scale>
      <Metadata><MDI key="STATISTICS_MINIMUM">0</MDI></Metadata></PAMRasterBand></PAMDataset>"#;
    let loaded = with("a.tif", &own.bytes(tiny::height), &[("aux.xml", xml)], &Options::default());
    let field = &loaded.field;
    assert!((field.spacing[0] - 2.0 * 0.3048006).abs() < 1e-6 && (field.spacing[1] - 3.0 * 0.3048006).abs() < 1e-6);
    assert!((field.origin[0] - 6.0 * 0.3048006).abs() < 1e-6 && (field.origin[1] + 4.5 * 0.3048006).abs() < 1e-6);
    assert_eq!((field.holes().count(), field.is_hole(0, 1), field.crs.as_deref()), (1, true, Some("EPSG:2263")));
    assert!((f64::from(field.height(1, 1)) - (tiny::height(1, 1) * 0.25 + 3.0) * 0.3048).abs() < 1e-5);
    assert_eq!(loaded.warnings, Vec::<String>::new());
    // Every format: here a text that has its position but no system.
    let srs = "<PAMDataset><SRS>EPSG:32611</SRS></PAMDataset>";
    let asc = with("g.asc", tiny::asc().as_bytes(), &[("aux.xml", srs)], &Options::default());
    assert_eq!((asc.warnings.len(), asc.field.crs.as_deref()), (0, Some("EPSG:32611")));
    // ArcGIS writes well-known text elsewhere.
    let esri = r#"<PAMDataset><GeodataXform><SpatialReference><WKT>PROJCS["a",GEOGCS["g"],UNIT["Foot",0.3048]]</WKT></SpatialReference></GeodataXform></PAMDataset>"#;
    assert_eq!(
        with("g.asc", tiny::asc().as_bytes(), &[("aux.xml", esri)], &Options::default()).field.spacing,
        [3.048; 2]
    );
    for broken in
        ["", "<a", "<PAMDataset><SRS>x</SRS></PAMDataset>", "<PAMDataset><GeoTransform>1,2</GeoTransform></PAMDataset>"]
    {
        let loaded = with("a.tif", &own.bytes(tiny::height), &[("aux.xml", broken)], &Options::default());
        assert!(loaded.warnings.iter().any(|warning| warning.contains(".aux.xml")), "{broken}: {:?}", loaded.warnings);
    }
}

#[test]
fn envi_gains() {
    let envi = tiny::all().into_iter().find(|file| file.name == "envi.dat").unwrap();
    let header =
        String::from_utf8(envi.hdr.unwrap()).unwrap() + "\ndata gain values = {0.1}\ndata offset values = {5}\n";
    let loaded = with("envi.dat", &envi.bytes, &[("hdr", &header)], &Options::default());
    assert!((f64::from(loaded.field.height(1, 1)) - (tiny::height(1, 1) * 0.1 + 5.0)).abs() < 1e-5);
}

#[test]
fn grey_pictures_that_state_nothing() {
    let metres = picture(tiny::height);
    let codes = picture(|i, j| (1000 * i + 9000 * j) as f64);
    let one = |loaded: &Loaded, words: &[&str]| {
        let [warning] = &loaded.warnings[..] else { panic!("{:?}", loaded.warnings) };
        assert!(words.iter().all(|word| warning.contains(word)), "{warning}");
    };
    let loaded = load_bytes("m.png", &metres, &Options::default()).unwrap();
    one(&loaded, &["--spacing", "--height-scale", "as metres"]);
    assert_eq!(loaded.field.height(1, 1), tiny::height(1, 1) as f32);
    let assumed = load_bytes("c.png", &codes, &Options::default()).unwrap();
    one(&assumed, &["--spacing", "--height-scale", "0.0000258 m a value", "fifth"]);
    // Four metres wide: 0.8 m of relief.
    assert!((assumed.field.statistics().max - 0.8).abs() < 0.01, "{:?}", assumed.field.statistics());
    // Flags are taken at their word.
    let spaced = load_bytes("c.png", &codes, &Options { spacing: Some([20.0; 2]), ..Options::default() }).unwrap();
    assert_eq!((spaced.warnings.len(), spaced.field.statistics().max), (0, 31000.0));
    let scaled = load_bytes("c.png", &codes, &Options { height_scale: Some(0.5), ..Options::default() }).unwrap();
    one(&scaled, &["--spacing"]);
    assert_eq!(scaled.field.statistics().max, 15500.0);
    // Bare samples and a TIFF without georeference alike; signed ones are measurements.
    let raw: Vec<u8> = (0..20u16).flat_map(|k| (k * 3000).to_le_bytes()).collect();
    let options = Options { raw: Some("5x4:u16le".parse().unwrap()), ..Options::default() };
    one(&load_bytes("r", &raw, &options).unwrap(), &["fifth"]);
    let unsigned = TiffFile::new(SIZE, 16, 1).bytes(|i, j| (1000 * i + 9000 * j) as f64);
    one(&load_bytes("u.tif", &unsigned, &Options::default()).unwrap(), &["fifth"]);
    assert!(load_bytes("s.tif", &tiff().bytes(tiny::height), &Options::default()).unwrap().warnings.is_empty());
}

/// `a.tif.aux.xml` is that of `a.tif`, `a.aux.xml` may be that of another picture; in a folder and in archives alike.
#[test]
fn the_file_with_the_whole_name_counts_and_is_read_whole() {
    let scale = |scale: f64, padding: usize| {
        let band = format!("<PAMRasterBand band=\"1\"><Scale>{scale}</Scale></PAMRasterBand>");
        format!("<PAMDataset><Metadata><MDI key=\"K\">{}</MDI></Metadata>{band}</PAMDataset>", " ".repeat(padding))
    };
    let tiff = tiff().placed([10.0; 2], [1000.0, 9000.0]).keys(&UTM).bytes(tiny::height);
    // Longer than the first bytes by which a format is recognised, and than a short text.
    let files = [
        ("a.tif", tiff),
        ("a.aux.xml", scale(10.0, 0).into_bytes()),
        ("a.tif.aux.xml", scale(2.0, 70_000).into_bytes()),
    ];
    let folder = tempfile::tempdir().unwrap();
    let mut zip = zip::ZipWriter::new(std::fs::File::create(folder.path().join("a.zip")).unwrap());
    let mut tar = tar::Builder::new(std::fs::File::create(folder.path().join("a.tar")).unwrap());
    for (name, bytes) in &files {
        std::fs::write(folder.path().join(name), bytes).unwrap();
        zip.start_file(*name, zip::write::SimpleFileOptions::default()).unwrap();
        std::io::Write::write_all(&mut zip, bytes).unwrap();
        let mut header = tar::Header::new_gnu();
        header.set_size(bytes.len() as u64);
        tar.append_data(&mut header, name, &bytes[..]).unwrap();
    }
    zip.finish().unwrap();
    tar.finish().unwrap();
    for name in ["a.tif", "a.zip", "a.tar"] {
        let loaded = load(&folder.path().join(name), &Options::default()).unwrap();
        assert_eq!(f64::from(loaded.field.height(1, 0)), 2.0 * tiny::height(1, 0), "{name}: {:?}", loaded.warnings);
    }
}
