//! A cache of derived data in a file beside the one that the heights were read from.
//!
//! A cache file holds a hash of the samples and one of its own content. Stale, truncated and damaged files are ignored
//! and replaced. A cache that cannot be written is no error.

use std::io::Write;
use std::path::PathBuf;

use xxhash_rust::xxh3::{Xxh3, xxh3_128};

use super::field::Field;
use super::samples::Samples;
use super::save::replace;

/// First bytes of a cache file; the digit grows when the content changes its meaning.
const MAGIC: &[u8; 16] = b"cuesta kept 1\r\n\x1a";

/// A cache file, and the hash of the samples that its content is derived from.
pub struct DiskCache {
    path: PathBuf,
    key: u128,
}

impl DiskCache {
    /// Returns the cache file called `name` beside the field's file; `None` if the field has no file.
    pub fn new(field: &Field, name: &str) -> Option<Self> {
        let source = field.file.as_deref()?;
        let mut path = source.as_os_str().to_owned();
        path.push(format!(".cuesta-{name}"));
        Some(Self { path: path.into(), key: key(field) })
    }

    /// Reads the content; `None` if there is none for these samples.
    pub fn read(&self) -> Option<Vec<u8>> {
        let mut bytes = std::fs::read(&self.path).ok()?;
        let head = size_of_val(MAGIC) + 2 * size_of::<u128>();
        let is_whole = bytes.len() >= head && bytes[..head] == self.head(&bytes[head..]);
        is_whole.then(|| bytes.split_off(head))
    }

    /// Writes the content, if the file can be written.
    pub fn write(&self, content: &[u8]) {
        let head = self.head(content);
        // Without the cache the next start takes as long as this one.
        let _ = replace(&self.path, |out| out.write_all(&head).and_then(|()| out.write_all(content)));
    }

    fn head(&self, content: &[u8]) -> Vec<u8> {
        [&MAGIC[..], &self.key.to_le_bytes(), &xxh3_128(content).to_le_bytes()].concat()
    }
}

/// Returns a hash of a field's heights and holes; position and spacing do not count.
fn key(field: &Field) -> u128 {
    let mut hash = Xxh3::new();
    hash.update(bytemuck::bytes_of(&field.stored()));
    hash.update(bytemuck::bytes_of(&field.size()));
    match field.samples() {
        Samples::F32(heights) => hash.update(bytemuck::cast_slice(heights)),
        Samples::Coded { codes, zero, scale } => {
            hash.update(bytemuck::bytes_of(&[*zero, *scale]));
            hash.update(bytemuck::cast_slice(codes));
        }
    }
    hash.update(bytemuck::cast_slice(field.holes().words()));
    hash.digest128()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    use crate::height::Holes;

    fn field(source: &Path, heights: [f32; 4]) -> Field {
        let mut field = Field::new(Samples::F32(heights.to_vec()), [2, 2], [1.0; 2], Holes::none(4));
        field.file = Some(source.into());
        field
    }

    #[test]
    fn it_is_found_again_for_the_same_heights_only() {
        let folder = tempfile::tempdir().unwrap();
        let source = folder.path().join("a.tif");
        let cache = DiskCache::new(&field(&source, [1.0, 2.0, 3.0, 4.0]), "thing").unwrap();
        assert_eq!(cache.read(), None);
        cache.write(b"what was found");
        assert_eq!(cache.path, folder.path().join("a.tif.cuesta-thing"));
        assert_eq!(cache.read().as_deref(), Some(&b"what was found"[..]));
        for other in [field(&source, [1.0, 2.0, 3.0, 5.0]), field(&source, [1.0, 2.0, 3.0, 4.0]).tiled([2, 1])] {
            assert_eq!(DiskCache::new(&other, "thing").unwrap().read(), None);
        }
        assert_eq!(DiskCache::new(&field(&source, [1.0, 2.0, 3.0, 4.0]), "other").unwrap().read(), None);
    }

    #[test]
    fn a_truncated_or_damaged_file_is_not_read() {
        let folder = tempfile::tempdir().unwrap();
        let cache = DiskCache::new(&field(&folder.path().join("a.tif"), [0.0; 4]), "thing").unwrap();
        cache.write(b"what was found");
        let whole = std::fs::read(&cache.path).unwrap();
        for length in 0..whole.len() {
            std::fs::write(&cache.path, &whole[..length]).unwrap();
            assert_eq!(cache.read(), None, "{length} bytes");
        }
        for k in 0..whole.len() {
            let mut damaged = whole.clone();
            damaged[k] ^= 1;
            std::fs::write(&cache.path, damaged).unwrap();
            assert_eq!(cache.read(), None, "byte {k}");
        }
    }

    #[test]
    fn where_nothing_can_be_written_nothing_is_kept() {
        let cache = DiskCache::new(&field(Path::new("/nowhere/at/all.tif"), [0.0; 4]), "thing").unwrap();
        cache.write(b"what was found");
        assert_eq!(cache.read(), None);
    }
}
