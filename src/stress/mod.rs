//! The stability battery: every technique on stiff and extreme fields, positions, views and times; the budget
//! controller on loads that are hard to hold; the loaders on broken files. A case passes when the picture and the
//! numbers are right, not when nothing crashed.
//!
//! A case is a row of [`CASES`]; what is found in it, a [`Row`] for each technique and check.

pub mod laws;
pub mod views;
