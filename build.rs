//! Tells the program which commit it is built from, for reports; `unknown` where the sources are in no repository.

use std::process::Command;

fn git(args: &[&str]) -> Option<String> {
    let output = Command::new("git").args(args).output().ok().filter(|output| output.status.success())?;
    Some(String::from_utf8(output.stdout).ok()?.trim().to_owned())
}

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    // Sources that lie in somebody else's repository, as a vendored crate does, are not of its commits.
    let own = git(&["ls-files", "build.rs"]).is_some_and(|listed| listed == "build.rs");
    let commit = git(&["describe", "--always", "--tags"]).filter(|_| own);
    println!("cargo:rustc-env=SPHEREBOARD_COMMIT={}", commit.as_deref().unwrap_or("unknown"));
    // Grows with every commit; absent in a fresh clone of some servers, where HEAD has to do.
    for name in ["logs/HEAD", "HEAD"] {
        if let Some(path) = git(&["rev-parse", "--git-path", name]).filter(|path| std::path::Path::new(path).exists()) {
            println!("cargo:rerun-if-changed={path}");
        }
    }
}
