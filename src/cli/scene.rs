//! Arguments that describe a scene (terrain, view and look), and the values built from them.

use std::path::Path;

use anyhow::{Context, Result, anyhow, bail};
use clap::builder::PossibleValue;
use clap::{Args, ValueEnum};
use glam::DVec3;

use super::common::Common;
use super::numbers::{FARTHEST_M, LENGTHS, angles, is_length, nodata, numbers, spacing};
use super::overlay::Picture;
use super::several::is_demo;
use super::whole::Whole;
use super::{endless, report, several};
use crate::height::cave::Cave;
use crate::height::{Encoding, Field, Footprint, HoleFill, Loaded, Options, RawLayout, demo, load_all, load_bytes};

use crate::plan::{Colour, Forced, Look};
use crate::view::{Lens, Tolerance, View, default_near};

/// Height data on the command line.
#[derive(Args, Debug, Clone)]
pub struct TerrainArgs {
    /// Height files of any supported format, or folders of them, as one field; a folder of web-map tiles; `demo`; or
    /// `endless[:SEED]`. Where files overlap, the last one counts.
    #[arg(required = true)]
    pub terrain: Vec<String>,
    /// Options for reading them.
    #[command(flatten)]
    pub reading: ReadArgs,
}

/// Options for reading heights.
#[derive(Args, Debug, Clone)]
pub struct ReadArgs {
    /// Distance between samples, metres; overrides the file.
    #[arg(long, value_name = "DX[,DZ]", value_parser = spacing)]
    pub spacing: Option<[f64; 2]>,
    /// Factor on every height.
    #[arg(long, value_name = "S")]
    pub height_scale: Option<f64>,
    /// Added to every height after the factor, metres.
    #[arg(long, value_name = "M", allow_negative_numbers = true, default_value_t = 0.0)]
    pub height_offset: f64,
    /// Value that means "no data"; overrides the file.
    #[arg(long, value_name = "V", value_parser = nodata)]
    pub nodata: Option<f64>,
    /// Read the file as bare samples: WxH:u16le|u16be|i16le|i16be|f32le|f32be.
    #[arg(long, value_name = "LAYOUT")]
    pub raw: Option<RawLayout>,
    /// Heights of a cave's ceiling; the terrain is its floor. Where the ceiling is not above the floor there is rock.
    /// Requires sorted-strips.
    #[arg(long, value_name = "FILE")]
    pub ceiling: Option<String>,
    /// Keep only W by H samples, from sample (X, Z) on.
    #[arg(long, value_name = "X,Z,W,H", value_parser = numbers::<u32, 4>)]
    pub crop: Option<[u32; 4]>,
    /// Repeat the field NX times along x and NZ times along z.
    #[arg(long, value_name = "NX,NZ", value_parser = numbers::<u32, 2>)]
    pub tile: Option<[u32; 2]>,
    /// Samples without data: no (they stay holes) or interpolate (they are filled).
    #[arg(long, value_name = "HOW", default_value = "no", value_parser = hole_fill)]
    pub hole_fill: HoleFill,
    /// Encoding of heights in a colour picture: terrarium or mapbox.
    #[arg(long, value_name = "E", value_parser = encoding)]
    pub encoding: Option<Encoding>,
    /// Band to read, from 1.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub band: Option<u32>,
    /// Zoom level to read from a folder of web-map tiles; default: the highest one without missing tiles.
    #[arg(long)]
    pub zoom: Option<u32>,
    /// Largest number of samples; larger terrain is refused.
    #[arg(long, value_name = "N", default_value_t = 1 << 30)]
    pub max_samples: u64,
    /// Neither read nor write cache files beside large height files.
    #[arg(long)]
    pub no_cache: bool,
}

/// Eye and projection.
#[derive(Args, Debug, Clone)]
pub struct ViewArgs {
    /// Position of the eye, world metres; Y may be +H, a height above ground.
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true)]
    pub eye: Option<String>,
    /// Point to look at, world metres; Y may be +H, a height above ground.
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true, conflicts_with_all = ["yaw", "pitch"])]
    pub look: Option<String>,
    /// Heading, degrees: 0 = east, 90 = south.
    #[arg(long, value_name = "D")]
    pub yaw: Option<f64>,
    /// Pitch, degrees above the horizon.
    #[arg(long, value_name = "D")]
    pub pitch: Option<f64>,
    /// Roll, degrees clockwise.
    #[arg(long, value_name = "D", default_value_t = 0.0)]
    pub roll: f64,
    /// Horizontal field of view, degrees.
    #[arg(long, value_name = "D", default_value_t = 60.0)]
    pub fov: f64,
    /// Size of the picture, pixels.
    #[arg(long, value_name = "WxH", default_value = "1280x720", value_parser = size)]
    pub size: [u32; 2],
    /// Near plane, metres; default: 1/1000 of the height above ground, at least 0.1 m (less on terrain below 20 m
    /// across).
    #[arg(long, value_name = "M")]
    pub near: Option<f64>,
    /// Orthographic projection; the picture is M metres wide.
    #[arg(long, value_name = "M")]
    pub ortho: Option<f64>,
}

/// Colours, light and overlay.
#[derive(Args, Debug, Clone)]
pub struct LookArgs {
    /// Colour of the terrain; default: `overlay` if a picture is given, else `height`.
    #[arg(long, value_enum)]
    pub colour: Option<Colour>,
    /// Picture to drape over the terrain, placed by its GeoTIFF tags or world file. Without these it covers the whole
    /// height file.
    #[arg(long, value_name = "IMG")]
    pub overlay: Option<String>,
    /// Device memory for the overlay or for `--colour ground`, megabytes. Larger textures are streamed in tiles, finer
    /// near the eye.
    #[arg(long, value_name = "MB", default_value_t = 1100, value_parser = clap::value_parser!(u64).range(1..=1_000_000))]
    pub texture_memory: u64,
    /// Azimuth (0 = north, 90 = east) and altitude of the sun, degrees.
    #[arg(long, value_name = "AZ,ALT", value_parser = angles)]
    pub sun: Option<[f64; 2]>,
    /// Optical density of the fog, per metre.
    #[arg(long, value_name = "DENSITY", default_value_t = 0.0)]
    pub fog: f64,
    /// Draw edges only.
    #[arg(long)]
    pub wireframe: bool,
    /// Ground materials, a moving sun, and forced features.
    #[command(flatten)]
    pub ground: GroundArgs,
}

/// Ground materials, a moving sun, and forced features.
#[derive(Args, Debug, Clone)]
pub struct GroundArgs {
    /// Show grass, rock, scree and snow near the eye, by slope and height.
    #[arg(long)]
    pub detail: bool,
    /// Change of the sun's azimuth, degrees per second of scene time: real time in a window, 1/60 s per frame on a
    /// path, `--time` in a picture.
    #[arg(long, value_name = "DEG_PER_S", default_value_t = 0.0)]
    pub sun_speed: f64,
    /// Keep these features even if the scene does not need them; `info --plan` lists them.
    #[arg(long, value_name = "FEATURE,…", value_delimiter = ',')]
    pub keep: Vec<String>,
    /// Leave these features out even if the scene has them.
    #[arg(long, value_name = "FEATURE,…", value_delimiter = ',')]
    pub leave_out: Vec<String>,
}

impl GroundArgs {
    /// Returns a look with these options set.
    ///
    /// # Errors
    /// If a feature is unknown or cannot be forced, or the speed is not finite.
    pub fn over(&self, look: Look) -> Result<Look> {
        if !self.sun_speed.is_finite() {
            bail!("--sun-speed {}: expected degrees per second", self.sun_speed);
        }
        let named =
            |names: &[String], keep: bool, forced| names.iter().try_fold(forced, |f: Forced, n| f.with(n, keep));
        let forced = named(&self.keep, true, look.forced).map_err(|why| anyhow!("--keep {why}"))?;
        let forced = named(&self.leave_out, false, forced).map_err(|why| anyhow!("--leave-out {why}"))?;
        Ok(Look { detail: self.detail, sun_speed: self.sun_speed, forced, ..look })
    }
}

impl ValueEnum for Colour {
    fn value_variants<'a>() -> &'a [Self] {
        Self::ALL
    }

    fn to_possible_value(&self) -> Option<PossibleValue> {
        Some(PossibleValue::new(self.name()).help(self.help()))
    }
}

/// Parses a size, `WxH`, of positive numbers.
pub(super) fn size(text: &str) -> Result<[u32; 2], String> {
    let pair = numbers::<u32, 2>(&text.replace('x', ","));
    pair.ok().filter(|s| s.iter().all(|&n| n > 0)).ok_or_else(|| "expected WxH, as in 1280x720".to_string())
}

/// Parses `KEY=VALUE`.
pub(super) fn key_value(text: &str) -> Result<(String, String), String> {
    let (key, value) = text.split_once('=').ok_or("expected KEY=VALUE")?;
    Ok((key.trim().to_string(), value.trim().to_string()))
}

fn hole_fill(text: &str) -> Result<HoleFill, String> {
    match text {
        "no" => Ok(HoleFill::No),
        "interpolate" => Ok(HoleFill::Interpolate),
        _ => Err("expected no or interpolate".to_string()),
    }
}

fn encoding(text: &str) -> Result<Encoding, String> {
    match text {
        "terrarium" => Ok(Encoding::Terrarium),
        "mapbox" => Ok(Encoding::Mapbox),
        _ => Err("expected terrarium or mapbox".to_string()),
    }
}

impl ReadArgs {
    /// Reads a field, and its ceiling if one is given. Prints the reader's warnings.
    ///
    /// # Errors
    /// If a file cannot be read, or floor and ceiling do not match.
    pub fn load(&self, common: &Common, terrain: &[String]) -> Result<Loaded> {
        let mut loaded = self.load_alone(common, terrain)?;
        if let Some(file) = &self.ceiling {
            let ceiling = self.load_alone(common, std::slice::from_ref(file))?;
            loaded.field = Field::clone(Cave::new(&loaded.field, &ceiling.field, file)?.floor());
        }
        Ok(loaded)
    }

    /// Reads a field without its ceiling.
    fn load_alone(&self, common: &Common, terrain: &[String]) -> Result<Loaded> {
        let options = Options {
            spacing: self.spacing,
            height_scale: self.height_scale,
            height_offset: self.height_offset,
            nodata: self.nodata,
            raw: self.raw,
            crop: self.crop,
            tiles: self.tile,
            hole_fill: self.hole_fill,
            encoding: self.encoding,
            band: self.band,
            zoom: self.zoom,
            max_samples: self.max_samples,
        };
        let only = several::only(terrain)?;
        if let Some(terrain) = only.and_then(|only| endless::named(only, &options)) {
            return terrain;
        }
        let _spinner = report::spinner(common, format!("reading {}", terrain.join(" ")));
        let is_demo = only.is_some_and(is_demo);
        let mut loaded = if is_demo {
            load_bytes("demo", demo::PICTURE, &demo_options(options))?
        } else {
            load_all(&terrain.iter().map(Path::new).collect::<Vec<_>>(), &options)?
        };
        loaded.field.file = (!self.no_cache && !is_demo).then(|| several::cache_path(terrain).into());
        warn_of(common, &terrain.join(" "), &loaded);
        Ok(loaded)
    }
}

impl TerrainArgs {
    /// Reads the field and prints the reader's warnings.
    ///
    /// # Errors
    /// If a file cannot be read.
    pub fn load(&self, common: &Common) -> Result<Loaded> {
        self.reading.load(common, &self.terrain)
    }

    /// Returns the names on the command line, separated by spaces.
    pub fn name(&self) -> String {
        self.terrain.join(" ")
    }
}

/// Prints the reader's warnings. Those about a single file get its name, unless they begin with that of the terrain.
fn warn_of(common: &Common, terrain: &str, loaded: &Loaded) {
    for warning in &loaded.warnings {
        match &loaded.sources[..] {
            [only] if !warning.starts_with(terrain) => report::warn(common, &format!("{}: {warning}", only.file)),
            _ => report::warn(common, warning),
        }
    }
}

/// Adds the spacing and the height scale of the embedded terrain to the user's options.
fn demo_options(options: Options) -> Options {
    Options {
        spacing: options.spacing.or(Some([demo::SPACING; 2])),
        height_scale: Some(f64::from(demo::SCALE) * options.height_scale.unwrap_or(1.0)),
        raw: None,
        ..options
    }
}

impl LookArgs {
    /// Returns the device memory for streamed textures, bytes.
    pub fn texture_bytes(&self) -> u64 {
        1_000_000 * self.texture_memory
    }

    /// Returns the look, and the overlay if the colours need one. `terrain` is the field's name on the command line.
    ///
    /// # Errors
    /// If an option is wrong or the overlay cannot be read.
    pub fn build(
        &self,
        common: &Common,
        terrain: &str,
        (field, footprint): (&Field, &Footprint),
    ) -> Result<(Look, Option<image::RgbaImage>)> {
        let has_picture = self.overlay.is_some() || is_demo(terrain);
        let colour = self.colour.unwrap_or(if has_picture { Colour::Overlay } else { Colour::Height });
        if colour == Colour::Error && endless::is_named(terrain) {
            bail!("--colour error: {terrain} has no samples to compare with");
        }
        let picture = self.picture(terrain, colour)?;
        let defaults = Look::default();
        let sun = self.sun.unwrap_or(defaults.sun);
        if !(self.fog.is_finite() && self.fog >= 0.0) {
            bail!("--fog {}: expected a density of 0 or more per metre", self.fog);
        }
        let look = Look { colour, sun, fog: self.fog, wireframe: self.wireframe, ..defaults };
        let drape = picture.as_ref().map(|picture| picture.drape(common, field, footprint)).transpose()?;
        let look = Look { texture_bytes: self.texture_bytes(), drape, ..look };
        Ok((self.ground.over(look)?, picture.map(|picture| picture.image)))
    }

    /// Returns the look and the overlay for a window, where the user may switch to the overlay later. The overlay is
    /// read even if the initial colours do not need it.
    ///
    /// # Errors
    /// As [`Self::build`].
    pub fn build_for_window(
        &self,
        common: &Common,
        terrain: &str,
        loaded: (&Field, &Footprint),
    ) -> Result<(Look, Option<image::RgbaImage>)> {
        let (look, picture) = self.build(common, terrain, loaded)?;
        if picture.is_some() {
            return Ok((look, picture));
        }
        let overlaid = LookArgs { colour: None, ..self.clone() };
        let (Look { drape, .. }, picture) = overlaid.build(common, terrain, loaded)?;
        Ok((Look { drape, ..look }, picture))
    }

    /// Returns the overlay; `None` if the colours need none.
    fn picture(&self, terrain: &str, colour: Colour) -> Result<Option<Picture>> {
        match (&self.overlay, colour) {
            (Some(path), Colour::Overlay | Colour::Maps) => Ok(Some(Picture::read(path)?)),
            (None, Colour::Overlay | Colour::Maps) if is_demo(terrain) => Ok(Some(Picture::demo()?)),
            (None, Colour::Overlay | Colour::Maps) => bail!("--colour: no picture given, expected --overlay IMG"),
            _ => Ok(None),
        }
    }
}

impl ViewArgs {
    /// Returns the view of a field. By default, it shows the whole field at an angle from above.
    ///
    /// # Errors
    /// If a number is out of range.
    pub fn build(&self, field: &Field, tolerance: Tolerance) -> Result<View> {
        if !(self.fov > 0.0 && self.fov < 180.0) {
            bail!("--fov {}: expected degrees between 0 and 180", self.fov);
        }
        let angles = [("--yaw", self.yaw), ("--pitch", self.pitch), ("--roll", Some(self.roll))];
        if let Some((flag, Some(angle))) = angles.into_iter().find(|(_, angle)| angle.is_some_and(|a| !a.is_finite())) {
            bail!("{flag} {angle}: expected degrees");
        }
        let whole = Whole::of(field, self.fov, self.size);
        let eye = match &self.eye {
            Some(text) => position("--eye", text, field)?,
            None => whole.eye,
        };
        let world_from_eye = match (&self.look, self.yaw, self.pitch) {
            (Some(text), _, _) => {
                let forward = position("--look", text, field)? - eye;
                if forward == DVec3::ZERO {
                    bail!("--look {text}: expected another point than the eye");
                }
                View::looking_along(forward) * View::rolled(self.roll)
            }
            (None, None, None) if self.eye.is_none() => whole.world_from_eye * View::rolled(self.roll),
            (None, yaw, pitch) => View::turned(yaw.unwrap_or(-90.0), pitch.unwrap_or(0.0), self.roll),
        };
        let above = eye.y - field.height_at(eye.x, eye.z).unwrap_or(whole.centre.y);
        let near = match self.near {
            Some(near) if !is_length(near) => bail!("--near {near:?}: expected {LENGTHS}"),
            Some(near) => near,
            None => default_near(above, 2.0 * whole.radius).min(FARTHEST_M),
        };
        let lens = match self.ortho {
            Some(width) if is_length(width) => {
                Lens::Orthographic { width, far: near + 2.0 * (eye.distance(whole.centre) + whole.radius) }
            }
            Some(width) => bail!("--ortho {width:?}: expected {LENGTHS}"),
            None => Lens::Perspective { fov_x: self.fov.to_radians() },
        };
        Ok(View { eye, world_from_eye, lens, size: self.size, near, tolerance, time_s: 0.0 })
    }
}

/// Parses a position `X,Y,Z` in metres. Y may be `+H`, a height above the ground at (X, Z). `flag` is named in errors.
fn position(flag: &str, text: &str, field: &Field) -> Result<DVec3> {
    let parts: Vec<_> = text.split(',').map(str::trim).collect();
    let wrong = || anyhow!("{flag} {text}: expected X,Y,Z in metres, at most 1e12; Y may be +H above ground");
    let &[x, y, z] = parts.as_slice() else { return Err(wrong()) };
    let number = |part: &str| part.parse::<f64>().ok().filter(|v| v.abs() <= FARTHEST_M).ok_or_else(wrong);
    let (x, z) = (number(x)?, number(z)?);
    let y = match y.strip_prefix('+') {
        Some(above) => {
            let ground = field.height_at(x, z);
            ground.with_context(|| format!("{flag} {text}: there is no terrain below"))? + number(above)?
        }
        None => number(y)?,
    };
    Ok(DVec3::new(x, y, z))
}
