//! Arguments of `cuesta bench`, and the fields and cases that they select.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::{Result, bail, ensure};
use clap::{Args, ValueEnum};

use super::common::Common;
use super::scene::{GroundArgs, ReadArgs, key_value, size};
use super::{endless, report, technique};
use crate::bench::goal::Goal;
use crate::bench::{Case, Terrain, kit, paths};
use crate::height::Field;
use crate::lod::TechniqueSpec;

/// Warm-up frames before each path.
const WARM_UP: usize = 5;
/// Largest number of frames on a path at which errors are measured.
const MEASURED: usize = 12;
/// The technique that draws every sample. Its tolerance has no effect, so it is measured at one only.
const BRUTE_FORCE: &str = "brute-force";

/// Fields, techniques, tolerances and paths of a benchmark.
#[derive(Args, Debug)]
pub struct MeasureArgs {
    /// Height files of any supported format, folders of web-map tiles, or `demo`.
    #[arg(required_unless_present = "kit")]
    pub terrain: Vec<String>,
    /// Options for reading them.
    #[command(flatten)]
    pub reading: ReadArgs,
    /// Folder for rows, results, pictures and the report. A stopped run resumes in its folder.
    #[arg(long, value_name = "DIR", required = true)]
    pub out: Option<PathBuf>,
    /// Techniques, each `technique` or `technique:variant`; default: all. Times are also given relative to the first
    /// one.
    #[arg(long, value_name = "T,…", value_delimiter = ',')]
    pub technique: Vec<TechniqueSpec>,
    /// Settings of the techniques that have them; may be repeated. Each combination of the values is measured.
    #[arg(long = "set", value_name = "KEY=V,…", value_parser = key_value)]
    pub settings: Vec<(String, String)>,
    /// Tolerances: largest allowed errors on the screen, pixels. Each is measured.
    #[arg(long, value_name = "PX,…", value_delimiter = ',', default_values_t = [0.5, 1.0, 2.0, 4.0, 8.0])]
    pub tolerance: Vec<f64>,
    /// Adjust the tolerance to keep N triangles per frame, starting from the first --tolerance. Each value is measured.
    #[arg(long, value_name = "N,…", value_delimiter = ',')]
    pub triangles: Vec<f64>,
    /// Adjust the tolerance to keep MS milliseconds per frame, starting from the first --tolerance. Each value is
    /// measured.
    #[arg(long, value_name = "MS,…", value_delimiter = ',')]
    pub frame_time: Vec<f64>,
    /// Camera paths; the kit has its own.
    #[arg(long, value_name = "P,…", value_delimiter = ',', default_value = "circle", help = path_help())]
    pub path: Vec<String>,
    /// Formula that converts metres of error to pixels.
    #[arg(long, value_enum, default_value_t = Choice::Certified)]
    pub metric: Choice,
    /// Size of the pictures, pixels; the kit has its own.
    #[arg(long, value_name = "WxH", default_value = "1280x720", value_parser = size)]
    pub size: [u32; 2],
    /// Number of frames per path; the kit has its own.
    #[arg(long, value_name = "N", default_value_t = 24, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub frames: u32,
    /// Number of times that each case is timed.
    #[arg(long, value_name = "R", default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..=100))]
    pub rounds: u32,
    /// Ground materials and a moving sun.
    #[command(flatten)]
    pub ground: GroundArgs,
    /// Run the public benchmark kit. Terrains on the command line are measured along with it.
    #[arg(long)]
    pub kit: bool,
    /// Run only the scenes of the kit whose name contains one of these texts, as in "peers-1 2049".
    #[arg(long, value_name = "TEXT,…", value_delimiter = ',', requires = "kit")]
    pub only: Vec<String>,
    /// Smoke test: a quarter of the frames, and two rounds. Not for publication.
    #[arg(long)]
    pub quick: bool,
}

/// The metrics to measure under.
#[derive(ValueEnum, Clone, Copy, Debug, PartialEq, Eq)]
pub enum Choice {
    /// An upper bound of the error at every pixel.
    Certified,
    /// The formula of the technique's paper: no bound off the view axis.
    Paper,
    /// Both, one after the other.
    Both,
}

/// The fields and cases of a run.
pub struct Planned {
    /// The fields of all cases.
    pub fields: Vec<(Terrain, Arc<Field>)>,
    /// The cases.
    pub cases: Vec<Case>,
    /// Number of times that each case is timed.
    pub rounds: usize,
    /// Warm-up frames before each path.
    pub warm_up: usize,
    /// The technique that times are relative to.
    pub base: String,
    /// Arguments that determine the cases, in a fixed order and spelling. A stopped run resumes only if they are equal.
    pub arguments: Vec<String>,
}

/// Returns the help of `--path`, which lists all paths.
pub fn path_help() -> String {
    let paths: Vec<_> = paths::PATHS.iter().map(|path| format!("{} ({})", path.name, path.about)).collect();
    format!("Camera paths; the kit has its own: {}", paths.join(", "))
}

/// A requested technique with its settings.
#[derive(Clone)]
struct Requested {
    technique: String,
    settings: BTreeMap<String, String>,
}

/// A path over a field, which every technique is measured on.
struct Flight {
    terrain: Terrain,
    path: &'static str,
    /// Size of the pictures (x, y), pixels.
    size: [u32; 2],
    frames: usize,
    /// Errors are measured at frames 0, `every`, 2 · `every`, …
    every: usize,
}

impl Planned {
    /// Reads and synthesises the fields, and lists the cases.
    ///
    /// # Errors
    /// If an argument is wrong or a file cannot be read.
    pub fn new(common: &Common, args: &MeasureArgs) -> Result<Self> {
        let requested = techniques(common, args)?;
        let numbers = [
            ("--tolerance", "pixels", &args.tolerance),
            ("--triangles", "triangles", &args.triangles),
            ("--frame-time", "milliseconds", &args.frame_time),
        ];
        for (flag, unit, values) in numbers {
            if let Some(wrong) = values.iter().find(|value| !(value.is_finite() && **value > 0.0)) {
                bail!("{flag} {wrong}: expected more than 0 {unit}");
            }
        }
        let (mut fields, mut flights) = (Vec::new(), Vec::new());
        if args.kit {
            of_kit(common, &args.only, &mut fields, &mut flights)?;
        }
        of_files(common, args, &mut fields, &mut flights)?;
        if args.quick {
            flights.iter_mut().for_each(Flight::shorten);
        }
        let cases = flights.iter().flat_map(|flight| cases(flight, &requested, args)).collect();
        let rounds = if args.quick { 2 } else { args.rounds as usize };
        let warm_up = if args.kit && !args.quick { kit::WARM_UP } else { WARM_UP };
        let arguments = arguments(args);
        Ok(Self { fields, cases, rounds, warm_up, base: requested[0].technique.clone(), arguments })
    }
}

/// Returns the requested techniques with their settings. Without `--technique` these are all techniques, without
/// variants.
fn techniques(common: &Common, args: &MeasureArgs) -> Result<Vec<Requested>> {
    let mut specs = args.technique.clone();
    if specs.is_empty() {
        specs = common.techniques.specs().into_iter().filter(|spec| spec.variant.is_none()).collect();
    }
    for (key, _) in &args.settings {
        let has = |spec| common.techniques.entry(spec).is_ok_and(|entry| entry.settings.iter().any(|s| s.key == key));
        ensure!(specs.iter().any(has), "--set {key}: no technique of this run has this setting");
    }
    Ok(specs.iter().map(|spec| combinations(common, spec, &args.settings)).collect::<Result<Vec<_>>>()?.concat())
}

/// Returns a technique once for each combination of the values of its settings.
fn combinations(common: &Common, spec: &TechniqueSpec, choices: &[(String, String)]) -> Result<Vec<Requested>> {
    let entry = technique::entry(&common.techniques, spec)?;
    let mut all = vec![Vec::new()];
    for (key, values) in choices.iter().filter(|(key, _)| entry.settings.iter().any(|setting| setting.key == key)) {
        let with = |own: &Vec<(String, String)>, value: &str| [&own[..], &[(key.clone(), value.to_string())]].concat();
        all = all.iter().flat_map(|own| values.split(',').map(move |value| with(own, value))).collect();
    }
    let checked = |own: Vec<(String, String)>| {
        let settings = technique::settings(entry, spec.variant.as_deref(), &own)?;
        report::warn_of_idle(common, entry, &settings);
        Ok(Requested { technique: spec.to_string(), settings: own.into_iter().collect() })
    };
    all.into_iter().map(checked).collect()
}

/// Adds the fields and flights of the kit, or only scenes with one of the texts `only` in their name.
fn of_kit(
    common: &Common,
    only: &[String],
    fields: &mut Vec<(Terrain, Arc<Field>)>,
    flights: &mut Vec<Flight>,
) -> Result<()> {
    let is_wanted = |scene: &&kit::KitScene| only.is_empty() || only.iter().any(|text| scene.name().contains(text));
    for scene in kit::SCENES.iter().filter(is_wanted) {
        let terrain = scene.terrain();
        if fields.iter().all(|(other, _)| *other != terrain) {
            let _spinner = report::spinner(common, format!("synthesising {terrain}"));
            fields.push((terrain.clone(), scene.field()));
        }
        let kit::KitScene { path, frames, every, .. } = *scene;
        flights.push(Flight { terrain, path, size: kit::SIZE, frames, every });
    }
    if flights.is_empty() {
        let names: Vec<_> = kit::SCENES.iter().map(kit::KitScene::name).collect();
        bail!("--only {}: no scene of the kit matches, expected part of one of: {}", only.join(","), names.join("; "));
    }
    Ok(())
}

/// Adds the fields of height files, and a flight along each path over each of them.
fn of_files(
    common: &Common,
    args: &MeasureArgs,
    fields: &mut Vec<(Terrain, Arc<Field>)>,
    flights: &mut Vec<Flight>,
) -> Result<()> {
    let paths =
        if args.kit { kit::REAL_PATHS.iter().map(|name| name.to_string()).collect() } else { args.path.clone() };
    for file in &args.terrain {
        let field = Arc::new(args.reading.load(common, std::slice::from_ref(file))?.field);
        endless::need_samples(&field, "bench")?;
        let name = Path::new(file).file_stem().map_or_else(|| file.clone(), |stem| stem.to_string_lossy().into_owned());
        let terrain = Terrain { name, size: field.size(), spacing_m: field.spacing };
        if let Some((other, _)) =
            fields.iter().find(|(other, _)| other.name == terrain.name && other.size == terrain.size)
        {
            bail!("{file}: another terrain has the same name and size: {other}");
        }
        for name in &paths {
            let Some(path) = paths::find(name) else {
                let known: Vec<_> = paths::PATHS.iter().map(|path| path.name).collect();
                bail!("--path {name}: expected one of {}", known.join(", "))
            };
            let frames = args.frames as usize;
            let every = frames.div_ceil(MEASURED);
            let size = if args.kit { kit::SIZE } else { args.size };
            flights.push(Flight { terrain: terrain.clone(), path: path.name, size, frames, every });
        }
        fields.push((terrain, field));
    }
    Ok(())
}

impl Flight {
    /// Reduces the frames to a quarter, with errors measured at no more than three of them.
    fn shorten(&mut self) {
        self.frames = self.frames.div_ceil(4);
        self.every = self.frames.div_ceil(3);
    }
}

/// Returns the cases of a flight: every technique at every tolerance or goal under every metric. Brute force has one
/// case, as neither has an effect on it.
fn cases(flight: &Flight, requested: &[Requested], args: &MeasureArgs) -> Vec<Case> {
    let metrics: &[&str] = match args.metric {
        Choice::Certified => &["certified"],
        Choice::Paper => &["paper"],
        Choice::Both => &["certified", "paper"],
    };
    let goals = goals(args);
    let mut cases = Vec::new();
    for (metric, own) in metrics.iter().flat_map(|metric| requested.iter().map(move |own| (metric, own))) {
        let is_brute_force = own.technique == BRUTE_FORCE;
        if is_brute_force && *metric != metrics[0] {
            continue;
        }
        // With goals, the first tolerance is that of the first frame.
        let has_one = is_brute_force || !goals.is_empty();
        let tolerances = if has_one { &args.tolerance[..1] } else { &args.tolerance[..] };
        let has_goals = has_one && !is_brute_force;
        let goals: Vec<_> = if has_goals { goals.iter().copied().map(Some).collect() } else { vec![None] };
        let choices = tolerances.iter().flat_map(|&px| goals.iter().map(move |&goal| (px, goal)));
        cases.extend(choices.map(|(tolerance_px, goal)| Case {
            terrain: flight.terrain.clone(),
            technique: own.technique.clone(),
            settings: own.settings.clone(),
            tolerance_px,
            goal,
            metric: metric.to_string(),
            path: flight.path.to_string(),
            size: flight.size,
            frames: flight.frames,
            every: flight.every,
        }));
    }
    cases
}

/// Returns the goals of `--triangles` and `--frame-time`.
fn goals(args: &MeasureArgs) -> Vec<Goal> {
    let triangles = args.triangles.iter().map(|&count| Goal::Triangles(count));
    triangles.chain(args.frame_time.iter().map(|&ms| Goal::FrameMs(ms))).collect()
}

/// Returns the arguments that determine the cases, independent of their order and spelling on the command line.
fn arguments(args: &MeasureArgs) -> Vec<String> {
    let joined = |values: &[String]| values.join(",");
    let specs: Vec<_> = args.technique.iter().map(TechniqueSpec::to_string).collect();
    let tolerances: Vec<_> = args.tolerance.iter().map(f64::to_string).collect();
    let settings: Vec<_> = args.settings.iter().map(|(key, value)| format!("{key}={value}")).collect();
    let mut list = args.terrain.clone();
    let techniques = if specs.is_empty() { "all".to_string() } else { joined(&specs) };
    let metric = format!("{:?}", args.metric).to_lowercase();
    list.push(format!("--technique {techniques} --tolerance {} --metric {metric}", joined(&tolerances)));
    if !settings.is_empty() {
        list.push(format!("--set {}", joined(&settings)));
    }
    list.extend(goals(args).iter().map(|goal| format!("held at {goal}")));
    list.extend(args.ground.detail.then(|| "--detail".to_string()));
    if args.ground.sun_speed != 0.0 {
        list.push(format!("--sun-speed {}", args.ground.sun_speed));
    }
    let [w, h] = args.size;
    if args.kit {
        list.push(format!("--kit (version {})", kit::VERSION));
        list.extend((!args.only.is_empty()).then(|| format!("--only {}", joined(&args.only))));
    } else {
        list.push(format!("--path {} --size {w}x{h} --frames {}", joined(&args.path), args.frames));
    }
    list.push(if args.quick { "--quick".to_string() } else { format!("--rounds {}", args.rounds) });
    list
}
