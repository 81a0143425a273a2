//! clap's complaints about arguments as one sentence each: expected, found, what to do.

use clap::error::{ContextKind, ContextValue, ErrorKind};

/// The sentence, without the program's name. `command` is the first argument, a command's name or not.
pub fn sentence(error: &clap::Error, command: Option<&str>) -> String {
    let text = |kind: ContextKind| error.get(kind).map(words).unwrap_or_default();
    let (arg, prior, value) = (text(ContextKind::InvalidArg), text(ContextKind::PriorArg), text(ContextKind::InvalidValue));
    let known = command.filter(|name| super::names().iter().any(|known| known == name)).map(|name| format!("{name} "));
    let help = format!("`sphereboard {}--help`", known.unwrap_or_default());
    let meant = |suggested: String| if suggested.is_empty() { String::new() } else { format!(", but perhaps {suggested}") };
    match error.kind() {
        ErrorKind::UnknownArgument => {
            format!("there is no option {arg}{}; {help} lists all options", meant(text(ContextKind::SuggestedArg)))
        }
        ErrorKind::InvalidSubcommand => format!(
            "expected a command ({}), but found {}; write for example `sphereboard model oak.jpg --out trees`",
            super::names().join(", "),
            text(ContextKind::InvalidSubcommand),
        ),
        ErrorKind::MissingRequiredArgument => format!("{arg} must be given, but is missing; {help} explains it"),
        ErrorKind::ArgumentConflict if prior.is_empty() || prior == arg => {
            format!("{arg} was given more than once, but means one thing; give it once")
        }
        ErrorKind::ArgumentConflict => format!("{arg} and {prior} cannot be used together; leave one of them out"),
        ErrorKind::InvalidValue if value.is_empty() && arg.starts_with("PHOTO") => {
            format!("expected the name of a photograph, but found an empty one; {help} explains it")
        }
        ErrorKind::InvalidValue | ErrorKind::TooFewValues | ErrorKind::WrongNumberOfValues if value.is_empty() => {
            format!("{arg} needs a value behind it, but has none; {help} explains it")
        }
        ErrorKind::TooManyValues => format!("{arg} takes no value, but has {value}; leave the value out"),
        ErrorKind::InvalidUtf8 => "expected options in Unicode, but one is not; rename its file or retype it".to_owned(),
        _ => {
            let whole = error.render().to_string();
            let first = whole.split("\n\n").next().unwrap_or_default().trim_start_matches("error: ");
            format!("{}; {help} explains the options", first.split_whitespace().collect::<Vec<_>>().join(" "))
        }
    }
}

fn words(value: &ContextValue) -> String {
    let text = match value {
        ContextValue::Strings(all) => all.join(" and "),
        other => other.to_string(),
    };
    // Brackets around what may be left out are for usage lines.
    text.replace("[PHOTO]...", "PHOTO...").replace("<PHOTO>...", "PHOTO...")
}
