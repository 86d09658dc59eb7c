//! Mosaics: one raster from several on one grid, which are files named together, a folder, or members of an archive.

use super::decoded::Decoded;
use super::input;
use super::loaded::SourceFile;
use super::options::Options;
use crate::height::error::Error;
use crate::height::georef::place::Place;
use crate::height::georef::unit::Unit;
use crate::height::holes::Holes;
use crate::height::samples::Samples;

/// Distance from the common grid up to which a file counts as on it, samples: coordinates are rounded in files.
const ON_GRID: f64 = 0.01;
/// Distance from the common grid up to which a file is moved onto it, with a warning, samples.
const NEAR_GRID: f64 = 0.25;

/// A raster, and the file that it was read from.
pub(super) struct Part {
    /// The file's name in messages.
    pub name: String,
    pub raster: Decoded,
}

impl Part {
    /// Returns the rank among rasters of the same samples, lowest for heights. Their name ends in a word for heights, as in
    /// `N42E001_dem.tif` beside `N42E001_num.tif`, and their samples have more than 8 bits.
    fn unlikeliness(&self) -> u32 {
        const HEIGHTS: [&str; 8] = ["dem", "dtm", "dsm", "dhm", "dgm", "hgt", "elevation", "height"];
        let file = self.name.rsplit(['/', '\\']).next().unwrap_or_default().to_lowercase();
        let stem = file.rsplit_once('.').map_or(file.as_str(), |(stem, _)| stem);
        let last = stem.rsplit(|c: char| !c.is_alphanumeric()).next().unwrap_or_default();
        let is_byte = ["u8", "i8"].contains(&self.raster.sample_type.as_str());
        u32::from(!HEIGHTS.contains(&last)) * 2 + u32::from(is_byte)
    }
}

/// Rasters read one after the other, together within the limit of samples.
#[derive(Default)]
pub(super) struct Parts {
    list: Vec<Part>,
    samples: u64,
    /// Warnings about the mosaic, in addition to those of each raster.
    pub warnings: Vec<String>,
}

impl Parts {
    /// Number of rasters.
    pub fn len(&self) -> usize {
        self.list.len()
    }

    /// Reads one more raster under what is left of the limit.
    pub fn add(
        &mut self,
        name: &str,
        options: &Options,
        read: impl FnOnce(&Options) -> Result<Decoded, Error>,
    ) -> Result<(), Error> {
        let left = options.max_samples - self.samples.min(options.max_samples);
        let raster = read(&Options { max_samples: left, ..options.clone() }).map_err(|mut error| {
            if self.samples > 0 && error.what.contains("--max-samples") {
                error.what += &format!(" after {} samples of other files", self.samples);
            }
            error
        })?;
        self.samples += raster.samples.len() as u64;
        self.list.push(Part { name: name.to_owned(), raster });
        Ok(())
    }

    /// Removes companions from the rasters of one folder or archive, which begin at `begin`.
    ///
    /// A companion has no position beside rasters that have one, as a preview. Or it covers the samples of a raster
    /// that is more likely one of heights, as a mask or a count.
    pub fn leave_out_companions(&mut self, begin: usize) {
        let group = self.list.split_off(begin);
        let any_placed = group.iter().any(|part| part.raster.place.is_some());
        let rank = |at: usize| (group[at].unlikeliness(), at);
        let preferred = |at: usize| {
            let mut others = (0..group.len()).filter(|&other| rank(other) < rank(at));
            others.find(|&other| covers_same(&group[other].raster, &group[at].raster))
        };
        let left_out = |at: usize| match preferred(at) {
            _ if any_placed && group[at].raster.place.is_none() => Some("says no position".to_owned()),
            Some(other) => Some(format!("covers the same samples as {}", group[other].name)),
            None => None,
        };
        let reasons: Vec<_> = (0..group.len()).map(left_out).collect();
        for (part, reason) in group.into_iter().zip(reasons) {
            match reason {
                Some(reason) => self.warnings.push(format!("{} {reason} and is left out", part.name)),
                None => self.list.push(part),
            }
        }
        self.samples = self.list.iter().map(|part| part.raster.samples.len() as u64).sum();
    }

    /// Combines the rasters. Where several have data the last one counts; where none has data there is a hole.
    pub fn join(self, name: &str, options: &Options) -> Result<(Decoded, Vec<SourceFile>), Error> {
        let Self { mut list, warnings, .. } = self;
        if let [part] = &mut list[..] {
            let source = source_file(&part.name, &part.raster, [0, 0]);
            part.raster.warnings.extend(warnings);
            return Ok((list.remove(0).raster, vec![source]));
        }
        let mut parts = Vec::with_capacity(list.len());
        for Part { name, raster } in list {
            let raster = raster.settled(&name, options)?;
            parts.push(Part { name, raster });
        }
        let Layout { size, corners, place, moved } = Layout::of(name, &mut parts)?;
        let count = input::samples(name, size, options)?;
        let size = size.map(|n| n as u32);
        let sources = parts.iter().zip(&corners).map(|(part, &at)| source_file(&part.name, &part.raster, at));
        let sources = sources.collect();
        let mut raster = Canvas::paint(parts, size, count, &corners);
        raster.place = Some(place);
        raster.warnings.splice(0..0, warnings.into_iter().chain(moved));
        Ok((raster, sources))
    }
}

/// The file of a raster whose north-west sample lies at a column and row.
fn source_file(file: &str, raster: &Decoded, at: [u32; 2]) -> SourceFile {
    SourceFile { file: file.to_owned(), format: raster.format, at, size: raster.size }
}

/// Returns true if two rasters have the same size at the same place.
fn covers_same(a: &Decoded, b: &Decoded) -> bool {
    let same = |(a, b): (&Place, &Place)| a.unit == b.unit && offset(a, b).iter().all(|steps| steps.abs() < ON_GRID);
    a.size == b.size && a.place.as_ref().zip(b.place.as_ref()).is_some_and(same)
}

/// Columns and rows, in samples of `first`, from its north-west sample to that of `other`.
fn offset(first: &Place, other: &Place) -> [f64; 2] {
    let [east, north] = [other.origin[0] - first.origin[0], other.origin[1] - first.origin[1]];
    [east / first.step[0], -north / first.step[1]]
}

/// Position of each raster in the rectangle around all.
struct Layout {
    size: [u64; 2],
    /// Column and row of each raster's north-west sample.
    corners: Vec<[u32; 2]>,
    place: Place,
    /// A warning about rasters moved onto the common grid.
    moved: Option<String>,
}

impl Layout {
    fn of(name: &str, parts: &mut [Part]) -> Result<Self, Error> {
        let steps = on_one_grid(parts)?;
        let nearest = steps.iter().map(|at| at.map(f64::round)).collect::<Vec<_>>();
        let low = [0, 1].map(|axis| nearest.iter().map(|at| at[axis]).fold(f64::INFINITY, f64::min));
        let end = |axis: usize| {
            let ends = nearest.iter().zip(&*parts).map(|(at, part)| at[axis] + f64::from(part.raster.size[axis]));
            ends.fold(f64::NEG_INFINITY, f64::max)
        };
        let size = [end(0) - low[0], end(1) - low[1]];
        if size.iter().any(|n| *n > f64::from(u32::MAX)) {
            let what =
                format!("expected at most 2^32 samples a side around all files, found {} x {}", size[0], size[1]);
            return Err(Error::new(name, "size", what));
        }
        let away = |at: &[f64; 2]| (at[0] - at[0].round()).abs().max((at[1] - at[1].round()).abs());
        let farthest = steps.iter().map(away).fold(0.0, f64::max);
        let moved = (farthest > ON_GRID).then(|| {
            let all = steps.iter().filter(|at| away(at) > ON_GRID).count();
            format!(
                "{all} of {} files are moved onto the grid of the first, by {farthest:.2} samples at most",
                parts.len()
            )
        });
        let mut place =
            parts.iter().find_map(|part| part.raster.place.clone()).ok_or_else(|| no_position(&parts[0], name))?;
        place.crs = parts.iter().find_map(|part| part.raster.place.as_ref()?.crs.clone());
        place.origin = [place.origin[0] + low[0] * place.step[0], place.origin[1] - low[1] * place.step[1]];
        let corners = nearest.iter().map(|at| [(at[0] - low[0]) as u32, (at[1] - low[1]) as u32]).collect();
        Ok(Self { size: size.map(|n| n as u64), corners, place, moved })
    }
}

/// Samples from the first raster's corner to each one's, once all are found to lie on one grid.
fn on_one_grid(parts: &mut [Part]) -> Result<Vec<[f64; 2]>, Error> {
    across_the_antimeridian(parts);
    let (first, rest) = parts.split_first().ok_or_else(|| Error::new("mosaic", "files", "expected one, found none"))?;
    let place = first.raster.place.as_ref().ok_or_else(|| no_position(first, "other files"))?;
    let mut steps = vec![[0.0; 2]];
    for part in rest {
        let other = part.raster.place.as_ref().ok_or_else(|| no_position(part, &first.name))?;
        let differs = |field: &str, expected: String, found: String| {
            let what = format!(
                "expected {expected} as in {}, found {found}: bring the files onto one grid first, as with gdalwarp",
                first.name
            );
            Error::new(&part.name, field, what)
        };
        let crs = |place: &Place| place.crs.clone().unwrap_or_else(|| "no named system".to_owned());
        let named_apart = place.crs.as_ref().zip(other.crs.as_ref()).is_some_and(|(a, b)| !a.eq_ignore_ascii_case(b));
        if named_apart || place.unit != other.unit {
            return Err(differs("coordinate system", crs(place), crs(other)));
        }
        // A step that differs puts the last sample off the grid.
        let drift = |axis: usize| {
            (other.step[axis] / place.step[axis] - 1.0).abs()
                * f64::from(part.raster.size[axis].max(first.raster.size[axis]))
        };
        if drift(0).max(drift(1)) > NEAR_GRID {
            let spacing = |place: &Place| format!("a spacing of {} x {}", place.step[0], place.step[1]);
            return Err(differs("spacing", spacing(place), spacing(other)));
        }
        let at = offset(place, other);
        let away = at.map(|steps| steps - steps.round());
        if away.iter().any(|away| away.is_nan() || away.abs() > NEAR_GRID) {
            let found = format!("them {:.2} east and {:.2} south of it", away[0], away[1]);
            return Err(differs("grid", "samples on the grid".to_owned(), found));
        }
        steps.push(at);
    }
    Ok(steps)
}

fn no_position(part: &Part, beside: &str) -> Error {
    let what =
        format!("expected one, to lie beside {beside}, found none: give a georeferenced file, or one file alone");
    Error::new(&part.name, "position", what)
}

/// Moves western longitudes by a turn where that makes the rectangle around all narrower.
fn across_the_antimeridian(parts: &mut [Part]) {
    let places = || parts.iter().map(|part| (part.raster.place.as_ref(), part.raster.size[0]));
    if !places().all(|(place, _)| place.is_some_and(|place| place.unit == Unit::DEGREES)) {
        return;
    }
    let width = |turned: fn(f64) -> f64| {
        let ends = places().filter_map(|(place, columns)| {
            let (west, step) = place.map(|place| (turned(place.origin[0]), place.step[0]))?;
            Some([west, west + step * f64::from(columns)])
        });
        let [west, east] = ends.fold([f64::INFINITY, f64::NEG_INFINITY], |[w, e], end| [w.min(end[0]), e.max(end[1])]);
        east - west
    };
    // Half a degree: a tile's own edge may lie a sample west of 0.
    let turned = |west: f64| if west < -0.5 { west + 360.0 } else { west };
    if width(turned) < width(|west| west) - 180.0 {
        parts
            .iter_mut()
            .filter_map(|part| part.raster.place.as_mut())
            .for_each(|place| place.origin[0] = turned(place.origin[0]));
    }
}

/// The rectangle that rasters are copied into.
struct Canvas {
    width: usize,
    samples: Samples,
    /// Samples that have data.
    known: Holes,
    /// Samples within some raster.
    covered: Holes,
    /// Number of samples with other heights in an earlier raster, and the largest difference.
    apart: (u64, f32),
}

impl Canvas {
    /// Copies rasters to their corners, with warnings about overlaps and gaps. Values are copied unchanged if all
    /// files have one unit; otherwise they become metres.
    fn paint(parts: Vec<Part>, size: [u32; 2], count: usize, corners: &[[u32; 2]]) -> Decoded {
        let first = &parts[0].raster;
        let (format, sample_type) = (first.format, first.sample_type.clone());
        let measure = |raster: &Decoded| [raster.step, raster.scale, raster.offset, raster.unit];
        let [step, scale, offset, unit] = measure(first);
        let all = |alike: &dyn Fn(&Decoded) -> bool| parts.iter().all(|part| alike(&part.raster));
        let alike = all(&|raster| measure(raster) == [step, scale, offset, unit]);
        let codes = |samples: &Samples| match samples {
            Samples::Coded { zero, scale, .. } => Some((*zero, *scale)),
            Samples::F32(_) => None,
        };
        let coded = codes(&first.samples).filter(|own| alike && all(&|raster| codes(&raster.samples) == Some(*own)));
        let samples = match coded {
            Some((zero, scale)) => Samples::Coded { codes: vec![0; count], zero, scale },
            None => Samples::F32(vec![0.0; count]),
        };
        let format = if all(&|raster| raster.format == format) { format } else { "mosaic" };
        let sample_type = if all(&|raster| raster.sample_type == sample_type) { sample_type } else { "f32".to_owned() };

        let none = Holes::none(count);
        let mut canvas = Self { width: size[0] as usize, samples, known: none.clone(), covered: none, apart: (0, 0.0) };
        let mut warnings = Vec::new();
        for (Part { name, raster }, corner) in parts.into_iter().zip(corners) {
            let to_metres = [raster.step * raster.scale * raster.unit, raster.offset * raster.unit];
            canvas.copy(&raster, if alike { [1.0, 0.0] } else { to_metres }, *corner);
            warnings.extend(raster.warnings.into_iter().map(|warning| format!("{name}: {warning}")));
        }
        let unit_of_value = if alike { step * scale * unit } else { 1.0 };
        warnings.extend(canvas.warnings(count, unit_of_value));
        let mut raster = Decoded::new(&sample_type, size, canvas.samples);
        raster.format = format;
        (0..count).filter(|&k| !canvas.known.contains(k)).for_each(|k| raster.holes.insert(k));
        if alike {
            (raster.step, raster.scale, raster.offset, raster.unit) = (step, scale, offset, unit);
        }
        raster.warnings = warnings;
        raster
    }

    /// Copies a raster whose values become value · factor + offset.
    fn copy(&mut self, raster: &Decoded, [factor, offset]: [f64; 2], [column, row]: [u32; 2]) {
        let width = raster.size[0] as usize;
        for k in 0..raster.samples.len() {
            let at = (row as usize + k / width) * self.width + column as usize + k % width;
            self.covered.insert(at);
            if raster.holes.contains(k) {
                continue;
            }
            let value = match [factor, offset] {
                [1.0, 0.0] => raster.samples.height(k),
                _ => (f64::from(raster.samples.height(k)) * factor + offset) as f32,
            };
            if self.known.contains(at) {
                let apart = (self.samples.height(at) - value).abs();
                self.apart = (self.apart.0 + u64::from(apart > 0.0), self.apart.1.max(apart));
            }
            self.known.insert(at);
            match (&mut self.samples, &raster.samples) {
                (Samples::Coded { codes, .. }, Samples::Coded { codes: from, .. }) => codes[at] = from[k],
                (samples, _) => samples.set(at, value),
            }
        }
    }

    fn warnings(&self, count: usize, metres: f64) -> Vec<String> {
        let (apart, max) = self.apart;
        let gaps = count as u64 - self.covered.count();
        let overlap = (apart > 0).then(|| {
            let max = f64::from(max) * metres.abs();
            format!("{apart} samples have other heights in another file, up to {max:.2} m apart: the last file counts")
        });
        let gap = (gaps > 0).then(|| format!("{gaps} of {count} samples lie in no file and are holes"));
        overlap.into_iter().chain(gap).collect()
    }
}
