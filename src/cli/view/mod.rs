//! `sphereboard view`: a window to look through.

mod app;
mod keys;
mod overlay;
mod state;

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Arg, ArgMatches, Command, value_parser};
use winit::event_loop::EventLoop;

use crate::{Error, files};

use super::look::{self, Look};
use super::subject::{self, Wish};
use super::{Outcome, options};
use app::App;

/// The command's arguments.
pub fn command() -> Command {
    let keys = keys::lines().map(|line| format!("  {line}")).collect::<Vec<_>>().join("\n");
    let command = Command::new("view")
        .about("Look at trees, or at what a method makes of them, in a window: orbit, zoom, walk, every stage of the drawing, sun")
        .arg(
            Arg::new("sources")
                .value_name("SOURCE")
                .required(true)
                .num_args(1..)
                .help(format!("{}; several stand side by side", subject::SOURCE_HELP)),
        )
        .arg(
            Arg::new("screenshots")
                .long("screenshots")
                .value_name("DIR")
                .default_value(".")
                .value_parser(value_parser!(PathBuf))
                .help("Folder for the pictures that the key p saves"),
        )
        .arg(
            Arg::new("seconds")
                .long("seconds")
                .value_name("N")
                .allow_negative_numbers(true)
                .help("Close the window by itself after this many seconds, 1 to 86400"),
        );
    let command = subject::add_method(command, false);
    let command = subject::add_source(command, "Seed of a preset's growth and of the method");
    look::add(command).after_help(format!("Keys:\n{keys}"))
}

/// Runs it until the window is closed.
pub fn run(matches: &ArgMatches) -> Outcome {
    let look = Look::read(matches)?;
    let seconds = options::whole(matches, "seconds", 1..=86_400)?;
    let screenshots: &PathBuf = matches.get_one("screenshots").expect("clap gives the default");
    let _folder = files::ready_folder(screenshots)?;
    let sources = matches.get_many::<String>("sources").expect("clap requires it");
    let wish = Wish::read(matches)?;
    let trees = sources.map(|source| wish.subject(source)).collect::<Result<Vec<_>, _>>()?;
    let no_window = |e: &dyn std::fmt::Display| Error::NoWindow { what: e.to_string() };
    let event_loop = EventLoop::new().map_err(|e| no_window(&e))?;
    let mut app = App::new(look, trees, screenshots.clone(), seconds)?;
    event_loop.run_app(&mut app).map_err(|e| no_window(&e))?;
    app.outcome()?;
    Ok(ExitCode::SUCCESS)
}
