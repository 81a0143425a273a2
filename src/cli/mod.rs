//! The command line: arguments to library calls. clap, progress bars and colours live only here.

/// Runs the program and returns its exit code.
pub fn run() -> std::process::ExitCode {
    std::process::ExitCode::SUCCESS
}
