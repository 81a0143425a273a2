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
use super::{Outcome, options, render};
use app::App;

/// The command's arguments.
pub fn command() -> Command {
    let keys = keys::lines().map(|line| format!("  {line}")).collect::<Vec<_>>().join("\n");
    let command = Command::new("view")
        .about("Look at models in a window: orbit, zoom, walk, every stage of the drawing, sun")
        .arg(
            Arg::new("models")
                .value_name("MODEL")
                .required(true)
                .num_args(1..)
                .value_parser(value_parser!(PathBuf))
                .help("Models to stand side by side: GLB, glTF or OBJ"),
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
    look::add(command).after_help(format!("Keys:\n{keys}"))
}

/// Runs it until the window is closed.
pub fn run(matches: &ArgMatches) -> Outcome {
    let look = Look::read(matches)?;
    let seconds = options::whole(matches, "seconds", 1..=86_400)?;
    let screenshots: &PathBuf = matches.get_one("screenshots").expect("clap gives the default");
    let _folder = files::ready_folder(screenshots)?;
    let models = matches.get_many::<PathBuf>("models").expect("clap requires it");
    let trees = models.map(|path| render::read_model(path)).collect::<Result<Vec<_>, _>>()?;
    let no_window = |e: &dyn std::fmt::Display| Error::NoWindow { what: e.to_string() };
    let event_loop = EventLoop::new().map_err(|e| no_window(&e))?;
    let mut app = App::new(look, trees, screenshots.clone(), seconds)?;
    event_loop.run_app(&mut app).map_err(|e| no_window(&e))?;
    app.outcome()?;
    Ok(ExitCode::SUCCESS)
}
