//! Files beside height files: companions of a raster, common texts, and those that are left out with a warning.

use super::format::Format;

/// Extensions of files that belong to a raster, lower case. Some, as overviews, are rasters themselves.
const COMPANIONS: [&str; 10] = ["hdr", "prj", "xml", "aux", "ovr", "msk", "rrd", "stx", "clr", "wld"];
/// Extensions of texts that commonly lie beside height files, lower case.
const TEXTS: [&str; 14] =
    ["txt", "md", "json", "csv", "html", "htm", "pdf", "log", "sha256", "md5", "qml", "lyr", "ini", "db"];

/// A file's name without folders, and its extension, lower case.
fn name_and_extension(path: &str) -> (String, String) {
    let name = path.rsplit(['/', '\\']).next().unwrap_or(path).to_lowercase();
    let extension = name.rsplit_once('.').map_or("", |(_, extension)| extension).to_owned();
    (name, extension)
}

/// Returns true if a name is that of a raster's companion: a header, world file, overview, or hidden file.
pub(super) fn is_companion(path: &str) -> bool {
    let (name, extension) = name_and_extension(path);
    let is_world_file = (3..=4).contains(&extension.len()) && extension.ends_with('w') && extension != "raw";
    name.starts_with('.') || name.contains(".cuesta-") || is_world_file || COMPANIONS.contains(&extension.as_str())
}

/// Returns true if a name is that of a text or companion that commonly lies beside height files.
fn is_expected(path: &str) -> bool {
    let (name, extension) = name_and_extension(path);
    is_companion(path) || name.starts_with("readme") || TEXTS.contains(&extension.as_str())
}

/// Files of a folder or an archive that hold no heights that can be read.
#[derive(Default)]
pub(super) struct LeftOut(Vec<String>);

impl LeftOut {
    /// Notes a file, unless it commonly lies beside height files.
    pub fn add(&mut self, name: &str, format: Option<&Format>) {
        match format {
            _ if is_expected(name) => (),
            Some(format) if !format.is_read() => self.0.push(format!("{name} ({})", format.name)),
            Some(format) if format.is_archive() => self.0.push(format!("{name} (an archive)")),
            _ => self.0.push(name.to_owned()),
        }
    }

    /// Returns the first names after a colon; empty if nothing was left out.
    pub fn list(&self) -> String {
        let Self(names) = self;
        match names.len() {
            0 => String::new(),
            n @ 1..=3 => format!(": {}", names[..n].join(", ")),
            n => format!(": {} and {} more", names[..3].join(", "), n - 3),
        }
    }

    /// Returns a warning that names them.
    pub fn warning(&self, folder: &str) -> Option<String> {
        let (count, list) = (self.0.len(), self.list());
        (count > 0).then(|| format!("{folder}: {count} files hold no heights that can be read and are left out{list}"))
    }
}
