//! The program `cuesta`.

use cuesta::internal::lod::Techniques;

fn main() -> std::process::ExitCode {
    cuesta::internal::cli::main(&Techniques::built_in())
}
