//! `cuesta view`: the window.
