//! The program `cuesta`.

use cuesta::lod::Techniques;

fn main() -> std::process::ExitCode {
    cuesta::cli::main(&Techniques::built_in())
}
