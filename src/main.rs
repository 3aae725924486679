//! The program `tyndall`; all it does is in the library.

fn main() -> std::process::ExitCode {
    tyndall::cli::main()
}
