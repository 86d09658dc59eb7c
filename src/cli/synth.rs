//! `cuesta synth`: writes a synthetic field to a file.

use std::path::PathBuf;

use anyhow::{Result, bail};
use clap::Args;

use super::common::{Common, Outcome};
use super::info::Info;
use super::report;
use crate::height::synth::{self, Kind};
use crate::height::{Footprint, Loaded, Samples, save};

/// Arguments of `cuesta synth`.
#[derive(Args, Debug)]
pub struct SynthArgs {
    /// The kind of field.
    #[arg(help = kinds())]
    pub kind: Kind,
    /// Size of the field, samples.
    #[arg(long, value_name = "WxH", default_value = "1025x1025", value_parser = super::scene::size)]
    pub size: [u32; 2],
    /// Seed; the same seed gives the same bytes on every machine.
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// Output file: .tif, .png, .asc, .r16 or .raw.
    #[arg(short, long, value_name = "FILE")]
    pub output: PathBuf,
}

/// Returns the help of the kind, which lists all kinds.
fn kinds() -> String {
    let names: Vec<_> = synth::KINDS.iter().map(|kind| format!("{} ({})", kind.name, kind.about)).collect();
    format!("Kind of field: {}", names.join(", "))
}

/// Runs the subcommand.
pub fn run(common: &Common, args: &SynthArgs) -> Result<Outcome> {
    let [w, h] = args.size;
    if w < 2 || h < 2 || u64::from(w) * u64::from(h) > 1 << 30 {
        bail!("--size {w}x{h}: expected at least 2x2 and at most 2^30 samples");
    }
    let field = {
        let _spinner = report::spinner(common, "synthesising");
        synth::synth(args.kind, args.size, args.seed)
    };
    save::save(&field, &args.output)?;
    let coded = matches!(field.samples(), Samples::Coded { .. });
    let sample_type = if coded { "u16" } else { "f32" }.to_string();
    let loaded = Loaded {
        field,
        format: "synth",
        sample_type,
        exact_in_16_bit: coded,
        footprint: Footprint::default(),
        warnings: Vec::new(),
        sources: Vec::new(),
    };
    report::print(common, &Info::of(&loaded))?;
    Ok(Outcome::Done)
}
