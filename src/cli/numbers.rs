//! Parses numbers on the command line. Negative ones are accepted after a space, and lists in the notation of gdalinfo.

use std::any::TypeId;

use clap::{Arg, Command};

use crate::height;

/// Largest absolute coordinate and largest length, metres. Beyond it, f64 cannot resolve a tenth of a millimetre.
pub(super) const FARTHEST_M: f64 = 1e12;
/// Smallest length, metres; also the smallest tolerance, pixels.
pub(super) const FINEST: f64 = 1e-9;
/// The range of lengths, for error messages.
pub(super) const LENGTHS: &str = "1e-9 to 1e12 metres";

/// Returns true if a length is within the accepted range, metres.
pub(super) fn is_length(metres: f64) -> bool {
    (FINEST..=FARTHEST_M).contains(&metres)
}

/// Makes all flags for numbers accept values that begin with a minus, as in `--nodata -3.4e38`, also in subcommands.
pub fn with_negative(command: Command) -> Command {
    let names: Vec<String> = command.get_subcommands().map(|command| command.get_name().to_string()).collect();
    let command = command.mut_args(|arg| if is_number(&arg) { arg.allow_hyphen_values(true) } else { arg });
    names.into_iter().fold(command, |command, name| command.mut_subcommand(name, with_negative))
}

/// Returns true for a flag that requires numbers as its value.
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

/// Parses the value of `--nodata`.
pub(super) fn nodata(text: &str) -> Result<f64, String> {
    height::number(text).ok_or_else(|| "expected a number, nan, inf or -inf".to_string())
}

/// Parses N numbers separated by commas, with or without parentheses around them, which gdalinfo prints.
pub(super) fn numbers<T: std::str::FromStr, const N: usize>(text: &str) -> Result<[T; N], String> {
    let bare = text.strip_prefix('(').and_then(|text| text.strip_suffix(')')).unwrap_or(text);
    let parts: Vec<T> = bare.split(',').filter_map(|part| part.trim().parse().ok()).collect();
    let found = bare.split(',').count();
    if found != parts.len() {
        return Err("expected numbers separated by commas".to_string());
    }
    parts.try_into().map_err(|_| format!("expected {N} numbers separated by commas, found {found}"))
}

/// Parses two angles, degrees.
pub(super) fn angles(text: &str) -> Result<[f64; 2], String> {
    let angles = numbers::<f64, 2>(text)?;
    let is_finite = angles.iter().all(|angle| angle.is_finite());
    is_finite.then_some(angles).ok_or_else(|| "expected two angles in degrees".to_string())
}

/// Parses a spacing: one number for both axes, or one along x and one along z, metres. The latter may be negative, as
/// gdalinfo prints it for rows that run south.
pub(super) fn spacing(text: &str) -> Result<[f64; 2], String> {
    let pair = numbers::<f64, 2>(text).map(|[x, z]| [x, z.abs()]);
    let pair = pair.or_else(|_| numbers::<f64, 1>(text).map(|[s]| [s, s]))?;
    let is_length = pair.iter().all(|&s| is_length(s));
    if is_length { Ok(pair) } else { Err(format!("expected {}", LENGTHS)) }
}
