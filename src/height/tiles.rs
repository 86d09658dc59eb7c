//! Directories of web-map tiles, `zoom/x/y.png`, whose colours encode heights.

use std::{
    collections::BTreeMap,
    fs::{self, File},
    io::Read,
    path::{Path, PathBuf},
};

use super::{
    Error, Holes, Samples,
    georef::{MERCATOR_HALF, Place, Unit},
    load::{self, Options},
    raster::Raster,
    terrain_rgb::{self, Encoding},
};

/// Files of one zoom level by (x, y).
type Level = BTreeMap<[u32; 2], PathBuf>;

/// The deepest zoom level: 2^30 tiles a side, so that sample positions fit.
const MAX_ZOOM: u32 = 30;
/// The most bytes of one tile.
const TILE_BYTES: u64 = 1 << 26;

/// Reads the bounding rectangle of the tiles at one zoom level; absent tiles are holes.
pub(super) fn read(path: &Path, options: &Options) -> Result<Raster, Error> {
    let name = path.display().to_string();
    load::one_band(&name, options)?;
    let (zoom, level) = choose(scan(path)?, &name, options)?;
    let encoding = encoding(path, &name, options)?;
    let [west, north, east, south] = bounds(&level);
    let (across, down) = (east - west + 1, south - north + 1);

    let mut target: Option<Mosaic> = None;
    for (&[x, y], file) in &level {
        let tile_name = file.display().to_string();
        let picture = terrain_rgb::decode_bytes(&tile_name, &bytes(file, &tile_name)?, options)?;
        let side = picture.width();
        let mosaic = match &mut target {
            Some(mosaic) => mosaic,
            None => {
                let size = [across, down].map(|n| u64::from(n) * u64::from(side));
                let count = load::samples(&name, size, options)?;
                target.insert(Mosaic {
                    side,
                    size: size.map(|n| n as u32),
                    heights: vec![0.0; count],
                    known: Holes::none(count),
                })
            }
        };
        if [picture.width(), picture.height()] != [mosaic.side; 2] {
            let what =
                format!("expected {0}x{0} pixels, found {1}x{2}", mosaic.side, picture.width(), picture.height());
            return Err(Error::new(tile_name, "size", what));
        }
        mosaic.store(encoding, picture.as_raw(), [x - west, y - north]);
    }
    let Some(mosaic) = target else { return Err(no_tiles(&name)) };

    let step = 2.0 * MERCATOR_HALF / (f64::from(mosaic.side) * f64::from(1u32 << zoom));
    let centre = |tile: u32| (f64::from(tile) * f64::from(mosaic.side) + 0.5) * step - MERCATOR_HALF;
    let format = match encoding {
        Encoding::Terrarium => "Terrarium tiles",
        Encoding::Mapbox => "Terrain-RGB tiles",
    };
    let holes = mosaic.holes();
    let mut raster = Raster::new(format, encoding.name(), mosaic.size, Samples::F32(mosaic.heights));
    raster.holes = holes;
    raster.step = encoding.step();
    raster.place = Some(Place {
        origin: [centre(west), -centre(north)],
        step: [step; 2],
        unit: Unit::Mercator,
        crs: Some("EPSG:3857".to_owned()),
    });
    let absent = u64::from(across) * u64::from(down) - level.len() as u64;
    if absent > 0 {
        raster.warnings.push(format!("{absent} of {} tiles at zoom {zoom} are absent and become holes", across * down));
    }
    Ok(raster)
}

fn no_tiles(name: &str) -> Error {
    Error::new(name, "directory", "expected tiles named zoom/x/y.png, found none")
}

/// All tiles by zoom level.
fn scan(path: &Path) -> Result<BTreeMap<u32, Level>, Error> {
    let mut levels: BTreeMap<u32, Level> = BTreeMap::new();
    for (zoom, zoom_path) in numbered(path)?.into_iter().filter(|(zoom, path)| *zoom <= MAX_ZOOM && path.is_dir()) {
        for (x, x_path) in numbered(&zoom_path)?.into_iter().filter(|(x, path)| *x < 1 << zoom && path.is_dir()) {
            for (y, file) in numbered(&x_path)?.into_iter().filter(|(y, path)| *y < 1 << zoom && is_picture(path)) {
                levels.entry(zoom).or_default().insert([x, y], file);
            }
        }
    }
    Ok(levels)
}

/// What lies in a directory under names that are numbers.
fn numbered(path: &Path) -> Result<Vec<(u32, PathBuf)>, Error> {
    let entries = fs::read_dir(path).map_err(|e| Error::new(path.display().to_string(), "directory", e))?;
    let paths = entries.filter_map(|entry| Some(entry.ok()?.path()));
    Ok(paths.filter_map(|path| Some((path.file_stem()?.to_str()?.parse().ok()?, path))).collect())
}

fn is_picture(path: &Path) -> bool {
    let extension = path.extension().and_then(|e| e.to_str()).unwrap_or_default();
    ["png", "webp", "pngraw"].iter().any(|e| extension.eq_ignore_ascii_case(e))
}

/// The zoom level asked for, else the highest whose tiles fill their rectangle, else the highest.
fn choose(mut levels: BTreeMap<u32, Level>, name: &str, options: &Options) -> Result<(u32, Level), Error> {
    let complete = |level: &Level| {
        let [west, north, east, south] = bounds(level);
        u64::from(east - west + 1) * u64::from(south - north + 1) == level.len() as u64
    };
    let best = levels.iter().rev().find(|(_, level)| complete(level)).or(levels.iter().next_back());
    let zoom = options.zoom.or(best.map(|(&zoom, _)| zoom)).ok_or_else(|| no_tiles(name))?;
    let found: Vec<String> = levels.keys().map(u32::to_string).collect();
    match levels.remove(&zoom) {
        Some(level) => Ok((zoom, level)),
        None => Err(Error::new(name, "--zoom", format!("expected one of {}, found {zoom}", found.join(", ")))),
    }
}

/// First and last x and y: west, north, east, south.
fn bounds(level: &Level) -> [u32; 4] {
    level.keys().fold([u32::MAX, u32::MAX, 0, 0], |[w, n, e, s], &[x, y]| [w.min(x), n.min(y), e.max(x), s.max(y)])
}

/// The encoding asked for, else the one that the directory's name or a description in it names.
fn encoding(path: &Path, name: &str, options: &Options) -> Result<Encoding, Error> {
    let absolute = path.canonicalize().unwrap_or_else(|_| path.to_owned());
    let descriptions =
        ["tilejson.json", "tiles.json", "tile.json", "metadata.json", "README.md", "README.txt", "README"];
    let texts = descriptions.iter().filter_map(|file| bytes(&path.join(file), name).ok());
    let texts = texts.map(|bytes| String::from_utf8_lossy(&bytes).to_lowercase());
    let own_name = absolute.file_name().unwrap_or_default().to_string_lossy().to_lowercase();
    options.encoding.or_else(|| std::iter::once(own_name).chain(texts).find_map(|text| named(&text))).ok_or_else(|| {
        let what = "neither name nor description tells what the colours mean: give --encoding terrarium|mapbox";
        Error::new(name, "directory", what)
    })
}

/// The encoding a text names, if only one.
fn named(text: &str) -> Option<Encoding> {
    let says = |words: &[&str]| words.iter().any(|word| text.contains(word));
    match (says(&["terrarium"]), says(&["mapbox", "terrain-rgb", "terrain_rgb"])) {
        (true, false) => Some(Encoding::Terrarium),
        (false, true) => Some(Encoding::Mapbox),
        _ => None,
    }
}

fn bytes(path: &Path, name: &str) -> Result<Vec<u8>, Error> {
    let mut bytes = Vec::new();
    let read = File::open(path).and_then(|file| file.take(TILE_BYTES).read_to_end(&mut bytes));
    read.map_err(|e| Error::new(name, "file", e))?;
    Ok(bytes)
}

/// The rectangle being put together.
struct Mosaic {
    /// Pixels a side of a tile.
    side: u32,
    size: [u32; 2],
    heights: Vec<f32>,
    /// Samples that some tile has given a height.
    known: Holes,
}

impl Mosaic {
    fn store(&mut self, encoding: Encoding, pixels: &[u8], [x, y]: [u32; 2]) {
        let (side, width) = (self.side as usize, self.size[0] as usize);
        for (j, row) in pixels.chunks_exact(side * 4).enumerate() {
            let at = (y as usize * side + j) * width + x as usize * side;
            let mut clear = Holes::none(side);
            encoding.store(row, 4, &mut self.heights[at..at + side], &mut clear, 0);
            (0..side).filter(|&i| !clear.contains(i)).for_each(|i| self.known.insert(at + i));
        }
    }

    fn holes(&self) -> Holes {
        let mut holes = Holes::none(self.heights.len());
        (0..self.heights.len()).filter(|&k| !self.known.contains(k)).for_each(|k| holes.insert(k));
        holes
    }
}
