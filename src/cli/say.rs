//! Printing to people and programs that may stop listening at any moment: a closed pipe is no failure of ours.

use std::io::{Error, ErrorKind, Write};

/// Prints lines to standard output. False when that failed for another reason than a closed pipe, which is then said.
pub fn out(text: &str) -> bool {
    match writeln!(std::io::stdout().lock(), "{text}") {
        Err(cause) if !closed(&cause) => {
            err(&format!("sphereboard: cannot write to standard output: {cause}; check free space"));
            false
        }
        _ => true,
    }
}

/// Prints lines to standard error, where a failure can be told to nobody.
pub fn err(text: &str) {
    let _ = writeln!(std::io::stderr().lock(), "{text}");
}

fn closed(cause: &Error) -> bool {
    cause.kind() == ErrorKind::BrokenPipe
}
