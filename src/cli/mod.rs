//! The command line: arguments to library calls. clap, progress bars and colours live only here.
//!
//! Exit codes: 0 all done, 1 at least one photograph failed (the others are written), 2 the arguments make no sense (nothing is written).

mod bake;
mod batch;
mod compare;
mod doctor;
mod grove;
mod grow;
mod hints;
mod inspect;
mod look;
mod methods;
mod model;
mod options;
mod photograph;
mod preview;
mod render;
mod say;
mod scenes;
mod segment;
mod subject;
mod usage;
mod view;
mod walk;
mod window;

use std::ffi::OsStr;
use std::process::ExitCode;

use clap::Command;

use crate::Result;

/// Runs the program on the process's arguments and returns its exit code.
pub fn run() -> ExitCode {
    let matches = match command().try_get_matches() {
        Ok(matches) => matches,
        Err(message) if asks_for_help(&message) => {
            // A closed pipe is no reason to fail louder than the message itself.
            let _ = message.print();
            return if message.use_stderr() { ExitCode::from(2) } else { ExitCode::SUCCESS };
        }
        Err(mistake) => {
            let first = std::env::args_os().nth(1);
            say::err(&format!("sphereboard: {}", usage::sentence(&mistake, first.as_deref().and_then(OsStr::to_str))));
            return ExitCode::from(2);
        }
    };
    let outcome = match matches.subcommand() {
        Some(("bake", m)) => bake::run(m),
        Some(("compare", m)) => compare::run(m),
        Some(("grove", m)) => grove::run(m),
        Some(("doctor", m)) => doctor::run(m),
        Some(("methods", m)) => methods::run(m),
        Some(("model", m)) => model::run(m),
        Some(("render", m)) => render::run(m),
        Some(("segment", m)) => segment::run(m),
        Some(("view", m)) => view::run(m),
        Some(("grow", m)) => grow::run(m),
        Some(("inspect", m)) => inspect::run(m),
        Some(("photograph", m)) => photograph::run(m),
        _ => unreachable!("clap accepts only the subcommands of `command`"),
    };
    outcome.unwrap_or_else(|error| {
        say::err(&format!("sphereboard: {error}"));
        ExitCode::from(2)
    })
}

fn asks_for_help(message: &clap::Error) -> bool {
    use clap::error::ErrorKind::{DisplayHelp, DisplayHelpOnMissingArgumentOrSubcommand, DisplayVersion};
    matches!(message.kind(), DisplayHelp | DisplayHelpOnMissingArgumentOrSubcommand | DisplayVersion)
}

/// What the help of both commands closes with.
const ABOUT_SHE: &str = "Sections and figures are those of the paper whose method this is: She et al. 2018, \"Sphere-Board\" trees, ISPRS Int. J. Geo-Inf. 7(2):45.";

/// The whole command line, as clap sees it.
fn command() -> Command {
    Command::new("sphereboard")
        .version(env!("CARGO_PKG_VERSION"))
        .about("Photographs of trees become light 3-D models for scenes that need thousands of them.")
        .after_help(
            "Start here:\n  sphereboard model photos/oak.jpg --out trees --height-m 12\n\
             writes trees/oak.glb, which any glTF viewer opens, and trees/oak.json, which says how it was made.\n\
             `sphereboard COMMAND --help` explains every option; `-h` is the short form.",
        )
        .subcommand_required(true)
        .arg_required_else_help(true)
        .subcommand(model::command().after_help(ABOUT_SHE))
        .subcommand(segment::command().after_help(ABOUT_SHE))
        .subcommand(render::command().after_help(ABOUT_SHE))
        .subcommand(view::command())
        .subcommand(methods::command())
        .subcommand(bake::command())
        .subcommand(compare::command())
        .subcommand(grove::command())
        .subcommand(doctor::command())
        .subcommand(grow::command())
        .subcommand(inspect::command())
        .subcommand(photograph::command())
}

/// The names of all commands.
fn names() -> Vec<String> {
    command().get_subcommands().map(|command| command.get_name().to_owned()).collect()
}

/// What a command returns: its exit code, or a mistake in the arguments.
type Outcome = Result<ExitCode>;

#[cfg(test)]
mod tests {
    #[test]
    fn the_command_line_is_consistent() {
        super::command().debug_assert();
    }
}
