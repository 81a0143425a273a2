//! Parameter tables to command-line options and back: one option per parameter, with its meaning, unit, range, default and source.

use std::ops::RangeInclusive;
use std::str::FromStr;

use clap::{Arg, ArgMatches, Command};

use crate::params::{Kind, ParamSet, ParamSpec};
use crate::{Error, Result, Seed};

/// Adds every parameter of `P` to `command`, under `heading` in its help.
pub fn add<P: ParamSet>(command: Command, heading: &'static str) -> Command {
    P::specs().iter().fold(command, |command, spec| command.arg(option(spec).help_heading(heading)))
}

/// Reads the options of `P` back; what was not given keeps its default.
///
/// # Errors
/// [`crate::Error::Parameter`] for a value outside its range.
pub fn read<P: ParamSet>(matches: &ArgMatches) -> Result<P> {
    read_over(matches, P::default())
}

/// Reads the options of a table back over values from elsewhere; what was not given keeps those.
///
/// # Errors
/// As [`read`].
pub fn read_over<P: ParamSet>(matches: &ArgMatches, mut params: P) -> Result<P> {
    for spec in P::specs() {
        if let Some(value) = matches.get_one::<String>(spec.name) {
            params.set(spec.name, value)?;
        }
    }
    params.validate()?;
    Ok(params)
}

/// Reads an option that is a whole number, where it was given or has a default.
///
/// # Errors
/// [`crate::Error::Parameter`] for anything else, or a number out of `range`.
pub fn whole<T: FromStr + PartialOrd + ToString>(
    matches: &ArgMatches,
    name: &'static str,
    range: RangeInclusive<T>,
) -> Result<Option<T>> {
    let Some(text) = matches.get_one::<String>(name) else { return Ok(None) };
    let number = text.parse().ok().filter(|number| range.contains(number));
    number.map(Some).ok_or_else(|| Error::Parameter {
        name: format!("--{name}"),
        expected: format!("a whole number from {} to {}", range.start().to_string(), range.end().to_string()),
        found: text.clone(),
    })
}

/// The seed of every random choice, which every command that makes something has.
pub fn seed(help: &'static str) -> Arg {
    Arg::new("seed").long("seed").value_name("N").allow_negative_numbers(true).default_value("1").help(help)
}

/// The seed that [`seed`] was told.
///
/// # Errors
/// [`crate::Error::Parameter`] for anything but a whole number of 64 bits.
pub fn read_seed(matches: &ArgMatches) -> Result<Seed> {
    Ok(Seed(whole(matches, "seed", 0..=u64::MAX)?.expect("clap gives the default")))
}

fn option(spec: &ParamSpec) -> Arg {
    let range = spec.with_unit(&spec.kind.range());
    let short = format!("{} [default: {}; {range}]", spec.meaning, spec.default);
    let words = match spec.kind {
        Kind::Choice(words) => words.iter().map(|(word, meaning)| format!("\n  {word}: {meaning}")).collect(),
        _ => String::new(),
    };
    Arg::new(spec.name)
        .long(spec.flag())
        .aliases(without_unit(&spec.flag()))
        .value_name(value_name(spec))
        .allow_negative_numbers(true)
        .help(short.clone())
        .long_help(format!("{short}{words}\n  {}", origin(spec.source)))
}

/// The option without the unit at its end, which may be left out: `azimuth` for `azimuth-deg`.
fn without_unit(flag: &str) -> Option<String> {
    ["-deg", "-m", "-px", "-s"].iter().find_map(|unit| flag.strip_suffix(unit)).map(str::to_owned)
}

/// Where the default comes from, for people who do not know how the tables say it.
fn origin(source: &str) -> String {
    source.strip_prefix("ours: ").map_or_else(|| format!("From {source}"), |reason| format!("Why: {reason}"))
}

fn value_name(spec: &ParamSpec) -> &'static str {
    match spec.kind {
        Kind::Real { .. } => "X",
        Kind::Whole { .. } | Kind::PowerOfTwo { .. } => "N",
        Kind::Choice(_) => "WORD",
    }
}
