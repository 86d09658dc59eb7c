//! The program.

fn main() -> std::process::ExitCode {
    cuesta::internal::cli::main()
}
