//! `sphereboard methods`: the representations that there are, with their parameters.

use std::process::ExitCode;

use clap::{Arg, ArgAction, ArgMatches, Command};
use serde_json::{Value, json};

use crate::params::ParamSpec;
use crate::repr::{METHODS, Representation, Scope, method};

use super::bake::aligned;
use super::{Outcome, say};

/// The command's arguments.
pub fn command() -> Command {
    Command::new("methods")
        .about("List the tree representations: what each is, where it comes from, what it takes, its parameters")
        .after_help(
            "`sphereboard bake SOURCE --method ID --set KEY=VALUE --out T.glb` builds one; `render` and `view` take the same options.\n\
             Sources: a grown tree is a preset of `sphereboard grow --list`, an imported tree any GLB, glTF or OBJ file, a photograph's\n\
             model what `sphereboard model` writes.",
        )
        .arg(Arg::new("id").value_name("METHOD").action(ArgAction::Append).help("Only these; all when none is named"))
        .arg(Arg::new("json").long("json").action(ArgAction::SetTrue).help("Print everything as JSON instead"))
}

/// Runs it.
pub fn run(matches: &ArgMatches) -> Outcome {
    let asked: Vec<&String> = matches.get_many("id").map(Iterator::collect).unwrap_or_default();
    let chosen: Vec<&dyn Representation> = match asked.as_slice() {
        [] => METHODS.to_vec(),
        ids => ids.iter().map(|id| method(id)).collect::<Result<_, _>>()?,
    };
    let text = if matches.get_flag("json") {
        let methods: Vec<Value> = chosen.iter().map(|method| report(*method)).collect();
        format!("{:#}", json!({"sphereboard": env!("CARGO_PKG_VERSION"), "methods": methods}))
    } else {
        chosen.iter().map(|method| told(*method)).collect::<Vec<_>>().join("\n\n")
    };
    Ok(if say::out(&text) { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

/// All of one method: a few lines, and its parameters as a table.
fn told(method: &dyn Representation) -> String {
    let takes = method.accepts().iter().map(|kind| kind.words()).collect::<Vec<_>>().join(", ");
    let builds = match method.scopes()[0] {
        Scope::Tree if method.scopes().contains(&Scope::Foliage) => {
            "the whole tree; only the leaves with --trunk, which says who builds the wood".to_owned()
        }
        Scope::Tree => "the whole tree".to_owned(),
        Scope::Foliage => format!("the leaves; the wood is built by {} unless --trunk says otherwise", method.partner()),
        Scope::Wood => "the wood; the leaves stay as they are".to_owned(),
    };
    let mut lines = vec![
        format!("{}  ({})", method.id(), method.name()),
        format!("  from    {}", method.citation()),
        format!("  takes   {takes}"),
        format!("  builds  {builds}"),
    ];
    let row = |spec: &ParamSpec| {
        let range = spec.with_unit(&spec.kind.range());
        [format!("{}={}", spec.name, spec.default), range, spec.meaning.to_owned(), format!("({})", spec.source)]
    };
    let rows: Vec<_> = method.specs().iter().map(row).collect();
    lines.extend(aligned(&rows, 4).into_iter().map(|row| format!("  --set {row}")));
    lines.join("\n")
}

/// The same for programs.
fn report(method: &dyn Representation) -> Value {
    let scope = |scope: &Scope| match scope {
        Scope::Tree => "tree",
        Scope::Foliage => "foliage",
        Scope::Wood => "wood",
    };
    let parameter = |spec: &ParamSpec| {
        json!({
            "name": spec.name,
            "meaning": spec.meaning,
            "range": spec.kind.range(),
            "unit": spec.unit,
            "default": spec.default,
            "source": spec.source,
        })
    };
    json!({
        "id": method.id(),
        "name": method.name(),
        "citation": method.citation(),
        "sources": method.accepts(),
        "scopes": method.scopes().iter().map(scope).collect::<Vec<_>>(),
        "partner": method.partner(),
        "parameters": method.specs().iter().map(parameter).collect::<Vec<_>>(),
    })
}
