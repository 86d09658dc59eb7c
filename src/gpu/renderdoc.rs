//! RenderDoc's in-application API: captures single frames if its library is already loaded in the process.
//!
//! After RenderDoc, "In-application API" (documentation of version 1.x). `RENDERDOC_GetAPI` returns a table of
//! functions, to which later versions only append.

use std::ffi::{CStr, c_char, c_int, c_void};
use std::path::PathBuf;

use anyhow::{Result, bail};
use libloading::Library;

/// `eRENDERDOC_API_Version_1_0_0`.
const VERSION: c_int = 1_00_00;

type Function = *const c_void;
type StartFrameCapture = unsafe extern "C" fn(device: *mut c_void, window: *mut c_void);
type EndFrameCapture = unsafe extern "C" fn(device: *mut c_void, window: *mut c_void) -> u32;
type GetNumCaptures = unsafe extern "C" fn() -> u32;
type GetCapture = unsafe extern "C" fn(k: u32, path: *mut c_char, length: *mut u32, time: *mut u64) -> u32;

/// The function table of API version 1.0.0; four of its functions are called.
#[repr(C)]
struct Table {
    /// Version, options, keys, overlay, shutdown and file path template; unused.
    _before: [Function; 13],
    get_num_captures: GetNumCaptures,
    get_capture: GetCapture,
    /// Trigger, replay program and active window; unused.
    _between: [Function; 4],
    start_frame_capture: StartFrameCapture,
    _is_frame_capturing: Function,
    end_frame_capture: EndFrameCapture,
}

/// The API of the library loaded in this process.
pub struct RenderDoc {
    table: &'static Table,
    _library: Library,
}

impl RenderDoc {
    /// Returns the API if the library is already loaded (usually by RenderDoc itself), otherwise `None`.
    pub fn loaded() -> Option<Self> {
        let library = library()?;
        let mut table: *const Table = std::ptr::null();
        // SAFETY: the symbol has this type in every version. It returns 1 and a table that lives as long as the
        // library, or 0.
        unsafe {
            let get_api: libloading::Symbol<unsafe extern "C" fn(c_int, *mut *const Table) -> c_int> =
                library.get(b"RENDERDOC_GetAPI\0").ok()?;
            if get_api(VERSION, &mut table) != 1 {
                return None;
            }
            table.as_ref().map(|table| Self { table, _library: library })
        }
    }

    /// Captures everything submitted by `frame`. Returns its result and the capture's file.
    pub fn capture<T>(&self, frame: impl FnOnce() -> Result<T>) -> Result<(T, PathBuf)> {
        let any = std::ptr::null_mut();
        // SAFETY: null stands for any device and any window.
        unsafe { (self.table.start_frame_capture)(any, any) };
        let result = frame();
        // SAFETY: as above; a capture has been started.
        if unsafe { (self.table.end_frame_capture)(any, any) } != 1 {
            bail!("RenderDoc took no capture: run under `renderdoccmd capture` or from its window");
        }
        Ok((result?, self.newest()))
    }

    /// Returns the path of the latest capture.
    fn newest(&self) -> PathBuf {
        let mut path = [0 as c_char; 4096];
        let mut length = path.len() as u32;
        // SAFETY: the buffer has `length` bytes, and the path is NUL-terminated.
        unsafe {
            let last = (self.table.get_num_captures)().saturating_sub(1);
            (self.table.get_capture)(last, path.as_mut_ptr(), &mut length, std::ptr::null_mut());
            path[path.len() - 1] = 0;
            PathBuf::from(CStr::from_ptr(path.as_ptr()).to_string_lossy().into_owned())
        }
    }
}

#[cfg(target_os = "linux")]
fn library() -> Option<Library> {
    use libloading::os::unix;
    /// Returns a library only if it is already loaded.
    const RTLD_NOLOAD: c_int = 4;
    // SAFETY: nothing is loaded, so no initialiser runs.
    unsafe { unix::Library::open(Some("librenderdoc.so"), unix::RTLD_NOW | RTLD_NOLOAD) }.ok().map(Library::from)
}

#[cfg(windows)]
fn library() -> Option<Library> {
    libloading::os::windows::Library::open_already_loaded("renderdoc.dll").ok().map(Library::from)
}

/// RenderDoc does not support other platforms.
#[cfg(not(any(target_os = "linux", windows)))]
fn library() -> Option<Library> {
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_has_the_documented_offsets() {
        let place = |offset: usize| offset / size_of::<Function>();
        assert_eq!(place(std::mem::offset_of!(Table, get_num_captures)), 13);
        assert_eq!(place(std::mem::offset_of!(Table, get_capture)), 14);
        assert_eq!(place(std::mem::offset_of!(Table, start_frame_capture)), 19);
        assert_eq!(place(std::mem::offset_of!(Table, end_frame_capture)), 21);
    }

    #[test]
    fn querying_does_not_load_the_library() {
        assert!(RenderDoc::loaded().is_none());
        assert!(RenderDoc::loaded().is_none(), "nor the second time");
    }
}
