//! Small inputs that went wrong for other people (`shared/data/reports/INDEX.md`), each with its right value.

mod position;
mod samples;
