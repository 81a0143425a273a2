//! Parameter tables to command-line options and back: one option per parameter, with its meaning, unit, range, default and source.

use clap::{Arg, ArgMatches, Command};

use crate::Result;
use crate::params::{Kind, ParamSet, ParamSpec};

/// Adds every parameter of `P` to `command`, under `heading` in its help.
pub fn add<P: ParamSet>(command: Command, heading: &'static str) -> Command {
    P::specs().iter().fold(command, |command, spec| command.arg(option(spec).help_heading(heading)))
}

/// Reads the options of `P` back; what was not given keeps its default.
///
/// # Errors
/// [`crate::Error::Parameter`] for a value outside its range.
pub fn read<P: ParamSet>(matches: &ArgMatches) -> Result<P> {
    let mut params = P::default();
    for spec in P::specs() {
        if let Some(value) = matches.get_one::<String>(spec.name) {
            params.set(spec.name, value)?;
        }
    }
    params.validate()?;
    Ok(params)
}

fn option(spec: &ParamSpec) -> Arg {
    let unit = if spec.unit.is_empty() { String::new() } else { format!(" {}", spec.unit) };
    let short = format!("{} [default: {}{unit}; {}{unit}]", spec.meaning, spec.default, spec.kind.range());
    let words = match spec.kind {
        Kind::Choice(words) => words.iter().map(|(word, meaning)| format!("\n  {word}: {meaning}")).collect(),
        _ => String::new(),
    };
    Arg::new(spec.name)
        .long(spec.flag())
        .value_name(value_name(spec))
        .allow_negative_numbers(true)
        .help(short.clone())
        .long_help(format!("{short}{words}\n  Source: {}", spec.source))
}

fn value_name(spec: &ParamSpec) -> &'static str {
    match spec.kind {
        Kind::Real { .. } => "X",
        Kind::Whole { .. } | Kind::PowerOfTwo { .. } => "N",
        Kind::Choice(_) => "WORD",
    }
}
