//! The steps from the samples of a file to a field: crop, turn, holes, scale and place.

use super::decoded::Decoded;
use super::loaded::{Footprint, Loaded};
use super::options::{HoleFill, Options};
use super::{rounding, unplaced};
use crate::height::error::Error;
use crate::height::field::Field;
use crate::height::georef::affine::Turn;
use crate::height::holes::Holes;
use crate::height::samples::Samples;

/// Largest absolute height, metres: f64 resolves a tenth of a millimetre there.
const FARTHEST_M: f64 = 1e12;

impl Decoded {
    /// Applies the options and makes the field.
    pub fn finish(mut self, name: &str, options: &Options) -> Result<Loaded, Error> {
        let whole = self.size;
        self.rearrange(name, options)?;
        self.make_holes(options);
        let range = self.check_range();
        self.blank_holes(range);
        self.samples = self.samples.compacted();
        self.assume_scale(options, range);
        self.scale_to_metres(name, options, range)?;
        let metres = self.step * self.scale * self.unit;
        self.warnings.extend(rounding::warning(&self.sample_type, range, metres));
        let exact_in_16_bit = matches!(self.samples, Samples::Coded { .. });
        let (spacing, origin) = self.lie(name, options)?;
        let tiles = tiles(name, self.size, options)?;

        let mut field = Field::new(self.samples, self.size, spacing, self.holes).tiled(tiles);
        field.origin = origin;
        field.crs = self.place.as_ref().and_then(|place| place.crs.clone());
        if options.hole_fill == HoleFill::Interpolate {
            field = field.without_holes();
        }
        let Self { format, sample_type, place, warnings, .. } = self;
        let first = options.crop.map_or([0, 0], |[x, z, ..]| [x, z]);
        let footprint = Footprint { whole, first, place };
        let sources = Vec::new();
        Ok(Loaded { field, format, sample_type, exact_in_16_bit, footprint, warnings, sources })
    }

    /// Returns the same values with rows from north to south, columns from west to east, and holes in place of nodata.
    pub fn settled(mut self, name: &str, options: &Options) -> Result<Self, Error> {
        self.rearrange(name, &Options { crop: None, ..options.clone() })?;
        self.make_holes(options);
        (self.nodata, self.turn) = (None, Turn::default());
        Ok(self)
    }

    /// Crops, and turns the rows to run from north to south and the columns from west to east.
    fn rearrange(&mut self, name: &str, options: &Options) -> Result<(), Error> {
        let Turn { transposed, flip } = self.turn;
        let [w, h] = if transposed { [self.size[1], self.size[0]] } else { self.size };
        let [x, z, crop_w, crop_h] = options.crop.unwrap_or([0, 0, w, h]);
        let fits = |at: u32, n: u32, side: u32| n >= 2 && at.checked_add(n).is_some_and(|end| end <= side);
        if !fits(x, crop_w, w) || !fits(z, crop_h, h) {
            let what = format!("expected at least 2x2 samples within {w}x{h}, found {crop_w}x{crop_h} at {x},{z}");
            return Err(Error::new(name, "--crop", what));
        }
        if [x, z, crop_w, crop_h] == [0, 0, w, h] && self.turn == Turn::default() {
            return Ok(());
        }
        // Samples of the file from one column, and from one row, to the next.
        let stride = if transposed { [self.size[0] as usize, 1] } else { [1, self.size[0] as usize] };
        let source = |n: u32, side: u32, flip: bool| if flip { side - 1 - n } else { n } as usize;
        let columns: Vec<usize> = (x..x + crop_w).map(|i| source(i, w, flip[0]) * stride[0]).collect();
        let rows = (z..z + crop_h).map(|j| source(j, h, flip[1]) * stride[1]);
        let order = rows.flat_map(|row| columns.iter().map(move |column| row + column));

        let mut holes = Holes::none(crop_w as usize * crop_h as usize);
        order.clone().enumerate().filter(|&(_, k)| self.holes.contains(k)).for_each(|(to, _)| holes.insert(to));
        self.samples = match &self.samples {
            Samples::F32(heights) => Samples::F32(order.map(|k| heights[k]).collect()),
            &Samples::Coded { ref codes, zero, scale } => {
                Samples::Coded { codes: order.map(|k| codes[k]).collect(), zero, scale }
            }
        };
        self.holes = holes;
        self.size = [crop_w, crop_h];
        self.place = self.place.take().map(|place| place.moved([x, z]));
        Ok(())
    }

    /// Returns the lowest and highest value, and warns of values that look like undeclared nodata.
    fn check_range(&mut self) -> [f32; 2] {
        let (mut low, mut high) = (Edge::default(), Edge::default());
        for k in (0..self.samples.len()).filter(|&k| self.holes.count() == 0 || !self.holes.contains(k)) {
            let value = self.samples.height(k);
            low.add(value);
            high.add(-value);
        }
        if low.count == 0 {
            self.warnings.push("no sample has data".to_owned());
            return [0.0, 0.0];
        }
        let (min, max) = (low.value, -high.value);
        let looks_like_nodata = [(min, low.count, low.next, max), (max, high.count, -high.next, min)]
            .into_iter()
            .filter(|&(value, count, next, other)| {
                let (gap, rest) = (distance(value, next), distance(next, other));
                count > 1
                    && next.is_finite()
                    && rest > 0.0
                    && gap > rest * if is_usual(f64::from(value) * self.step) { 0.25 } else { 4.0 }
            });
        for (value, count, next, _) in looks_like_nodata {
            let (value, next) = (f64::from(value) * self.step, f64::from(next) * self.step);
            self.warnings.push(format!(
                "{count} samples are {value}, far from the next value {next}: undeclared nodata? --nodata {value} makes them holes"
            ));
        }
        [min, max]
    }

    /// Sets samples under holes to a value in range, so that they do not affect the choice of codes.
    fn blank_holes(&mut self, [min, _]: [f32; 2]) {
        if let Samples::F32(heights) = &mut self.samples
            && self.holes.count() > 0
        {
            let holes = &self.holes;
            heights.iter_mut().enumerate().filter(|(k, _)| holes.contains(*k)).for_each(|(_, h)| *h = min);
        }
    }

    /// Warns if neither spacing nor scale is stated, and assumes a scale if the values cannot be metres.
    fn assume_scale(&mut self, options: &Options, range: [f32; 2]) {
        if self.place.is_some() || options.spacing.is_some() {
            return;
        }
        let has_scale = self.scale != 1.0 || self.unit != 1.0 || options.height_scale.is_some();
        if let Some(unplaced::Assumed { scale, warning }) =
            unplaced::assume(self.format, &self.sample_type, self.size, range, has_scale)
        {
            self.scale *= scale;
            self.warnings.push(warning);
        }
    }

    /// Turns values into metres: (value · scale + offset) · unit · `--height-scale` + `--height-offset`.
    fn scale_to_metres(&mut self, name: &str, options: &Options, range: [f32; 2]) -> Result<(), Error> {
        let metres = |unit: f64, shift: f64| (self.step * self.scale * unit, self.offset * unit + shift);
        let is_far = |value: f32, (factor, offset): (f64, f64)| {
            !(0.0..=FARTHEST_M).contains(&(f64::from(value) * factor + offset).abs())
        };
        let own = metres(self.unit, 0.0);
        if let Some(far) = range.into_iter().find(|&value| is_far(value, own)) {
            let far = f64::from(far) * self.step;
            let what = format!("expected at most 1e12 m, found {far:e}; --nodata {far:e} makes it a hole");
            return Err(Error::new(name, "heights", what));
        }
        let (factor, offset) = metres(self.unit * options.height_scale.unwrap_or(1.0), options.height_offset);
        if options.height_scale == Some(0.0) {
            return Err(Error::new(name, "--height-scale", "expected a number other than 0, found 0"));
        }
        let is_usable = |factor: f64| factor.is_finite() && factor as f32 != 0.0;
        if !is_usable(factor) || range.iter().any(|&value| is_far(value, (factor, offset))) {
            let what = format!("expected heights of at most 1e12 m, found {range:?} times {factor} plus {offset}");
            let place = match options.height_scale {
                _ if !is_usable(own.0) => "scale of the band",
                Some(_) => "--height-scale",
                None => "--height-offset",
            };
            return Err(Error::new(name, place, what));
        }
        if offset != 0.0 {
            self.samples.scale_and_shift(factor, offset);
        } else if factor != 1.0 {
            self.samples.multiply(factor as f32);
        }
        Ok(())
    }

    /// Returns spacing and origin, metres.
    fn lie(&self, name: &str, options: &Options) -> Result<([f64; 2], [f64; 2]), Error> {
        let (spacing, origin) = match &self.place {
            Some(place) => place.spacing_and_origin(self.size[1]),
            None => ([1.0; 2], [0.0; 2]),
        };
        let spacing = options.spacing.unwrap_or(spacing);
        // Positions are f64 metres, and f32 relative to the eye. Both limits are far beyond any planet.
        if spacing.iter().any(|s| !(1e-6..=1e9).contains(s)) || origin.iter().any(|o| !(-1e12..=1e12).contains(o)) {
            let what = format!("expected a spacing of 1e-6 to 1e9 m, found {spacing:?} m at {origin:?} m");
            return Err(Error::new(name, "spacing", what));
        }
        Ok((spacing, origin))
    }
}

/// Most samples along a side of a field, tiling included: lattice coordinates are i32, and the last block of a level may
/// end beyond the field by its own length.
pub const MAX_SIDE: u32 = 1 << 30;

/// Returns the repetitions of the field along (x, z).
fn tiles(name: &str, [w, h]: [u32; 2], options: &Options) -> Result<[u32; 2], Error> {
    let [nx, nz] = options.tiles.unwrap_or([1, 1]);
    if nx == 0 || nz == 0 {
        return Err(Error::new(name, "--tile", format!("expected at least 1 tile each way, found {nx},{nz}")));
    }
    let fits = |n: u32, side: u32| n.checked_mul(side).is_some_and(|n| n <= MAX_SIDE);
    match fits(nx, w) && fits(nz, h) {
        true => Ok([nx, nz]),
        false => Err(Error::new(
            name,
            "--tile",
            format!("expected at most 2^30 samples a side, found {nx}x{nz} tiles of {w}x{h}"),
        )),
    }
}

/// The lowest value, how often it occurs, and the lowest value above it.
struct Edge {
    value: f32,
    count: u64,
    next: f32,
}

impl Default for Edge {
    fn default() -> Self {
        Self { value: f32::INFINITY, count: 0, next: f32::INFINITY }
    }
}

impl Edge {
    #[inline]
    fn add(&mut self, value: f32) {
        if value > self.value {
            self.next = self.next.min(value);
        } else if value < self.value {
            *self = Self { value, count: 1, next: self.value };
        } else {
            self.count += 1;
        }
    }
}

fn distance(a: f32, b: f32) -> f64 {
    (f64::from(a) - f64::from(b)).abs()
}

/// Returns true for a value that programs commonly use for "no data".
fn is_usual(value: f64) -> bool {
    // −10000 m is black in Mapbox Terrain-RGB.
    const USUAL: [f64; 9] = [-32768.0, -32767.0, 32767.0, 65535.0, -9999.0, -10000.0, -99999.0, -999.0, 9999.0];
    USUAL.iter().any(|usual| (value - usual).abs() < 1e-3)
}
