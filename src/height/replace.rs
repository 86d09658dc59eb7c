//! Atomic writes: a file is written under a temporary name in its folder, and then renamed.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard};

use tempfile::NamedTempFile;

/// A file while it is written.
pub type Out<'a> = BufWriter<&'a File>;

/// Temporary files that are not renamed yet.
static UNFINISHED: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// Writes a file beside `path` and then gives it that name: readers see the old file or the new one, never a part.
pub fn replace(path: &Path, write: impl FnOnce(&mut Out) -> io::Result<()>) -> io::Result<()> {
    let file = begin(path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new(".")))?;
    let unfinished = file.path().to_owned();
    let written = fill(file, path, write);
    lock().retain(|other| *other != unfinished);
    written
}

fn begin(folder: &Path) -> io::Result<NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    // A temporary file is the owner's alone; a saved one is everyone's that the umask allows.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    let mut unfinished = lock();
    // The error would name the temporary file.
    let file = builder.tempfile_in(folder).map_err(|e| io::Error::new(e.kind(), e.kind().to_string()))?;
    unfinished.push(file.path().to_owned());
    Ok(file)
}

/// Writes and renames a temporary file. On failure no file remains: dropping a temporary one removes it.
fn fill(file: NamedTempFile, path: &Path, write: impl FnOnce(&mut Out) -> io::Result<()>) -> io::Result<()> {
    let mut out = BufWriter::new(file.as_file());
    write(&mut out)?;
    out.flush()?;
    drop(out);
    file.persist(path)?;
    Ok(())
}

/// Removes all unfinished files and blocks new ones, for a process that ends at once.
pub fn discard_unfinished() {
    let unfinished = lock();
    for path in unfinished.iter() {
        // A file renamed in the meantime is complete.
        let _ = std::fs::remove_file(path);
    }
    std::mem::forget(unfinished);
}

fn lock() -> MutexGuard<'static, Vec<PathBuf>> {
    UNFINISHED.lock().unwrap_or_else(|e| e.into_inner())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_fails_leaves_what_was_there_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.txt");
        replace(&path, |out| out.write_all(b"old")).unwrap();
        let failed = replace(&path, |out| {
            out.write_all(&[b'n'; 1 << 16])?;
            assert_eq!(std::fs::read(&path).unwrap(), b"old", "while the new one is written");
            Err(io::Error::other("no more"))
        });
        assert_eq!(failed.unwrap_err().to_string(), "no more");
        assert_eq!(std::fs::read(&path).unwrap(), b"old");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
        assert!(lock().iter().all(|path| !path.starts_with(folder.path())), "nothing is left to be discarded");
    }
}
