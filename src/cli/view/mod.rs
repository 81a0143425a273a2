//! `sphereboard view`: a window to look through.

mod keys;
mod row;
mod state;

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Arg, ArgMatches, Command, value_parser};

use crate::files;

use super::Outcome;
use super::look::{self, Look};
use super::subject::{self, Wish};
use super::window::{self, Opening};
use row::Row;

/// The command's arguments.
pub fn command() -> Command {
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
        .arg(window::seconds());
    let command = subject::add_method(command, false);
    let command = subject::add_source(command, "Seed of a preset's growth and of the method");
    look::add(command).after_help(window::keys::help(keys::KEYS))
}

/// Runs it until the window is closed.
pub fn run(matches: &ArgMatches) -> Outcome {
    let look = Look::read(matches)?;
    let seconds = window::seconds_of(matches)?;
    let screenshots: &PathBuf = matches.get_one("screenshots").expect("clap gives the default");
    let _folder = files::ready_folder(screenshots)?;
    let sources = matches.get_many::<String>("sources").expect("clap requires it");
    let wish = Wish::read(matches)?;
    let trees = sources.map(|source| wish.subject(source)).collect::<Result<Vec<_>, _>>()?;
    let events = window::events()?;
    let opening = Opening { size_px: look.size_px, adapter: look::adapter(matches), screenshots: screenshots.clone(), seconds };
    window::run(events, opening, Row::new(look, trees)?)?;
    Ok(ExitCode::SUCCESS)
}
