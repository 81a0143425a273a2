//! `sphereboard methods`: the representations that there are, with their parameters.

use std::process::ExitCode;

use clap::{Arg, ArgAction, ArgMatches, Command};

use crate::repr::{METHODS, Representation, Scope, method};

use super::{Outcome, say};

/// The command's arguments.
pub fn command() -> Command {
    Command::new("methods")
        .about("List the tree representations: what each is, where it comes from, what it takes, its parameters")
        .arg(Arg::new("id").value_name("METHOD").action(ArgAction::Append).help("Only these; all when none is named"))
}

/// Runs it.
pub fn run(matches: &ArgMatches) -> Outcome {
    let asked: Vec<&String> = matches.get_many("id").map(Iterator::collect).unwrap_or_default();
    let chosen: Vec<&dyn Representation> = match asked.as_slice() {
        [] => METHODS.to_vec(),
        ids => ids.iter().map(|id| method(id)).collect::<Result<_, _>>()?,
    };
    let text = chosen.iter().map(|method| told(*method)).collect::<Vec<_>>().join("\n\n");
    Ok(if say::out(&text) { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

/// All of one method in a few lines.
fn told(method: &dyn Representation) -> String {
    let takes = method.accepts().iter().map(|kind| kind.words()).collect::<Vec<_>>().join(", ");
    let builds = match method.scopes()[0] {
        Scope::Tree => "the whole tree".to_owned(),
        Scope::Foliage => format!("the leaves; the wood is built by {} (--trunk)", method.partner()),
        Scope::Wood => "the wood; the leaves stay as they are".to_owned(),
    };
    let mut lines = vec![
        format!("{}  {}", method.id(), method.name()),
        format!("    from    {}", method.citation()),
        format!("    takes   {takes}"),
        format!("    builds  {builds}"),
    ];
    for spec in method.specs() {
        let range = spec.with_unit(&spec.kind.range());
        lines.push(format!("    --set {}={}  {} ({range}; {})", spec.name, spec.default, spec.meaning, spec.source));
    }
    lines.join("\n")
}
