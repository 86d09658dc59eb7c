//! Numbers on the command line: negative ones everywhere, and the spellings of gdalinfo.

use std::any::TypeId;

use clap::{Arg, Command};

use crate::height;

/// Largest coordinate and largest length, metres: beyond it f64 cannot resolve a tenth of a millimetre.
pub(super) const FARTHEST_M: f64 = 1e12;
/// Smallest length, metres, and smallest tolerance, pixels.
pub(super) const FINEST: f64 = 1e-9;
/// The lengths that [`is_length`] accepts.
pub(super) const LENGTHS: &str = "1e-9 to 1e12 metres";

pub(super) fn is_length(metres: f64) -> bool {
    (FINEST..=FARTHEST_M).contains(&metres)
}

/// The same command whose flags for numbers take ones that begin with a minus, in any notation.
pub fn with_negative(command: Command) -> Command {
    let names: Vec<String> = command.get_subcommands().map(|command| command.get_name().to_string()).collect();
    let command = command.mut_args(|arg| if is_number(&arg) { arg.allow_hyphen_values(true) } else { arg });
    names.into_iter().fold(command, |command, name| command.mut_subcommand(name, with_negative))
}

/// Returns true for a flag that takes numbers, at least one.
fn is_number(arg: &Arg) -> bool {
    let kinds = [
        TypeId::of::<f64>(),
        TypeId::of::<u32>(),
        TypeId::of::<u64>(),
        TypeId::of::<usize>(),
        TypeId::of::<[f64; 2]>(),
        TypeId::of::<[u32; 2]>(),
        TypeId::of::<[u32; 4]>(),
    ];
    let kind = arg.get_value_parser().type_id();
    let may_be_absent = arg.get_num_args().is_some_and(|count| count.min_values() == 0);
    arg.get_action().takes_values() && !arg.is_positional() && !may_be_absent && kinds.iter().any(|k| kind == *k)
}

/// The value for "no data".
pub(super) fn nodata(text: &str) -> Result<f64, String> {
    height::number(text).ok_or_else(|| "expected a number, nan, inf or -inf".to_string())
}

/// A list of numbers, in parentheses or not, as gdalinfo prints sizes of pixels.
pub(super) fn numbers<T: std::str::FromStr, const N: usize>(text: &str) -> Result<[T; N], String> {
    let bare = text.strip_prefix('(').and_then(|text| text.strip_suffix(')')).unwrap_or(text);
    let parts: Vec<T> = bare.split(',').filter_map(|part| part.trim().parse().ok()).collect();
    let found = bare.split(',').count();
    if found != parts.len() {
        return Err("expected numbers separated by commas".to_string());
    }
    parts.try_into().map_err(|_| format!("expected {N} numbers separated by commas, found {found}"))
}

/// A spacing: one number, or one along x and one along z. The latter may be negative, as gdalinfo prints it for rows that run south.
pub(super) fn spacing(text: &str) -> Result<[f64; 2], String> {
    let pair = numbers::<f64, 2>(text).map(|[x, z]| [x, z.abs()]);
    let pair = pair.or_else(|_| numbers::<f64, 1>(text).map(|[s]| [s, s]))?;
    let is_length = pair.iter().all(|&s| is_length(s));
    if is_length { Ok(pair) } else { Err(format!("expected {}", LENGTHS)) }
}
