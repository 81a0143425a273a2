//! The `sphereboard` program; everything it does is in the library.

fn main() -> std::process::ExitCode {
    sphereboard::cli::run()
}
