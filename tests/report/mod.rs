//! The report: drawn from rows alone, whole without a network, legible and usable in a browser.

mod browser;
mod page;
