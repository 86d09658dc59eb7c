//! World files: six numbers in a file beside a picture that place its samples.

use super::input::Input;
use crate::height::georef::affine::Affine;

/// Reads the transformation of the world file beside a file; `None` if there is none.
///
/// # Errors
/// A warning text, if the world file does not hold six numbers.
pub(super) fn beside(input: &Input) -> Option<Result<Affine, String>> {
    let extensions = extensions(input.name);
    let (extension, text) = extensions.iter().find_map(|e| Some((e, input.sibling_text(e)?)))?;
    Some(parse(&text).ok_or_else(|| format!(".{extension}: expected six numbers a line each, found others; ignored")))
}

/// Returns the extensions of world files of a file name: for `a.tif` these are `tfw`, `tifw` and `wld`.
fn extensions(name: &str) -> Vec<String> {
    let extension = name.rsplit(['/', '\\']).next().and_then(|file| Some(file.rsplit_once('.')?.1.to_lowercase()));
    let mut names = Vec::new();
    if let Some(extension) = extension.filter(|e| e.is_ascii() && e.len() >= 2) {
        names.push(format!("{}{}w", &extension[..1], &extension[extension.len() - 1..]));
        names.push(format!("{extension}w"));
    }
    names.push("wld".to_owned());
    names
}

/// Parses six lines: x of a column, y of a column, x of a row, y of a row, then the centre of the first sample.
fn parse(text: &str) -> Option<Affine> {
    let number = |word: &str| word.replace(',', ".").parse::<f64>().ok().filter(|n| n.is_finite());
    let numbers: Vec<f64> = text.split_whitespace().map(number).collect::<Option<_>>()?;
    let [a, d, b, e, x, y] = numbers[..] else { return None };
    Some(Affine { origin: [x, y], column: [a, d], row: [b, e] })
}
