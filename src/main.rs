//! The `sphereboard` program: see [`sphereboard::cli`].

use std::process::ExitCode;

fn main() -> ExitCode {
    if cfg!(target_os = "linux") && std::env::var_os("XDG_RUNTIME_DIR").is_none() {
        // Mesa complains on standard error where this is unset, as in containers, though nothing is put there without a window.
        // SAFETY: no other thread exists yet.
        unsafe { std::env::set_var("XDG_RUNTIME_DIR", std::env::temp_dir()) };
    }
    sphereboard::cli::run()
}
