//! Directories of web-map tiles, `zoom/x/y.png`, whose colours encode heights.

use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
};

use super::decoded::Decoded;
use super::encoding::Encoding;
use super::format::Formats;
use super::mosaic::Parts;
use super::options::Options;
use super::tile_grid::TileGrid;
use super::{input, picture};
use crate::height::error::Error;
use crate::height::holes::Holes;
use crate::height::samples::Samples;

/// Files of one zoom level by column from the west and row from the north.
type ZoomLevel = BTreeMap<[u32; 2], PathBuf>;

/// A directory of tiles.
struct Tiles {
    grid: TileGrid,
    /// By zoom level and by whether the tiles have twice the pixels, `@2x`.
    levels: BTreeMap<(u32, bool), ZoomLevel>,
}

/// The deepest zoom level: 2^30 tiles a side, so that sample positions fit.
const MAX_ZOOM: u32 = 30;

/// Reads a folder of tiles; returns false if it has none.
pub(super) fn gather(path: &Path, options: &Options, _: Formats, parts: &mut Parts) -> Result<bool, Error> {
    let Some(tiles) = scan(path)? else { return Ok(false) };
    parts.add(&path.display().to_string(), options, |options| read(path, tiles, options))?;
    Ok(true)
}

/// Reads the bounding rectangle of the tiles at one zoom level; absent and empty tiles are holes.
fn read(path: &Path, tiles: Tiles, options: &Options) -> Result<Decoded, Error> {
    let name = path.display().to_string();
    input::one_band(&name, options)?;
    let Tiles { grid, levels } = tiles;
    let (zoom, level) = choose(levels, &name, options)?;
    let encoding = encoding(path, &name, &grid, options)?;
    let [west, north, east, south] = bounds(&level);
    let (across, down) = (east - west + 1, south - north + 1);

    let mut target: Option<Mosaic> = None;
    let mut empty = 0;
    for (&[x, y], file) in &level {
        let tile_name = file.display().to_string();
        let content = input::small_file(file, &tile_name)?;
        if content.is_empty() {
            empty += 1;
            continue;
        }
        let picture = picture::decode_bytes(&tile_name, &content, options)?;
        // Servers answer with a transparent picture of any size for absent tiles.
        if picture.pixels().all(|pixel| pixel.0[3] == 0) {
            continue;
        }
        let side = target.as_ref().map_or(picture.width(), |mosaic| mosaic.side);
        if picture.dimensions() != (side, side) {
            let what = format!("expected {side}x{side} pixels, found {}x{}", picture.width(), picture.height());
            return Err(Error::new(tile_name, "size", what));
        }
        let mosaic = match &mut target {
            Some(mosaic) => mosaic,
            None => target.insert(Mosaic::new(&name, [across, down], side, options)?),
        };
        mosaic.store(encoding, picture.as_raw(), [x - west, y - north]);
    }
    let Some(mosaic) = target else {
        return Err(Error::new(name, "directory", format!("expected tiles with data at zoom {zoom}, found none")));
    };

    let place = grid.place(&name, zoom, mosaic.side, [west, north])?;
    let format = match encoding {
        Encoding::Terrarium => "Terrarium tiles",
        Encoding::Mapbox => "Terrain-RGB tiles",
    };
    let holes = mosaic.holes();
    let mut raster = Decoded::new(encoding.name(), mosaic.size, Samples::F32(mosaic.heights));
    raster.format = format;
    raster.holes = holes;
    raster.step = encoding.step();
    raster.place = Some(place);
    let all = u64::from(across) * u64::from(down);
    let absent = all - level.len() as u64;
    for (count, what) in [(absent, "absent"), (empty, "empty")].into_iter().filter(|(count, _)| *count > 0) {
        raster.warnings.push(format!("{count} of {all} tiles at zoom {zoom} are {what} and become holes"));
    }
    Ok(raster)
}

fn no_tiles(name: &str) -> Error {
    Error::new(name, "directory", "expected tiles named zoom/x/y.png, found none")
}

/// Finds all tiles of a directory; `None` if it is another kind of folder.
fn scan(path: &Path) -> Result<Option<Tiles>, Error> {
    let mut levels: BTreeMap<(u32, bool), ZoomLevel> = BTreeMap::new();
    let grid = TileGrid::read(path)?;
    for (zoom, _, zoom_path) in numbered(path)?.into_iter().filter(|(zoom, _, path)| *zoom <= MAX_ZOOM && path.is_dir())
    {
        for (x, _, x_path) in numbered(&zoom_path)?.into_iter().filter(|(.., path)| path.is_dir()) {
            for (y, double, file) in numbered(&x_path)?.into_iter().filter(|(.., path)| is_picture(path)) {
                if let Some(tile) = grid.tile_at(zoom, [x, y]) {
                    levels.entry((zoom, double)).or_default().entry(tile).or_insert(file);
                }
            }
        }
    }
    Ok((!levels.is_empty()).then_some(Tiles { grid, levels }))
}

/// Entries of a directory with numbers as names, in the order of their names; the flag is true if `@2x` follows the
/// number. Of several files of one number the first counts.
fn numbered(path: &Path) -> Result<Vec<(u32, bool, PathBuf)>, Error> {
    let entries = fs::read_dir(path).map_err(|e| Error::new(path.display().to_string(), "directory", e))?;
    let paths = entries.filter_map(|entry| Some(entry.ok()?.path()));
    let number = |path: PathBuf| {
        let stem = path.file_stem()?.to_str()?;
        let double = stem.strip_suffix("@2x");
        let digits = double.unwrap_or(stem);
        // Neither 00 nor +0.
        let number = digits.parse().ok().filter(|number: &u32| number.to_string() == digits)?;
        Some((number, double.is_some(), path))
    };
    let mut found: Vec<_> = paths.filter_map(number).collect();
    found.sort();
    Ok(found)
}

fn is_picture(path: &Path) -> bool {
    let extension = path.extension().and_then(|e| e.to_str()).unwrap_or_default();
    ["png", "webp", "pngraw"].iter().any(|e| extension.eq_ignore_ascii_case(e))
}

/// Chooses the requested zoom level, else the highest whose tiles fill their rectangle, else the highest. Of both
/// densities it takes the one with more tiles, else the finer one.
fn choose(levels: BTreeMap<(u32, bool), ZoomLevel>, name: &str, options: &Options) -> Result<(u32, ZoomLevel), Error> {
    let mut fullest: BTreeMap<u32, ZoomLevel> = BTreeMap::new();
    for ((zoom, _), level) in levels {
        let other = fullest.entry(zoom).or_default();
        if level.len() >= other.len() {
            *other = level;
        }
    }
    let complete = |level: &ZoomLevel| {
        let [west, north, east, south] = bounds(level);
        u64::from(east - west + 1) * u64::from(south - north + 1) == level.len() as u64
    };
    let best = fullest.iter().rev().find(|(_, level)| complete(level)).or(fullest.iter().next_back());
    let zoom = options.zoom.or(best.map(|(&zoom, _)| zoom)).ok_or_else(|| no_tiles(name))?;
    let found: Vec<String> = fullest.keys().map(u32::to_string).collect();
    match fullest.remove(&zoom) {
        Some(level) => Ok((zoom, level)),
        None => Err(Error::new(name, "--zoom", format!("expected one of {}, found {zoom}", found.join(", ")))),
    }
}

/// First and last x and y: west, north, east, south.
fn bounds(level: &ZoomLevel) -> [u32; 4] {
    level.keys().fold([u32::MAX, u32::MAX, 0, 0], |[w, n, e, s], &[x, y]| [w.min(x), n.min(y), e.max(x), s.max(y)])
}

/// Returns the requested encoding, else the one that the directory's name or a description in it names.
fn encoding(path: &Path, name: &str, grid: &TileGrid, options: &Options) -> Result<Encoding, Error> {
    let absolute = path.canonicalize().unwrap_or_else(|_| path.to_owned());
    let descriptions =
        ["tilejson.json", "tiles.json", "tile.json", "metadata.json", "README.md", "README.txt", "README"];
    let texts = descriptions.iter().filter_map(|file| input::small_file(&path.join(file), name).ok());
    let texts = texts.map(|bytes| String::from_utf8_lossy(&bytes).to_lowercase());
    let own_name = absolute.file_name().unwrap_or_default().to_string_lossy().to_lowercase();
    options
        .encoding
        .or(grid.encoding)
        .or_else(|| std::iter::once(own_name).chain(texts).find_map(|text| named(&text)))
        .ok_or_else(|| {
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

/// The rectangle that tiles are copied into.
struct Mosaic {
    /// Pixels a side of a tile.
    side: u32,
    size: [u32; 2],
    heights: Vec<f32>,
    /// Samples that some tile has given a height.
    known: Holes,
}

impl Mosaic {
    fn new(name: &str, tiles: [u32; 2], side: u32, options: &Options) -> Result<Self, Error> {
        let size = tiles.map(|n| u64::from(n) * u64::from(side));
        let count = input::samples(name, size, options)?;
        Ok(Self { side, size: size.map(|n| n as u32), heights: vec![0.0; count], known: Holes::none(count) })
    }

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
