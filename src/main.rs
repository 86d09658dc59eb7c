//! The program.

fn main() -> std::process::ExitCode {
    cuesta::cli::main()
}
