//! Parameters of a method as a user sets them, by name, before it is known which table they belong to.

use crate::params::{ParamSet, ParamSpec};
use crate::{Error, Result};

use super::Representation;

crate::choices! {
    /// Whether a method does a thing.
    pub enum Switch {
        /// It does not.
        Off = "off",
        /// It does.
        On = "on",
    }
}

/// Names and values, in the order in which they were set.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Settings {
    pairs: Vec<(String, String)>,
    /// What a user writes before each of these names.
    prefix: String,
}

impl Settings {
    /// Nothing is set.
    pub fn none() -> &'static Self {
        static NONE: Settings = Settings { pairs: vec![], prefix: String::new() };
        &NONE
    }

    /// From `key=value` texts; hyphens in keys count as underscores.
    ///
    /// # Errors
    /// [`Error::Hint`] for a text without `=`.
    pub fn parse<'a>(texts: impl IntoIterator<Item = &'a str>) -> Result<Self> {
        let pair = |text: &str| match text.split_once('=') {
            Some((key, value)) => Ok((key.trim().replace('-', "_"), value.trim().to_owned())),
            None => Err(Error::Hint { flag: "--set", expected: "KEY=VALUE".to_owned(), found: text.to_owned() }),
        };
        Ok(Self { pairs: texts.into_iter().map(pair).collect::<Result<_>>()?, ..Self::default() })
    }

    /// The same with another one set.
    pub fn with(mut self, name: &str, value: impl ToString) -> Self {
        self.pairs.push((name.to_owned(), value.to_string()));
        self
    }

    /// The same with those of another set after these.
    pub fn and(mut self, other: &Self) -> Self {
        self.pairs.extend(other.pairs.iter().cloned());
        self
    }

    /// Whether nothing is set.
    pub fn is_empty(&self) -> bool {
        self.pairs.is_empty()
    }

    /// Those whose names do not begin with `prefix`, and those that do, without it.
    pub fn split(&self, prefix: &str) -> (Self, Self) {
        let (with, without): (Vec<_>, Vec<_>) = self.pairs.iter().cloned().partition(|(name, _)| name.starts_with(prefix));
        let bare = with.into_iter().map(|(name, value)| (name[prefix.len()..].to_owned(), value)).collect();
        (Self { pairs: without, prefix: self.prefix.clone() }, Self { pairs: bare, prefix: format!("{}{prefix}", self.prefix) })
    }

    /// A method's table with these values in it.
    ///
    /// # Errors
    /// [`Error::UnknownParameter`] for a name that it does not have, [`Error::Parameter`] for a value out of range.
    pub fn read<P: ParamSet>(&self) -> Result<P> {
        let mut params = P::default();
        for (name, value) in &self.pairs {
            params.set(name, value).map_err(|error| self.as_set(error))?;
        }
        params.validate().map_err(|error| self.as_set(error))?;
        Ok(params)
    }

    /// The error in a user's words: these parameters are no options of their own.
    pub(super) fn as_set(&self, error: Error) -> Error {
        let own = |option: &str| option.trim_start_matches("--").replace('-', "_");
        match error {
            Error::Parameter { name, expected, found } => {
                Error::Parameter { name: format!("--set {}{}", self.prefix, own(&name)), expected, found }
            }
            Error::UnknownParameter { name, known } => Error::UnknownParameter { name: format!("{}{name}", self.prefix), known },
            other => other,
        }
    }

    /// Checks every name against the method's table, so that one that it would not read is an error all the same.
    ///
    /// # Errors
    /// [`Error::UnknownParameter`].
    pub fn check(&self, method: &dyn Representation) -> Result<()> {
        let specs = method.specs();
        match self.pairs.iter().find(|(name, _)| !specs.iter().any(|spec| spec.name == name)) {
            Some((name, _)) => Err(self.as_set(Error::UnknownParameter { name: name.clone(), known: names(&specs) })),
            None => Ok(()),
        }
    }
}

fn names(specs: &[ParamSpec]) -> String {
    if specs.is_empty() { "none".to_owned() } else { specs.iter().map(|spec| spec.name).collect::<Vec<_>>().join(", ") }
}

/// Every parameter of `method` with its effective value, for reports and files.
///
/// # Errors
/// As [`Settings::check`].
pub fn tabled(method: &dyn Representation, settings: &Settings) -> Result<Vec<(&'static str, String)>> {
    settings.check(method)?;
    let set = |spec: &ParamSpec| settings.pairs.iter().rev().find(|(name, _)| name == spec.name).map(|(_, value)| value.clone());
    Ok(method.specs().iter().map(|spec| (spec.name, set(spec).unwrap_or_else(|| spec.default.clone()))).collect())
}
