//! Reads a height file of any supported format, recognised by its content.

use std::{io::Cursor, path::Path};

use super::format::{Formats, Read};
use super::gather::{gather, gather_file};
use super::input::Input;
use super::loaded::Loaded;
use super::mosaic::Parts;
use super::options::Options;
use super::table::FORMATS;
use crate::height::error::Error;

/// The formats that are read.
const KNOWN: Formats = Formats(FORMATS);

/// Reads a file, a directory of tiles, or a folder of height files.
pub fn load(path: &Path, options: &Options) -> Result<Loaded, Error> {
    load_all(&[path], options)
}

/// Reads files and folders as one field: a mosaic of one grid. A later file overlies an earlier one, and samples in no
/// file are holes.
pub fn load_all(paths: &[&Path], options: &Options) -> Result<Loaded, Error> {
    let mut parts = Parts::default();
    for path in paths {
        match path.is_dir() {
            true => gather_folder(path, options, &mut parts)?,
            false => gather_file(path, options, KNOWN, &mut parts)?,
        }
    }
    let first = paths.first().map_or_else(String::new, |path| path.display().to_string());
    let name = if paths.len() > 1 { format!("{first} and {} more", paths.len() - 1) } else { first };
    finish(parts, &name, options)
}

/// Reads a file held in memory; `name` is for messages, and for the position of SRTM tiles.
pub fn load_bytes(name: &str, bytes: &[u8], options: &Options) -> Result<Loaded, Error> {
    load_bytes_with(name, bytes, &|_| None, options)
}

/// Reads a file held in memory, of which `siblings` yields the file beside it with a given extension: `hdr`
/// (header), `prj` (projection), `aux.xml` (band metadata) and those of world files.
pub fn load_bytes_with(
    name: &str,
    bytes: &[u8],
    siblings: &dyn Fn(&str) -> Option<Vec<u8>>,
    options: &Options,
) -> Result<Loaded, Error> {
    let len = bytes.len() as u64;
    let mut input = Input { name, reader: &mut Cursor::new(bytes), len, siblings };
    let format = KNOWN.of_input(&mut input, options)?;
    let mut parts = Parts::default();
    gather(&mut input, format, options, KNOWN, &mut parts)?;
    finish(parts, name, options)
}

fn finish(parts: Parts, name: &str, options: &Options) -> Result<Loaded, Error> {
    let is_mosaic = parts.len() > 1;
    let (raster, sources) = parts.join(name, options)?;
    // In a mosaic each file's nodata became holes before, and its value may be a height in another file.
    let nodata = options.nodata.filter(|_| !is_mosaic);
    let loaded = raster.finish(name, &Options { nodata, ..options.clone() })?;
    Ok(Loaded { sources, ..loaded })
}

fn gather_folder(path: &Path, options: &Options, parts: &mut Parts) -> Result<(), Error> {
    for format in FORMATS.iter().filter(|format| format.may_be(path)) {
        match format.read {
            Some(Read::Dataset(gather)) if gather(path, options, KNOWN, parts)? => break,
            Some(_) => (),
            None => return Err(Error::new(path.display().to_string(), "content", format.refusal())),
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::io::{self, BufReader, Seek};

    use super::*;
    use crate::height::formats::raster_file::read;
    use crate::height::{Field, Holes, Samples, save};

    /// A file whose content changes at the first seek.
    struct Changing {
        now: Cursor<Vec<u8>>,
        then: Option<Vec<u8>>,
    }

    impl io::Read for Changing {
        fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
            self.now.read(into)
        }
    }

    impl Seek for Changing {
        fn seek(&mut self, to: io::SeekFrom) -> io::Result<u64> {
            if let Some(then) = self.then.take() {
                *self.now.get_mut() = then;
            }
            self.now.seek(to)
        }
    }

    /// Reads a file that becomes `then` once its format is detected.
    fn changed(
        name: &str,
        first: &[u8],
        then: Vec<u8>,
        raw: Option<crate::height::RawLayout>,
    ) -> Result<Loaded, Error> {
        let len = first.len() as u64;
        let mut reader = BufReader::with_capacity(16, Changing { now: Cursor::new(first.to_vec()), then: Some(then) });
        let mut input = Input { name, reader: &mut reader, len, siblings: &|_| None };
        let options = Options { raw, max_samples: 1 << 16, ..Options::default() };
        let format = KNOWN.of_input(&mut input, &options)?;
        read(&mut input, format, &options)?.finish(name, &options)
    }

    #[test]
    fn a_file_that_changes_while_it_is_read_is_refused_or_read_as_one_of_the_two() {
        let folder = tempfile::tempdir().unwrap();
        let heights = (0..63).map(|k| (k * k % 50) as f32).collect();
        let field = Field::new(Samples::F32(heights), [9, 7], [1.0; 2], Holes::none(63));
        for (extension, raw) in [("tif", None), ("asc", None), ("png", None), ("raw", Some("9x7:u16le"))] {
            let name = format!("land.{extension}");
            save::save(&field, &folder.path().join(&name)).unwrap();
            let whole = std::fs::read(folder.path().join(&name)).unwrap();
            let raw = raw.map(|layout| layout.parse().unwrap());
            let same = changed(&name, &whole, whole.clone(), raw).expect("nothing has changed");
            let mut refused = 0;
            for left in 0..whole.len() {
                match changed(&name, &whole, whole[..left].to_vec(), raw) {
                    // A text's last number may have lost digits unnoticed.
                    Ok(_) if extension == "asc" && left + 3 > whole.len() => {}
                    Ok(loaded) => assert_eq!(loaded.field.samples(), same.field.samples(), "{name}: {left} bytes left"),
                    Err(error) => {
                        let error = error.to_string();
                        assert!(error.starts_with(&name) && !error.contains('\n'), "{left} bytes left: {error}");
                        refused += 1;
                    }
                }
            }
            assert!(refused + 60 > whole.len(), "{name}: {refused} of {} were refused", whole.len());
            // Longer by then.
            let grown = [&whole[..], &whole].concat();
            if let Ok(loaded) = changed(&name, &whole, grown, raw) {
                assert_eq!(loaded.field.samples(), same.field.samples(), "{name}");
            }
        }
    }
}
